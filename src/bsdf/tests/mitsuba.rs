//! Values and densities against those of Mitsuba 3.9.1: `tests/data/reference/bsdfs.csv`, made by `bsdfs.py` there.

use super::*;

/// Relative difference of numbers that both compute in f32, with half vectors of directions written with nine digits.
const ROUNDING: f32 = 2e-4;

/// Error of the approximation of masking that Mitsuba has in Beckmann's density, too, and we in the value only.
const MASKING: f32 = 0.0036;

fn bsdf(words: &[&str]) -> Bsdf {
    let number = |i: usize| words[i].parse::<f32>().unwrap();
    let distribution = if words[1] == "ggx" { Distribution::Ggx } else { Distribution::Beckmann };
    let facets = Microfacets::new(distribution, number(2), number(3));
    let rgb = Rgb::new;
    match words[0] {
        "diffuse" => Bsdf::Diffuse(Diffuse { reflectance: rgb(0.8, 0.5, 0.2) }),
        "roughconductor" => {
            let (eta, k) = (rgb(0.2, 0.9, 1.1), rgb(3.9, 2.4, 2.1));
            Bsdf::RoughConductor(RoughConductor::new(facets, eta, k, rgb(0.9, 0.8, 0.7)))
        }
        "roughdielectric" => RoughDielectric::bsdf(facets, number(4), rgb(0.9, 0.8, 0.7), rgb(0.6, 0.7, 0.8)),
        other => panic!("{other}"),
    }
}

#[test]
fn values_and_densities_are_those_of_mitsuba() {
    let mut rows = 0;
    for line in include_str!("../../../tests/data/reference/bsdfs.csv").lines().filter(|l| !l.starts_with('#')) {
        let words: Vec<&str> = line.split(',').collect();
        let numbers: Vec<f32> = words[5..].iter().map(|w| w.parse().unwrap()).collect();
        let (wo, wi) = (Vec3::from_slice(&numbers), Vec3::from_slice(&numbers[3..]));
        let (f, p) = bsdf(&words).eval_pdf(wo, wi);
        let expected = Vec3::from_slice(&numbers[6..]);
        let off = (f.0 - expected).abs().max_element();
        assert!(off <= ROUNDING * expected.max_element(), "{line}: {f:?}");
        let tolerance = ROUNDING + if words[1] == "beckmann" { MASKING } else { 0.0 };
        assert!((p.0 - numbers[9]).abs() <= tolerance * numbers[9], "{line}: {p:?}");
        rows += 1;
    }
    assert!(rows > 300, "{rows} rows");
}
