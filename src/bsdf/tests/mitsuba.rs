//! Values and densities against those of Mitsuba 3.9.1: `tests/data/reference/bsdfs.csv`, made by `bsdfs.py` there.

use super::named::{named, principled};
use super::*;

/// Relative difference of numbers that both compute in f32, with half vectors of directions written with nine digits.
const ROUNDING: f32 = 2e-4;

/// Error of the approximation of masking that Mitsuba has in Beckmann's density, too, and we in the value only.
const MASKING: f32 = 0.0036;

/// The transmittances that rough plastic multiplies are sums in f32 of numbers up to 1.
const TABLE: f32 = crate::math::float::UNIT_ROUNDOFF;

fn bsdf(words: &[&str]) -> Bsdf {
    let number = |i: usize| words[i].parse::<f32>().unwrap();
    let (plugin, parameters) = named(words[0]);
    let distribution = if words[1] == "ggx" { Distribution::Ggx } else { Distribution::Beckmann };
    let facets = Microfacets::new(distribution, number(2), number(3));
    let rgb = Rgb::new;
    match plugin {
        "diffuse" => Bsdf::Diffuse(Diffuse { reflectance: rgb(0.8, 0.5, 0.2) }),
        "roughconductor" => {
            let (eta, k) = (rgb(0.2, 0.9, 1.1), rgb(3.9, 2.4, 2.1));
            Bsdf::RoughConductor(RoughConductor::new(facets, eta, k, rgb(0.9, 0.8, 0.7)))
        }
        "roughdielectric" => RoughDielectric::bsdf(facets, number(4), rgb(0.9, 0.8, 0.7), rgb(0.6, 0.7, 0.8)),
        "plastic" => {
            let nonlinear = parameters("nonlinear") == Some(1.0);
            Bsdf::Plastic(Plastic::new(number(4), rgb(0.7, 0.4, 0.1), rgb(0.9, 0.8, 0.7), nonlinear))
        }
        "roughplastic" => {
            let nonlinear = parameters("nonlinear") == Some(1.0);
            let (diffuse, specular) = (rgb(0.7, 0.4, 0.1), rgb(0.9, 0.8, 0.7));
            Bsdf::RoughPlastic(RoughPlastic::new(facets, number(4), diffuse, specular, nonlinear))
        }
        _ => principled(words[0], rgb(0.8, 0.5, 0.2)),
    }
}

/// The density of GGX's mirrors without a bound over that with it.
fn unbounded(words: &[&str], wo: Vec3) -> f32 {
    let alpha = |i: usize| words[i].parse::<f32>().unwrap();
    let view = Microfacets::new(Distribution::Ggx, alpha(2), alpha(3)).mirrored(wo);
    view.masking / view.density
}

#[test]
fn values_and_densities_are_those_of_mitsuba() {
    let (mut rows, mut failures) = (0, Vec::new());
    // The last one, for rough plastic takes time to make.
    let mut made: Option<(Vec<&str>, Bsdf)> = None;
    for line in include_str!("../../../tests/data/reference/bsdfs.csv").lines().filter(|l| !l.starts_with('#')) {
        let words: Vec<&str> = line.split(',').collect();
        let numbers: Vec<f32> = words[5..].iter().map(|w| w.parse().unwrap()).collect();
        let (wo, wi) = (Vec3::from_slice(&numbers), Vec3::from_slice(&numbers[3..]));
        if made.as_ref().is_none_or(|(of, _)| of[..] != words[..5]) {
            made = Some((words[..5].to_vec(), bsdf(&words)));
        }
        let Some((_, bsdf)) = &made else { unreachable!() };
        let (f, p) = bsdf.eval_pdf(wo, wi);
        let expected = Vec3::from_slice(&numbers[6..]);
        let step = if words[0].starts_with("roughplastic") { TABLE } else { 0.0 };
        let off = (f.0 - expected).abs().max_element();
        if !(off <= ROUNDING * expected.max_element() + step) {
            failures.push(format!("{line}: {f:?}, off by {:e}", off / expected.max_element()));
        }
        let tolerance = ROUNDING + if words[1] == "beckmann" { MASKING } else { 0.0 };
        // Principled bsdfs have lobes chosen by other probabilities; mirrors of GGX are sampled within a bound, which changes
        // the density by a factor that the lobes of rough plastic do not share.
        let (is_ggx, is_metal) = (words[1] == "ggx", words[0] == "roughconductor");
        let ours = words[0].starts_with("principled") || is_ggx && words[0].starts_with("roughplastic");
        let p = if is_ggx && is_metal { p.0 * unbounded(&words, wo) } else { p.0 };
        if !(ours || (p - numbers[9]).abs() <= tolerance * numbers[9]) {
            failures.push(format!("{line}: {p:?}"));
        }
        rows += 1;
    }
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
    assert!(rows > 800, "{rows} rows");
}
