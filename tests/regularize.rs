//! Paths that are regularized: biased as they are said to be and no more, with less noise; and nothing changes where they are not.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;
mod desk;

use common::*;
use desk::*;
use snell::accel::Accelerator;
use snell::description::SceneDescription;
use snell::image::Picture;
use snell::integrator::{Estimator, PathReuse};
use snell::scene::Scene;
use std::fs;

/// Pictures of each kind.
const SEEDS: u64 = 32;

fn regularized(description: &SceneDescription) -> Scene {
    let mut scene = compiled(description, Accelerator::Auto);
    scene.regularize();
    scene
}

/// Both pictures of a scene in 16 samples a pixel, without and with.
fn both(description: &SceneDescription) -> [Picture; 2] {
    let settings = file_settings(description, Estimator::Path, 16);
    [compiled(description, Accelerator::Auto), regularized(description)].map(|scene| picture(&scene, &settings))
}

/// Where everything is diffuse, and where paths meet nothing but mirrors and smooth glass before they end, no bit changes.
#[test]
fn diffuse_scenes_and_what_is_seen_by_mirrors_alone_keep_their_bits() {
    let [without, with] = both(&load("scenes/cornell-box/scene.xml", &[("res", "24")]));
    assert_eq!(without, with);
    let desk = Desk::new();
    let sphere = |x: &str, bsdf: &str| {
        format!(r#"<shape type="sphere"><point name="center" x="{x}" y="0" z="5"/><bsdf type="{bsdf}"/></shape>"#)
    };
    let sky = r#"<emitter type="constant"><rgb name="radiance" value="1, 2, 3"/></emitter>"#;
    let text = scene_text(&(sphere("-1", "dielectric") + &sphere("1.1", "conductor") + sky));
    fs::write(desk.path("mirrors.xml"), text).unwrap();
    let [without, with] = both(&load(desk.path("mirrors.xml").to_str().unwrap(), &[]));
    assert_eq!(without, with);
    // The same under plastic differs: what its base scatters meets rougher spheres.
    let text = scene_text(&(sphere("-1", "plastic") + &sphere("1.1", "conductor") + sky));
    fs::write(desk.path("plastic.xml"), text).unwrap();
    let [without, with] = both(&load(desk.path("plastic.xml").to_str().unwrap(), &[]));
    assert_ne!(without, with);
}

/// Hypothesis: the variance of pixels over eight seeds of 16 samples, over the square of what the references have there, falls to
/// less than 0.7 of it, in scenes of caustics by smooth and by rough glass. (By the pictures' own means, as for other scenes, it would
/// not do: a pixel whose light one seed of eight has found has a relative variance of eight, however bright that is.) Few paths
/// decide, so that the figure wobbles from one set of seeds to another; the seeds are fixed. With them it is 0.70 and 0.15.
#[test]
fn caustics_have_less_noise() {
    for name in ["caustic", "rough-glass-caustic"] {
        let description = load(&format!("scenes/{name}/scene.xml"), &[("res", &RES.to_string())]);
        let (settings, reference) = (file_settings(&description, Estimator::Path, 16), read_reference(name));
        let [without, with] = [compiled(&description, Accelerator::Auto), regularized(&description)].map(|scene| {
            let pixels = Estimate::of(&scene, &settings, 8).pixels;
            pixels.iter().zip(&reference.pixels).map(|(p, r)| p.variance / (r.mean * r.mean + 0.01)).sum::<f64>()
        });
        println!("{name}: {without:.3} falls to {with:.3}, {:.3} of it", with / without);
        assert!(with < 0.7 * without, "{name}: {with} instead of {without}");
    }
}

/// Hypothesis: all ways to find light, and sharing among pixels, agree about the expectation of every tile (8×8 pixels) and of the
/// whole picture: there is one regularized picture, whose twins' values and densities are one another's. z follows Student's t with
/// 31 to 62 degrees of freedom: |t₃₁| > 6.5 has probability 3·10⁻⁷, in one of 25 tiles 8·10⁻⁶, |t₃₁| > 5.5 for the whole
/// 5·10⁻⁶: below 10⁻⁴ for all. The seeds are fixed.
#[test]
fn all_estimators_agree_about_the_regularized_picture() {
    let scratch = tempfile::tempdir().unwrap();
    for name in ["cornell-box-materials", "layers"] {
        let description = load_scene(name, 36, scratch.path());
        let scene = regularized(&description);
        let of = |estimator: Estimator, reuse: PathReuse, shift: u64| {
            let mut settings = file_settings(&description, estimator, 16);
            settings.integrator.reuse = reuse;
            Estimate::of_shifted(&scene, &settings, SEEDS, shift)
        };
        let path = of(Estimator::Path, PathReuse::Off, 0);
        let others = [
            (Estimator::Path, PathReuse::Blocks),
            (Estimator::Path, PathReuse::Eights),
            (Estimator::Nee, PathReuse::Off),
        ];
        for (estimator, reuse) in others {
            let worst = of(estimator, reuse, 100).worst_z_against(&path);
            println!("{name}, {estimator:?}, {reuse:?}: z {:.2}, worst tile {:.2}", worst.whole, worst.tile);
            assert!(worst.whole < 5.5 && worst.tile < 6.5, "{name}, {estimator:?}, {reuse:?}: {worst:?}");
        }
    }
}

/// The command does it, to the same bits on any number of threads, and a checkpoint knows.
#[test]
fn the_command_regularizes_and_checkpoints_know() {
    let desk = Desk::new();
    let scene = project("scenes/caustic/scene.xml");
    let scene = scene.to_str().unwrap();
    let common = ["render", scene, "-Dres=16", "--spp=4", "-q"];
    let pixels = |name: &str, more: &[&str]| {
        desk.succeeds(&[&common[..], more, &["-o", name]].concat());
        snell::image::read_picture(&desk.path(name)).unwrap().picture
    };
    let one = pixels("one.exr", &["--regularize", "--threads=1"]);
    assert_eq!(one, pixels("two.exr", &["--regularize", "--threads=2", "--checkpoint=c.snell", "--resume"]));
    assert_ne!(one, pixels("none.exr", &[]));
    desk.refuses(
        &[&common[..], &["--checkpoint=c.snell", "--resume", "-o", "two.exr"]].concat(),
        &["c.snell: this checkpoint is of another render: bias: regularize, not none"],
    );
}
