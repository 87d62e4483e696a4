//! Objects of files for Mitsuba 0.x, as Mitsuba 3 would have them.
//!
//! Names are changed by [`super::modern_name`]. Mitsuba 3 itself changes those and `uoffset`, `voffset`, `uscale`, `vscale`; it
//! refuses what is below with a warning. The warning says what is done instead.

use crate::loader::document::{Category, Object, Param, Value};
use crate::loader::source::{Loc, Sources};
use glam::{DAffine3, DVec3};
use std::cell::Cell;

/// What Mitsuba 0.x did to a picture before it was written.
const TONE_MAPPING: &[&str] = &["burn", "exposure", "gamma", "key", "tonemap_method"];

/// Samplers that are no more. Which sampler a file names is a hint.
const OLD_SAMPLERS: &[&str] = &["halton", "hammersley", "sobol"];

/// Filters of textures over an area, which need ray differentials.
const AREA_FILTERS: &[&str] = &["ewa", "trilinear"];

/// Changes an object, whose children are read; adds to `warnings` what was lost.
pub(super) fn upgrade(object: &mut Object, sources: &Sources, warnings: &mut Vec<String>) {
    let mut warn = |at: Loc, message: String| warnings.push(format!("{}: {message}", sources.span(at)));
    coordinates(object);
    match (object.category, object.plugin.as_str()) {
        (Category::Film, "ldrfilm") => {
            object.plugin = "hdrfilm".into();
            object.params.retain(|p| !TONE_MAPPING.contains(&p.name.as_str()) && p.name != "file_format");
            let message = "the film 'ldrfilm' of Mitsuba 0.6 is taken for 'hdrfilm': the picture is not tone-mapped";
            warn(object.plugin_at, message.into());
        }
        (Category::Sampler, plugin) if OLD_SAMPLERS.contains(&plugin) => {
            object.plugin = "independent".into();
            object.params.retain(|p| p.name != "scramble");
        }
        (Category::Texture, "bitmap") => {
            object.params.retain(|p| p.name != "max_anisotropy");
            for p in object.params.iter_mut().filter(|p| p.name == "filter_type") {
                let Value::Text(filter) = &mut p.value else { continue };
                if AREA_FILTERS.contains(&filter.as_str()) {
                    warn(p.value_at, format!("the filter '{filter}' of Mitsuba 0.6 is taken for 'bilinear'"));
                    *filter = "bilinear".into();
                }
            }
        }
        (Category::Bsdf, "conductor" | "roughconductor") => {
            // What is around the metal: nothing, unless it is something else.
            object.params.retain(|p| p.name != "ext_eta" || number(p) != Some(1.0));
        }
        _ => {}
    }
    if object.category == Category::Film {
        let old = object.params.iter_mut().find(|p| p.name == "high_quality_edges");
        old.into_iter().for_each(|p| p.name = "sample_border".into());
    }
}

/// Offset and scale of texture coordinates become a transformation, the offset first, as in Mitsuba 3.
fn coordinates(object: &mut Object) {
    const NAMES: [&str; 4] = ["uoffset", "voffset", "uscale", "vscale"];
    let place = |name: &str| object.params.iter().find(|p| p.name == name).map(|p| (p.at, p.value_at));
    let (Some((at, value_at)), None) = (NAMES.iter().find_map(|name| place(name)), place("to_uv")) else { return };
    let value = |name: &str| object.params.iter().find(|p| p.name == name).map_or(Some(None), |p| number(p).map(Some));
    let [Some(u), Some(v), Some(uscale), Some(vscale)] = NAMES.map(value) else { return };
    let offset = DVec3::new(u.unwrap_or(0.0), v.unwrap_or(0.0), 0.0);
    let scale = DVec3::new(uscale.unwrap_or(1.0), vscale.unwrap_or(1.0), 1.0);
    object.params.retain(|p| !NAMES.contains(&p.name.as_str()));
    let value = Value::Transform(DAffine3::from_scale(scale) * DAffine3::from_translation(offset));
    object.params.push(Param { name: "to_uv".into(), at, value_at, value, used: Cell::new(false) });
}

fn number(param: &Param) -> Option<f64> {
    match param.value {
        Value::Float(v) => Some(v),
        Value::Integer(v) => Some(v as f64),
        _ => None,
    }
}
