//! Bsdfs that come to something simpler.

use super::constant::Constants;
use super::has_lights_without_size;
use crate::description::{
    Bsdf, BsdfId, BsdfKind, Microfacets, NormalSource, Parameter, SceneDescription, TextureId, Varying,
};
use crate::math::float::{max, min};
use std::collections::HashSet;

/// The roughness α below which a lobe cannot be told from a mirror's. Reason: a half vector has a length of about 1, and the
/// rounding of directions to f32, of 2⁻²⁴ ≈ 6·10⁻⁸ in each of their coordinates, must be well below α for the density of
/// microfacets to mean anything; it is the same bound as that of refracted lobes (`bsdf/rough_dielectric.rs`), of which the half
/// vector is |η − 1| long. A pixel of a picture of 4,096 pixels and 60° is 60 times as wide.
const NARROWEST_MIRROR: f64 = 4e-6;

/// What a bsdf becomes.
enum Simpler {
    /// The same with another kind.
    Kind(BsdfKind),
    /// Another one.
    Other(BsdfId),
}

/// Exchanges every bsdf that comes to something simpler for that.
pub(super) fn fold(description: &mut SceneDescription, constants: &Constants, notes: &mut Vec<String>) {
    for bsdf in &mut description.bsdfs {
        known_numbers(&mut bsdf.kind, constants);
    }
    // What a side of a two-sided bsdf may be is for the compiler to say, of what was written.
    let sides: HashSet<BsdfId> = description
        .bsdfs
        .iter()
        .filter(|bsdf| matches!(bsdf.kind, BsdfKind::TwoSided { .. }))
        .flat_map(Bsdf::parts)
        .collect();
    let has_glints = has_lights_without_size(description);
    // Each of them makes a bsdf of fewer parts or of another kind that nothing here changes: this ends.
    let mut index = 0;
    while index < description.bsdfs.len() {
        let (bsdfs, id) = (&description.bsdfs, BsdfId(index));
        let bsdf = &bsdfs[index];
        let simpler = simpler_combination(bsdf, bsdfs, constants)
            .filter(|_| !sides.contains(&id) || !matches!(bsdf.kind, BsdfKind::Mask { .. }))
            .or_else(|| smooth(bsdf).filter(|_| !has_glints));
        let Some((simpler, why)) = simpler else {
            index += 1;
            continue;
        };
        let name = if bsdf.name.is_empty() { String::new() } else { format!(" '{}'", bsdf.name) };
        notes.push(format!("{}: the bsdf{name}: {why}", bsdf.at));
        let (kind, varying) = match simpler {
            Simpler::Kind(BsdfKind::Null) => (BsdfKind::Null, Vec::new()),
            Simpler::Kind(kind) => (kind, without_roughness(&bsdf.varying)),
            Simpler::Other(other) => (bsdfs[other.0].kind.clone(), bsdfs[other.0].varying.clone()),
        };
        let bsdf = &mut description.bsdfs[index];
        (bsdf.kind, bsdf.varying) = (kind, varying);
    }
}

/// Puts numbers in the place of textures that give nothing else.
fn known_numbers(kind: &mut BsdfKind, constants: &Constants) {
    if let BsdfKind::Blend { weight: number, .. } | BsdfKind::Mask { opacity: number, .. } = kind
        && let Varying::Texture(texture) = *number
        && let Some(value) = constants.number(texture)
    {
        // As at a point: NaN is 0.
        *number = Varying::Constant(f64::from(min(max(value, 0.0), 1.0)));
    }
}

/// What is left of a combination of bsdfs, and why.
fn simpler_combination(bsdf: &Bsdf, bsdfs: &[Bsdf], constants: &Constants) -> Option<(Simpler, &'static str)> {
    Some(match bsdf.kind {
        BsdfKind::Mask { nested, opacity: Varying::Constant(opacity) } if opacity >= 1.0 => {
            (Simpler::Other(nested), "an opacity of 1 is no mask")
        }
        BsdfKind::Mask { nested, opacity: Varying::Constant(opacity) }
            if opacity <= 0.0 && !has_inside(bsdfs, nested) =>
        {
            (Simpler::Kind(BsdfKind::Null), "an opacity of 0 leaves nothing")
        }
        BsdfKind::Blend { first, weight: Varying::Constant(weight), .. } if weight <= 0.0 => {
            (Simpler::Other(first), "a blend of weight 0 is its first bsdf")
        }
        BsdfKind::Blend { second, weight: Varying::Constant(weight), .. } if weight >= 1.0 => {
            (Simpler::Other(second), "a blend of weight 1 is its second bsdf")
        }
        BsdfKind::Perturbed { nested, normal: NormalSource::Bump { height, .. }, .. }
            if constants.colour(height).is_some() =>
        {
            (Simpler::Other(nested), "a bump map of one height has no bumps")
        }
        _ => return None,
    })
}

/// The smooth bsdf that a rough one cannot be told from, and why.
fn smooth(bsdf: &Bsdf) -> Option<(Simpler, &'static str)> {
    let is_narrow = |facets: &Microfacets| facets.alpha_u.max(facets.alpha_v) < NARROWEST_MIRROR;
    let varies = bsdf.varying.iter().any(|(parameter, _)| is_roughness(*parameter));
    let kind = match bsdf.kind {
        BsdfKind::RoughConductor { facets, eta, k, specular_reflectance } if is_narrow(&facets) => {
            BsdfKind::Conductor { eta, k, specular_reflectance }
        }
        BsdfKind::RoughDielectric { facets, int_ior, ext_ior, specular_reflectance, specular_transmittance }
            if is_narrow(&facets) =>
        {
            BsdfKind::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance }
        }
        _ => return None,
    };
    (!varies).then_some((Simpler::Kind(kind), "its roughness is less than directions can tell: it is a mirror"))
}

fn is_roughness(parameter: Parameter) -> bool {
    matches!(parameter, Parameter::AlphaU | Parameter::AlphaV)
}

fn without_roughness(varying: &[(Parameter, TextureId)]) -> Vec<(Parameter, TextureId)> {
    varying.iter().copied().filter(|(parameter, _)| !is_roughness(*parameter)).collect()
}

/// Whether a bsdf is the border of something that absorbs.
fn has_inside(bsdfs: &[Bsdf], id: BsdfId) -> bool {
    let bsdf = &bsdfs[id.0];
    let own = matches!(bsdf.kind, BsdfKind::Gltf(gltf) if gltf.transmission > 0.0 && gltf.volume.is_some());
    own || bsdf.parts().into_iter().any(|part| has_inside(bsdfs, part))
}

/// Whether a bsdf lets everything straight through.
pub(super) fn is_nothing(bsdfs: &[Bsdf], id: BsdfId) -> bool {
    matches!(bsdfs[id.0].kind, BsdfKind::Null)
}
