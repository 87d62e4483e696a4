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
    for sampler in [SOBOL, INDEPENDENT] {
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
    for sampler in [SOBOL, INDEPENDENT] {
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
