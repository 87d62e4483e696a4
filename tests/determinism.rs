//! The same picture every time: for any number of threads, for both accelerators, at any power-of-two scale.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use glam::DVec3;
use snell::accel::Accelerator;
use snell::integrator::Estimator;

const SCENES: [&str; 3] =
    ["scenes/cornell-box/scene.xml", "scenes/cornell-box-materials/scene.xml", "scenes/furnace/scene.xml"];

#[test]
fn threads_change_no_bit() {
    for path in SCENES {
        let description = load(path, &[("res", "70")]);
        for accelerator in accelerators() {
            let scene = compiled(&description, accelerator);
            let s = file_settings(&description, Estimator::Path, 20);
            let one = rendered(&scene, &s, 1).film.develop();
            for threads in [2, 7] {
                assert_eq!(
                    one,
                    rendered(&scene, &s, threads).film.develop(),
                    "{path}, {accelerator:?}, {threads} threads"
                );
            }
        }
    }
}

/// Every length of the Cornell boxes times 2^±40: geometry, camera, clip planes.
#[test]
fn powers_of_two_change_no_bit() {
    for path in SCENES {
        for accelerator in accelerators() {
            let description = load(path, &[("res", "48")]);
            let s = file_settings(&description, Estimator::Path, 8);
            let base = picture(&compiled(&description, accelerator), &s);
            for exponent in [-40, -3, 40] {
                let scaled = transformed(description.clone(), 2f64.powi(exponent), DVec3::ZERO);
                assert_eq!(
                    base,
                    picture(&compiled(&scaled, accelerator), &s),
                    "{path} × 2^{exponent}, {accelerator:?}"
                );
            }
        }
    }
}

/// A part of the picture is the same bits as that part of the whole.
#[test]
fn a_crop_is_a_part_of_the_whole() {
    let mut description = load(SCENES[1], &[("res", "64")]);
    let s = file_settings(&description, Estimator::Path, 4);
    let whole = picture(&compiled(&description, Accelerator::Native), &s);
    let crop = snell::image::Crop { x: 13, y: 30, width: 21, height: 19 };
    description.cameras[0].film.crop = crop;
    let part = picture(&compiled(&description, Accelerator::Native), &s);
    for y in 0..crop.height {
        for x in 0..crop.width {
            assert_eq!(part.get(x, y), whole.get(x + crop.x, y + crop.y), "pixel {x}, {y} of the crop");
        }
    }
}

/// Native and Embree differ only where a ray had a tie, or where Embree lost a hit that the oracle confirms; every ray of
/// whole renders is counted.
#[cfg(feature = "embree")]
#[test]
fn accelerators_differ_only_by_ties_and_confirmed_misses() {
    for path in SCENES {
        let description = load(path, &[("res", "64")]);
        let s = file_settings(&description, Estimator::Path, 32);
        let both = compiled(&description, Accelerator::Both);
        let rays = rendered(&both, &s, 2).rays.total();
        let counts = both.accel.comparison().expect("both are compared");
        println!("{path}: {rays} rays: {counts:?}");
        let unexplained = counts.native_misses + counts.native_false + counts.embree_false;
        assert_eq!(unexplained, 0, "{path}: {counts:?}");
        let explained = counts.ties + counts.edges + counts.embree_misses;
        let [native, embree] =
            [Accelerator::Native, Accelerator::Embree].map(|a| picture(&compiled(&description, a), &s));
        let different = native.pixels().iter().zip(embree.pixels()).filter(|(a, b)| a != b).count() as u64;
        println!("{path}: {different} pixels differ");
        assert!(different <= explained, "{path}: {different} pixels differ, {counts:?}");
    }
}
