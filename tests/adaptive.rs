//! Samples that go where the error is: the same bits whatever the threads, and the same picture in the mean.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod common;

use common::*;
use snell::accel::Accelerator;
use snell::film::Film;
use snell::image::{Filter, Picture};
use snell::integrator::aov::{Aov, Aovs, Quantity};
use snell::integrator::{Estimator, PathReuse};
use snell::render::adaptive::{Limits, render_adaptively};
use snell::render::{Ended, Progress, RenderSettings, Rendered, render_with};
use snell::sampler::SamplerKind;
use snell::scene::Scene;
use std::time::Duration;

fn adaptive(scene: &Scene, settings: &RenderSettings, samples: u32, aovs: &Aovs, threads: usize) -> Rendered {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let limits = Limits { samples: Some(samples), time: None, error: None, confidence: 0.95 };
    render_adaptively(scene, settings, aovs, &limits, (&pool, &Progress::default()))
}

/// The same of two sequences, whether that pays or not: towards a target that is never reached.
fn uneven(scene: &Scene, settings: &RenderSettings, samples: u32, aovs: &Aovs, threads: usize) -> Rendered {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let limits = Limits { samples: Some(samples), time: None, error: Some(0.0), confidence: 0.95 };
    render_adaptively(scene, settings, aovs, &limits, (&pool, &Progress::default()))
}

fn bits(picture: &Picture) -> Vec<[u32; 3]> {
    picture.pixels().iter().map(|p| p.to_array().map(f32::to_bits)).collect()
}

fn counts(film: &Film) -> Vec<u32> {
    film.sample_counts()
}

/// The report's box, whose light is small and whose corners are dark, with the filter given.
fn room(filter: Filter) -> Scene {
    let scratch = tempfile::tempdir().unwrap();
    let mut description = load_scene("cornell-box", 37, scratch.path());
    for camera in &mut description.cameras {
        camera.film.filter = filter;
    }
    compiled(&description, Accelerator::Native)
}

#[test]
fn threads_change_no_bit_and_numbers_differ() {
    let aovs = Aovs { means: vec![], numbers: vec![], sample_counts: true, sky_counts: false, looked_at: u32::MAX };
    for reuse in [PathReuse::Off, PathReuse::Blocks] {
        let scene = room(Filter::Gaussian { stddev: 0.5 });
        let mut settings = settings(Estimator::Path, 1);
        settings.integrator.reuse = reuse;
        let one = uneven(&scene, &settings, 48, &aovs, 1);
        let three = uneven(&scene, &settings, 48, &aovs, 3);
        assert_eq!(bits(&one.film.develop()), bits(&three.film.develop()));
        assert_eq!((one.ended, one.samples), (Ended::Samples, three.samples));
        assert_eq!(one.estimates.unwrap().whole(0.95), three.estimates.unwrap().whole(0.95));
        let counts = counts(&one.film);
        assert_eq!(counts.iter().map(|&n| u64::from(n)).sum::<u64>(), one.samples);
        assert!(one.samples <= 48 * 37 * 37 && one.samples > 46 * 37 * 37, "{}", one.samples);
        let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
        assert!(*least >= 8 && most > least, "{least} to {most} samples");
    }
}

/// Hypothesis: the mean over renders with samples where the error is, is that of renders with the same number everywhere, for a filter
/// that mixes blocks of different numbers. 48 seeds of each, 16 tiles and the whole; of 17 z-scores with some twenty degrees of
/// freedom none is above 4.5 but with a probability of about 0.002.
#[test]
fn the_mean_is_that_of_even_numbers() {
    for filter in [Filter::Box, Filter::Gaussian { stddev: 0.5 }] {
        let scene = room(filter);
        let mut alone = settings(Estimator::Path, 32);
        alone.integrator.max_depth = 4;
        let tiles = |picture: &Picture| {
            let mut sums = [0.0f64; 17];
            for (i, pixel) in picture.pixels().iter().enumerate() {
                let tile = i / 37 / 10 * 4 + i % 37 / 10;
                let value = f64::from(pixel.luminance());
                sums[tile] += value;
                sums[16] += value;
            }
            sums
        };
        let (mut sums, mut squares) = ([[0.0; 17]; 2], [[0.0; 17]; 2]);
        const SEEDS: u64 = 48;
        for seed in 0..SEEDS {
            alone.sampler.seed = 1000 + seed;
            let even = tiles(&rendered(&scene, &alone, 2).film.develop());
            alone.sampler.seed = seed;
            let uneven = tiles(&uneven(&scene, &alone, 32, &Aovs::default(), 2).film.develop());
            for (which, of) in [even, uneven].into_iter().enumerate() {
                for (tile, value) in of.into_iter().enumerate() {
                    sums[which][tile] += value;
                    squares[which][tile] += value * value;
                }
            }
        }
        let n = SEEDS as f64;
        for tile in 0..17 {
            let mean = [0, 1].map(|w| sums[w][tile] / n);
            let variance = [0, 1].map(|w| (squares[w][tile] / n - mean[w] * mean[w]) / (n - 1.0));
            let z = (mean[1] - mean[0]) / (variance[0] + variance[1]).sqrt();
            assert!(z.abs() < 4.5, "{filter:?}, tile {tile}: {} and {}, {z} standard errors apart", mean[0], mean[1]);
        }
    }
}

/// What goes beside radiance is weighted as that is: alpha of a picture that is covered everywhere is 1, and a mean of radiance is the
/// picture.
#[test]
fn what_goes_beside_is_put_together_alike() {
    let scene = room(Filter::Gaussian { stddev: 0.5 });
    let aov = |quantity| Aov { quantity, squared: false };
    let means = vec![aov(Quantity::Alpha), aov(Quantity::Radiance)];
    let aovs = Aovs { means, numbers: vec![], sample_counts: true, sky_counts: true, looked_at: u32::MAX };
    let rendered = uneven(&scene, &settings(Estimator::Path, 1), 40, &aovs, 2);
    let picture = rendered.film.develop();
    let [red, alpha] = [1, 0].map(|which| rendered.film.means(which));
    for ((pixel, red), alpha) in picture.pixels().iter().zip(red).zip(alpha) {
        // The sum beside is rounded to a unit of its own.
        assert!((f64::from(pixel.to_array()[0]) - red).abs() <= 1e-6 * red, "{pixel:?} {red}");
        assert!(alpha > 0.0 && alpha < 1.0 + 1e-9, "{alpha}");
    }
}

/// A hall of even light, in which nothing is gained.
fn hall(filter: Filter) -> Scene {
    let scratch = tempfile::tempdir().unwrap();
    let mut description = load_scene("enclosure", 21, scratch.path());
    for camera in &mut description.cameras {
        camera.film.filter = filter;
    }
    compiled(&description, Accelerator::Native)
}

/// Then the picture is that of a render of as many samples, to the last bit, whatever their number, and so is what goes beside.
#[test]
fn where_it_does_not_pay_all_pixels_get_the_same() {
    let means = vec![Aov { quantity: Quantity::Depth, squared: false }];
    let aovs = Aovs { means, numbers: vec![], sample_counts: true, sky_counts: false, looked_at: u32::MAX };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    for filter in [Filter::Box, Filter::Gaussian { stddev: 0.5 }] {
        let scene = hall(filter);
        let variants = [PathReuse::Off, PathReuse::Blocks, PathReuse::Eights].map(|reuse| (reuse, SamplerKind::Sobol));
        for (reuse, kind) in [&variants[..], &[(PathReuse::Off, SamplerKind::Independent)]].concat() {
            for samples in [4, 32, 51] {
                let mut settings = settings(Estimator::Path, samples);
                settings.integrator.reuse = reuse;
                settings.sampler.kind = kind;
                let case = format!("{filter:?}, {reuse:?}, {kind:?}, {samples} samples");
                let plain = render_with(&scene, &settings, &aovs, &pool, &Progress::default());
                let even = adaptive(&scene, &settings, samples, &aovs, 2);
                assert_eq!((even.is_adaptive, even.ended), (false, Ended::Samples), "{case}");
                assert_eq!((even.samples, even.rays.total()), (plain.samples, plain.rays.total()), "{case}");
                assert_eq!(bits(&even.film.develop()), bits(&plain.film.develop()), "{case}");
                assert_eq!(even.film.means(0), plain.film.means(0), "{case}");
                assert_eq!(counts(&even.film), counts(&plain.film), "{case}");
                let [even, plain] = [even, plain].map(|rendered| rendered.estimates.unwrap().error());
                assert_eq!(even, plain, "{case}");
            }
        }
    }
}

/// In a room with a lamp it does; whatever decides it does not depend on threads.
#[test]
fn where_it_pays_numbers_differ() {
    let aovs = Aovs { means: vec![], numbers: vec![], sample_counts: true, sky_counts: false, looked_at: u32::MAX };
    let scene = room(Filter::Box);
    let [one, three] = [1, 3].map(|threads| adaptive(&scene, &settings(Estimator::Path, 1), 64, &aovs, threads));
    let counts = counts(&one.film);
    assert!(one.is_adaptive && counts.iter().max() > counts.iter().min(), "{:?}", counts.iter().max());
    assert_eq!(bits(&one.film.develop()), bits(&three.film.develop()));
    assert_eq!(one.estimates.unwrap().whole(0.95), three.estimates.unwrap().whole(0.95));
}

/// With no number of samples it goes on until the time is up.
#[test]
fn where_it_does_not_pay_time_is_used_up() {
    let scene = hall(Filter::Box);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let limits = Limits { samples: None, time: Some(Duration::from_millis(300)), error: None, confidence: 0.95 };
    let aovs = Aovs { means: vec![], numbers: vec![], sample_counts: true, sky_counts: false, looked_at: u32::MAX };
    let all = (&pool, &Progress::default());
    let rendered = render_adaptively(&scene, &settings(Estimator::Path, 1), &aovs, &limits, all);
    assert_eq!((rendered.is_adaptive, rendered.ended), (false, Ended::Time));
    let counts = counts(&rendered.film);
    let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
    assert!(*least > 8 && least == most, "{least} to {most} samples");
    assert!(rendered.estimates.is_some());
}

#[test]
fn a_render_that_is_stopped_has_what_was_done() {
    let scene = room(Filter::Box);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let progress = Progress::default();
    progress.cancel();
    let limits = Limits { samples: None, time: None, error: Some(1e-6), confidence: 0.95 };
    let settings = settings(Estimator::Path, 1);
    let rendered = render_adaptively(&scene, &settings, &Aovs::default(), &limits, (&pool, &progress));
    assert_eq!((rendered.ended, rendered.samples, rendered.estimates.is_none()), (Ended::Stopped, 0, true));
    assert!(rendered.film.develop().pixels().iter().all(|pixel| pixel.is_black()));
}
