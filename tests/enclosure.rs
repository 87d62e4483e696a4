//! Closed rooms, whose radiance is known in closed form: where every wall emits Le and reflects the fraction a of what
//! it gets, every wall shows Le·(1 + a + a² + …) = Le / (1 − a) in every direction. A ray that slips out between two
//! walls, or meets the wall it starts from, darkens or brightens a pixel.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use glam::DVec3;
use snell::integrator::Estimator;

const ALBEDO: f32 = 0.5;
const EMISSION: f32 = 0.75;
const EXPECTED: f32 = EMISSION / (1.0 - ALBEDO);

/// Bsdf sampling without roulette has no variance here: every path collects the same geometric series. So each pixel must
/// have the value itself, up to the rounding of its sums (a dozen operations, a few ulps) and the tail of the series that
/// the depth limit cuts off (2⁻⁴⁰).
#[test]
fn every_pixel_of_a_closed_room_has_the_closed_form_value() {
    let mut s = settings(Estimator::Bsdf, 64);
    s.integrator.max_depth = 40;
    s.integrator.rr_depth = u32::MAX;
    for accelerator in accelerators() {
        for offset in [0.0, 1.0, 1e3, 1e6] {
            let room = transformed(enclosure(ALBEDO, EMISSION), 1.0, DVec3::new(1.0, -0.7, 0.3) * offset);
            let picture = picture(&compiled(&room, accelerator), &s);
            for (i, p) in picture.pixels().iter().enumerate() {
                for v in p.to_array() {
                    let error = (v / EXPECTED - 1.0).abs();
                    assert!(error < 1e-6, "{accelerator:?}, offset {offset}, pixel {i}: {v} is off by {error:e}");
                }
            }
        }
    }
}

/// The same by light sampling, with noise: the mean of 24² pixels × 256 samples. Hypothesis: its expectation is the
/// closed form. The error is taken from 16 independent seeds; 5 standard errors give a false alarm in 10⁻⁴ of cases (t
/// with 15 degrees of freedom), for six cases together below 10⁻³; the seeds are fixed.
#[test]
fn every_estimator_finds_the_closed_form_in_the_mean() {
    for estimator in [Estimator::Path, Estimator::Nee, Estimator::Naive] {
        for accelerator in accelerators() {
            let scene = compiled(&enclosure(ALBEDO, EMISSION), accelerator);
            let means: Vec<f64> = (0..16)
                .map(|seed| {
                    let mut s = settings(estimator, 16);
                    s.sampler.seed = seed;
                    mean(&picture(&scene, &s))
                })
                .collect();
            let n = means.len() as f64;
            let m = means.iter().sum::<f64>() / n;
            let se = (means.iter().map(|x| (x - m) * (x - m)).sum::<f64>() / (n - 1.0) / n).sqrt();
            let z = (m - f64::from(EXPECTED)) / se;
            assert!(z.abs() < 5.0, "{estimator:?} {accelerator:?}: mean {m} ± {se}, z {z}");
            assert!(se < 1e-2, "{estimator:?} {accelerator:?}: too noisy to tell, {se}");
        }
    }
}

#[test]
fn scaling_by_a_power_of_two_changes_no_bit() {
    for accelerator in accelerators() {
        let s = settings(Estimator::Path, 4);
        let base = picture(&compiled(&enclosure(ALBEDO, EMISSION), accelerator), &s);
        for exponent in [-40, -1, 1, 40] {
            let scaled = transformed(enclosure(ALBEDO, EMISSION), 2f64.powi(exponent), DVec3::ZERO);
            let other = picture(&compiled(&scaled, accelerator), &s);
            assert_eq!(base, other, "2^{exponent} with {accelerator:?}");
        }
    }
}
