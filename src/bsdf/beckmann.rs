//! Beckmann's distribution for roughness 1: masking, and the inversion of the distribution functions of its slopes.
//!
//! Everything in terms of a = cot θ, where θ is the angle of view after stretching to roughness 1. The functions that are
//! inverted are smooth and monotonous, so that well distributed uniform numbers give well distributed slopes; the idea of
//! inverting numerically instead of by a fit is Jakob's (2014, *An Improved Visible Normal Sampling Routine for the
//! Beckmann Distribution*). Where he takes three Newton steps in f32 in the domain of erf, we take Halley steps in f64 in
//! the domain of slopes until they are below f32's resolution: grazing views and far tails need no exceptions.

use crate::math::float::UNIT_ROUNDOFF;
use std::f64::consts::FRAC_2_SQRT_PI;

/// a from which the rational approximation of masking is 1 (Walter et al. 2007, equation 27).
const NO_MASKING: f32 = 1.6;

/// A slope beyond all that a uniform f32 can reach: erf(6) is 1 in f64.
const LARGEST_SLOPE: f64 = 6.0;

/// Enough bisections of the interval of slopes to reach f32's resolution, should every Halley step be refused.
const MOST_STEPS: u32 = 40;

/// Smith's masking G₁, approximated: within 0.35 % (Walter et al. 2007, equation 27).
#[inline]
pub(super) fn g1(a: f32) -> f32 {
    // 0/0 is the view along the normal, where nothing is masked.
    if a < NO_MASKING { a * (3.535 + 2.181 * a) / (1.0 + a * (2.276 + 2.577 * a)) } else { 1.0 }
}

/// Smith's masking G₁ = 2 / (1 + erf a + exp(−a²)/(a√π)) (Walter et al. 2007, equation 26).
#[inline]
pub(super) fn exact_g1(a: f32) -> f32 {
    /// erf is 1 and the rest 0 from here, in f32.
    const NO_MASKING_AT_ALL: f32 = 4.0;
    const FRAC_1_SQRT_PI: f32 = 0.564_189_6;
    if a < NO_MASKING_AT_ALL {
        // Multiplied through by a: finite at a = 0.
        2.0 * a / (a * (1.0 + libm::erff(a)) + FRAC_1_SQRT_PI * libm::expf(-a * a))
    } else {
        1.0
    }
}

/// A slope x with density exp(−x²)/√π, from a uniform number.
#[inline]
pub(super) fn slope(u: f32) -> f32 {
    inverse_erf(2.0 * open(u) - 1.0) as f32
}

/// A slope x ≤ a with density proportional to (a − x)·exp(−x²): as often as microfacets of that slope are seen under the
/// angle with the cotangent `a`, in (0, ∞], from a uniform number (Heitz and d'Eon 2014, supplemental 1).
#[inline]
pub(super) fn visible_slope(a: f64, u: f32) -> f32 {
    let u = open(u);
    let tan = 1.0 / a;
    let top = a.min(LARGEST_SLOPE);
    let erf_top = libm::erf(top);
    // The distribution function, times the constant that makes it simple, and its derivative is (1 − x tan)·gauss.
    let integral = |erf: f64, gauss: f64| 0.5 * (1.0 + erf) + 0.5 * tan * gauss;
    let gauss = |x: f64| 0.5 * FRAC_2_SQRT_PI * libm::exp(-x * x);
    let target = u * integral(erf_top, gauss(top));
    // Exact for the grazing view, and nearly so for the vertical (Jakob 2014).
    let guess = erf_top - (erf_top + 1.0) * libm::erf((-libm::log(u)).sqrt());
    let (mut low, mut high) = (-LARGEST_SLOPE, top);
    let mut x = inverse_erf(guess).clamp(low, high);
    for _ in 0..MOST_STEPS {
        let g = gauss(x);
        let excess = integral(libm::erf(x), g) - target;
        if excess > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let facing = 1.0 - x * tan;
        let newton = excess / (facing * g);
        // Halley: half of newton times second over first derivative, which is −tan/facing − 2x.
        let next = x - newton / (1.0 + newton * (0.5 * tan / facing + x));
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        let step = (next - x).abs();
        x = next;
        if step < f64::from(UNIT_ROUNDOFF) {
            break;
        }
    }
    x as f32
}

/// The uniform number, or, instead of zero, the middle of the interval that zero stands for.
#[inline]
fn open(u: f32) -> f64 {
    f64::from(u).max(0.5 * f64::from(UNIT_ROUNDOFF))
}

/// erf⁻¹, to a relative error of some 10⁻⁷ (Giles 2011, *Approximating the erfinv Function*, single precision).
#[inline]
fn inverse_erf(y: f64) -> f64 {
    const CENTRAL: [f64; 9] = [
        0.000_000_028_102_263_6,
        0.000_000_343_273_939,
        -0.000_003_523_387_7,
        -0.000_004_391_506_54,
        0.000_218_580_87,
        -0.001_253_725_03,
        -0.004_177_681_64,
        0.246_640_727,
        1.501_409_41,
    ];
    const TAIL: [f64; 9] = [
        -0.000_200_214_257,
        0.000_100_950_558,
        0.001_349_343_22,
        -0.003_673_428_44,
        0.005_739_507_73,
        -0.007_622_461_3,
        0.009_438_870_47,
        1.001_674_06,
        2.832_976_82,
    ];
    /// Where one polynomial takes over from the other.
    const TAIL_BEGINS: f64 = 5.0;
    let w = -libm::log((1.0 - y) * (1.0 + y));
    let (w, coefficients) = if w < TAIL_BEGINS { (w - 2.5, &CENTRAL) } else { (w.sqrt() - 3.0, &TAIL) };
    y * coefficients.iter().fold(0.0, |p, c| p * w + c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_invert_their_distribution_functions() {
        // The uniform number that a slope came from, by statrs' erf; angles from vertical to 1e-9 above the surface.
        for a in [f64::INFINITY, 1e4, 5.0, 1.0, 0.3, 1e-2, 1e-5, 1e-9] {
            let cdf = |x: f64| 1.0 + statrs::function::erf::erf(x) + (-x * x).exp() / (a * std::f64::consts::PI.sqrt());
            let all = if a < 30.0 { cdf(a) } else { 2.0 + (-a * a).exp() };
            for i in 0..4096 {
                let u = if i == 0 { 0.0 } else { (i as f32 + 0.3) / 4096.0 };
                let x = f64::from(visible_slope(a, u));
                let (got, expected) = (cdf(x) / all, open(u));
                // The slope is rounded to f32, and so the function moves by its derivative times that.
                assert!((got - expected).abs() < 2e-7, "a {a}: u {expected} gave {x}, whose u is {got}");
            }
        }
        for u in [0.0, 1e-6, 0.2, 0.5, 0.9, crate::math::float::ONE_MINUS_EPSILON] {
            let back = 0.5 + 0.5 * statrs::function::erf::erf(slope(u).into());
            assert!((back - f64::from(u)).abs() < 2e-7, "{u}: {back}");
        }
    }

    #[test]
    fn approximate_masking_is_within_its_bound() {
        for i in 1..=4000 {
            let a = i as f32 * 1e-3;
            let error = (g1(a) / exact_g1(a) - 1.0).abs();
            assert!(error < 0.0036, "a {a}: {error}");
        }
        assert_eq!((g1(0.0), exact_g1(0.0), g1(f32::NAN), exact_g1(f32::NAN)), (0.0, 0.0, 1.0, 1.0));
    }
}
