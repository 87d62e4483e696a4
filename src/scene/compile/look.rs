//! Materials and lights.

use crate::bsdf::{Bsdf, Dielectric, Diffuse, Material, RoughConductor};
use crate::description::{BsdfId, BsdfKind, LightKind, SceneDescription};
use crate::error::{Error, Result, Span};
use crate::light::{AreaLight, ConstantLight, Light};
use crate::scene::Appearance;
use crate::shape::Shape;
use crate::spectrum::Rgb;
use std::collections::HashMap;

/// What shapes look like, and every light.
#[derive(Default)]
pub(super) struct Look {
    pub(super) appearances: Vec<Appearance>,
    pub(super) materials: Vec<Material>,
    pub(super) lights: Vec<Light>,
    indices: HashMap<BsdfId, u32>,
}

/// Compiles what the kept shapes look like (`kept[i]` is the description of `shapes[i]`), and every light.
pub(super) fn compile(
    description: &SceneDescription,
    shapes: &[Shape],
    kept: &[usize],
    warnings: &mut Vec<String>,
) -> Result<Look> {
    let mut look = Look::default();
    for (index, (shape, &described)) in (0u32..).zip(shapes.iter().zip(kept)) {
        let described = &description.shapes[described];
        let material = look.material(description, described.bsdf)?;
        let light = match described.emission {
            Some(radiance) if !radiance.is_black() => {
                check_radiance(&described.at, radiance)?;
                let light = AreaLight::new(index, shape, radiance);
                if light.is_none() {
                    warnings.push(format!("{}: '{}' is too small to shed light", described.at, described.name));
                }
                light.map(|l| look.add_light(Light::Area(l)))
            }
            _ => None,
        };
        look.appearances.push(Appearance { material, light });
    }
    for light in &description.lights {
        let LightKind::Constant { radiance } = light.kind;
        check_radiance(&light.at, radiance)?;
        if !radiance.is_black() {
            look.add_light(Light::Constant(ConstantLight { radiance }));
        }
    }
    Ok(look)
}

impl Look {
    fn add_light(&mut self, light: Light) -> u32 {
        self.lights.push(light);
        (self.lights.len() - 1) as u32
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
        BsdfKind::RoughConductor { alpha, eta, k, specular_reflectance } => {
            Bsdf::RoughConductor(RoughConductor::new(alpha as f32, eta, k, specular_reflectance))
        }
        BsdfKind::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            Bsdf::Dielectric(Dielectric::new((int_ior / ext_ior) as f32, specular_reflectance, specular_transmittance))
        }
        BsdfKind::TwoSided { .. } => return Err(Error::scene(at, "two-sided bsdfs cannot be nested")),
    })
}

fn check_radiance(at: &Span, radiance: Rgb) -> Result<()> {
    if radiance.is_finite() && radiance.0.min_element() >= 0.0 {
        Ok(())
    } else {
        let [r, g, b] = radiance.to_array();
        Err(Error::scene(at, format!("a radiance must be finite and not negative, but this is ({r}, {g}, {b})")))
    }
}
