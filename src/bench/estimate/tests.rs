//! The estimators on synthetic pictures whose errors are known.

use super::*;

const SIDE: u32 = 96;

/// A number as good as random, with mean 0 and variance 1, of two values: a function of what it is for.
fn noise(seed: u64, pixel: u64, channel: u64) -> f64 {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ pixel.wrapping_mul(0xd1b5_4a32_d192_ed03) ^ channel << 60;
    for _ in 0..3 {
        x = (x ^ x >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    if x >> 63 == 0 { 1.0 } else { -1.0 }
}

/// The truth: from black to 2 across.
fn truth(x: u32) -> f64 {
    2.0 * f64::from(x) / f64::from(SIDE)
}

/// The truth and noise of variance `relative`·(truth² + 0.01), so that relMSE is `relative`, and a factor.
fn picture(seed: u64, relative: f64, factor: f64) -> Picture {
    let mut picture = Picture::new(SIDE, SIDE);
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        let value = |c: u64| {
            let deviation = (relative * (truth(x) * truth(x) + FLOOR)).sqrt();
            (factor * truth(x) + deviation * noise(seed, u64::from(y * SIDE + x), c)) as f32
        };
        picture.set(x, y, Rgb::new(value(0), value(1), value(2)));
    }
    picture
}

/// A reference with noise of its own, and the variance of that if it is to be known.
fn reference(relative: f64, known: bool) -> Reference {
    let mut variance = Picture::new(SIDE, SIDE);
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        variance.set(x, y, Rgb::splat((relative * (truth(x) * truth(x) + FLOOR)) as f32));
    }
    Reference::new(picture(1000, relative, 1.0), known.then_some(&variance))
}

fn near(value: f64, expected: f64, relative: f64) {
    assert!((value / expected - 1.0).abs() < relative, "{value} instead of {expected}");
}

#[test]
fn the_error_is_the_variance_that_was_put_in() {
    // Weights are of the noisy reference, and its own error is subtracted: 27,648 values whose squares are all but
    // constant, and a product of noises of relative size 2·√(1e-3/0.04): standard error 0.2 %.
    let reference = reference(1e-3, true);
    near(reference.own_error().unwrap(), 1e-3, 0.02);
    near(reference.error_of(&picture(1, 0.04, 1.0)), 0.04, 0.02);
}

#[test]
fn halves_tell_the_error_of_their_mean() {
    // (a − b)² is 0 or 4σ², each half of the time: standard error √(1/27,648) = 0.6 %.
    let reference = Reference::of_halves(&picture(1, 0.02, 1.0), &picture(2, 0.02, 1.0));
    near(reference.own_error().unwrap(), 0.01, 0.04);
}

#[test]
fn pairs_tell_the_error_of_the_reference() {
    for (own, known) in [(0.002, false), (0.002, true)] {
        let reference = reference(own, known);
        let mut errors = Errors::default();
        (0..5).for_each(|seed| errors.add(&picture(seed, 0.04, 1.0), &reference));
        let Shared { error, deviation } = errors.shared().unwrap();
        // Products of two noises of 0.04, of ten pairs, and of those with the reference's: 0.04/√(10·27,648) and
        // 2·√(0.04·0.002/(5·27,648)), together about 9e-5. What is told is √3 times the first, as if channels were alike.
        assert!((error - own).abs() < 5.0 * 9e-5 && deviation > 4e-5 && deviation < 2e-4, "{error} ± {deviation}");
    }
}

#[test]
fn one_picture_shares_nothing() {
    let reference = reference(0.001, false);
    let mut errors = Errors::default();
    errors.add(&picture(0, 0.04, 1.0), &reference);
    assert_eq!(errors.shared(), None);
    assert_eq!(Verdict::of(0.04, &reference, &errors), None);
}

#[test]
fn references_are_refused_that_are_not_ten_times_better() {
    for known in [false, true] {
        for (own, accepted) in [(0.002, true), (0.008, false), (0.04, false)] {
            let reference = reference(own, known);
            let mut errors = Errors::default();
            (0..5).for_each(|seed| errors.add(&picture(seed, 0.04, 1.0), &reference));
            let verdict = Verdict::of(0.04, &reference, &errors).unwrap();
            assert_eq!(verdict.accepts(), accepted, "{verdict:?}");
            assert!(!matches!(verdict, Verdict::Biased(_)), "{verdict:?}");
            near(verdict.own_error(), own, 0.3);
        }
    }
}

#[test]
fn pictures_of_something_else_are_refused() {
    // 20 % too bright: (0.2·t)²/(t² + 0.01) is nearly 0.04 in most pixels.
    let reference = reference(1e-5, true);
    let mut errors = Errors::default();
    (0..5).for_each(|seed| errors.add(&picture(seed, 0.04, 1.2), &reference));
    assert!(matches!(Verdict::of(0.08, &reference, &errors), Some(Verdict::Biased(e)) if e > 0.02));
}

#[test]
fn what_is_not_finite_is_left_out() {
    let reference = reference(1e-5, true);
    let clean = picture(0, 0.04, 1.0);
    let mut holed = clean.clone();
    holed.set(3, 4, Rgb::splat(f32::NAN));
    let (a, b) = (reference.error_of(&clean), reference.error_of(&holed));
    assert!(b < a && b.is_finite(), "{a} {b}");
    let mut errors = Errors::default();
    errors.add(&holed, &reference);
    assert!(errors.map().iter().all(|v| v.is_finite()));
}
