//! Light that is absorbed inside of glTF's volumes, in closed form and by all estimators.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use glam::{DAffine3, DMat3, DVec3};
use snell::accel::Accelerator;
use snell::description::*;
use snell::integrator::Estimator;
use snell::spectrum::Rgb;

const ESTIMATORS: [Estimator; 4] = [Estimator::Path, Estimator::Nee, Estimator::Bsdf, Estimator::Naive];

/// What is left of each channel after [`DISTANCE`].
const LEFT: Rgb = Rgb::new(0.9, 0.3, 0.05);
const DISTANCE: f64 = 0.7;

/// Half the field of view of the only pixel, in degrees.
const HALF_FOV: f64 = 1e-4;

/// Clear but for what is inside.
fn clear(ior: f64, roughness: f64, distance: f64) -> Bsdf {
    let volume = Some(Volume { attenuation_color: LEFT, attenuation_distance: distance });
    let gltf = Gltf { metallic: 0.0, roughness, ior, transmission: 1.0, volume, ..Gltf::default() };
    Bsdf { at: at(), name: String::new(), kind: BsdfKind::Gltf(gltf), varying: vec![] }
}

/// Shapes of one material under a sky of radiance 1, seen by one pixel from `from` in the direction of the origin.
fn under_the_sky(bsdf: Bsdf, shapes: Vec<Shape>, from: DVec3) -> SceneDescription {
    SceneDescription {
        cameras: vec![camera(from, DVec3::ZERO, 2.0 * HALF_FOV, 1)],
        bsdfs: vec![bsdf],
        shapes,
        lights: vec![light(LightKind::Constant { radiance: Rgb::WHITE })],
        ..enclosure(0.0, 0.0)
    }
}

fn ball(radius: f64) -> Geometry {
    Geometry::Sphere { centre: DVec3::ZERO, radius, frame: DMat3::IDENTITY }
}

/// What is left after a distance.
fn left(channel: f32, distance: f64) -> f64 {
    f64::from(channel).powf(distance / DISTANCE)
}

/// Without contrast a ball is Beer's law, exp(−σ·2r), for a ray through its middle; rays of the pixel miss it by less than
/// 10⁻⁵. From inside, whence half of it is seen, the exponent is half as large. Every sample is the same.
#[test]
fn a_ball_of_index_1_is_beer_s_law() {
    const ROUNDING: f64 = 1e-5;
    for scale in [1.0, 1000.0] {
        for estimator in ESTIMATORS {
            let radius = 1.3;
            for (from, distance) in [(5.0, 2.0 * radius), (1e-3, radius)] {
                let shapes = vec![shape(ball(radius), DAffine3::IDENTITY, 0, None)];
                let scene = under_the_sky(clear(1.0, 0.3, DISTANCE), shapes, DVec3::new(0.0, 0.0, from));
                let scene = compiled(&transformed(scene, scale, DVec3::ZERO), Accelerator::Auto);
                let seen = picture(&scene, &settings(estimator, 16)).get(0, 0);
                for (seen, channel) in seen.to_array().into_iter().zip(LEFT.to_array()) {
                    let expected = left(channel, distance);
                    let error = f64::from(seen) / expected - 1.0;
                    // The camera inside is a thousandth off the middle.
                    let tolerance = ROUNDING + if from < 1.0 { 5e-3 } else { 0.0 };
                    assert!(error.abs() < tolerance, "{estimator:?}, {from} × {scale}: {seen} instead of {expected}");
                }
            }
        }
    }
}

/// Lengths times a power of two change no bit, the attenuation's included.
#[test]
fn powers_of_two_change_no_bit() {
    let seen = |scale: f64| {
        let shapes = vec![shape(ball(1.0), DAffine3::IDENTITY, 0, None)];
        let scene = under_the_sky(clear(1.4, 0.6, DISTANCE), shapes, DVec3::new(1.0, 2.0, 3.0));
        picture(&compiled(&transformed(scene, scale, DVec3::ZERO), Accelerator::Auto), &settings(Estimator::Path, 64))
    };
    let one = seen(1.0);
    for scale in [0.25, 4096.0] {
        assert_eq!(seen(scale).pixels(), one.pixels(), "× {scale}");
    }
}

/// A slab of index 1.5 and thickness d seen along its normal under a uniform sky: with R = 0.04 and a = exp(−σ·d) what comes
/// back is R + (1−R)²·R·a²/(1−R²a²), what passes (1−R)²·a/(1−R²a²).
///
/// Hypothesis: the mean is that of the closed form, but for the facets' slopes of 10⁻⁴, which lengthen no path by more than
/// their square. 16 seeds of 2¹² samples; Student's t with 15 degrees of freedom exceeds 6.5 with probability 10⁻⁵, six times.
#[test]
fn a_slab_is_a_geometric_series() {
    const MOST: f64 = 6.5;
    let thickness = 0.5;
    let scale = DAffine3::from_scale(DVec3::new(40.0, 40.0, 1.0));
    let up = DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.5 * thickness));
    let turned = DAffine3::from_rotation_x(std::f64::consts::PI);
    let shapes =
        vec![shape(Geometry::Rectangle, up * scale, 0, None), shape(Geometry::Rectangle, turned * up * scale, 0, None)];
    let scene = under_the_sky(clear(1.5, 0.0, DISTANCE), shapes, DVec3::new(0.0, 0.0, 4.0));
    let scene = compiled(&scene, Accelerator::Auto);
    let reflectance = 0.04;
    for estimator in [Estimator::Path, Estimator::Bsdf] {
        let seeds: Vec<Rgb> = (0..16)
            .map(|seed| {
                let mut settings = settings(estimator, 1 << 12);
                settings.sampler.seed = seed;
                picture(&scene, &settings).get(0, 0)
            })
            .collect();
        for (c, channel) in LEFT.to_array().into_iter().enumerate() {
            let a = left(channel, thickness);
            let rest = (1.0 - reflectance) * (1.0 - reflectance) / (1.0 - reflectance * reflectance * a * a);
            let expected = reflectance + rest * (reflectance * a * a + a);
            let values: Vec<f64> = seeds.iter().map(|s| f64::from(s.to_array()[c])).collect();
            let mean = values.iter().sum::<f64>() / 16.0;
            let error = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 15.0 / 16.0).sqrt();
            let z = (mean - expected) / error.max(1e-7);
            println!("{estimator:?}: {mean} ± {error}, expected {expected}");
            assert!(z.abs() < MOST, "{estimator:?}, channel {c}: {mean} ± {error} instead of {expected}");
        }
    }
}

/// A light and a diffuse ball frozen into rough absorbing glass, in a room: shadow rays inside, and refraction both ways.
///
/// Hypothesis: estimators have the expectation of `path`; the bounds are those of the test of all scenes
/// (`tests/integrators.rs`), with three comparisons.
#[test]
fn estimators_agree_about_what_is_inside() {
    const SEEDS: u64 = 32;
    for (ior, roughness) in [(1.5, 1.0), (1.0, 1.0)] {
        let mut room = enclosure(0.6, 0.1);
        room.bsdfs.push(clear(ior, roughness, 0.4));
        let place = |x: f64, radius: f64| {
            DAffine3::from_translation(DVec3::new(x, 0.1, -0.3)) * DAffine3::from_scale(DVec3::splat(radius))
        };
        room.shapes.push(shape(ball(1.0), place(-0.3, 0.55), 1, None));
        room.shapes.push(shape(ball(1.0), place(-0.1, 0.15), 0, Some(5.0)));
        room.shapes.push(shape(ball(1.0), place(-0.6, 0.15), 0, None));
        room.integrator.max_depth = Some(6);
        let scene = compiled(&room, Accelerator::Auto);
        let estimate = |estimator, samples| Estimate::of(&scene, &file_settings(&room, estimator, samples), SEEDS);
        let path = estimate(Estimator::Path, 32);
        for estimator in &ESTIMATORS[1..] {
            let worst = estimate(*estimator, 64).worst_z_against(&path);
            println!("{ior}, {estimator:?}: z {:.2}, worst tile {:.2}", worst.whole, worst.tile);
            assert!(
                worst.whole < 5.5 && worst.tile < 6.5,
                "{ior}, {estimator:?} is off: {:?}",
                (worst.whole, worst.tile)
            );
        }
    }
}
