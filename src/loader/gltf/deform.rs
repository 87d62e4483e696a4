//! Meshes in their pose at rest: morph targets by their default weights, then skins.

use super::accessors::Purpose;
use super::model::Model;
use super::nodes::Nodes;
use crate::description::Mesh;
use crate::error::Result;
use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

/// What bends a mesh.
pub(super) struct Pose {
    /// How much each morph target counts.
    pub(super) weights: Vec<f64>,
    /// For each joint the way from the mesh at rest in its space to the world; without a skin `None`.
    pub(super) joints: Option<Vec<DAffine3>>,
}

impl Pose {
    /// The pose of `meshes[mesh]` where a node shows it.
    pub(super) fn of(model: &Model, nodes: &Nodes, node: usize, mesh: usize) -> Result<Self> {
        let shown = &model.root.nodes[node];
        let weights = shown.weights.as_ref().or(model.root.meshes[mesh].weights.as_ref());
        let weights: Vec<f64> = weights.into_iter().flatten().copied().map(f64::from).collect();
        if weights.iter().any(|w| !w.is_finite()) {
            return Err(model.error(&format!("nodes[{node}]"), "a weight of its mesh is not finite"));
        }
        let joints = match shown.skin {
            Some(skin) => Some(joints(model, nodes, skin.value(), &format!("nodes[{node}].skin"))?),
            None => None,
        };
        Ok(Self { weights, joints })
    }

    /// Whether its joints turn the mesh inside out.
    pub(super) fn mirrors(&self) -> bool {
        self.joints
            .as_ref()
            .is_some_and(|joints| !joints.is_empty() && joints.iter().all(|joint| joint.matrix3.determinant() < 0.0))
    }
}

/// For each joint of a skin the way from the mesh's space to the world.
fn joints(model: &Model, nodes: &Nodes, index: usize, place: &str) -> Result<Vec<DAffine3>> {
    let skin = model.get(&model.root.skins, index, "skins", place)?;
    let place = format!("skins[{index}]");
    let mut joints = Vec::with_capacity(skin.joints.len());
    for joint in skin.joints.iter().map(|joint| joint.value()) {
        joints.push(*model.get(&nodes.to_world, joint, "nodes", &format!("{place}.joints"))?);
    }
    if let Some(accessor) = skin.inverse_bind_matrices {
        let place = format!("{place}.inverseBindMatrices");
        let inverse: Vec<[f64; 16]> = model.numbers(accessor.value(), &place, Purpose::Measures)?;
        if inverse.len() < joints.len() {
            let message = format!("{} matrices are not enough for {} joints", inverse.len(), joints.len());
            return Err(model.error(&place, message));
        }
        for (joint, inverse) in joints.iter_mut().zip(&inverse) {
            *joint *= DAffine3::from_mat4(DMat4::from_cols_array(inverse));
        }
    }
    Ok(joints)
}

/// Bends a mesh that has been read from `primitive`; its tangents are those of the file, if any.
pub(super) fn bend(model: &Model, primitive: &Primitive, place: &str, pose: &Pose, mesh: &mut Mesh) -> Result<()> {
    morph(model, primitive, place, &pose.weights, mesh)?;
    if let Some(joints) = &pose.joints {
        skin(model, primitive, place, joints, mesh)?;
    }
    let bent = mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite());
    if bent && mesh.tangents.iter().all(|t| t.is_finite()) {
        return Ok(());
    }
    Err(model.error(place, "its pose is where numbers end: a vertex is not finite"))
}

fn morph(model: &Model, primitive: &Primitive, place: &str, weights: &[f64], mesh: &mut Mesh) -> Result<()> {
    let targets = primitive.targets.iter().flatten().enumerate();
    for ((number, target), &weight) in targets.zip(weights).filter(|(_, weight)| **weight != 0.0) {
        let place = format!("{place}.targets[{number}]");
        let vertices = mesh.positions.len();
        let read = |accessor: usize| -> Result<Vec<DVec3>> {
            let count = model.count(accessor, &place)?;
            if count != vertices {
                return Err(model.error(&place, format!("it moves {count} vertices, but there are {vertices}")));
            }
            Ok(model.numbers(accessor, &place, Purpose::Measures)?.into_iter().map(DVec3::from_array).collect())
        };
        if let Some(accessor) = target.positions {
            mesh.positions.iter_mut().zip(read(accessor.value())?).for_each(|(p, d)| *p += d * weight);
        }
        if let Some(accessor) = target.normals.filter(|_| !mesh.normals.is_empty()) {
            mesh.normals.iter_mut().zip(read(accessor.value())?).for_each(|(n, d)| *n += d * weight);
        }
        if let Some(accessor) = target.tangents.filter(|_| !mesh.tangents.is_empty()) {
            mesh.tangents.iter_mut().zip(read(accessor.value())?).for_each(|(t, d)| *t += (d * weight).extend(0.0));
        }
    }
    Ok(())
}

fn skin(model: &Model, primitive: &Primitive, place: &str, joints: &[DAffine3], mesh: &mut Mesh) -> Result<()> {
    let vertices = mesh.positions.len();
    // Sums of the joints' maps by their weights, and the sums of those.
    let mut maps = vec![([0.0; 12], 0.0); vertices];
    for set in 0.. {
        let of = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|accessor| accessor.value());
        let (Some(indices), Some(weights)) = (of(Semantic::Joints(set)), of(Semantic::Weights(set))) else {
            if set == 0 {
                return Err(model.error(place, "a mesh with a skin needs JOINTS_0 and WEIGHTS_0"));
            }
            break;
        };
        for accessor in [indices, weights] {
            let count = model.count(accessor, place)?;
            if count != vertices {
                let message = format!("its joints are those of {count} vertices, but it has {vertices}");
                return Err(model.error(place, message));
            }
        }
        let indices: Vec<[f64; 4]> = model.numbers(indices, place, Purpose::Joints)?;
        let weights: Vec<[f64; 4]> = model.numbers(weights, place, Purpose::Measures)?;
        for ((indices, weights), (map, total)) in indices.iter().zip(weights).zip(&mut maps) {
            for (&index, weight) in indices.iter().zip(weights).filter(|(_, weight)| *weight != 0.0) {
                let joint = joints.get(index as usize);
                let joint = joint.ok_or_else(|| model.error(place, format!("its skin has no joint {index}")))?;
                map.iter_mut().zip(joint.to_cols_array()).for_each(|(sum, v)| *sum += v * weight);
                *total += weight;
            }
        }
    }
    let normal_maps: Vec<(DAffine3, DMat3)> = maps
        .into_iter()
        .map(|(map, total)| {
            let scale = if total > 0.0 { 1.0 / total } else { 1.0 };
            let map = DAffine3::from_cols_array(&map.map(|v| v * scale));
            (map, cofactors(map.matrix3))
        })
        .collect();
    for (index, (map, normal_map)) in normal_maps.iter().enumerate() {
        mesh.positions[index] = map.transform_point3(mesh.positions[index]);
        if let Some(n) = mesh.normals.get_mut(index) {
            *n = *normal_map * *n;
        }
        if let Some(t) = mesh.tangents.get_mut(index) {
            *t = DVec4::from((map.matrix3 * t.truncate(), t.w));
        }
    }
    Ok(())
}

/// The inverse transpose of a matrix but for a positive factor; it moves normals, also where there is no inverse.
fn cofactors(m: DMat3) -> DMat3 {
    let c = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if m.determinant() < 0.0 { -c } else { c }
}
