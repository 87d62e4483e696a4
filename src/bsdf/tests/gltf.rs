//! The material of glTF: how much white ones return.

use super::albedo::albedos;
use super::*;
use crate::check::laws::gltf::{EDGE, compensated, dielectric, glass, gltf, mixed, sheet};

/// Those that may vary.
pub(super) const PARAMETERS: [Parameter; 12] = [
    Parameter::BaseColor,
    Parameter::Metallic,
    Parameter::Roughness,
    Parameter::Specular,
    Parameter::SpecularColor,
    Parameter::Transmission,
    Parameter::Clearcoat,
    Parameter::ClearcoatRoughness,
    Parameter::SheenColor,
    Parameter::SheenRoughness,
    Parameter::Iridescence,
    Parameter::IridescenceThickness,
];

/// A bsdf of all lobes.
pub(super) fn every_number_different(solid: bool) -> Bsdf {
    gltf(mixed(0.4, solid))
}

/// Error of an integral over 2¹⁴ Sobol' points ([`super::albedo`]).
const QUADRATURE: f64 = 2e-3;

/// Error of the tables of what one scattering returns.
const TABLES: f64 = 2e-3;

#[test]
fn white_returns_everything() {
    for roughness in [0.0, 1e-3, 0.1, 0.25, 0.37, 0.5, 0.8, 1.0] {
        let metal = GltfParameters { roughness, ..GltfParameters::default() };
        let plain = dielectric(roughness);
        let blend = GltfParameters { metallic: 0.4, ..plain };
        let shiny = GltfParameters { ior: 1.9, specular: 0.6, ..plain };
        let mut all = vec![("metal", metal), ("plain", plain), ("blend", blend), ("shiny", shiny)];
        all.push(("sheet", sheet(roughness)));
        all.push(("window", glass(roughness, 1.0)));
        for (name, ior) in [("glass", 1.5), ("ice", 1.2), ("diamond", 2.4)] {
            all.push((name, glass(roughness, ior)));
        }
        all.push(("half", GltfParameters { transmission: 0.5, specular: 0.5, ..glass(roughness, 1.5) }));
        for (name, is) in all {
            for cosine in [1.0f32, 0.8, 0.5, 0.2, 0.05, 0.01] {
                let [.., energy] = albedos(&gltf(is), cosine);
                let off = (energy - 1.0).abs();
                assert!(off < QUADRATURE + TABLES, "{name}, roughness {roughness}, cosine {cosine}: {energy}");
            }
        }
    }
}

#[test]
fn white_glass_returns_everything_inside() {
    for roughness in [0.0, 0.1, 0.3, 0.5, 0.8, 1.0] {
        for ior in [1.2, 1.5, 2.4] {
            for cosine in [1.0f32, 0.8, 0.5, 0.2, 0.05, 0.01] {
                let [.., energy] = albedos(&gltf(glass(roughness, ior)), -cosine);
                let off = (energy - 1.0).abs();
                assert!(off < QUADRATURE + TABLES, "{ior}, roughness {roughness}, cosine {cosine}: {energy}");
            }
        }
    }
}

#[test]
fn what_is_scattered_several_times_makes_white_return_everything() {
    for distribution in [Distribution::Ggx, Distribution::Beckmann] {
        for alpha in [1e-3, 0.03, 0.1, 0.3, 0.6, 1.0] {
            for (name, bsdf, _) in compensated(distribution, alpha) {
                for cosine in [1.0f32, 0.8, 0.5, 0.2, 0.05, 0.01] {
                    for cosine in [cosine, -cosine] {
                        if cosine < 0.0 && !bsdf.lobes().transmits {
                            continue;
                        }
                        let [.., energy] = albedos(&bsdf, cosine);
                        let off = (energy - 1.0).abs();
                        let inside = cosine < 0.0 && distribution == Distribution::Beckmann;
                        let edge = if inside || name.contains("plastic 0") { f64::from(EDGE) } else { 0.0 };
                        assert!(off < QUADRATURE + TABLES + edge, "{name}, cosine {cosine}: {energy}");
                    }
                }
            }
        }
    }
}
