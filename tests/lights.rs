//! What the lights of the scene's own bring to a point, against Mitsuba 3.9.1: `tests/data/reference/lights.csv`, made from
//! the same scene file by `lights.py` there.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use glam::{DVec3, Vec2, Vec3};
use snell::accel::Accelerator;
use snell::light::Light;

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
            Light::Environment(map) => map.seen(&place.as_vec3(), false).0,
            light => {
                let p = (place - scene.centre) * scene.unit;
                light.sample(&scene.shapes, p, Vec2::splat(0.5), false).map(|s| s.radiance).unwrap_or_default()
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
