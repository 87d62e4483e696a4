//! Materials and lights.

use super::geometry::Compiled;
use super::tangents;
use crate::bsdf::{
    Bsdf, Conductor, Dielectric, Diffuse, Distribution, Material, Microfacets, RoughConductor, RoughDielectric,
};
use crate::description::{self, BsdfId, BsdfKind, LightKind, MicrofacetDistribution, SceneDescription};
use crate::error::{Error, Result, Span};
use crate::light::{AreaLight, ConstantLight, Light, PointLight};
use crate::math::bounds::DBounds;
use crate::scene::Appearance;
use crate::scene::space::ToScene;
use crate::shape::Shape;
use crate::shape::tangent::TangentField;
use crate::shape::touch::touching;
use crate::spectrum::Rgb;
use glam::DVec3;
use std::collections::HashMap;

/// Where the scene is.
pub(super) struct Place {
    /// The box around every surface, in the file's world space.
    pub(super) bounds: DBounds,
    /// From there to the compiled scene's space.
    pub(super) to_scene: ToScene,
}

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

/// Compiles what the kept shapes look like, and every light.
pub(super) fn compile(
    description: &SceneDescription,
    Compiled { shapes, kept }: &Compiled<'_>,
    place: &Place,
    warnings: &mut Vec<String>,
) -> Result<Look> {
    let (mut look, mut fields) = (Look::default(), tangents::Fields::default());
    for (index, (shape, &described)) in (0u32..).zip(shapes.iter().zip(kept)) {
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
        let tangents = needs_tangents.then(|| fields.of(described, shape)).map(|field| look.add_tangents(field));
        let is_emitter = described.emission.is_some();
        look.appearances.push(Appearance { material, light, is_emitter, tangents });
    }
    for light in &description.lights {
        let (kind, colour, compiled) = match light.kind {
            LightKind::Constant { radiance } => {
                check_colour(&light.at, "a radiance", radiance)?;
                ("constant", radiance, Light::Constant(ConstantLight { radiance }))
            }
            LightKind::Point { position, intensity } => {
                check_colour(&light.at, "an intensity", intensity)?;
                ("point", intensity, Light::Point(point_light(&light.at, position, intensity, place)?))
            }
        };
        if !colour.is_black() {
            look.add_light(compiled, format!("{kind} ({})", light.at));
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

    /// Tells the point lights which surfaces they hang on.
    fn hang_up(&mut self, shapes: &[Shape]) {
        let points =
            || self.lights.iter().filter_map(|l| if let Light::Point(p) = l { Some(p.position) } else { None });
        let mut touching = touching(shapes, &points().collect::<Vec<_>>()).into_iter();
        for light in &mut self.lights {
            if let Light::Point(light) = light {
                light.touching = touching.next().unwrap_or_default();
            }
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

fn point_light(at: &Span, position: DVec3, intensity: Rgb, place: &Place) -> Result<PointLight> {
    let (to_scene, bounds) = (&place.to_scene, &place.bounds);
    let beside = (bounds.min - position).max(position - bounds.max).max(DVec3::ZERO);
    let light = PointLight {
        position: to_scene.point(position),
        // The unit is a power of two: its square changes no bit.
        intensity: intensity.map(|c| (f64::from(c) * to_scene.unit * to_scene.unit) as f32),
        clearance: beside.length() * to_scene.unit,
        touching: Vec::new(),
    };
    if !light.position.as_vec3().is_finite() {
        return Err(Error::scene(at, "the light is too far away for the size of the scene"));
    }
    let fits = |c: f32, of: f32| c.is_normal() || of == 0.0;
    let [r, g, b] = light.intensity.to_array();
    let [r0, g0, b0] = intensity.to_array();
    if !(fits(r, r0) && fits(g, g0) && fits(b, b0)) {
        let message = format!("the light's intensity ({r0}, {g0}, {b0}) is out of proportion to the size of the scene");
        return Err(Error::scene(at, message));
    }
    Ok(light)
}

fn check_colour(at: &Span, what: &str, colour: Rgb) -> Result<()> {
    if colour.is_finite() && colour.0.min_element() >= 0.0 {
        Ok(())
    } else {
        let [r, g, b] = colour.to_array();
        Err(Error::scene(at, format!("{what} must be finite and not negative, but this is ({r}, {g}, {b})")))
    }
}
