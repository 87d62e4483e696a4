//! What the lights of the scene's own bring to a point, against Mitsuba 3.9.1: `tests/data/reference/lights.csv`, made from
//! the same scene file by `lights.py` there.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use glam::{DVec3, Vec2, Vec3};
use snell::accel::{Accelerator, Hit};
use snell::light::Light;
use snell::math::ray::Ray;

/// Difference, relative to the brightest channel, of numbers that both compute in f32 from directions with nine digits; an
/// angle near a spot's cutoff, and places in pictures, magnify their rounding.
const ROUNDING: f32 = 3e-5;

#[test]
fn lights_bring_what_mitsuba_s_do() {
    let scene = compiled(&load("tests/data/reference/lights.xml", &[]), Accelerator::Native);
    let rows = std::fs::read_to_string(project("tests/data/reference/lights.csv")).unwrap();
    let mut counts = vec![0; scene.lights.len()];
    let mut dark = 0;
    for line in rows.lines().filter(|l| !l.starts_with('#')) {
        let numbers: Vec<f64> = line.split(',').map(|w| w.parse().unwrap()).collect();
        let (index, place) = (numbers[0] as usize, DVec3::from_slice(&numbers[1..]));
        let value = match &scene.lights[index] {
            Light::Environment(map) => map.seen(&place.as_vec3(), Vec3::ZERO, false).0,
            light => {
                let p = (place - scene.centre) * scene.unit;
                light
                    .sample(&scene.shapes, p, Vec3::ZERO, Vec2::splat(0.5), false)
                    .map(|s| s.radiance)
                    .unwrap_or_default()
            }
        };
        let expected = DVec3::from_slice(&numbers[4..]).as_vec3();
        let off = (value.0 - expected).abs().max_element();
        assert!(off <= ROUNDING * expected.max_element(), "{line}: {value:?}");
        counts[index] += 1;
        dark += u32::from(expected == Vec3::ZERO);
    }
    assert!(counts.iter().all(|c| *c >= 60) && dark > 10, "{counts:?}, {dark}");
}

/// `tests/data/reference/emission.csv`, made from the same scene file by `emission.py` there.
#[test]
fn surfaces_emit_textures_as_mitsuba_s_do() {
    /// Mitsuba keeps pictures of 8 bits as half floats, which have 11 bits, and decodes sRGB in them.
    const HALF: f32 = 1.0 / 1024.0;
    let scene = compiled(&load("tests/data/reference/emission.xml", &[]), Accelerator::Native);
    let rows = std::fs::read_to_string(project("tests/data/reference/emission.csv")).unwrap();
    let (mut count, mut dark) = (0, 0);
    for line in rows.lines().filter(|l| !l.starts_with('#')) {
        let numbers: Vec<f64> = line.split(',').map(|w| w.parse().unwrap()).collect();
        let origin = ((DVec3::from_slice(&numbers) - scene.centre) * scene.unit).as_vec3();
        let direction = DVec3::from_slice(&numbers[3..]).as_vec3();
        let ray = Ray::new(origin, direction);
        let mut hit = [Hit::NONE];
        scene.accel.closest_hits(&[ray], &mut hit);
        let shape = &scene.shapes[hit[0].shape as usize];
        let point = shape.meet(&ray, hit[0].primitive).point;
        let index = scene.appearances[hit[0].shape as usize].light.unwrap();
        let Light::Varying(light) = &scene.lights[index as usize] else { panic!("{line}") };
        let value = light.emitted(shape, hit[0].primitive, &point, &-direction);
        let expected = DVec3::from_slice(&numbers[6..]).as_vec3();
        let off = (value.0 - expected).abs().max_element();
        assert!(off <= HALF * expected.max_element(), "{line}: {value:?}");
        count += 1;
        dark += u32::from(expected == Vec3::ZERO);
    }
    assert!(count == 240 && dark > 10, "{count}, {dark}");
}
