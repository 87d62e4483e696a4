//! The laws that every bsdf obeys, in one table.

use super::*;
use crate::sampler::{Sampler, SamplerKind};
use crate::sampling::warp;

fn table() -> Vec<(String, Bsdf)> {
    let mut rows = vec![
        ("diffuse".into(), Bsdf::Diffuse(Diffuse { reflectance: Rgb::new(0.9, 0.5, 0.1) })),
        ("glass".into(), Bsdf::Dielectric(Dielectric::new(1.5, Rgb::WHITE, Rgb::WHITE))),
        ("bubble".into(), Bsdf::Dielectric(Dielectric::new(1.0 / 1.5, Rgb::WHITE, Rgb::WHITE))),
    ];
    for alpha in [0.1, 0.25, 0.5, 1.0] {
        let metal = RoughConductor::new(alpha, Rgb::new(0.2, 0.9, 1.4), Rgb::new(3.9, 2.4, 1.6), Rgb::WHITE);
        rows.push((format!("conductor {alpha}"), Bsdf::RoughConductor(metal)));
    }
    rows
}

/// Directions from normal incidence to nearly grazing.
fn outgoing() -> impl Iterator<Item = Vec3> {
    [1.0f32, 0.8, 0.4, 0.1, 0.01].into_iter().map(|z| {
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * 0.6, r * 0.8, z)
    })
}

fn uniforms(n: u32, seed: u64) -> impl Iterator<Item = BsdfUniforms> {
    let sampler = Sampler { kind: SamplerKind::Independent, seed };
    (0..n).map(move |i| sampler.stream(0, 0, i).bsdf(0))
}

#[test]
fn samples_follow_the_density() {
    // χ² of 2·10⁵ samples against the density integrated over 2 × 10 × 20 cells of (θ, φ) of the whole sphere, cells
    // pooled to an expectation of at least 10. Hypothesis: samples follow the pdf. 25 tests (smooth bsdfs × directions)
    // at 6 standard deviations of χ²: family-wise false-alarm rate below 1e-6; the seed is fixed.
    for (name, bsdf) in table().iter().filter(|(_, b)| b.lobes().smooth) {
        for wo in outgoing() {
            let z = chi_square_deviation(|u| bsdf.sample(wo, u).map(|s| s.wi), |wi| bsdf.pdf(wo, wi).0);
            assert!(z < 6.0, "{name}, wo {wo}: χ² is {z} standard deviations above its mean");
        }
    }
}

#[test]
fn the_chi_square_test_rejects_a_wrong_density() {
    let bsdf = Bsdf::Diffuse(Diffuse { reflectance: Rgb::WHITE });
    let wo = Vec3::Z;
    let z =
        chi_square_deviation(|u| bsdf.sample(wo, u).map(|s| s.wi), |wi| if wi.z > 0.0 { 0.159_154_94 } else { 0.0 });
    assert!(z > 50.0, "{z}");
}

/// Standard deviations by which χ² exceeds its degrees of freedom.
fn chi_square_deviation(sample: impl Fn(BsdfUniforms) -> Option<Vec3>, pdf: impl Fn(Vec3) -> f32) -> f64 {
    /// Rows of cells in each hemisphere, uniform in √(1 − |cos θ|) so that a narrow lobe around the normal is resolved.
    const ROWS: usize = 10;
    const COLUMNS: usize = 20;
    const SAMPLES: u32 = 200_000;
    /// Points for the integral of the density over a cell, along a row's height and along its width.
    const POINTS: (usize, usize) = (200, 48);
    let cell = |w: Vec3| {
        let t = ((w.x * w.x + w.y * w.y) / (1.0 + w.z.abs())).sqrt();
        let row = ((t * ROWS as f32) as usize).min(ROWS - 1) + if w.z < 0.0 { ROWS } else { 0 };
        let turn = (w.y.atan2(w.x) / std::f32::consts::TAU).rem_euclid(1.0);
        row * COLUMNS + ((turn * COLUMNS as f32) as usize).min(COLUMNS - 1)
    };
    let mut observed = vec![0.0; 2 * ROWS * COLUMNS];
    for u in uniforms(SAMPLES, 11) {
        if let Some(w) = sample(u) {
            observed[cell(w)] += 1.0;
        }
    }
    let mut expected = vec![0.0; 2 * ROWS * COLUMNS];
    let (rows, columns) = (ROWS * POINTS.0, COLUMNS * POINTS.1);
    let step = std::f64::consts::TAU / (rows * columns) as f64;
    for i in 0..rows {
        let t = (i as f32 + 0.5) / rows as f32;
        for j in 0..columns {
            let (s, c) = warp::sin_cos(std::f32::consts::TAU * (j as f32 + 0.5) / columns as f32);
            let r = t * (2.0 - t * t).sqrt();
            for z in [1.0 - t * t, t * t - 1.0] {
                let w = Vec3::new(r * c, r * s, z);
                expected[cell(w)] += f64::from(pdf(w)) * f64::from(2.0 * t) * step * f64::from(SAMPLES);
            }
        }
    }
    let (mut chi2, mut dof, mut pooled) = (0.0, -1.0, (0.0, 0.0));
    for (o, e) in observed.into_iter().zip(expected) {
        pooled = (pooled.0 + o, pooled.1 + e);
        if pooled.1 >= 10.0 {
            chi2 += (pooled.0 - pooled.1) * (pooled.0 - pooled.1) / pooled.1;
            dof += 1.0;
            pooled = (0.0, 0.0);
        }
    }
    // Samples where none are expected at all.
    let stray = if pooled.1 < 1.0 { pooled.0 } else { 0.0 };
    (chi2 - f64::max(dof, 1.0)) / (2.0 * f64::max(dof, 1.0)).sqrt() + stray
}

#[test]
fn weights_are_value_over_density_and_carry_no_energy_out_of_nothing() {
    for (name, bsdf) in table() {
        for wo in outgoing().flat_map(|w| [w, -w]) {
            for u in uniforms(2000, 5) {
                let Some(s) = bsdf.sample(wo, u) else { continue };
                assert!((s.wi.length() - 1.0).abs() < 1e-5, "{name}: |wi| = {}", s.wi.length());
                // 1/η² is the change of radiance, not of energy.
                let energy = s.weight.max_component() * s.eta * s.eta;
                assert!((0.0..=1.0 + 1e-5).contains(&energy), "{name}, wo {wo}: weight {:?}", s.weight);
                if let Some(pdf) = s.pdf {
                    let (f, p) = (bsdf.eval(wo, s.wi), bsdf.pdf(wo, s.wi));
                    // The half vector is recovered from wo + wi: relative rounding over the roughness.
                    assert!((p.0 / pdf.0 - 1.0).abs() < 2e-3, "{name}, wo {wo}: pdf {} sampled with {}", p.0, pdf.0);
                    let w = f / p.0;
                    assert!((w.0 - s.weight.0).abs().max_element() < 2e-3, "{name}, wo {wo}: {w:?} {:?}", s.weight);
                }
            }
        }
    }
}

#[test]
fn values_are_reciprocal() {
    for (name, bsdf) in table() {
        for wo in outgoing() {
            for u in uniforms(500, 3) {
                let wi = warp::square_to_cosine_hemisphere(u.direction());
                if wi.z < 1e-3 {
                    continue;
                }
                let (a, b) = (bsdf.eval(wo, wi) / wi.z, bsdf.eval(wi, wo) / wo.z);
                let scale = a.max_component().max(1e-3);
                assert!((a.0 - b.0).abs().max_element() < 1e-3 * scale, "{name}: {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn one_sided_bsdfs_are_black_from_behind_and_let_nothing_through() {
    for (name, bsdf) in table().iter().filter(|(_, b)| !b.lobes().transmits) {
        for w in outgoing() {
            assert!(bsdf.eval(-w, w).is_black() && bsdf.eval(w, -w).is_black(), "{name}");
            assert_eq!(bsdf.pdf(-w, -w).0, 0.0, "{name}");
            assert!(uniforms(10, 1).all(|u| bsdf.sample(-w, u).is_none()), "{name}");
        }
    }
}

#[test]
fn edges_of_the_parameters_stay_finite() {
    for alpha in [1e-5f32, 1e-4, 1e-2, 1.0, 10.0] {
        for z in [1e-7f32, 1e-4, 0.5, 1.0] {
            let metal = Bsdf::RoughConductor(RoughConductor::new(alpha, Rgb::splat(0.0), Rgb::splat(10.0), Rgb::WHITE));
            let wo = Vec3::new((1.0 - z * z).sqrt(), 0.0, z);
            for u in uniforms(2000, 9) {
                if let Some(s) = metal.sample(wo, u) {
                    let pdf = s.pdf.unwrap().0;
                    assert!(
                        s.wi.is_finite() && s.weight.is_finite() && pdf > 0.0 && !pdf.is_nan(),
                        "α {alpha} z {z}: {s:?}"
                    );
                    assert!(metal.eval(wo, s.wi).is_finite(), "α {alpha} z {z}");
                }
            }
            for eta in [1.0f32, 1.0 + 1e-7, 0.25, 4.0] {
                let glass = Bsdf::Dielectric(Dielectric::new(eta, Rgb::WHITE, Rgb::WHITE));
                for u in uniforms(200, 9) {
                    let s = glass.sample(wo, u).unwrap();
                    assert!(s.wi.is_finite() && s.weight.is_finite(), "η {eta} z {z}: {s:?}");
                }
            }
        }
    }
}
