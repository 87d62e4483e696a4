//! Paths that neighbours share: the same expected picture, less noise, and no less determined.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use snell::accel::Accelerator;
use snell::film::SampleId;
use snell::integrator::record::Event;
use snell::integrator::{Estimator, PathReuse, Undecided};
use snell::render::RenderSettings;
use snell::spectrum::Rgb;

/// Width and height of the pictures: not whole blocks of pixels.
const RES: u32 = 36;

/// A room whose surfaces scatter widely, but not alike in all directions.
const WIDE: &str = "tests/data/reuse/wide.xml";

/// Pictures of each kind.
const SEEDS: u64 = 32;

fn shared(alone: &RenderSettings, reuse: PathReuse) -> RenderSettings {
    let mut settings = *alone;
    settings.integrator.reuse = reuse;
    settings
}

/// Hypothesis: sharing does not change the expectation of any tile (8×8 pixels), nor of the whole picture. z follows Student's t
/// with 31 to 62 degrees of freedom: |t₃₁| > 6.5 has probability 3·10⁻⁷, in one of 25 tiles 8·10⁻⁶, and |t₃₁| > 5.5 for the whole
/// 5·10⁻⁶: below 2·10⁻⁴ for all scenes. The seeds are fixed, and those of the two pictures differ.
#[test]
fn sharing_changes_no_expectation() {
    let scratch = tempfile::tempdir().unwrap();
    let all = ["caustic", "cornell-box", "cornell-box-materials", "layers", "million", "plates", "shelf", WIDE];
    let blocks = all.map(|name| (name, PathReuse::Blocks));
    for (name, reuse) in blocks.into_iter().chain([("layers", PathReuse::Eights), (WIDE, PathReuse::Eights)]) {
        let description = match name {
            WIDE => load(WIDE, &[("res", &RES.to_string())]),
            own => load_scene(own, RES, scratch.path()),
        };
        let scene = compiled(&description, Accelerator::Auto);
        let mut alone = file_settings(&description, Estimator::Path, 16);
        let with = Estimate::of(&scene, &shared(&alone, reuse), SEEDS);
        alone.sampler.kind = snell::sampler::SamplerKind::Independent;
        let worst = with.worst_z_against(&Estimate::of(&scene, &alone, SEEDS));
        println!("{name}, {reuse:?}: z {:.2}, worst tile {:.2}", worst.whole, worst.tile);
        assert!(worst.whole < 5.5, "{name} is off by {} standard errors", worst.whole);
        assert!(worst.tile < 6.5, "{name} is off by {} standard errors in a tile", worst.tile);
    }
}

/// In the Cornell box all indirect light is diffuse, in the other room hardly any. At 128×128, where a block of eight pixels is a
/// sixteenth of their width, the variance is about a fifth in the one and half in the other, with eights a fourth and a little more
/// than half; measured by 8 pictures of 16,000 pixels each it wobbles by a hundredth.
#[test]
fn sharing_lowers_the_variance() {
    for (file, at_most) in [("scenes/cornell-box/scene.xml", 0.5), (WIDE, 0.8)] {
        let description = load(file, &[("res", "128")]);
        let scene = compiled(&description, Accelerator::Auto);
        let alone = file_settings(&description, Estimator::Path, 4);
        let variance = |settings: &RenderSettings| relative_variance(&scene, settings);
        let by_itself = variance(&alone);
        for reuse in [PathReuse::Eights, PathReuse::Blocks] {
            let ratio = variance(&shared(&alone, reuse)) / by_itself;
            println!("{file}, {reuse:?}: ratio {ratio}");
            assert!(ratio < at_most, "{file}, {reuse:?}: {ratio}");
        }
    }
}

/// Who shares does not depend on threads, nor the picture on who finds the hits; a longer render begins like a short one.
#[test]
fn sharing_is_determined() {
    let scratch = tempfile::tempdir().unwrap();
    let description = load_scene("cornell-box-materials", RES, scratch.path());
    let scene = compiled(&description, Accelerator::Native);
    let bits =
        |p: &snell::image::Picture| p.pixels().iter().map(|c| c.to_array().map(f32::to_bits)).collect::<Vec<_>>();
    for reuse in [PathReuse::Eights, PathReuse::Blocks] {
        let settings = shared(&file_settings(&description, Estimator::Path, 8), reuse);
        let first = bits(&rendered(&scene, &settings, 1).film.develop());
        assert!(first == bits(&rendered(&scene, &settings, 3).film.develop()), "threads");
        for accelerator in accelerators() {
            let scene = compiled(&description, accelerator);
            assert!(first == bits(&picture(&scene, &settings)), "{accelerator:?}");
        }
    }
}

/// A replayed sample is the sample that was rendered.
#[test]
fn replay_tells_the_shared_radiance() {
    let scratch = tempfile::tempdir().unwrap();
    let description = load_scene("cornell-box", RES, scratch.path());
    let scene = compiled(&description, Accelerator::Auto);
    let settings =
        [PathReuse::Blocks, PathReuse::Eights].map(|r| shared(&file_settings(&description, Estimator::Path, 1), r));
    let pictures = settings.map(|settings| picture(&scene, &settings));
    let places = [(0, 0), (35, 35), (17, 20), (5, 33)];
    for (x, y, i) in places.into_iter().flat_map(|(x, y)| [(x, y, 0), (x, y, 1)]) {
        let (picture, settings) = (&pictures[i], &settings[i]);
        let (mut radiance, mut shares) = (None, false);
        let mut listen = |event: Event| match event {
            Event::Finished { radiance: r } => radiance = Some(r),
            Event::Shared => shares = true,
            _ => {}
        };
        settings.integrator.replay(&scene, &settings.sampler, SampleId { x, y, index: 0 }, false, &mut listen);
        let seen: Rgb = picture.pixels()[(y * RES as i32 + x) as usize];
        let told = radiance.expect("the path was walked");
        assert!(shares);
        // The film rounds to 2⁻⁶⁴ of the brightest light.
        let off = (told.0 - seen.0).abs().max_element();
        assert!(off <= f32::EPSILON * told.max_component(), "{x},{y}: {told:?} {seen:?}");
    }
}

/// It is left alone where it does not pay.
#[test]
fn a_trial_decides() {
    let pays = |name: &str| {
        let scratch = tempfile::tempdir().unwrap();
        let description = load_scene(name, 64, scratch.path());
        let scene = compiled(&description, Accelerator::Auto);
        let settings = file_settings(&description, Estimator::Path, 1);
        settings.integrator.with_what_pays(&scene, Undecided { reuse: true, light_samples: false }).reuse
    };
    assert_eq!(pays("cornell-box"), PathReuse::Blocks);
    assert_eq!(pays("furnace"), PathReuse::Off, "one bounce under a constant sky");
    assert_eq!(pays("glass"), PathReuse::Off, "what absorbs shares nothing");
}
