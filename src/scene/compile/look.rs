//! What shapes look like: materials, and lights on surfaces and apart from them.

use super::geometry::Compiled;
use super::lights::{self, Place};
use super::material::Materials;
use super::{mesh_values, tangents, uvs};
use crate::bsdf::Clearness;
use crate::description::SceneDescription;
use crate::error::Result;
use crate::light::{Light, PointLight};
use crate::material::Material;
use crate::scene::Appearance;
use crate::shape::tangent::TangentField;
use crate::shape::touch::touching;
use crate::shape::uv::UvField;
use crate::shape::{Shape, TriangleMesh};
use crate::texture::MeshValues;
use glam::Vec3;
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
        let is_pane = is_pane(&look.materials.all[material as usize], shape);
        look.appearances.push(Appearance { material, light, is_emitter, tangents, uvs, along_uvs, is_pane, values });
    }
    for light in &description.lights {
        if let Some((compiled, name)) = lights::compile(light, place, warnings)? {
            look.add_light(compiled, name);
        }
    }
    look.hang_up(shapes);
    Ok(look)
}

/// See [`Appearance::is_pane`].
fn is_pane(material: &Material, shape: &Shape) -> bool {
    match (material.clearness(), shape) {
        (Clearness::Opaque, _) => false,
        (Clearness::Straight, _) => true,
        (Clearness::Bent, Shape::Mesh(mesh)) => (mesh.normals.is_empty() || mesh.is_flat()) && has_few_sides(mesh),
        (Clearness::Bent, _) => false,
    }
}

/// Whether the triangles of a mesh face so few sides that it is made of slabs: a ball, be it ever so coarse, has more.
fn has_few_sides(mesh: &TriangleMesh) -> bool {
    /// Four boxes in any directions.
    const MOST: usize = 24;
    /// Cosine of the angle between normals that are one side: a quarter of a degree.
    const SAME: f32 = 0.99999;
    let mut sides: Vec<Vec3> = Vec::new();
    (0..mesh.faces.len() as u32).all(|face| {
        let n = mesh.plane(face).n;
        if !sides.iter().any(|side| side.dot(n) > SAME) {
            sides.push(n);
        }
        sides.len() <= MOST
    })
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
