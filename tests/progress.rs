//! What a render tells of itself while it runs, to whoever uses the library.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod common;

use common::*;
use snell::accel::Accelerator;
use snell::image::Area;
use snell::integrator::Estimator;
use snell::render::{Progress, render};

/// One `Progress` may serve several renders, to be shown as one: each still knows what itself has done.
#[test]
fn renders_that_share_a_progress_count_their_own_work() {
    let scene = compiled(&enclosure(0.5, 1.0), Accelerator::Native);
    let settings = settings(Estimator::Path, 2);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let progress = Progress::default();
    let pixels = Area::from(scene.film.crop).pixels();
    for round in 1..=2 {
        let rendered = render(&scene, &settings, &pool, &progress);
        assert!(rendered.is_complete() && rendered.samples == 2 * pixels, "{} samples", rendered.samples);
        assert_eq!(progress.samples(), 2 * pixels * round);
    }
    progress.cancel();
    let cancelled = render(&scene, &settings, &pool, &progress);
    assert!(!cancelled.is_complete() && cancelled.samples == 0);
}
