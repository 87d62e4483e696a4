//! Figures in closed form, and those of published tools.

use super::significance::TILE;
use super::*;

fn picture(width: u32, height: u32, value: impl Fn(u32, u32) -> [f32; 3]) -> Picture {
    let mut p = Picture::new(width, height);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let [r, g, b] = value(x, y);
        p.set(x, y, Rgb::new(r, g, b));
    }
    p
}

/// A smooth picture with a bright corner, and one that differs from it in colour, in a line and in noise.
fn pair() -> (Picture, Picture) {
    let reference = |x: u32, y: u32| {
        let (u, v) = (x as f32 / 40.0, y as f32 / 30.0);
        let bright = if x < 5 && y < 5 { 6.0 } else { 0.0 };
        [0.1 + 0.8 * u + bright, 0.2 + 0.5 * v * v + bright, 0.7 - 0.6 * u * v + bright]
    };
    let other = |x: u32, y: u32| {
        let [r, g, b] = reference(x, y);
        let line = if x == 20 { 0.3 } else { 0.0 };
        let noise = ((x * 7919 + y * 104_729) % 97) as f32 / 97.0 - 0.5;
        [r * 1.05 + line, g + 0.2 * noise, b - line + 0.05 * noise]
    };
    (picture(40, 30, other), picture(40, 30, reference))
}

#[test]
fn errors_in_closed_form() {
    let reference = picture(4, 2, |_, _| [0.5, 1.0, 0.0]);
    let mut other = reference.clone();
    assert_eq!(errors(&other, &reference).mse, 0.0);
    assert_eq!(errors(&other, &reference).psnr, f64::INFINITY);
    other.set(3, 1, Rgb::new(0.5, 1.0, 0.5));
    let e = errors(&other, &reference);
    assert_eq!((e.max, e.max_at, e.non_finite_pixels), (0.5, (3, 1), 0));
    assert_eq!(e.mse, 0.25 / 24.0);
    assert!((e.rel_mse - 0.25 / 0.01 / 24.0).abs() < 1e-12);
    // sRGB of 0.5 is 0.735357.
    assert!((e.psnr - 10.0 * (24.0 / 0.735_357_f64.powi(2)).log10()).abs() < 1e-4, "{}", e.psnr);
    assert!((e.reference_mean - 0.5).abs() < 1e-12 && (e.mean - (12.5 / 24.0)).abs() < 1e-12);
}

#[test]
fn pixels_that_are_not_finite_are_left_out_and_counted() {
    let reference = picture(4, 2, |_, _| [0.5; 3]);
    let mut other = reference.clone();
    other.set(1, 0, Rgb::new(f32::NAN, 0.0, 0.0));
    other.set(2, 0, Rgb::new(0.0, f32::INFINITY, 0.0));
    let e = errors(&other, &reference);
    assert_eq!((e.non_finite_pixels, e.mse, e.mean), (2, 0.0, 0.5));
    let (a, b) = without_non_finite(&other, &reference);
    assert_eq!(a, b);
    let v = picture(4, 2, |_, _| [1e-4; 3]);
    assert_eq!(significance([&other, &reference], [Some(&v), None]).pixels.tests, 18);
}

/// The published implementation (FLIP 1.7, in single precision) says this of the same pictures.
#[test]
fn flip_is_that_of_the_published_implementation() {
    const TOLERANCE: f64 = 2e-5;
    let (a, b) = pair();
    let f = flip(&a, &b);
    assert!((f.mean - FLIP_MEAN).abs() < TOLERANCE, "{}", f.mean);
    for ((x, y), want) in FLIP_PIXELS {
        let got = f64::from(f.map[y * 40 + x]);
        assert!((got - want).abs() < 10.0 * TOLERANCE, "{got} at {x},{y}, not {want}");
    }
    let h = hdr_flip(&a, &b).unwrap();
    assert_eq!(h.exposures.2, HDR_COUNT);
    assert!((h.exposures.0 - HDR_RANGE.0).abs() < 1e-4 && (h.exposures.1 - HDR_RANGE.1).abs() < 1e-4);
    assert!((h.flip.mean - HDR_FLIP_MEAN).abs() < TOLERANCE, "{}", h.flip.mean);
}

const FLIP_MEAN: f64 = 0.124_589_15;
const FLIP_PIXELS: [((usize, usize), f64); 6] = [
    ((0, 0), 0.003_217_69),
    ((4, 4), 0.072_744_46),
    ((20, 15), 0.245_935_04),
    ((21, 15), 0.237_745_69),
    ((39, 29), 0.125_531_03),
    ((10, 3), 0.127_590_06),
];
const HDR_COUNT: u32 = 5;
const HDR_RANGE: (f64, f64) = (-1.557_700_4, 2.454_665_2);
const HDR_FLIP_MEAN: f64 = 0.125_997_04;

#[test]
fn flip_of_equal_pictures_is_zero_and_of_opposites_near_one() {
    let (a, _) = pair();
    assert_eq!(flip(&a, &a).mean, 0.0);
    assert_eq!(hdr_flip(&a, &a).unwrap().flip.mean, 0.0);
    let (green, blue) = (picture(30, 30, |_, _| [0.0, 1.0, 0.0]), picture(30, 30, |_, _| [0.0, 0.0, 1.0]));
    assert!((flip(&green, &blue).mean - 1.0).abs() < 1e-5, "the largest difference that there is");
    assert!(hdr_flip(&a, &Picture::new(40, 30)).is_none(), "nothing of a black reference can be shown");
}

/// Gaussian noise of known variance in both pictures. Hypothesis: every family's p is uniform on [0, 1]. Over 40 fixed
/// seeds none of the 120 values is below 10⁻³ / 120 (family-wise false-alarm rate 10⁻³), and the mean of each family's is
/// within four standard errors (0.289 / √40) of one half (3 · 6·10⁻⁵).
#[test]
fn noise_alone_is_not_significant_but_a_small_bias_is() {
    const SEEDS: u64 = 40;
    let mut sums = [0.0; 3];
    for seed in 0..SEEDS {
        let a = noisy(seed * 2, 0.0);
        let b = noisy(seed * 2 + 1, 0.0);
        let v = picture(48, 40, |_, _| [NOISE * NOISE; 3]);
        let s = significance([&a, &b], [Some(&v), Some(&v)]);
        let all = [s.pixels.p, s.tiles.p, s.whole.p];
        assert!(all.iter().all(|p| *p > 1e-3 / 120.0), "seed {seed}: {s:?}");
        sums.iter_mut().zip(all).for_each(|(s, p)| *s += p);
        assert_eq!((s.pixels.tests, s.tiles.tests, s.whole.tests), (48 * 40 * 3, 6 * 5 * 3, 3));
        // A fifth of a pixel's noise, everywhere, is 0.2·√(1920 / 2) = 6 standard errors of the whole.
        let biased = noisy(seed * 2, 0.2 * NOISE);
        assert!(significance([&biased, &b], [Some(&v), Some(&v)]).whole.p < 0.05, "seed {seed}");
    }
    for mean in sums.map(|s| s / SEEDS as f64) {
        assert!((mean - 0.5).abs() < 4.0 * 0.289 / (SEEDS as f64).sqrt(), "the mean of p is {mean}");
    }
    assert_eq!(48 % TILE, 0);
}

const NOISE: f32 = 0.1;

/// Independent Gaussian noise (Box and Muller) around 0.5.
fn noisy(seed: u64, bias: f32) -> Picture {
    let mut state = seed.wrapping_mul(0xd129_0d3f_8f5b_4c1d);
    let mut uniform = move || {
        // SplitMix64.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut gaussian =
        move || ((-2.0 * (1.0 - uniform()).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()) as f32;
    let mut p = Picture::new(48, 40);
    for pixel in &mut p.pixels {
        *pixel = Rgb::new(gaussian(), gaussian(), gaussian()) * NOISE + Rgb::splat(0.5 + bias);
    }
    p
}
