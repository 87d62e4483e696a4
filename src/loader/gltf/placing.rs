//! Meshes in their places: shapes, or groups and their instances where sharing geometry saves more than it costs.

use super::deform::Pose;
use super::materials::{Look, Materials};
use super::model::Model;
use super::nodes::Nodes;
use super::primitives::{self, attribute};
use crate::description::{Geometry, Group, GroupId, Instance, Mesh, Shape};
use crate::error::Result;
use glam::{DAffine3, DVec3};
use gltf::json::mesh::Semantic;
use std::collections::HashMap;
use std::sync::Arc;

/// Triangles that must be saved for a mesh to become a group. Reason: a ray enters a group by a second tree, in double
/// precision; beside that, copies of less than this are cheap.
const WORTH_SHARING: usize = 4096;

/// What the file's nodes put into the scene.
#[derive(Default)]
pub(super) struct Placed {
    pub(super) shapes: Vec<Shape>,
    pub(super) groups: Vec<Group>,
    pub(super) instances: Vec<Instance>,
}

/// A mesh, in all places where it is the same mesh.
struct Use {
    mesh: usize,
    /// A node that shows it.
    node: usize,
    /// Whether its places turn it inside out.
    mirrored: bool,
    places: Vec<DAffine3>,
}

/// A primitive of a mesh.
struct Part {
    name: String,
    mesh: Arc<Mesh>,
    look: Look,
}

/// Reads all meshes that are shown.
pub(super) fn read(model: &Model, nodes: &Nodes, materials: &mut Materials<'_>) -> Result<Placed> {
    let mut placed = Placed::default();
    for group in uses(model, nodes)? {
        let parts = parts(model, nodes, materials, &group)?;
        placed.add(model, parts, &group.places)?;
    }
    Ok(placed)
}

/// The meshes that are shown, in the order in which they first are.
fn uses(model: &Model, nodes: &Nodes) -> Result<Vec<Use>> {
    let mut uses: Vec<Use> = Vec::new();
    let mut known: HashMap<(usize, bool, Option<usize>), usize> = HashMap::new();
    for &node in &nodes.shown {
        let shown = &model.root.nodes[node];
        let Some(mesh) = shown.mesh.map(|mesh| mesh.value()) else { continue };
        model.get(&model.root.meshes, mesh, "meshes", &format!("nodes[{node}]"))?;
        // A skin puts its mesh where the joints are.
        let places = if shown.skin.is_some() { vec![DAffine3::IDENTITY] } else { nodes.stands(model, node)? };
        let own = (shown.skin.is_some() || shown.weights.is_some()).then_some(node);
        for place in places {
            let determinant = place.matrix3.determinant();
            if determinant == 0.0 || !place.matrix3.inverse().is_finite() {
                model.warn(&format!("nodes[{node}]"), "its scale makes its mesh flat: it is left out");
                continue;
            }
            let mirrored = determinant < 0.0;
            let index = *known.entry((mesh, mirrored, own)).or_insert_with(|| {
                uses.push(Use { mesh, node, mirrored, places: Vec::new() });
                uses.len() - 1
            });
            uses[index].places.push(place);
        }
    }
    Ok(uses)
}

/// The primitives of a mesh that can be seen.
fn parts(model: &Model, nodes: &Nodes, materials: &mut Materials<'_>, group: &Use) -> Result<Vec<Part>> {
    let index = group.mesh;
    let mesh = &model.root.meshes[index];
    let pose = Pose::of(model, nodes, group.node, index)?;
    let name = mesh.name.clone().unwrap_or_else(|| format!("meshes[{index}]"));
    let (mut parts, mesh_parts) = (Vec::new(), mesh.primitives.len());
    for (number, primitive) in mesh.primitives.iter().enumerate() {
        let place = format!("meshes[{index}].primitives[{number}]");
        let colors = attribute(primitive, Semantic::Colors(0)).is_some();
        let look = materials.look(primitive.material.map(|m| m.value()), colors, &place)?;
        if look.bsdf.is_none() {
            continue;
        }
        let mirrored = group.mirrored != pose.mirrors();
        if let Some(mesh) = primitives::read(model, primitive, &place, &look.wanted, &pose, mirrored)? {
            let name = if mesh_parts > 1 { format!("{name}[{number}]") } else { name.clone() };
            model.files.memory().keep(mesh.memory_bytes()).map_err(|m| model.error(&place, format!("it {m}")))?;
            parts.push(Part { name, mesh: Arc::new(mesh), look });
        }
    }
    Ok(parts)
}

impl Placed {
    fn add(&mut self, model: &Model, parts: Vec<Part>, places: &[DAffine3]) -> Result<()> {
        let is_lit = |part: &Part| part.look.emission.is_some();
        let triangles: usize = parts.iter().filter(|part| !is_lit(part)).map(|part| part.mesh.faces.len()).sum();
        let shared = triangles.saturating_mul(places.len() - 1) >= WORTH_SHARING;
        let shape = |part: &Part, to_world: DAffine3| {
            Some(Shape {
                at: model.at.clone(),
                name: part.name.clone(),
                geometry: Geometry::Mesh(part.mesh.clone()),
                to_world,
                flip_normals: false,
                bsdf: part.look.bsdf?,
                emission: part.look.emission,
            })
        };
        // What emits cannot be in a group.
        let (inside, alone): (Vec<&Part>, Vec<&Part>) = parts.iter().partition(|part| shared && !is_lit(part));
        // A file names a place by some bytes, and each place of what stands alone is a shape, whose points are all looked at.
        let of_alone =
            |part: &&Part| (size_of::<Shape>() + part.name.len() + size_of_val(&part.mesh.positions[..])) as u64;
        let of_place = alone.iter().map(of_alone).sum::<u64>() + size_of::<Instance>() as u64;
        let bytes = of_place.saturating_mul(places.len() as u64);
        let name = parts.first().map_or("", |part| &part.name);
        model.files.memory().check(bytes).map_err(|m| model.error(name, format!("{} times, it {m}", places.len())))?;
        for &place in places {
            self.shapes.extend(alone.iter().filter_map(|part| shape(part, place)));
        }
        if inside.is_empty() {
            return Ok(());
        }
        let group = GroupId(self.groups.len());
        let name = inside[0].name.clone();
        let shapes = inside.into_iter().filter_map(|part| shape(part, DAffine3::IDENTITY)).collect();
        self.groups.push(Group { shapes });
        let instance = |&to_world: &DAffine3| Instance { at: model.at.clone(), name: name.clone(), group, to_world };
        self.instances.extend(places.iter().map(instance));
        Ok(())
    }

    /// Points around all that there is: those of shapes, and corners of the boxes around instances.
    pub(super) fn points(&self) -> Vec<DVec3> {
        fn of(shape: &Shape) -> impl Iterator<Item = DVec3> {
            let positions = match &shape.geometry {
                Geometry::Mesh(mesh) => &mesh.positions[..],
                _ => &[],
            };
            positions.iter().map(|&p| shape.to_world.transform_point3(p))
        }
        let mut points: Vec<DVec3> = self.shapes.iter().flat_map(of).collect();
        let corners_of = |group: &Group| {
            let inside = group.shapes.iter().flat_map(of);
            let (low, high) =
                inside.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
            let corner = |mask: usize, axis: usize| if mask >> axis & 1 == 0 { low[axis] } else { high[axis] };
            [0, 1, 2, 3, 4, 5, 6, 7].map(|mask| DVec3::new(corner(mask, 0), corner(mask, 1), corner(mask, 2)))
        };
        let corners: Vec<[DVec3; 8]> = self.groups.iter().map(corners_of).collect();
        for Instance { group, to_world, .. } in &self.instances {
            points.extend(corners[group.0].map(|p| to_world.transform_point3(p)));
        }
        points
    }
}
