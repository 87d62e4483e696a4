//! The tree of nodes: where each is, and which of them the scene shows.

use super::accessors::Purpose;
use super::model::Model;
use crate::error::Result;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::Node;
use serde::Deserialize;

/// Where the nodes are.
pub(super) struct Nodes {
    /// From each node's space to the world's.
    pub(super) to_world: Vec<DAffine3>,
    /// Those of the scene, parents before their children.
    pub(super) shown: Vec<usize>,
}

impl Nodes {
    /// Checks that nodes are trees, and puts them into their places.
    pub(super) fn new(model: &Model) -> Result<Self> {
        let (parents, roots) = parents(model)?;
        let all = &model.root.nodes;
        let mut to_world = vec![DAffine3::IDENTITY; all.len()];
        let placed = below(model, &roots);
        if placed.len() < all.len() {
            let mut is_placed = vec![false; all.len()];
            placed.iter().for_each(|&node| is_placed[node] = true);
            let looped = is_placed.iter().position(|placed| !placed).unwrap_or(0);
            return Err(model.error(&format!("nodes[{looped}]"), "the node is below itself"));
        }
        for node in placed {
            let place = format!("nodes[{node}]");
            let own = local(model, &all[node], &place)?;
            to_world[node] = parents[node].map_or(own, |parent| to_world[parent] * own);
            if !to_world[node].is_finite() {
                return Err(model.error(&place, "it is where numbers end: its place is not finite"));
            }
        }
        let shown = below(model, &scene_roots(model, &roots, &parents)?);
        Ok(Self { to_world, shown })
    }
}

/// The parent of each node, and the nodes that have none.
fn parents(model: &Model) -> Result<(Vec<Option<usize>>, Vec<usize>)> {
    let all = &model.root.nodes;
    let mut parents = vec![None; all.len()];
    for (parent, node) in all.iter().enumerate() {
        let place = format!("nodes[{parent}].children");
        for child in node.children.iter().flatten().map(|child| child.value()) {
            model.get(all, child, "nodes", &place)?;
            if let Some(other) = parents[child].replace(parent) {
                let message = format!("nodes[{child}] is in two places: below nodes[{other}], too");
                return Err(model.error(&place, message));
            }
        }
    }
    let roots = (0..all.len()).filter(|&node| parents[node].is_none()).collect();
    Ok((parents, roots))
}

/// Some nodes and all below them, parents first. Every node must have one parent at most.
fn below(model: &Model, roots: &[usize]) -> Vec<usize> {
    let (mut found, mut waiting) = (Vec::new(), roots.to_vec());
    waiting.reverse();
    while let Some(node) = waiting.pop() {
        found.push(node);
        waiting.extend(model.root.nodes[node].children.iter().flatten().rev().map(|child| child.value()));
    }
    found
}

/// The roots of the file's scene: that which it says is shown, or its first; all nodes where it has none.
fn scene_roots(model: &Model, roots: &[usize], parents: &[Option<usize>]) -> Result<Vec<usize>> {
    let root = &model.root;
    let number = match root.scene {
        Some(scene) => scene.value(),
        None if root.scenes.is_empty() => return Ok(roots.to_vec()),
        None => 0,
    };
    let scene = model.get(&root.scenes, number, "scenes", "scene")?;
    let place = format!("scenes[{number}].nodes");
    let mut found: Vec<usize> = Vec::new();
    let mut is_found = vec![false; root.nodes.len()];
    for node in scene.nodes.iter().map(|node| node.value()) {
        model.get(&root.nodes, node, "nodes", &place)?;
        if let Some(parent) = parents[node] {
            let message = format!("nodes[{node}] is in two places: below nodes[{parent}], too");
            return Err(model.error(&place, message));
        }
        if std::mem::replace(&mut is_found[node], true) {
            return Err(model.error(&place, format!("nodes[{node}] is in the scene twice")));
        }
        found.push(node);
    }
    Ok(found)
}

/// From a node's space to its parent's.
fn local(model: &Model, node: &Node, place: &str) -> Result<DAffine3> {
    if let Some(matrix) = node.matrix {
        let m = matrix.map(f64::from);
        if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
            return Err(model.error(place, "the last row of its matrix must be 0 0 0 1"));
        }
        return Ok(DAffine3::from_mat4(DMat4::from_cols_array(&m)));
    }
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let rotation = node.rotation.unwrap_or_default().0.map(f64::from);
    Ok(DAffine3::from_scale_rotation_translation(
        node.scale.map_or(DVec3::ONE, vector),
        unit_rotation(model, rotation, place)?,
        node.translation.map_or(DVec3::ZERO, vector),
    ))
}

fn unit_rotation(model: &Model, xyzw: [f64; 4], place: &str) -> Result<DQuat> {
    let length2 = DQuat::from_array(xyzw).length_squared();
    if !(length2 > 0.0 && length2.is_finite()) {
        return Err(model.error(place, "its rotation must be neither zero nor infinite"));
    }
    Ok(DQuat::from_array(xyzw).normalize())
}

/// The attributes of `EXT_mesh_gpu_instancing`.
#[derive(Deserialize)]
struct Instancing {
    attributes: InstanceAttributes,
}

#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
struct InstanceAttributes {
    translation: Option<usize>,
    rotation: Option<usize>,
    scale: Option<usize>,
}

impl Nodes {
    /// Where the mesh of a node stands: where the node is, or all around it by `EXT_mesh_gpu_instancing`.
    pub(super) fn stands(&self, model: &Model, node: usize) -> Result<Vec<DAffine3>> {
        const NAME: &str = "EXT_mesh_gpu_instancing";
        let extensions = model.root.nodes[node].extensions.as_ref();
        let Some(value) = extensions.and_then(|e| e.others.get(NAME)) else {
            return Ok(vec![self.to_world[node]]);
        };
        let place = format!("nodes[{node}].extensions.{NAME}");
        let Instancing { attributes: InstanceAttributes { translation, rotation, scale } } =
            Deserialize::deserialize(value).map_err(|e| model.error(&place, format!("it is not understood: {e}")))?;
        let counts = [translation, rotation, scale].into_iter().flatten().map(|index| model.count(index, &place));
        let counts = counts.collect::<Result<Vec<usize>>>()?;
        let count = counts.first().copied().unwrap_or(0);
        if counts.iter().any(|&other| other != count) {
            return Err(model.error(&place, "its attributes must be of the same count"));
        }
        let vectors = |index: Option<usize>, default: DVec3| -> Result<Vec<DVec3>> {
            let Some(index) = index else { return Ok(vec![default; count]) };
            Ok(model.numbers(index, &place, Purpose::Measures)?.into_iter().map(DVec3::from_array).collect())
        };
        let (moved, scaled) = (vectors(translation, DVec3::ZERO)?, vectors(scale, DVec3::ONE)?);
        let turned = match rotation {
            Some(index) => model.numbers(index, &place, Purpose::Measures)?,
            None => vec![[0.0, 0.0, 0.0, 1.0]; count],
        };
        let each = moved.into_iter().zip(turned).zip(scaled);
        each.map(|((translation, rotation), scale)| {
            let rotation = unit_rotation(model, rotation, &place)?;
            Ok(self.to_world[node] * DAffine3::from_scale_rotation_translation(scale, rotation, translation))
        })
        .collect()
    }
}
