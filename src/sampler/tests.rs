//! Laws of the samplers.

use super::*;

const SOBOL: Sampler = Sampler { kind: SamplerKind::Sobol, seed: 7 };
const INDEPENDENT: Sampler = Sampler { kind: SamplerKind::Independent, seed: 7 };

/// Cells of a w × h grid over the unit square that hold exactly one of the points.
fn cells_with_one(points: &[(f32, f32)], w: usize, h: usize) -> usize {
    let mut count = vec![0; w * h];
    for &(x, y) in points {
        count[(y * h as f32) as usize * w + (x * w as f32) as usize] += 1;
    }
    count.iter().filter(|&&c| c == 1).count()
}

#[test]
fn sobol_prefixes_of_powers_of_two_fill_every_elementary_interval() {
    // Dimensions 1 and 2 are a (0, 2)-sequence; scrambling and shuffling must keep each aligned block a (0, m, 2)-net.
    for log in [4u32, 6, 8] {
        let n = 1u32 << log;
        for set in [0, 2, 3, 17] {
            for block in 0..3 {
                let points: Vec<_> =
                    (block * n..(block + 1) * n).map(|i| SOBOL.stream(3, 5, i).set(set, 2).pair().into()).collect();
                for k in 0..=log {
                    let (w, h) = (1usize << k, 1usize << (log - k));
                    assert_eq!(cells_with_one(&points, w, h), n as usize, "set {set}, block {block}, {w}×{h} cells");
                }
            }
        }
    }
}

#[test]
fn sobol_stratifies_each_dimension_alone() {
    for d in 0..4 {
        let points: Vec<_> = (0..256).map(|i| (SOBOL.stream(0, 0, i).set(9, 4).get(d), 0.0)).collect();
        assert_eq!(cells_with_one(&points, 256, 1), 256, "dimension {d}");
    }
}

/// Largest |z| of the mean over sets, pixels and numbers. Hypothesis: uniform on [0, 1). 4·64·16 means of 1024 numbers
/// each; for independent numbers the false-alarm rate at 5.5 σ is below 4096 · 4e-8 = 2e-4 (for Sobol' points, which
/// vary less, lower still). The seed is fixed.
fn worst_mean(sampler: Sampler) -> f64 {
    let n = 1024;
    let mut worst = 0.0f64;
    for set in 0..64 {
        for pixel in 0..16 {
            let mut sum = [0.0f64; 4];
            for i in 0..n {
                let numbers = sampler.stream(pixel, 2 * pixel, i).set(set, 4);
                for (d, s) in sum.iter_mut().enumerate() {
                    let u = numbers.get(d);
                    assert!((0.0..1.0).contains(&u), "{u}");
                    *s += f64::from(u) - 0.5;
                }
            }
            for s in sum {
                worst = worst.max((s / f64::from(n)).abs() / (1.0 / 12.0 / f64::from(n)).sqrt());
            }
        }
    }
    worst
}

#[test]
fn numbers_are_uniform_in_the_mean() {
    assert!(worst_mean(INDEPENDENT) < 5.5);
    assert!(worst_mean(SOBOL) < 0.5);
}

/// Correlation between two number sources over pixels must be that of independent ones: |r|·√n below 5 (false-alarm
/// rate 6e-7 a pair, about 100 pairs).
#[test]
fn pixels_sets_and_numbers_are_uncorrelated() {
    for sampler in all(16) {
        for (set_a, a, set_b, b) in
            [(0, 0, 0, 1), (0, 0, 2, 0), (2, 0, 3, 0), (2, 1, 3, 1), (2, 2, 2, 3), (3, 0, 5, 0), (2, 3, 4, 3)]
        {
            for index in [0, 1, 5] {
                let n = 64u32;
                let mut r = 0.0;
                for y in 0..n {
                    for x in 0..n {
                        let s = sampler.stream(x, y, index);
                        r += f64::from(s.set(set_a, 4).get(a) - 0.5) * f64::from(s.set(set_b, 4).get(b) - 0.5);
                    }
                }
                let z = r * 12.0 / f64::from(n);
                assert!(z.abs() < 5.0, "{sampler:?} {set_a}.{a} × {set_b}.{b} sample {index}: {z}");
            }
        }
        // Neighbouring pixels and neighbouring seeds.
        let (mut across, mut seeds) = (0.0, 0.0);
        let other = Sampler { seed: sampler.seed + 1, ..sampler };
        for y in 0..64 {
            for x in 0..64 {
                let u = f64::from(sampler.stream(x, y, 0).set(0, 1).get(0)) - 0.5;
                across += u * (f64::from(sampler.stream(x + 1, y, 0).set(0, 1).get(0)) - 0.5);
                seeds += u * (f64::from(other.stream(x, y, 0).set(0, 1).get(0)) - 0.5);
            }
        }
        assert!((across * 12.0 / 64.0f64).abs() < 5.0, "{sampler:?} neighbouring pixels: {across}");
        assert!((seeds * 12.0 / 64.0f64).abs() < 5.0, "{sampler:?} seeds: {seeds}");
    }
}

#[test]
fn a_batch_holds_the_numbers_of_each_stream() {
    let mut batch = Batch::default();
    let more = [
        SamplerKind::ZSobol { log_samples: 0 },
        SamplerKind::ZSobol { log_samples: 5 },
        SamplerKind::ZSobol { log_samples: MOST_LOG_SAMPLES },
        SamplerKind::Stratified { samples: 1 },
        SamplerKind::Stratified { samples: 37 },
        SamplerKind::Stratified { samples: u32::MAX },
    ];
    for sampler in [SOBOL, INDEPENDENT].into_iter().chain(more.map(|kind| Sampler { kind, seed: 7 })) {
        // Not a multiple of the lanes; indices below, across and above the shuffled bits.
        let indices = (0..37).chain(65_530..65_541).chain([1 << 20, u32::MAX]);
        let streams: Vec<_> = indices.enumerate().map(|(i, index)| sampler.stream(i as u32 / 3, 7, index)).collect();
        for lens in [true, false] {
            batch.fill_film(lens, streams.iter().copied());
            streams.iter().enumerate().for_each(|(i, s)| assert_eq!(batch.film(i), s.film()));
            let expected = |s: &Stream| if lens { s.lens() } else { Vec2::ZERO };
            streams.iter().enumerate().for_each(|(i, s)| assert_eq!(batch.lens(i), expected(s)));
        }
        for vertex in [0, 1, 9] {
            batch.fill_bsdf(vertex, streams.iter().copied());
            streams.iter().enumerate().for_each(|(i, s)| assert_eq!(batch.bsdf(i), s.bsdf(vertex)));
            batch.fill_light(vertex, true, streams.iter().copied());
            streams.iter().enumerate().for_each(|(i, s)| assert_eq!(batch.light(i), s.light(vertex)));
        }
    }
}

/// The samplers for `samples` a pixel.
fn all(samples: u32) -> Vec<Sampler> {
    let mut kinds = vec![SamplerKind::Sobol, SamplerKind::Stratified { samples }, SamplerKind::Independent];
    if samples.is_power_of_two() {
        kinds.push(SamplerKind::ZSobol { log_samples: samples.ilog2() });
    }
    kinds.into_iter().map(|kind| Sampler { kind, seed: 7 }).collect()
}

#[test]
fn squares_of_pixels_share_a_net() {
    // The samples of an aligned square of 2ᵏ × 2ᵏ pixels together, in the first two dimensions of each set.
    for (log_samples, log_side) in [(0, 1), (0, 3), (1, 2), (2, 2), (4, 0), (4, 1), (3, 3)] {
        let sampler = Sampler { kind: SamplerKind::ZSobol { log_samples }, seed: 3 };
        let (samples, side) = (1u32 << log_samples, 1u32 << log_side);
        for set in [0, 3, 12] {
            for (x0, y0) in [(0, 0), (40, 24), (7 * side, 9 * side)] {
                let pixels = (0..side).flat_map(|y| (0..side).map(move |x| (x0 + x, y0 + y)));
                let points: Vec<_> = pixels
                    .flat_map(|(x, y)| (0..samples).map(move |i| (x, y, i)))
                    .map(|(x, y, i)| sampler.stream(x, y, i).set(set, 2).pair().into())
                    .collect();
                let log = log_samples + 2 * log_side;
                for k in 0..=log {
                    let (w, h) = (1usize << k, 1usize << (log - k));
                    let full = cells_with_one(&points, w, h);
                    assert_eq!(full, points.len(), "2^{log_samples} samples, side {side}, set {set}, {w}×{h} cells");
                }
            }
        }
    }
}

#[test]
fn stratified_numbers_have_strata_for_any_count() {
    for samples in [1u32, 2, 3, 5, 7, 12, 16, 17, 64, 100, 257] {
        let sampler = Sampler { kind: SamplerKind::Stratified { samples }, seed: 5 };
        for set in [0, 3] {
            for pair in [Set::pair, Set::second_pair] {
                // The second pattern, too, which begins after the last sample.
                for first in [0, samples] {
                    let points: Vec<(f32, f32)> =
                        (first..first + samples).map(|i| pair(&sampler.stream(1, 2, i).set(set, 4)).into()).collect();
                    let n = samples as usize;
                    // Rounded to 24 bits a number may fall on the edge of its stratum, from above.
                    let swapped: Vec<_> = points.iter().map(|&(x, y)| (y + 1e-7, x)).collect();
                    assert_eq!(cells_with_one(&swapped, n, 1), n, "{samples} samples, rows");
                    let m = samples.isqrt() as usize;
                    if m * m == n {
                        assert_eq!(cells_with_one(&points, m, m), n, "{samples} samples, cells");
                        let points: Vec<_> = points.iter().map(|&(x, y)| (x + 1e-7, y)).collect();
                        assert_eq!(cells_with_one(&points, n, 1), n, "{samples} samples, columns");
                    }
                }
            }
        }
    }
}

/// Mean and variance over pixels of the estimate of an integral from `n` samples in four dimensions, the two sets of a vertex.
fn estimates(sampler: Sampler, n: u32, pixels: u32, f: impl Fn([f32; 4]) -> f64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for pixel in 0..pixels {
        // Far apart, so that pixels are independent of each other.
        let value = |i| {
            let stream = sampler.stream(64 * pixel, 64 * (pixel % 7), i);
            let (bsdf, light) = (stream.bsdf(0).direction(), stream.light(0).point());
            f([bsdf.x, bsdf.y, light.x, light.y])
        };
        let mean = (0..n).map(value).sum::<f64>() / f64::from(n);
        sum += mean;
        squares += mean * mean;
    }
    let mean = sum / f64::from(pixels);
    (mean, squares / f64::from(pixels) - mean * mean)
}

/// Of mean 1.
fn smooth([a, b, c, d]: [f32; 4]) -> f64 {
    // What light does on its way over a bounce: products of smooth terms.
    [a, b, c, d].iter().map(|&x| 0.5 + 1.5 * f64::from(x) * f64::from(x)).product()
}

/// Of mean 1/4: half a disk in one pair of dimensions, and a threshold in the other.
fn edges([a, b, c, d]: [f32; 4]) -> f64 {
    let inside = |x: f32, y: f32| f64::from(u8::from(x + y < 1.0));
    inside(a, b) * inside(c, d)
}

#[test]
fn no_count_of_samples_has_a_bias_or_more_variance_than_independent_numbers() {
    // Hypotheses, for every sampler and count: the mean over pixels is the integral (|z| < 5, 6e-7 a test, some 240 tests); the
    // variance is at most that of independent numbers. The variance of 4000 pixels has a standard error of some 2.5 % (the
    // excess kurtosis of means is small), so that the ratio is off by more than 1.2 at least eight of them. Owen-scrambled nets of
    // these sizes have gains up to 4 in the worst case, which products of terms in pairs are not.
    const PIXELS: u32 = 4000;
    let counts = [1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 13, 15, 16, 17, 23, 32, 33];
    for (name, f, mean, variance) in
        [("smooth", smooth as fn([f32; 4]) -> f64, 1.0, 1.2f64.powi(4) - 1.0), ("edges", edges, 0.25, 0.25 * 0.75)]
    {
        for n in counts {
            for sampler in all(n) {
                let (found, spread) = estimates(sampler, n, PIXELS, f);
                let z = (found - mean) / (variance / f64::from(n * PIXELS)).sqrt();
                assert!(z.abs() < 5.0, "{name}, {n} × {:?}: mean {found}, z {z}", sampler.kind);
                let ratio = spread * f64::from(n) / variance;
                assert!(ratio < 1.2, "{name}, {n} × {:?}: variance {ratio} times that of independent", sampler.kind);
            }
        }
    }
}

#[test]
fn the_error_of_smooth_pixels_falls_faster_than_that_of_independent_numbers() {
    // The slope of log error over log count, fitted from 4 to 1024 samples, of a sum of smooth terms in a pair of numbers each.
    // Theory: −1/2 for independent numbers, −3/2 for scrambled nets; −3/4 for correlated strata, whose offsets within cells of
    // √N columns are the same in all of them, so that a column's error has √N times less to average over. 300 pixels give
    // each error within some 4 %, which moves the slope by 0.01.
    let sum = |[a, b, c, d]: [f32; 4]| f64::from(a * b + c * d);
    let slope = |kind: fn(u32) -> SamplerKind| {
        let logs = [2u32, 4, 6, 8, 10];
        let point = |&log: &u32| {
            let sampler = Sampler { kind: kind(log), seed: 11 };
            (f64::from(log), 0.5 * estimates(sampler, 1 << log, 300, sum).1.log2())
        };
        let points: Vec<_> = logs.iter().map(point).collect();
        let n = points.len() as f64;
        let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
        let (xy, xx) =
            points.iter().fold((0.0, 0.0), |(a, b), p| (a + (p.0 - x) * (p.1 - y), b + (p.0 - x) * (p.0 - x)));
        xy / xx
    };
    for (name, kind, most) in [
        ("sobol", (|_| SamplerKind::Sobol) as fn(u32) -> SamplerKind, -1.3),
        ("zsobol", |log_samples| SamplerKind::ZSobol { log_samples }, -1.3),
        ("stratified", |log| SamplerKind::Stratified { samples: 1 << log }, -0.7),
    ] {
        let slope = slope(kind);
        assert!(slope < most, "{name}: slope {slope}");
    }
}

/// Mean power of a picture's error at wavelengths of 8 pixels and more, over the mean at all; 1 for white noise.
fn low_frequencies(error: &[f64], side: usize) -> f64 {
    let mut low = (0.0, 0.0);
    let most = side / 8;
    let at = |u: usize, v: usize| {
        let (mut re, mut im) = (0.0, 0.0);
        for (i, e) in error.iter().enumerate() {
            let phase = std::f64::consts::TAU * ((u * (i % side) + v * (i / side)) % side) as f64 / side as f64;
            re += e * libm::cos(phase);
            im += e * libm::sin(phase);
        }
        re * re + im * im
    };
    for u in 0..=most {
        for v in (0..=most).chain(side - most..side) {
            let distance = (u * u + v.min(side - v).pow(2)) as f64;
            if distance > 0.0 && distance <= (most * most) as f64 {
                low = (low.0 + at(u, v), low.1 + 1.0);
            }
        }
    }
    // By Parseval's theorem the mean power is the sum of squares.
    let all = error.iter().map(|e| e * e).sum::<f64>();
    low.0 / low.1 / all
}

#[test]
fn the_noise_of_zsobol_is_blue() {
    // The error of an integral in two dimensions, on 64 × 64 pixels: power of wavelengths of 8 pixels and more, relative to white
    // noise. `sobol` has 1 (some 100 frequencies, twice: within 0.25 by three standard errors).
    const SIDE: usize = 64;
    for log_samples in [0, 2, 4] {
        let ratio = |kind| {
            let sampler = Sampler { kind, seed: 21 };
            let value = |x: u32, y: u32, i: u32| {
                let point = sampler.stream(x, y, i).light(0).point();
                f64::from(u8::from(point.x * point.x + point.y * point.y < 0.8))
            };
            let n = 1u32 << log_samples;
            let mut pixels: Vec<f64> = (0..SIDE * SIDE)
                .map(|p| (0..n).map(|i| value((p % SIDE) as u32, (p / SIDE) as u32, i)).sum::<f64>() / f64::from(n))
                .collect();
            let mean = pixels.iter().sum::<f64>() / pixels.len() as f64;
            pixels.iter_mut().for_each(|p| *p -= mean);
            low_frequencies(&pixels, SIDE)
        };
        let (white, blue) = (ratio(SamplerKind::Sobol), ratio(SamplerKind::ZSobol { log_samples }));
        assert!((white - 1.0).abs() < 0.3, "{white}");
        // Less than half of what white noise has there; with one sample a pixel a third.
        assert!(blue < 0.45, "2^{log_samples} samples: {blue}");
    }
}

/// The parts of samples are the samples of as many times the number, of every sampler that can have so many.
#[test]
fn parts_of_samples_are_samples_of_more() {
    let (samples, parts) = (8, 4);
    for kind in [
        SamplerKind::Sobol,
        SamplerKind::Independent,
        SamplerKind::ZSobol { log_samples: 3 },
        SamplerKind::Stratified { samples },
    ] {
        let more = kind.split(parts).unwrap();
        let [few, many] = [kind, more].map(|kind| Sampler { kind, seed: 9 });
        for index in 0..samples * parts {
            let part = few.stream(5, 37, index / parts).part(more, index % parts, parts);
            assert_eq!(part.light(0), many.stream(5, 37, index).light(0), "{kind:?}");
        }
    }
    assert!(SamplerKind::ZSobol { log_samples: MOST_LOG_SAMPLES - 1 }.split(2).is_some());
    assert!(SamplerKind::ZSobol { log_samples: MOST_LOG_SAMPLES }.split(2).is_none());
    assert!(SamplerKind::Stratified { samples: u32::MAX }.split(2).is_none());
}
