//! The loop over paths is compiled for what scenes have: every variant that fits a scene gives the same bits.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use snell::accel::Accelerator;
use snell::description::SceneDescription;
use snell::image::Area;
use snell::integrator::record::Event;
use snell::integrator::variant::needs;
use snell::integrator::{Estimator, PathReuse};
use snell::scene::Scene;
use snell::spectrum::Rgb;
use std::collections::BTreeSet;

const RES: u32 = 24;

/// Scenes of all kinds, those that need the variants for any materials and any lights, and those that do not.
fn scenes() -> Vec<(&'static str, SceneDescription)> {
    [
        "caustic",
        "cornell-box",
        "cornell-box-materials",
        "enclosure",
        "glass",
        "layers",
        "many-lights",
        "plates",
        "shelf",
    ]
    .into_iter()
    .map(|name| (name, load(&format!("scenes/{name}/scene.xml"), &[("res", &RES.to_string())])))
    .collect()
}

/// The radiance of each pixel's one sample as a listener is told it: by the variant that fits every scene, as nobody is in a hurry
/// then.
fn as_told(scene: &Scene, settings: &snell::render::RenderSettings) -> Vec<[f32; 3]> {
    let mut told = Vec::new();
    let area = Area { x: 0, y: 0, width: RES, height: RES };
    settings.integrator.record(scene, &settings.sampler, area, 0..1, &mut |event: Event| {
        if let Event::Finished { radiance: Rgb(radiance) } = event {
            told.push(radiance.to_array());
        }
    });
    told
}

#[test]
fn variants_of_the_loop_agree_to_the_last_bit() {
    let mut kinds = BTreeSet::new();
    for (name, mut description) in scenes() {
        let film = &mut description.cameras[0].film;
        film.filter = snell::image::Filter::Box;
        assert_eq!((film.width, film.height), (RES, RES), "{name}");
        let scene = compiled(&description, Accelerator::Native);
        kinds.insert(needs(&scene));
        for estimator in [Estimator::Path, Estimator::Nee] {
            let mut settings = file_settings(&description, estimator, 1);
            settings.integrator.reuse = PathReuse::Off;
            let picture = picture(&scene, &settings);
            // The film's unit is 2⁻⁶⁴ of the power of two above the brightest light: a value is rounded to half of that.
            let rounding = scene.brightest() * libm::ldexpf(1.0, -64);
            let same = |[a, b]: [f32; 2]| a == b || (a - b).abs() <= rounding;
            for (i, (pixel, told)) in picture.pixels().iter().zip(as_told(&scene, &settings)).enumerate() {
                let pairs = [0, 1, 2].map(|c| [pixel.to_array()[c], told[c]]);
                assert!(pairs.into_iter().all(same), "{name}, {estimator:?}, pixel {i}: {pairs:?} {rounding}");
            }
        }
    }
    println!("{kinds:?}");
    assert_eq!(kinds.len(), 4, "every variant is among them: {kinds:?}");
}
