//! Furnace: how much of the light white bsdfs return, against Mitsuba 3.9.1: `tests/data/reference/albedos.csv`, made by
//! `albedos.py` there.
//!
//! Smooth and diffuse ones return everything. Rough ones lose what their microfacets reflect to each other, because only one
//! scattering is counted, as in Mitsuba. These losses are exceptions to the law, which the file lists for every row: for metal
//! of roughness 0.1 up to 13 % (GGX) or 9 % (Beckmann), of 0.5 up to 31 % or 13 %, of 1 up to 69 % or 54 %; for glass of
//! roughness 0.1 up to 15 % or 9 %, of 0.5 up to 40 % or 23 %, of 1 up to 66 % or 46 %.

use super::named::{named, principled};
use super::*;

/// Sobol' points of each integral.
const POINTS: u32 = 1 << 14;

/// Error of such an integral: samples are smooth functions of the points but where one is lost or the lobe changes, and
/// at such edges the error is some POINTS^(−3/4), a thousandth; of weights above 1, radiance from a denser medium, as much more.
const QUADRATURE: f64 = 2e-3;

/// Beckmann's approximate masking, which is in Mitsuba's density, too, and so in its albedos.
const MASKING: f64 = 0.0036;

/// What white plastic of index 1.5 returns too much, for the coat's reflectance inside is a fit.
const COAT: f64 = 0.0012;

/// Those that return everything.
const LOSSLESS: [&str; 4] = ["diffuse", "dielectric", "thindielectric", "null"];

/// Relative error of a weight in f32, twice.
const ROUNDING: f64 = 2.0 * f32::EPSILON as f64;

fn white(words: &[&str]) -> (Bsdf, f64) {
    let number = |i: usize| words[i].parse::<f32>().unwrap();
    let distribution = if words[1] == "ggx" { Distribution::Ggx } else { Distribution::Beckmann };
    let (facets, eta) = (Microfacets::new(distribution, number(2), number(3)), number(4));
    let (plugin, parameters) = named(words[0]);
    let nonlinear = parameters("nonlinear") == Some(1.0);
    let bsdf = match plugin {
        "diffuse" => Bsdf::Diffuse(Diffuse { reflectance: Rgb::WHITE }),
        "dielectric" => Bsdf::Dielectric(Dielectric::new(eta, Rgb::WHITE, Rgb::WHITE)),
        "roughconductor" => Bsdf::RoughConductor(RoughConductor::new(facets, Rgb::BLACK, Rgb::WHITE, Rgb::WHITE)),
        "roughdielectric" => RoughDielectric::bsdf(facets, eta, Rgb::WHITE, Rgb::WHITE),
        "null" => Bsdf::Null(Null),
        "thindielectric" => Bsdf::ThinDielectric(ThinDielectric::new(eta, Rgb::WHITE, Rgb::WHITE)),
        "plastic" => Bsdf::Plastic(Plastic::new(eta, Rgb::WHITE, Rgb::WHITE, nonlinear)),
        "roughplastic" => Bsdf::RoughPlastic(RoughPlastic::new(facets, eta, Rgb::WHITE, Rgb::WHITE, nonlinear)),
        _ => principled(words[0], Rgb::WHITE),
    };
    let gain = if distribution == Distribution::Beckmann { MASKING } else { 0.0 };
    (bsdf, if plugin == "plastic" { COAT } else { gain })
}

/// Mean weight of the samples on the viewer's side and on the other, and mean energy of all.
pub(super) fn albedos(bsdf: &Bsdf, cosine: f32) -> [f64; 3] {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
    let wo = Vec3::new(0.6 * sine, 0.8 * sine, cosine);
    let mut sums = [0.0; 3];
    for i in 0..POINTS {
        let u = Sampler { kind: SamplerKind::Sobol, seed: 4 }.stream(0, 0, i).bsdf(0);
        let Some(s) = bsdf.sample(wo, u) else { continue };
        let weight = f64::from(s.weight.0.x);
        sums[usize::from(s.wi.z * wo.z < 0.0)] += weight;
        sums[2] += weight * f64::from(s.eta * s.eta);
    }
    sums.map(|s| s / f64::from(POINTS))
}

#[test]
fn white_bsdfs_return_what_mitsuba_says() {
    let mut rows = 0;
    for line in include_str!("../../../tests/data/reference/albedos.csv").lines().filter(|l| !l.starts_with('#')) {
        let words: Vec<&str> = line.split(',').collect();
        let (bsdf, gain) = white(&words);
        let [same, other, energy] = albedos(&bsdf, words[5].parse().unwrap());
        let expected = [6, 7].map(|i: usize| words[i].parse::<f64>().unwrap());
        for (got, expected) in [same, other].into_iter().zip(expected) {
            assert!(
                (got - expected).abs() <= (QUADRATURE + gain) * expected.max(1.0),
                "{line}: {got} instead of {expected}"
            );
        }
        // Principled bsdfs may create energy: the table of the laws lists how much.
        let bounded = words[0].starts_with("principled") || energy <= 1.0 + gain + ROUNDING;
        assert!(bounded, "{line}: energy {energy}");
        if LOSSLESS.contains(&words[0]) {
            assert!((energy - 1.0).abs() < ROUNDING, "{line}: energy {energy}");
        }
        rows += 1;
    }
    assert_eq!(rows, 201);
}

#[test]
fn rough_diffuse_white_returns_everything() {
    // Up to the fit of the albedo (Portsmouth et al. 2024, section 3) and the quadrature.
    const FIT: f64 = 1e-3;
    for roughness in [0.0, 0.2, 0.5, 1.0] {
        let bsdf = Bsdf::OrenNayar(OrenNayar { reflectance: Rgb::WHITE, roughness });
        for cosine in [1.0, 0.7, 0.3, 0.1, 0.02] {
            let [reflected, ..] = albedos(&bsdf, cosine);
            assert!((reflected - 1.0).abs() < FIT + QUADRATURE, "roughness {roughness}, cosine {cosine}: {reflected}");
        }
    }
}

#[test]
fn the_loss_of_ggx_in_closed_form() {
    // Roughness 1 seen along the normal: visible microfacets are distributed like the cosine, and with x = cos θi the albedo
    // is ½∫G₁(x)dx = ∫x/(1 + x)dx over [0, 1] = 1 − ln 2.
    let (bsdf, _) = white(&["roughconductor", "ggx", "1", "1", "0"]);
    let [reflected, ..] = albedos(&bsdf, 1.0);
    assert!((reflected - (1.0 - std::f64::consts::LN_2)).abs() < 1e-5, "{reflected}");
}
