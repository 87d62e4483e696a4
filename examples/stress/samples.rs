//! How errors fall with the number of samples, and how heavy the tails of samples are.

use super::{Found, Result, compiled, load, picture, settings};
use snell::accel::Accelerator;
use snell::image::Picture;
use snell::sampler::SamplerKind;
use std::path::Path;

/// Pixels a side, and samples of a pixel, of long runs.
const LONG: u32 = 8;
const COUNTS: [u32; 7] = [1000, 3162, 10_000, 31_623, 100_000, 316_228, 1_000_000];

/// The slope of independent samples' error is −½; of seven differences of pictures of 64 pixels, it is known to 0.03.
const SLOPES: [f64; 2] = [-0.6, -0.4];

/// The error, as the difference of two seeds.
pub(super) fn long(path: &Path) -> Result<Found> {
    let scene = load(path, LONG)?;
    let compiled = compiled(&scene, Accelerator::Auto)?;
    let mut points = Vec::new();
    for count in COUNTS {
        let [a, b] = [1, 2].map(|seed| {
            let mut settings = settings(&scene, count);
            settings.sampler.seed = seed;
            settings.sampler.kind = SamplerKind::Independent;
            picture(&compiled, &settings)
        });
        let error = difference(&a, &b);
        println!("{count} samples: relative error {error:.3e}");
        points.push((f64::from(count).ln(), error.ln()));
    }
    let slope = slope(&points);
    let right = (SLOPES[0]..SLOPES[1]).contains(&slope);
    let last = points.last().map_or(0.0, |p| p.1.exp());
    Ok(Found { text: format!("error falls with exponent {slope:.3}, to {last:.1e} at 10^6 samples"), right })
}

/// Root of the mean squared difference over √2, relative to the mean.
fn difference(a: &Picture, b: &Picture) -> f64 {
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for (a, b) in a.pixels().iter().zip(b.pixels()) {
        for (a, b) in a.to_array().into_iter().zip(b.to_array()) {
            squares += (f64::from(a) - f64::from(b)).powi(2) / 2.0;
            sum += f64::from(a);
            count += 1.0;
        }
    }
    (squares / count).sqrt() / (sum / count)
}

/// Of the line through points that has the least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + (p.0 - x) * (p.1 - y), s.1 + (p.0 - x).powi(2)));
    xy / xx
}

/// Pixels a side, and seeds of one sample each, of tails.
const TAIL: (u32, u64) = (64, 256);

/// A sample is in the tail if it is one of the largest so manieth part.
const TAIL_PART: usize = 1000;

/// Below this Hill's index means that the variance of samples is not finite, or seems so.
const HEAVY: f64 = 2.0;

/// The largest sample over the mean, and Hill's estimate of the tail's index, relative to each pixel's mean.
pub(super) fn tail(path: &Path) -> Result<Found> {
    let scene = load(path, TAIL.0)?;
    let compiled = compiled(&scene, Accelerator::Auto)?;
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); (TAIL.0 * TAIL.0) as usize];
    for seed in 0..TAIL.1 {
        let mut settings = settings(&scene, 1);
        settings.sampler.seed = seed;
        settings.sampler.kind = SamplerKind::Independent;
        let picture = picture(&compiled, &settings);
        values.iter_mut().zip(picture.pixels()).for_each(|(v, p)| v.push(f64::from(p.luminance())));
    }
    let whole = values.iter().flatten().sum::<f64>() / (values.len() as u64 * TAIL.1) as f64;
    let mut all: Vec<f64> = values.into_iter().flatten().collect();
    all.sort_by(|a, b| b.total_cmp(a));
    let k = all.len() / TAIL_PART;
    let logs: f64 = all[..k].iter().map(|v| (v / all[k]).ln()).sum();
    let index = k as f64 / logs;
    let share = all[..k].iter().sum::<f64>() / (whole * all.len() as f64);
    let word = if index < HEAVY { "heavy" } else { "light" };
    let text = format!(
        "{} samples: the largest is {:.0} times the mean, the largest {k} are {:.1} % of all light, Hill's index {index:.2} ({word})",
        all.len(),
        all[0] / whole,
        100.0 * share
    );
    Ok(Found { text, right: all[0].is_finite() })
}
