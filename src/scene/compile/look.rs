//! Materials and lights.

use super::lights::{self, Place, check_colour};
use super::tangents;
use crate::bsdf::{
    Bsdf, Conductor, Dielectric, Diffuse, Distribution, Material, Microfacets, RoughConductor, RoughDielectric,
};
use crate::description::{self, BsdfId, BsdfKind, MicrofacetDistribution, SceneDescription};
use crate::error::{Error, Result, Span};
use crate::light::{AreaLight, Light, PointLight};
use crate::scene::Appearance;
use crate::shape::Shape;
use crate::shape::tangent::TangentField;
use crate::shape::touch::touching;
use std::collections::HashMap;

/// What shapes look like, and every light.
#[derive(Default)]
pub(super) struct Look {
    pub(super) appearances: Vec<Appearance>,
    pub(super) materials: Vec<Material>,
    pub(super) lights: Vec<Light>,
    pub(super) tangents: Vec<TangentField>,
    pub(super) light_names: Vec<String>,
    indices: HashMap<BsdfId, u32>,
}

/// Compiles what the kept shapes look like (`kept[i]` is the description of `shapes[i]`), and every light.
pub(super) fn compile(
    description: &SceneDescription,
    shapes: &[Shape],
    kept: &[usize],
    place: &Place,
    warnings: &mut Vec<String>,
) -> Result<Look> {
    let mut look = Look::default();
    for (index, (shape, &described)) in (0u32..).zip(shapes.iter().zip(kept)) {
        let described = &description.shapes[described];
        let material = look.material(description, described.bsdf)?;
        let light = match described.emission {
            Some(radiance) if !radiance.is_black() => {
                check_colour(&described.at, "a radiance", radiance)?;
                let light = AreaLight::new(index, shape, radiance);
                if light.is_none() {
                    warnings.push(format!("{}: '{}' is too small to shed light", described.at, described.name));
                }
                let name = format!("'{}' ({})", described.name, described.at);
                light.map(|l| look.add_light(Light::Area(l), name))
            }
            _ => None,
        };
        let needs_tangents = description.bsdfs[described.bsdf.0].kind.is_anisotropic(&description.bsdfs);
        let tangents = needs_tangents.then(|| look.add_tangents(tangents::field(described, shape)));
        let is_emitter = described.emission.is_some();
        look.appearances.push(Appearance { material, light, is_emitter, tangents });
    }
    for light in &description.lights {
        if let Some((compiled, name)) = lights::compile(light, place)? {
            look.add_light(compiled, name);
        }
    }
    look.hang_up(shapes);
    Ok(look)
}

impl Look {
    fn add_light(&mut self, light: Light, name: String) -> u32 {
        self.light_names.push(name);
        self.lights.push(light);
        (self.lights.len() - 1) as u32
    }

    fn add_tangents(&mut self, field: TangentField) -> u32 {
        self.tangents.push(field);
        (self.tangents.len() - 1) as u32
    }

    /// Tells the lights that are points which surfaces they hang on.
    fn hang_up(&mut self, shapes: &[Shape]) {
        let mut points: Vec<&mut PointLight> = self.lights.iter_mut().filter_map(Light::as_point_mut).collect();
        let touching = touching(shapes, &points.iter().map(|p| p.position).collect::<Vec<_>>());
        for (point, touching) in points.iter_mut().zip(touching) {
            point.touching = touching;
        }
    }

    /// Index of the material for a bsdf of the description, compiled once.
    fn material(&mut self, description: &SceneDescription, id: BsdfId) -> Result<u32> {
        if let Some(&index) = self.indices.get(&id) {
            return Ok(index);
        }
        let bsdf = &description.bsdfs[id.0];
        let material = match &bsdf.kind {
            &BsdfKind::TwoSided { front, back } => {
                let front = one_sided(description, front, &bsdf.at)?;
                let back = one_sided(description, back, &bsdf.at)?;
                Material { front, back: Some(back) }
            }
            kind => Material { front: single(kind, &bsdf.at)?, back: None },
        };
        let index = self.materials.len() as u32;
        self.materials.push(material);
        self.indices.insert(id, index);
        Ok(index)
    }
}

/// A side of a two-sided bsdf: anything that reflects only.
fn one_sided(description: &SceneDescription, id: BsdfId, at: &Span) -> Result<Bsdf> {
    let bsdf = single(&description.bsdfs[id.0].kind, at)?;
    if bsdf.lobes().transmits {
        return Err(Error::scene(at, "a two-sided bsdf cannot have a side that transmits light"));
    }
    Ok(bsdf)
}

fn single(kind: &BsdfKind, at: &Span) -> Result<Bsdf> {
    Ok(match *kind {
        BsdfKind::Diffuse { reflectance } => Bsdf::Diffuse(Diffuse { reflectance }),
        BsdfKind::Conductor { eta, k, specular_reflectance } => {
            Bsdf::Conductor(Conductor { eta, k, reflectance: specular_reflectance })
        }
        BsdfKind::RoughConductor { facets, eta, k, specular_reflectance } => {
            Bsdf::RoughConductor(RoughConductor::new(microfacets(facets), eta, k, specular_reflectance))
        }
        BsdfKind::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            Bsdf::Dielectric(Dielectric::new((int_ior / ext_ior) as f32, specular_reflectance, specular_transmittance))
        }
        BsdfKind::RoughDielectric { facets, int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            let eta = (int_ior / ext_ior) as f32;
            RoughDielectric::bsdf(microfacets(facets), eta, specular_reflectance, specular_transmittance)
        }
        BsdfKind::TwoSided { .. } => return Err(Error::scene(at, "two-sided bsdfs cannot be nested")),
    })
}

fn microfacets(facets: description::Microfacets) -> Microfacets {
    let distribution = match facets.distribution {
        MicrofacetDistribution::Beckmann => Distribution::Beckmann,
        MicrofacetDistribution::Ggx => Distribution::Ggx,
    };
    Microfacets::new(distribution, facets.alpha_u as f32, facets.alpha_v as f32)
}
