//! What shapes look like: materials, and lights on surfaces and apart from them.

use super::geometry::Compiled;
use super::lights::{self, Place};
use super::material::Materials;
use super::{mesh_values, tangents, uvs};
use crate::description::SceneDescription;
use crate::error::Result;
use crate::light::{Light, PointLight};
use crate::scene::Appearance;
use crate::shape::Shape;
use crate::shape::tangent::TangentField;
use crate::shape::touch::touching;
use crate::shape::uv::UvField;
use crate::texture::MeshValues;
use std::sync::Arc;

/// What shapes look like, and every light.
#[derive(Default)]
pub(super) struct Look {
    pub(super) appearances: Vec<Appearance>,
    pub(super) materials: Materials,
    pub(super) lights: Vec<Light>,
    pub(super) tangents: Vec<TangentField>,
    pub(super) uvs: Vec<UvField>,
    pub(super) mesh_values: Vec<Arc<MeshValues>>,
    pub(super) light_names: Vec<String>,
}

/// Compiles what the kept shapes look like, and every light.
pub(super) fn compile(
    description: &SceneDescription,
    Compiled { shapes, kept, spaces }: &Compiled<'_>,
    place: &Place,
    warnings: &mut Vec<String>,
) -> Result<Look> {
    let (mut look, mut fields, mut uv_fields) = (Look::default(), tangents::Fields::default(), uvs::Fields::default());
    let mut makers = mesh_values::Makers::new(description);
    for (index, ((shape, &described), space)) in (0u32..).zip(shapes.iter().zip(kept).zip(spaces)) {
        let material = look.materials.index(description, described.bsdf, (&place.textures, place.to_scene.unit))?;
        let values = makers.of(described, shape)?;
        let light = match described.emission {
            Some(emission) if !emission.radiance.is_black() => {
                let coat = (emission.texture.map(|_| uv_fields.of(described, shape, space)), values.clone());
                let light = lights::area((index, shape), described, emission, coat, place, warnings)?;
                let name = format!("'{}' ({})", described.name, described.at);
                light.map(|light| look.add_light(light, name))
            }
            _ => None,
        };
        let needs = description.bsdfs[described.bsdf.0].needs(&description.bsdfs, &description.textures);
        // Where texture coordinates are looked up anyway, they tell the tangents, too.
        let along_uvs = needs.uvs && needs.tangents;
        let tangents = (needs.tangents && !along_uvs).then(|| add(&mut look.tangents, fields.of(described, shape)));
        let uvs =
            (needs.uvs || description.wants_uvs).then(|| add(&mut look.uvs, uv_fields.of(described, shape, space)));
        let values = values.map(|values| add(&mut look.mesh_values, values));
        let is_emitter = described.emission.is_some();
        look.appearances.push(Appearance { material, light, is_emitter, tangents, uvs, along_uvs, values });
    }
    for light in &description.lights {
        if let Some((compiled, name)) = lights::compile(light, place, warnings)? {
            look.add_light(compiled, name);
        }
    }
    look.hang_up(shapes);
    Ok(look)
}

/// Adds an element to a table; returns its index.
fn add<T>(table: &mut Vec<T>, element: T) -> u32 {
    table.push(element);
    (table.len() - 1) as u32
}

impl Look {
    fn add_light(&mut self, light: Light, name: String) -> u32 {
        self.light_names.push(name);
        add(&mut self.lights, light)
    }

    /// Tells the lights that are points which surfaces they hang on.
    fn hang_up(&mut self, shapes: &[Shape]) {
        let mut points: Vec<&mut PointLight> = self.lights.iter_mut().filter_map(Light::as_point_mut).collect();
        let touching = touching(shapes, &points.iter().map(|p| p.position).collect::<Vec<_>>());
        for (point, touching) in points.iter_mut().zip(touching) {
            point.touching = touching;
        }
    }
}
