//! Whole pictures against converged references of another renderer, with the variance of both.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use exr::prelude::*;
use snell::image::Picture;
use snell::integrator::Estimator;

fn read(path: &str) -> Picture {
    let set = |picture: &mut Picture, at: Vec2<usize>, (r, g, b, _): (f32, f32, f32, f32)| {
        picture.set(at.x() as u32, at.y() as u32, snell::spectrum::Rgb::new(r, g, b));
    };
    let new = |size: Vec2<usize>, _: &_| Picture::new(size.width() as u32, size.height() as u32);
    let image = read_first_rgba_layer_from_file(project(path), new, set).unwrap_or_else(|e| panic!("{path}: {e}"));
    image.layer_data.channel_data.pixels
}

/// Hypothesis: the expectation of each tile (8×8 pixels) and of the picture is the reference's. 24 seeds × 64 samples at
/// the references' 64×64. The picture's mean must be within 4 standard errors (false-alarm rate 6·10⁻⁵ a case, four
/// cases), every tile within 7 (Student's t with 23 degrees of freedom: 4·10⁻⁷ a tile, 64 tiles, four cases: 10⁻⁴). The
/// seeds are fixed.
#[test]
fn pictures_agree_with_the_references() {
    for name in ["cornell-box", "cornell-box-materials"] {
        let mean = tile_means(&read(&format!("tests/data/reference/{name}.exr")));
        // The mean of 192 independent values has their mean variance over 192.
        let variance = tile_means(&read(&format!("tests/data/reference/{name}_var.exr")));
        let reference = Tiles { mean, variance: variance.iter().map(|v| v / 192.0).collect() };
        let description = load(&format!("scenes/{name}/scene.xml"), &[("res", "64")]);
        for accelerator in accelerators() {
            let scene = compiled(&description, accelerator);
            let tiles = Tiles::of(&scene, &file_settings(&description, Estimator::Path, 64), 24);
            let (whole, worst) = tiles.z_against(&reference);
            println!("{name}, {accelerator:?}: z {whole:.2}, worst tile {worst:.2}");
            assert!(whole.abs() < 4.0, "{name}, {accelerator:?}: the mean is off by {whole} standard errors");
            assert!(worst < 7.0, "{name}, {accelerator:?}: a tile is off by {worst} standard errors");
        }
    }
}

/// The white furnace: radiance 1 in every pixel, within noise, and within 10⁻⁴ in the mean. 128×128 × 1024 samples have a
/// standard error of about 2·10⁻⁵ (taken from 8 seeds of 128 samples each).
#[test]
fn the_furnace_is_white() {
    let description = load("scenes/furnace/scene.xml", &[]);
    for accelerator in accelerators() {
        let scene = compiled(&description, accelerator);
        let means: Vec<f64> = (0..8)
            .map(|seed| {
                let mut s = file_settings(&description, Estimator::Path, 128);
                s.sampler.seed = seed;
                mean(&picture(&scene, &s))
            })
            .collect();
        let m = means.iter().sum::<f64>() / 8.0;
        println!("{accelerator:?}: mean {m}");
        assert!((m - 1.0).abs() < 1e-4, "{accelerator:?}: mean {m} from {means:?}");
    }
}

/// Without light sampling and roulette the furnace has no noise: every path ends in the sky, with exactly the throughput
/// that its lossless surfaces left it. Paths longer than the limit are those caught in glass by total reflection.
#[test]
fn the_furnace_without_noise_is_white_in_every_pixel() {
    let description = load("scenes/furnace/scene.xml", &[]);
    for accelerator in accelerators() {
        let mut s = file_settings(&description, Estimator::Bsdf, 32);
        s.integrator.rr_depth = u32::MAX;
        s.integrator.max_depth = 1000;
        let picture = picture(&compiled(&description, accelerator), &s);
        for (i, p) in picture.pixels().iter().enumerate() {
            for v in p.to_array() {
                // Each refraction multiplies and divides by η², with two roundings; paths have some dozen.
                assert!((v - 1.0).abs() < 2e-6, "{accelerator:?}: pixel {i} is {v}");
            }
        }
    }
}
