//! Several light samples at the first hit: the same expected picture, and less noise of direct light.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use snell::accel::Accelerator;
use snell::integrator::{Estimator, PathReuse, Undecided};
use snell::render::RenderSettings;
use snell::sampler::SamplerKind;

/// Width and height of the pictures.
const RES: u32 = 32;

/// Pictures of each kind.
const SEEDS: u64 = 24;

fn with_samples(light_samples: u32, settings: &RenderSettings) -> RenderSettings {
    let mut settings = *settings;
    settings.integrator.light_samples = light_samples;
    settings
}

/// Hypothesis: more light samples do not change the expectation of any tile (8×8 pixels), nor of the whole picture, with shared
/// paths or without; lights of every kind, lobes of every kind. z follows Student's t with 23 to 46 degrees of freedom: |t₂₃| > 7
/// has probability 4·10⁻⁷, in one of 16 tiles 6·10⁻⁶, and |t₂₃| > 6 for the whole 4·10⁻⁶: below 2·10⁻⁴ for all pictures. The
/// seeds are fixed, and those of the two pictures differ.
#[test]
fn light_samples_change_no_expectation() {
    let scenes =
        ["caustic", "cornell-box", "cornell-box-materials", "glass", "layers", "many-lights", "plates", "shelf"];
    for (i, name) in scenes.into_iter().enumerate() {
        let scratch = tempfile::tempdir().unwrap();
        let description = load_scene(name, RES, scratch.path());
        let scene = compiled(&description, Accelerator::Auto);
        let mut one = file_settings(&description, Estimator::Path, 16);
        let mut several = with_samples([2, 4, 16][i % 3], &one);
        several.integrator.reuse = if i % 2 == 1 { PathReuse::Blocks } else { PathReuse::Off };
        several.sampler.kind = [SamplerKind::Sobol, SamplerKind::Stratified { samples: 16 }][i % 2];
        let estimate = Estimate::of(&scene, &several, SEEDS);
        one.sampler.kind = SamplerKind::Independent;
        let worst = estimate.worst_z_against(&Estimate::of(&scene, &one, SEEDS));
        println!("{name}: z {:.2}, worst tile {:.2}", worst.whole, worst.tile);
        assert!(worst.whole < 6.0, "{name} is off by {} standard errors", worst.whole);
        assert!(worst.tile < 7.0, "{name} is off by {} standard errors in a tile", worst.tile);
    }
}

/// Where what is in the way is all that is left to be noise, more samples than rays are worth as many: under 200 lamps the
/// variance of direct light with eight samples and four rays is about two thirds of that with one; measured by 8 pictures of
/// 1,024 pixels each it wobbles by a fiftieth.
#[test]
fn light_samples_lessen_the_noise_of_direct_light() {
    let description = load("scenes/many-lights/scene.xml", &[("res", "32")]);
    let scene = compiled(&description, Accelerator::Auto);
    let mut one = file_settings(&description, Estimator::Path, 4);
    one.integrator.max_depth = 2;
    let variance = |settings: &RenderSettings| relative_variance(&scene, settings);
    let ratio = variance(&with_samples(8, &one)) / variance(&one);
    println!("ratio {ratio}");
    assert!(ratio < 0.75, "{ratio}");
}

/// A sampler that has no numbers for so many takes one.
#[test]
fn samplers_without_numbers_for_more_take_one() {
    let description = load("scenes/cornell-box/scene.xml", &[("res", "8")]);
    let scene = compiled(&description, Accelerator::Native);
    let mut one = file_settings(&description, Estimator::Path, 1);
    one.sampler.kind = SamplerKind::ZSobol { log_samples: snell::sampler::MOST_LOG_SAMPLES };
    let pictures = [1, 4].map(|n| picture(&scene, &with_samples(n, &one)));
    assert_eq!(pictures[0].pixels(), pictures[1].pixels());
}

/// They are taken where a choice among many lights makes the noise, not where one lamp does, nor where there is no choice.
#[test]
fn a_trial_decides() {
    let taken = |name: &str| {
        let scratch = tempfile::tempdir().unwrap();
        let description = load_scene(name, 64, scratch.path());
        let scene = compiled(&description, Accelerator::Auto);
        let settings = file_settings(&description, Estimator::Path, 1);
        settings.integrator.with_what_pays(&scene, Undecided { reuse: false, light_samples: true }).light_samples
    };
    assert_eq!(["many-lights", "cornell-box", "furnace"].map(taken), [4, 1, 1]);
}
