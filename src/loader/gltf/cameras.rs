//! Cameras, in the order of the nodes that carry them. A glTF camera looks along −z and has +x at its right; that is the
//! description's, turned half round +y.

use super::model::Model;
use super::nodes::Nodes;
use crate::description::{Camera, FieldOfView, Film, FovAxis, Projection};
use crate::error::{Error, Result};
use crate::loader::framing;
use glam::{DAffine3, DMat3, DVec3};
use gltf::json::camera::{Orthographic, Perspective, Type};
use gltf::json::validation::Checked;

/// Width over height of a perspective camera that says nothing of it.
const ASPECT: f64 = framing::SIZE.0 as f64 / framing::SIZE.1 as f64;

/// The near plane of a camera that has it in itself, as a part of the distance of the far plane: not zero, but nothing is cut
/// off that single precision tells from it.
const LEAST_NEAR: f64 = 1e-7;

/// The cameras of the nodes that are shown.
pub(super) fn read(model: &Model, nodes: &Nodes) -> Result<Vec<Camera>> {
    let mut shown: Vec<usize> = nodes.shown.clone();
    shown.sort_unstable();
    let mut cameras = Vec::new();
    for node in shown {
        let Some(index) = model.root.nodes[node].camera.map(|camera| camera.value()) else { continue };
        let camera = model.get(&model.root.cameras, index, "cameras", &format!("nodes[{node}]"))?;
        let place = format!("cameras[{index}]");
        let axes = axes(&nodes.to_world[node].matrix3)
            .ok_or_else(|| model.error(&format!("nodes[{node}]"), "its place gives its camera no direction"))?;
        let seen = match camera.type_ {
            Checked::Valid(Type::Perspective) => {
                let own = camera.perspective.as_ref();
                perspective(model, own.ok_or_else(|| model.error(&place, "it needs its 'perspective'"))?, &place)?
            }
            Checked::Valid(Type::Orthographic) => {
                let own = camera.orthographic.as_ref();
                orthographic(model, own.ok_or_else(|| model.error(&place, "it needs its 'orthographic'"))?, &place)?
            }
            Checked::Invalid => {
                return Err(model.error(&place, "its type is not one of perspective, orthographic"));
            }
        };
        let matrix3 = axes * DMat3::from_diagonal(DVec3::new(seen.half_width, seen.half_width, 1.0));
        cameras.push(Camera {
            at: model.at.clone(),
            to_world: DAffine3 { matrix3, translation: nodes.to_world[node].translation },
            projection: seen.projection,
            near_clip: seen.clip.0,
            far_clip: seen.clip.1,
            film: framing::film(&model.at, size(seen.aspect)),
            sampler: framing::SAMPLER,
        });
    }
    Ok(cameras)
}

/// How a camera sees.
struct Seen {
    projection: Projection,
    /// Nearest and farthest distance.
    clip: (f64, f64),
    /// Width over height.
    aspect: f64,
    /// Half the width of what it sees in parallel; 1 where it sees in perspective.
    half_width: f64,
}

/// The camera's axes: left, up, forward. A scale, or a mirror, does not count.
fn axes(node: &DMat3) -> Option<DMat3> {
    let forward = (-node.z_axis).try_normalize()?;
    let up = (node.y_axis - forward * forward.dot(node.y_axis)).try_normalize()?;
    Some(DMat3::from_cols(up.cross(forward), up, forward))
}

fn perspective(model: &Model, camera: &Perspective, place: &str) -> Result<Seen> {
    let (yfov, near) = (f64::from(camera.yfov), f64::from(camera.znear));
    let far = camera.zfar.map_or(f64::INFINITY, f64::from);
    let aspect = camera.aspect_ratio.map_or(ASPECT, f64::from);
    let degrees = yfov.to_degrees();
    if !(degrees > 0.0 && degrees < 180.0) {
        return Err(model.error(place, format!("expected a yfov between 0 and π, not {yfov}")));
    }
    if !(aspect > 0.0 && aspect.is_finite()) {
        return Err(model.error(place, format!("expected an aspectRatio above 0, not {aspect}")));
    }
    Ok(Seen {
        projection: Projection::Perspective {
            fov: FieldOfView { degrees, axis: FovAxis::Y },
            principal_point_offset: (0.0, 0.0),
        },
        clip: clip(near, far).ok_or_else(|| clip_error(model, place))?,
        aspect,
        half_width: 1.0,
    })
}

fn orthographic(model: &Model, camera: &Orthographic, place: &str) -> Result<Seen> {
    let (xmag, ymag) = (f64::from(camera.xmag.abs()), f64::from(camera.ymag.abs()));
    let (near, far) = (f64::from(camera.znear), f64::from(camera.zfar));
    if !(xmag > 0.0 && ymag > 0.0 && xmag.is_finite() && ymag.is_finite()) {
        return Err(model.error(place, "its xmag and ymag must be neither zero nor infinite"));
    }
    let clip = if near >= 0.0 { clip(near.max(LEAST_NEAR * far), far) } else { None };
    Ok(Seen {
        projection: Projection::Orthographic,
        clip: clip.ok_or_else(|| clip_error(model, place))?,
        aspect: xmag / ymag,
        half_width: xmag,
    })
}

fn clip(near: f64, far: f64) -> Option<(f64, f64)> {
    (near > 0.0 && near < far && near.is_finite()).then_some((near, far))
}

fn clip_error(model: &Model, place: &str) -> Error {
    model.error(place, "expected 0 < znear < zfar (0 ≤ znear where it is orthographic)")
}

/// Pixels of a film of about this width over height.
fn size(aspect: f64) -> (u32, u32) {
    let long = f64::from(framing::SIZE.0);
    let pixels = |v: f64| v.round().clamp(1.0, f64::from(Film::MAX_SIDE)) as u32;
    if aspect >= 1.0 { (pixels(long), pixels(long / aspect)) } else { (pixels(long * aspect), pixels(long)) }
}
