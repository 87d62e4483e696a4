//! Groups of shapes, and their instances.

use super::shape::{shape, to_world};
use crate::description::{Group, Instance};
use crate::error::Result;
use crate::loader::build::Builder;
use crate::loader::document::{Category, ObjectId};
use crate::loader::params::{Params, title};

/// A place of a group.
pub(crate) fn instance(b: &mut Builder<'_>, id: ObjectId) -> Result<Instance> {
    let p = Params::new(b.document, id);
    let Some((group, at)) = p.child(Category::Shape)? else {
        return Err(b.document.sources.error(p.object.at, "an instance needs a shapegroup: <ref id=\"…\"/>"));
    };
    if b.document.objects[group].plugin != "shapegroup" {
        let message = format!("an instance places a shapegroup, not a {}", title(&b.document.objects[group]));
        return Err(b.document.sources.error(at, message));
    }
    let to_world = to_world(&p)?;
    p.accept(&["face_normals", "silhouette_sampling_weight"]);
    let group = b.group(group)?;
    let name = if p.object.id.is_empty() { p.object.plugin.clone() } else { p.object.id.clone() };
    let made = Instance { at: p.span(), name, group, to_world };
    p.finish(b)?;
    Ok(made)
}

/// The shapes of a group.
pub(crate) fn group(b: &mut Builder<'_>, id: ObjectId) -> Result<Group> {
    let p = Params::new(b.document, id);
    let mut shapes = Vec::new();
    for (child, at) in p.children(Category::Shape) {
        let object = &b.document.objects[child];
        if ["instance", "shapegroup"].contains(&object.plugin.as_str()) {
            return Err(b.document.sources.error(at, format!("a {} cannot be in a shapegroup", title(object))));
        }
        let made = shape(b, child)?;
        if made.emission.is_some() {
            return Err(b.document.sources.error(at, "a shape with an emitter cannot be in a shapegroup"));
        }
        shapes.push(made);
    }
    if p.transform("to_world")?.is_some() {
        b.warn(p.at("to_world"), "the to_world of a shapegroup does nothing; that of its instances places it");
    }
    p.accept(&["face_normals", "silhouette_sampling_weight"]);
    p.finish(b)?;
    Ok(Group { shapes })
}
