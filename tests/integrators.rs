//! All estimators converge to the same picture.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use snell::accel::Accelerator;
use snell::integrator::Estimator;

/// Hypothesis: the expectation of every tile (8×8 pixels) and of the whole picture is that of `path`. Each estimator is
/// rendered with 32 seeds at 64×64. A tile's z follows Student's t with about 31 to 62 degrees of freedom: |t₃₁| > 6.5 has
/// probability 3·10⁻⁷, times 64 tiles × 8 comparisons 2·10⁻⁴; the whole picture's |z| > 5 has 6·10⁻⁷ a comparison. The
/// seeds are fixed. With heavy tails (caustics) the normal law is an approximation, hence the wide bounds.
#[test]
fn estimators_agree_with_path_on_every_scene() {
    for (path, samples) in [("scenes/cornell-box/scene.xml", 16), ("scenes/cornell-box-materials/scene.xml", 16)] {
        let description = load(path, &[("res", "64")]);
        let scene = compiled(&description, Accelerator::Auto);
        let reference = Tiles::of(&scene, &file_settings(&description, Estimator::Path, samples), 32);
        for estimator in [Estimator::Nee, Estimator::Bsdf, Estimator::Naive] {
            let tiles = Tiles::of(&scene, &file_settings(&description, estimator, 2 * samples), 32);
            let (whole, worst) = tiles.z_against(&reference);
            println!("{path}: {estimator:?} against path: z {whole:.2}, worst tile {worst:.2}");
            assert!(whole.abs() < 5.0, "{path}: {estimator:?} is off by {whole} standard errors");
            assert!(worst < 6.5, "{path}: {estimator:?} is off by {worst} standard errors in a tile");
        }
    }
}

/// The same for the two samplers.
#[test]
fn samplers_agree() {
    let description = load("scenes/cornell-box-materials/scene.xml", &[("res", "64")]);
    let scene = compiled(&description, Accelerator::Auto);
    let sobol = file_settings(&description, Estimator::Path, 16);
    let mut independent = sobol;
    independent.sampler.kind = snell::sampler::SamplerKind::Independent;
    let (whole, worst) = Tiles::of(&scene, &independent, 32).z_against(&Tiles::of(&scene, &sobol, 32));
    assert!(whole.abs() < 5.0 && worst < 6.5, "z {whole}, worst tile {worst}");
}
