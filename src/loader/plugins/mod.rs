//! The plugins: one function each, from parameters to a part of the description, and the tables that name them.

pub(crate) mod aov;
pub(crate) mod bsdf;
pub(crate) mod colour;
pub(crate) mod emitter;
pub(crate) mod film;
pub(crate) mod group;
pub(crate) mod integrator;
pub(crate) mod principled;
pub(crate) mod sensor;
pub(crate) mod shape;
pub(crate) mod texture;

use super::document::{Category, Document, ObjectId};
use super::params::title;
use super::suggest::suggestion;
use crate::error::{Error, Result};

/// Every plugin of Mitsuba 3.9, by category; those that no table of ours has are not supported yet.
const MITSUBA: &[(Category, &[&str])] = &[
    (
        Category::Bsdf,
        &[
            "blendbsdf",
            "bumpmap",
            "circular",
            "conductor",
            "dielectric",
            "diffuse",
            "hair",
            "mask",
            "measured",
            "measured_polarized",
            "normalmap",
            "null",
            "plastic",
            "polarizer",
            "pplastic",
            "principled",
            "principledthin",
            "retarder",
            "roughconductor",
            "roughdielectric",
            "roughplastic",
            "thindielectric",
            "twosided",
        ],
    ),
    (
        Category::Shape,
        &[
            "blender",
            "bsplinecurve",
            "cube",
            "cylinder",
            "disk",
            "ellipsoids",
            "ellipsoidsmesh",
            "instance",
            "linearcurve",
            "merge",
            "obj",
            "ply",
            "rectangle",
            "sdfgrid",
            "serialized",
            "shapegroup",
            "sphere",
        ],
    ),
    (
        Category::Emitter,
        &[
            "area",
            "constant",
            "directional",
            "directionalarea",
            "envmap",
            "point",
            "projector",
            "spot",
            "sunsky",
            "timed_sunsky",
        ],
    ),
    (
        Category::Sensor,
        &["batch", "distant", "irradiancemeter", "orthographic", "perspective", "radiancemeter", "thinlens"],
    ),
    (Category::Film, &["hdrfilm", "specfilm"]),
    (Category::Sampler, &["independent", "ldsampler", "multijitter", "orthogonal", "stratified"]),
    (Category::Rfilter, &["box", "catmullrom", "gaussian", "lanczos", "mitchell", "tent"]),
    (Category::Integrator, &["aov", "depth", "direct", "moment", "path", "ptracer", "stokes", "volpath", "volpathmis"]),
    (
        Category::Texture,
        &[
            "bitmap",
            "blackbody",
            "checkerboard",
            "d65",
            "irregular",
            "mesh_attribute",
            "rawconstant",
            "regular",
            "srgb",
            "uniform",
            "volume",
        ],
    ),
    (Category::Medium, &["heterogeneous", "homogeneous"]),
    (Category::Phase, &["blendphase", "hg", "isotropic", "rayleigh", "sggx", "tabphase"]),
    (Category::Volume, &["constvolume", "gridvolume"]),
];

/// Plugins that Mitsuba does not have.
const OWN: &[(Category, &[&str])] = &[(Category::Bsdf, &["oren_nayar"]), (Category::Sensor, &["panorama"])];

/// Every plugin that a file may name.
fn known(category: Category) -> impl Iterator<Item = &'static str> {
    let rows = MITSUBA.iter().chain(OWN).filter(move |row| row.0 == category);
    rows.flat_map(|row| row.1).copied()
}

/// The entry of `table` for an object's plugin, or an error that says what there is.
pub(crate) fn find<T: Copy>(document: &Document, id: ObjectId, table: &[(&'static str, T)]) -> Result<T> {
    let object = &document.objects[id];
    match table.iter().find(|row| row.0 == object.plugin) {
        Some(row) => Ok(row.1),
        None => Err(unknown(document, id, table.iter().map(|row| row.0))),
    }
}

/// An error unless there is such a plugin.
pub(crate) fn check_known(document: &Document, id: ObjectId) -> Result<()> {
    let object = &document.objects[id];
    if known(object.category).any(|name| name == object.plugin) {
        return Ok(());
    }
    Err(unknown(document, id, std::iter::empty()))
}

fn unknown(document: &Document, id: ObjectId, supported: impl Iterator<Item = &'static str>) -> Error {
    let object = &document.objects[id];
    let tag = object.category.tag();
    if known(object.category).any(|name| name == object.plugin) {
        let list: Vec<&str> = supported.collect();
        let what = format!("{tag} plugin '{}'", object.plugin);
        return document.sources.unsupported(object.plugin_at, what, format!("; supported: {}", list.join(", ")));
    }
    let elsewhere = MITSUBA.iter().find(|row| row.1.contains(&object.plugin.as_str()));
    let hint = match elsewhere {
        Some((category, _)) => format!("; '{}' is a plugin for <{}>", object.plugin, category.tag()),
        None => suggestion(&object.plugin, known(object.category)),
    };
    document.sources.error(object.plugin_at, format!("unknown {tag} plugin '{}'{hint}", object.plugin))
}

/// An error that says which kinds of child an object cannot have there.
pub(crate) fn misplaced(document: &Document, id: ObjectId, at: super::source::Loc, whose: &str) -> Error {
    document.sources.error(at, format!("{} cannot belong to {whose}", title(&document.objects[id])))
}
