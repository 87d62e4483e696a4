//! Overriding one parameter gives the bsdf that has it from the start, and cannot take a number out of its range.

use super::*;
use crate::check::laws::table::edge_directions;
use Parameter as P;

const GREEN: Rgb = Rgb::new(0.1, 0.7, 0.2);
const GREY: Rgb = Rgb::splat(0.4);

fn rough_metal(alpha_u: f32, eta: Rgb, k: Rgb, reflectance: Rgb) -> Bsdf {
    Bsdf::RoughConductor(RoughConductor::new(Microfacets::new(Distribution::Ggx, alpha_u, 0.3), eta, k, reflectance))
}

fn rough_glass(alpha_v: f32, reflectance: Rgb, transmittance: Rgb) -> Bsdf {
    RoughDielectric::bsdf(Microfacets::new(Distribution::Beckmann, 0.3, alpha_v), 1.5, reflectance, transmittance)
}

/// One of each kind with its parameters.
fn all() -> Vec<(Bsdf, Vec<P>)> {
    let facets = Microfacets::new(Distribution::Ggx, 0.2, 0.2);
    let (metal, glass) = ([P::Eta, P::K, P::SpecularReflectance], [P::SpecularReflectance, P::SpecularTransmittance]);
    let (alphas, plastic) = ([P::AlphaU, P::AlphaV], vec![P::DiffuseReflectance, P::SpecularReflectance]);
    let disney = vec![
        P::BaseColor,
        P::Roughness,
        P::Anisotropic,
        P::SpecTrans,
        P::Eta,
        P::SpecTint,
        P::Sheen,
        P::SheenTint,
        P::Flatness,
    ];
    vec![
        (Bsdf::Diffuse(Diffuse { reflectance: GREY }), vec![P::Reflectance]),
        (Bsdf::OrenNayar(OrenNayar { reflectance: GREY, roughness: 0.4 }), vec![P::Reflectance, P::Roughness]),
        (Bsdf::Conductor(Conductor { eta: GREY, k: GREY, reflectance: GREY }), metal.into()),
        (rough_metal(0.2, GREY, GREY, GREY), [&alphas[..], &metal].concat()),
        (Bsdf::Dielectric(Dielectric::new(1.5, GREY, GREY)), glass.into()),
        (rough_glass(0.2, GREY, GREY), [&alphas[..], &glass].concat()),
        (Bsdf::ThinDielectric(ThinDielectric::new(1.5, GREY, GREY)), glass.into()),
        (Bsdf::Plastic(Plastic::new(1.5, GREY, GREY, true)), plastic.clone()),
        (Bsdf::RoughPlastic(RoughPlastic::new(facets, 1.5, GREY, GREY, true)), plastic),
        (
            Bsdf::Principled(Principled::default()),
            [&disney[..], &[P::Metallic, P::Clearcoat, P::ClearcoatGloss]].concat(),
        ),
        (Bsdf::PrincipledThin(PrincipledThin::default()), [&disney[..], &[P::DiffTrans]].concat()),
        (rough_metal(0.3, GREY, GREY, GREY).with_multiple_scattering(), [&alphas[..], &metal].concat()),
        (rough_glass(0.3, GREY, GREY).with_multiple_scattering(), [&alphas[..], &glass].concat()),
        (super::gltf::every_number_different(false), super::gltf::PARAMETERS.into()),
        (super::gltf::every_number_different(true), super::gltf::PARAMETERS.into()),
        (Bsdf::Null(Null), vec![]),
    ]
}

#[test]
fn a_parameter_that_is_set_is_as_good_as_given() {
    let is = |mut bsdf: Bsdf, parameter: P, value: Rgb, expected: Bsdf| {
        bsdf.set(parameter, value);
        assert_eq!(bsdf, expected, "{parameter:?}");
    };
    let third = Rgb::splat(0.3);
    is(rough_metal(0.2, GREY, GREY, GREY), P::AlphaU, third, rough_metal(0.3, GREY, GREY, GREY));
    is(rough_metal(0.2, GREY, GREY, GREY), P::Eta, GREEN, rough_metal(0.2, GREEN, GREY, GREY));
    is(rough_metal(0.2, GREY, GREY, GREY), P::K, GREEN, rough_metal(0.2, GREY, GREEN, GREY));
    is(rough_glass(0.2, GREY, GREY), P::AlphaV, third, rough_glass(0.3, GREY, GREY));
    is(rough_glass(0.2, GREY, GREY), P::SpecularTransmittance, GREEN, rough_glass(0.2, GREY, GREEN));
    let plastic = |diffuse, specular| Bsdf::Plastic(Plastic::new(1.5, diffuse, specular, false));
    is(plastic(GREY, GREY), P::DiffuseReflectance, GREEN, plastic(GREEN, GREY));
    is(plastic(GREY, GREY), P::SpecularReflectance, GREEN, plastic(GREY, GREEN));
    let gltf = |roughness, specular_color| {
        let is =
            GltfParameters { roughness, specular_color, metallic: 0.5, clearcoat: 0.5, ..GltfParameters::default() };
        Bsdf::Gltf(Gltf::new(is))
    };
    is(gltf(0.1, GREY), P::Roughness, third, gltf(0.3, GREY));
    is(gltf(0.1, GREY), P::SpecularColor, GREEN, gltf(0.1, GREEN));
    let several = |eta| rough_metal(0.3, eta, GREY, GREY).with_multiple_scattering();
    is(several(GREY), P::Eta, GREEN, several(GREEN));
    let principled = |base_color, metallic| {
        let disney = Disney { base_color, ..Disney::default() };
        Bsdf::Principled(Principled { disney, metallic, ..Principled::default() })
    };
    is(principled(GREY, 0.1), P::BaseColor, GREEN, principled(GREEN, 0.1));
    is(principled(GREY, 0.1), P::Metallic, third, principled(GREY, 0.3));
}

#[test]
fn a_twin_takes_the_parameters_of_its_original() {
    for (bsdf, parameters) in all() {
        for &parameter in &parameters {
            for value in [Rgb::splat(0.01), GREEN / 3.0, GREEN, Rgb::WHITE] {
                let (mut early, mut late) = (bsdf.clone().regularized(), bsdf.clone());
                early.set(parameter, value);
                late.set(parameter, value);
                assert_eq!(early, late.regularized(), "{parameter:?} {value:?}");
            }
        }
    }
}

#[test]
fn no_number_gets_out_of_range() {
    for (bsdf, parameters) in all() {
        for (&parameter, bsdf) in parameters.iter().flat_map(|p| [(p, bsdf.clone()), (p, bsdf.clone().regularized())]) {
            for value in [-1.0, 0.0, 0.5, 1.0, 3.0, f32::NAN] {
                let mut bsdf = bsdf.clone();
                bsdf.set(parameter, Rgb::splat(value));
                for (i, wo) in (0..).zip(edge_directions()) {
                    let sample = bsdf.sample(wo, uniform(4, i));
                    let good = sample.is_none_or(|s| s.weight.is_finite() && s.weight.0.min_element() >= 0.0);
                    assert!(good, "{parameter:?} {value}: {bsdf:?}, wo {wo}: {sample:?}");
                    let (f, p) = bsdf.eval_pdf(wo, edge_directions().nth(i as usize / 2).unwrap());
                    let good = f.is_finite() && f.0.min_element() >= 0.0 && p.0.is_finite();
                    assert!(good, "{parameter:?} {value}: {bsdf:?}, wo {wo}: {f:?} {p:?}");
                }
            }
        }
    }
}

#[test]
fn a_bsdf_is_small_enough_to_be_copied() {
    // Where a parameter varies, every vertex of a path has a copy. The largest is rough plastic with its table.
    const MOST: usize = 400;
    assert!(size_of::<Bsdf>() <= MOST, "{} bytes", size_of::<Bsdf>());
}
