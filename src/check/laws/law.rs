//! The laws, each for one bsdf and one direction of view.

use super::{Subject, uniform};
use crate::math::float::UNIT_ROUNDOFF;
use crate::sampler::{Sampler, SamplerKind};
use crate::sampling::chi_square;
use crate::sampling::warp;
use glam::{DVec3, Vec3};

/// False-alarm rate of all χ² tests of a family together.
pub(crate) const FALSE_ALARMS: f64 = 0.01;

/// Relative error of a density's integral over the sphere: what the harness allows itself, twice.
const INTEGRAL: f64 = 1e-3;

/// Samples of each χ² test.
const SAMPLES: u32 = 50_000;

/// The seed of a law's own samples, by its number below 16, where the user asks for the seed `asked`.
fn own_seed(asked: u64, law: u64) -> u64 {
    asked.wrapping_mul(16) + law
}

/// Samples follow the density, whose integral falls short of one by the share of samples that are lost: those that leave
/// to the wrong side of the surface (up to a few per cent for rough microfacets seen at grazing angles).
pub(crate) fn density(subject: &impl Subject, wo: Vec3, (tests, seed): (usize, u64)) -> Result<(), String> {
    /// Standard deviations that the lost samples' number may be off by: false alarms are one in a million.
    const DEVIATIONS: f64 = 5.0;
    // Delta lobes have no density, and count as lost.
    let sample = |i| subject.draw(wo, uniform(own_seed(seed, 11), i)).filter(|s| s.pdf.is_some()).map(|s| s.wi);
    let outcome = chi_square::on_sphere(SAMPLES, sample, |wi| subject.value_and_pdf(wo, wi).1.0.into());
    let missing = 1.0 - outcome.integral;
    // The variance of one sample, at least that of one lost in the whole run.
    let variance = (missing.abs() * outcome.integral).max(1.0 / f64::from(SAMPLES));
    let share = INTEGRAL + DEVIATIONS * (variance / f64::from(SAMPLES)).sqrt();
    if !(missing >= -INTEGRAL) || !((missing - outcome.lost).abs() < share) {
        return Err(format!("the density does not integrate to what samples lose: {outcome:?}"));
    }
    let level = chi_square::sidak(FALSE_ALARMS, tests);
    if outcome.p_value < level { Err(format!("χ²: {outcome:?}, level {level:.1e}")) } else { Ok(()) }
}

/// How much `f` changes where `w` is rounded differently: each coordinate by a few units in the last place of one, and its length,
/// which matters where directions nearly cancel, as at an interface of hardly any contrast.
fn wobble(w: Vec3, f: impl Fn(Vec3) -> f32) -> f32 {
    /// A direction is the result of some operations with results of size one, and is normalised once more.
    const ROUNDINGS: f32 = 8.0 * UNIT_ROUNDOFF;
    /// A vector that was normalised has a length of one but for the rounding of its coordinates, the square root and the quotient.
    const LENGTH: f32 = 2.0 * UNIT_ROUNDOFF;
    let here = f(w);
    let change = |d: Vec3| (f((w + d * ROUNDINGS).normalize()) - here).abs();
    let sideways: f32 = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().map(|axis| change(axis).max(change(-axis))).sum();
    let stretched = |by: f32| (f(w * (1.0 + by)) - here).abs();
    sideways + stretched(LENGTH).max(stretched(-LENGTH))
}

/// Relative error of the operations that follow, beyond what rounding of directions does.
const OPERATIONS: f32 = 1e-5;

/// A sample's weight is value over density, and its density is the one asked for, both as near as rounding allows.
pub(crate) fn weight(subject: &impl Subject, wo: Vec3, seed: u64) -> Result<(), String> {
    for i in 0..1000 {
        let Some(s) = subject.draw(wo, uniform(own_seed(seed, 5), i)) else { continue };
        if !((s.wi.length() - 1.0).abs() < OPERATIONS) {
            return Err(format!("|wi| is {}", s.wi.length()));
        }
        let Some(sampled) = s.pdf else { continue };
        let (f, p) = subject.value_and_pdf(wo, s.wi);
        let tolerance = OPERATIONS * p.0 + wobble(s.wi, |w| subject.value_and_pdf(wo, w).1.0);
        if !((p.0 - sampled.0).abs() <= tolerance) {
            return Err(format!("wi {}: sampled with density {}, which is {}", s.wi, sampled.0, p.0));
        }
        if p.0 == 0.0 {
            // Rounded to where there is nothing, which was near enough: at an interface of hardly any contrast the microfacet that
            // refracts is the difference of two directions that nearly cancel.
            continue;
        }
        let ratio = |w: Vec3| {
            let (f, p) = subject.value_and_pdf(wo, w);
            if p.0 > 0.0 { f.0.element_sum() / p.0 } else { 0.0 }
        };
        let (got, expected) = (s.weight.0.element_sum(), f.0.element_sum() / p.0);
        if !((got - expected).abs() <= OPERATIONS * expected + wobble(s.wi, ratio)) {
            return Err(format!("wi {}: weight {got}, but value over density is {expected}", s.wi));
        }
    }
    Ok(())
}

/// No sample carries more than came in, up to `gain`. For transmission 1/η² is the change of radiance, not of energy.
pub(crate) fn energy(subject: &impl Subject, wo: Vec3, gain: f32, seed: u64) -> Result<(), String> {
    for i in 0..2000 {
        let Some(s) = subject.draw(wo, uniform(own_seed(seed, 6), i)) else { continue };
        let energy = s.weight.0 * (s.eta * s.eta);
        if !(energy.min_element() >= 0.0 && energy.max_element() <= 1.0 + gain + OPERATIONS) {
            return Err(format!("wi {}: weight {energy}", s.wi));
        }
    }
    Ok(())
}

/// Samples carry no more than `most` of what came in, on average: for bsdfs of several lobes, whose samples may weigh more
/// if only others weigh less.
pub(crate) fn albedo(subject: &impl Subject, wo: Vec3, most: f32, seed: u64) -> Result<(), String> {
    const POINTS: u32 = 1 << 13;
    /// Error of an integral over Sobol' points: samples are smooth functions of them but where the lobe changes, and at such
    /// edges the error is some POINTS^(−3/4), a thousandth, of weights of some units.
    const QUADRATURE: f32 = 4e-3;
    let mut sum = DVec3::ZERO;
    for i in 0..POINTS {
        let u = Sampler { kind: SamplerKind::Sobol, seed: own_seed(seed, 8) }.stream(0, 0, i).bsdf(0);
        let Some(s) = subject.draw(wo, u) else { continue };
        if !(s.weight.0.min_element() >= 0.0) {
            return Err(format!("wi {}: weight {:?}", s.wi, s.weight));
        }
        sum += (s.weight.0 * (s.eta * s.eta)).as_dvec3();
    }
    let mean = sum / f64::from(POINTS);
    let good = mean.max_element() <= f64::from(most + QUADRATURE);
    if good { Ok(()) } else { Err(format!("albedo {mean}, more than {most}")) }
}

/// f(wo, wi)/ηi² = f(wi, wo)/ηo², up to rounding (Veach 1997, equation 5.14, for radiance as it is seen), where `eta` is
/// the index below relative to above: for directions all over the sphere, and for sampled ones, but for pairs that are `exempt`.
pub(crate) fn reciprocity(
    subject: &impl Subject,
    wo: Vec3,
    eta: f32,
    exempt: fn(Vec3, Vec3) -> bool,
    seed: u64,
) -> Result<(), String> {
    let index = |w: Vec3| if w.z > 0.0 { 1.0 } else { eta };
    for i in 0..500 {
        let u = uniform(own_seed(seed, 3), i);
        let sampled = subject.draw(wo, u).filter(|s| s.pdf.is_some()).map(|s| s.wi);
        let anywhere = warp::square_to_uniform_sphere(u.direction());
        for wi in sampled.into_iter().chain([anywhere]) {
            let value = |wo: Vec3, wi: Vec3| {
                subject.value_and_pdf(wo, wi).0.0.element_sum() / wi.z.abs() * index(wi) * index(wi)
            };
            if exempt(wo, wi) {
                continue;
            }
            let (a, b) = (value(wo, wi), value(wi, wo));
            // Below the normal numbers every value is rounded to the same absolute step.
            let tolerance = OPERATIONS * a
                + wobble(wi, |wi| value(wo, wi))
                + wobble(wi, |wi| value(wi, wo))
                + wobble(wo, |wo| value(wo, wi))
                + wobble(wo, |wo| value(wi, wo))
                + f32::MIN_POSITIVE;
            if !((a - b).abs() <= tolerance) {
                return Err(format!("wi {wi}: {a} there, {b} back, tolerance {tolerance}"));
            }
        }
    }
    Ok(())
}

/// Where parameters and directions are at their ends, samples are finite, of unit length and with a positive density, and
/// values and densities are finite and not negative.
pub(crate) fn edges(subject: &impl Subject, wo: Vec3, seed: u64) -> Result<(), String> {
    for i in 0..200 {
        let sample = subject.draw(wo, uniform(own_seed(seed, 9), i));
        if let Some(s) = sample {
            let pdf = s.pdf.map_or(1.0, |p| p.0);
            let good = s.wi.is_finite() && s.weight.is_finite() && s.eta > 0.0 && pdf > 0.0 && pdf.is_finite();
            if !(good && (s.wi.length() - 1.0).abs() < OPERATIONS) {
                return Err(format!("{s:?}"));
            }
        }
        for wi in sample.map(|s| s.wi).into_iter().chain(super::table::edge_directions().nth(i as usize)) {
            let (f, p) = subject.value_and_pdf(wo, wi);
            if !(f.is_finite() && f.0.min_element() >= 0.0 && p.0 >= 0.0 && p.0.is_finite()) {
                return Err(format!("wi {wi}: {f:?} {p:?}"));
            }
        }
    }
    Ok(())
}
