//! Rows of the table for the material of glTF, and for what is scattered several times.

use super::table::{Energy, Row, row};
use crate::bsdf::*;
use crate::spectrum::Rgb;
use glam::Vec3;

const COLOUR: Rgb = Rgb::new(0.9, 0.5, 0.1);

/// Smooth (its α is the smallest there is), in between, as rough as can be.
const ROUGHNESSES: [f32; 3] = [1e-3, 0.3, 1.0];

/// Whether directions in f32 resolve lobes of the least of these: α is its square, 10⁻⁶, and across the plane of view a lobe is 2α·cos θ
/// wide, where coordinates near one are 6·10⁻⁸ apart. At a cosine of 0.01 one unit in the last place is three lobes.
fn is_resolved(wo: Vec3) -> bool {
    /// At which a lobe is three units wide.
    const LEAST_COSINE: f32 = 0.1;
    wo.z.abs() >= LEAST_COSINE
}

pub(crate) fn gltf(is: GltfParameters) -> Bsdf {
    Bsdf::Gltf(Gltf::new(is))
}

pub(crate) fn dielectric(roughness: f32) -> GltfParameters {
    GltfParameters { metallic: 0.0, roughness, ..GltfParameters::default() }
}

pub(crate) fn sheet(roughness: f32) -> GltfParameters {
    GltfParameters { transmission: 1.0, ..dielectric(roughness) }
}

pub(crate) fn glass(roughness: f32, ior: f32) -> GltfParameters {
    GltfParameters { solid: true, ior, ..sheet(roughness) }
}

/// Every number different.
pub(crate) fn mixed(roughness: f32, solid: bool) -> GltfParameters {
    GltfParameters {
        base_color: COLOUR,
        metallic: 0.3,
        roughness,
        ior: 1.4,
        specular: 0.7,
        specular_color: Rgb::new(0.5, 0.9, 1.5),
        transmission: 0.4,
        solid,
        clearcoat: 0.6,
        clearcoat_roughness: 0.2,
        sheen_color: Rgb::new(0.1, 0.2, 0.5),
        sheen_roughness: 0.4,
        iridescence: 0.5,
        iridescence_ior: 1.7,
        iridescence_thickness: 300.0,
    }
}

/// What one can make of [`dielectric`], by name.
fn kinds(roughness: f32) -> Vec<(&'static str, GltfParameters)> {
    let (plain, metal) = (dielectric(roughness), GltfParameters { roughness, ..GltfParameters::default() });
    let film = |thickness: f32, is: GltfParameters| GltfParameters {
        iridescence: 1.0,
        iridescence_thickness: thickness,
        ..is
    };
    vec![
        ("white", plain),
        ("metal", metal),
        ("gold", GltfParameters { base_color: COLOUR, ..metal }),
        ("dense", GltfParameters { ior: 2.4, ..plain }),
        ("tinted", GltfParameters { specular_color: Rgb::new(2.0, 0.5, 30.0), specular: 0.8, ..plain }),
        ("coated", GltfParameters { clearcoat: 1.0, clearcoat_roughness: 0.1, ..plain }),
        ("coated metal", GltfParameters { clearcoat: 0.7, clearcoat_roughness: 1.0, ..metal }),
        ("cloth", GltfParameters { sheen_color: Rgb::WHITE, sheen_roughness: roughness, ..plain }),
        ("film", film(300.0, plain)),
        ("film on metal", film(500.0, GltfParameters { base_color: Rgb::splat(0.7), ..metal })),
        ("sheet", sheet(roughness)),
        ("glass", glass(roughness, 1.5)),
        ("half glass", GltfParameters { transmission: 0.5, ..glass(roughness, 1.5) }),
        ("filmed glass", film(200.0, glass(roughness, 1.5))),
        ("window", glass(roughness, 1.0)),
        ("mixed", mixed(roughness, false)),
        ("mixed solid", mixed(roughness, true)),
    ]
}

/// How much more than everything a kind may return: the tables' error; of a film on a diffuse base or on glass the error of
/// taking its reflectance under the angle of view instead of averaging it over the microfacets.
fn gain(name: &str) -> f32 {
    const TABLES: f32 = 2e-3;
    const FILM: f32 = 0.02;
    // Smooth sheen has its whole albedo within a few degrees of the horizon.
    const SHEEN: f32 = 0.016;
    if name == "cloth" {
        return SHEEN;
    }
    if name.contains("film") || name.contains("mixed") { FILM } else { TABLES }
}

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for (name, is, tilt) in [("coat", dielectric(0.4), 0.2f32), ("coat of a sheet", sheet(0.4), 0.5)] {
        let mut bsdf = Gltf::new(GltfParameters { clearcoat: 0.9, clearcoat_roughness: 0.3, ..is });
        bsdf.set_coat_normal(Vec3::new(tilt, -tilt, 1.0).normalize());
        // Cosines to two normals: what the coat gives back is not what it keeps from the base.
        const TILTED: f32 = 0.3;
        let energy = Energy::Mean(1.0 + TILTED);
        // Each lobe's value has the cosine to its own normal, of one direction only.
        rows.push(Row { energy, exempt: |_, _| true, ..row(&format!("glTF tilted {name}"), Bsdf::Gltf(bsdf), 1.0) });
    }
    for roughness in ROUGHNESSES {
        for (name, is) in kinds(roughness) {
            // All roughnesses where lobes are as they are, one where they are combined.
            let is_plain = ["metal", "white", "sheet", "glass"].contains(&name);
            if !is_plain && roughness != ROUGHNESSES[1] {
                continue;
            }
            let eta = if is.solid { is.ior } else { 1.0 };
            let energy = Energy::Mean(1.0 + gain(name));
            let resolved = if roughness == ROUGHNESSES[0] { is_resolved } else { |_| true };
            rows.push(Row { energy, resolved, ..row(&format!("glTF {name} {roughness}"), gltf(is), eta) });
        }
    }
    rows
}

pub(crate) fn extremes() -> Vec<(String, Bsdf)> {
    let mut all = Vec::new();
    // Corners of the parameters' ranges, a bit each: a seventh of them.
    for corner in (0..1u32 << 12).step_by(7) {
        let bit = |i: u32| (corner >> i & 1) as f32;
        let is = GltfParameters {
            base_color: Rgb::splat(bit(0)),
            metallic: bit(1),
            roughness: bit(2),
            ior: [1.0, 1.0 + 1e-7, 1.0 + 1e-5, 1.5, 5.0][(corner % 5) as usize],
            specular: bit(3),
            specular_color: Rgb::splat(100.0 * bit(4)),
            transmission: bit(5),
            solid: bit(6) > 0.0,
            clearcoat: bit(7),
            clearcoat_roughness: bit(8),
            sheen_color: Rgb::splat(bit(9)),
            sheen_roughness: bit(10),
            iridescence: bit(11),
            iridescence_ior: 1.0 + bit(8),
            iridescence_thickness: 1e4 * bit(10),
        };
        all.push((format!("{is:?}"), gltf(is)));
    }
    all
}

/// Error of the albedo of a coat of less index than its surroundings, and of Beckmann's glass seen from inside (where 0.6 % was
/// found): it has an edge where everything begins to be reflected, which a table does not resolve.
pub(crate) const EDGE: f32 = 0.01;

/// Metal, dielectrics and plastic of Mitsuba's with what they scatter several times.
pub(crate) fn compensated(distribution: Distribution, alpha: f32) -> Vec<(String, Bsdf, f32)> {
    let facets = Microfacets::new(distribution, alpha, alpha);
    let mut all = vec![];
    let metal = RoughConductor::new(facets, Rgb::BLACK, Rgb::WHITE, Rgb::WHITE);
    all.push((format!("mirror {distribution:?} {alpha}"), Bsdf::RoughConductor(metal), 1.0));
    for eta in [1.5, 1.0 / 1.5, 1.1, 2.4] {
        let glass = RoughDielectric::bsdf(facets, eta, Rgb::WHITE, Rgb::WHITE);
        all.push((format!("glass {eta} {distribution:?} {alpha}"), glass, eta));
    }
    for eta in [1.5, 1.0 / 1.5] {
        let plastic = Bsdf::RoughPlastic(RoughPlastic::new(facets, eta, Rgb::WHITE, Rgb::WHITE, true));
        all.push((format!("plastic {eta} {distribution:?} {alpha}"), plastic, 1.0));
    }
    all.into_iter().map(|(name, bsdf, eta)| (name, bsdf.with_multiple_scattering(), eta)).collect()
}

pub(crate) fn compensated_rows() -> Vec<Row> {
    /// Error of the tables, and of Beckmann's approximate masking.
    const TABLES: f32 = 2e-3;
    let mut rows = Vec::new();
    let facets = Microfacets::new(Distribution::Ggx, 0.3, 0.3);
    let gold = RoughConductor::new(facets, Rgb::new(0.2, 0.9, 1.4), Rgb::new(3.9, 2.4, 1.6), Rgb::WHITE);
    let gold = Bsdf::RoughConductor(gold).with_multiple_scattering();
    rows.push(Row { energy: Energy::Mean(1.0), ..row("several gold Ggx", gold, 1.0) });
    for (distribution, alpha) in
        [(Distribution::Ggx, 1e-3), (Distribution::Ggx, 0.3), (Distribution::Ggx, 1.0), (Distribution::Beckmann, 0.4)]
    {
        for (name, bsdf, eta) in compensated(distribution, alpha) {
            if [1.5, 1.0].contains(&eta) {
                let energy = Energy::Mean(1.0 + TABLES + if name.contains("plastic 0") { EDGE } else { 0.0 });
                rows.push(Row { energy, ..row(&format!("several {name}"), bsdf, eta) });
            }
        }
    }
    rows
}
