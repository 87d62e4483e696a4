//! Which objects of a document were used.

use super::document::{Category, Document, ObjectId, Value};
use super::params::title;
use crate::description::Inventory;
use std::collections::HashSet;

/// What there is, where the objects `used` were interpreted.
pub(super) fn of(document: &Document, used: &HashSet<ObjectId>) -> Inventory {
    let mut inventory = Inventory::default();
    let mut inside = HashSet::new();
    for (id, object) in document.objects.iter().enumerate() {
        if used.contains(&id) {
            if object.category != Category::Scene {
                let plugin = (object.category.tag().to_owned(), object.plugin.clone());
                *inventory.used.entry(plugin).or_default() += 1;
            }
            continue;
        }
        inside.extend(object.params.iter().filter_map(|p| if let Value::Child(c) = p.value { Some(c) } else { None }));
        // Objects stand after those that they are inside of; what is inside of this one and unused has no line of its own.
        if inside.contains(&id) {
            continue;
        }
        let name = if object.id.is_empty() { String::new() } else { format!(" '{}'", object.id) };
        let file = object.params.iter().find_map(|p| match (&p.value, p.name.as_str()) {
            (Value::Text(file), "filename") => {
                let bytes = document.find_file(file, p.at).ok().and_then(|path| document.files.bytes(&path));
                let size = bytes.map_or_else(String::new, |bytes| format!(" ({bytes} bytes)"));
                Some(format!(", '{file}'{size} is not read"))
            }
            _ => None,
        });
        let (title, place) = (title(object), document.sources.span(object.at));
        inventory.unused.push(format!("{title}{name} ({place}){}", file.unwrap_or_default()));
    }
    inventory
}
