//! The lights of `KHR_lights_punctual`. Photometric units stay as they are: lux is irradiance, candela intensity, as nits of
//! what emits are radiance. Between the two angles of a spot light its intensity falls linearly with the angle, as Mitsuba's
//! does, where the extension proposes the square of a function linear in the cosine. A `range` is a hint for speed alone.

use super::model::Model;
use super::nodes::Nodes;
use crate::description::{Light, LightKind};
use crate::error::Result;
use crate::spectrum::Rgb;
use glam::DVec3;
use gltf::json::extensions::scene::khr_lights_punctual as punctual;
use gltf::json::validation::Checked;
use std::f64::consts::FRAC_PI_2;

/// The lights of the nodes that are shown.
pub(super) fn read(model: &Model, nodes: &Nodes) -> Result<Vec<Light>> {
    let all: &[punctual::Light] = model.root.as_ref();
    let mut lights = Vec::new();
    for &node in &nodes.shown {
        let extensions = model.root.nodes[node].extensions.as_ref();
        let Some(index) = extensions.and_then(|e| e.khr_lights_punctual.as_ref()).map(|l| l.light.value()) else {
            continue;
        };
        let light = model.get(all, index, "extensions.KHR_lights_punctual.lights", &format!("nodes[{node}]"))?;
        let place = format!("extensions.KHR_lights_punctual.lights[{index}]");
        let power = |c: f32| model.number(&place, f64::from(c) * f64::from(light.intensity), 0.0, f64::from(f32::MAX));
        let [r, g, b] = light.color;
        let power = Rgb::new(power(r)? as f32, power(g)? as f32, power(b)? as f32);
        let to_world = &nodes.to_world[node];
        let (position, direction) = (to_world.translation, to_world.transform_vector3(DVec3::NEG_Z));
        let kind = match light.type_ {
            Checked::Valid(punctual::Type::Directional) => LightKind::Directional { direction, irradiance: power },
            Checked::Valid(punctual::Type::Point) => LightKind::Point { position, intensity: power },
            Checked::Valid(punctual::Type::Spot) => {
                let spot = light.spot.as_ref().ok_or_else(|| model.error(&place, "a spot light needs its 'spot'"))?;
                let (inner, outer) = (f64::from(spot.inner_cone_angle), f64::from(spot.outer_cone_angle));
                // As large as a right angle in single precision is.
                if !(0.0 <= inner && inner <= outer && 0.0 < outer && outer <= f64::from(FRAC_PI_2 as f32)) {
                    let message = "expected 0 ≤ innerConeAngle ≤ outerConeAngle ≤ π/2 and an outerConeAngle above 0";
                    return Err(model.error(&place, message));
                }
                let (cutoff_angle, beam_width) = (outer.to_degrees(), inner.to_degrees());
                LightKind::Spot { position, direction, intensity: power, cutoff_angle, beam_width, texture: None }
            }
            Checked::Invalid => return Err(model.error(&place, "its type is not one of directional, point, spot")),
        };
        lights.push(Light { at: model.at.clone(), kind });
    }
    Ok(lights)
}
