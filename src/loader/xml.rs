//! Mitsuba 3 XML to a [`Document`]: includes, defaults, references, and the place of everything.

mod attributes;
mod files;
mod property;
mod upgrade;

use super::LoadOptions;
use super::document::{Category, Document, Object, ObjectId, Param, Value, find_file};
use super::source::{Loc, Sources};
use super::substitute::Parameters;
use super::suggest::suggestion;
use crate::error::{Error, Result};
use crate::files::Files;
use roxmltree::Node;
use std::cell::Cell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Deepest nesting of elements. Reason: the reader and the builders recurse; real scenes nest less than ten deep.
pub(crate) const MAX_NESTING: usize = 64;

/// Reads a scene file and what it includes.
pub(crate) fn read(path: &Path, options: &LoadOptions) -> Result<Document> {
    let mut reader = Reader {
        files: options.files.clone(),
        sources: Sources::default(),
        objects: Vec::new(),
        ids: HashMap::new(),
        named: HashMap::new(),
        parameters: Parameters::new(&options.defines),
        search: vec![path.parent().unwrap_or(Path::new("")).to_path_buf()],
        open: Vec::new(),
        warnings: Vec::new(),
        lenient: options.lenient,
    };
    reader.file(path, None)?;
    if let Some(message) = reader.parameters.unused() {
        return Err(Error::Usage(message));
    }
    reader.resolve_references()?;
    let Reader { files, sources, objects, search, warnings, .. } = reader;
    let document = Document { files, sources, objects, search, warnings };
    document.check_cycles()?;
    Ok(document)
}

struct Reader {
    files: Files,
    sources: Sources,
    objects: Vec<Object>,
    /// Objects by `id` and alias.
    ids: HashMap<String, ObjectId>,
    /// Where objects were given the parameters that have names.
    named: HashMap<(ObjectId, String), Loc>,
    parameters: Parameters,
    search: Vec<PathBuf>,
    /// The files that are being read, each included by the one before.
    open: Vec<PathBuf>,
    warnings: Vec<String>,
    lenient: bool,
}

/// What an element's meaning depends on beside the element.
#[derive(Clone, Copy)]
struct Context<'a> {
    /// The number of the file.
    file: usize,
    /// Whether names are those of Mitsuba 0.x.
    legacy: bool,
    /// The object around it.
    parent: Option<ObjectId>,
    /// The name that an `<include>` gives to the object in the file.
    name: &'a str,
    depth: usize,
}

impl Reader {
    fn children(&mut self, node: Node<'_, '_>, cx: Context<'_>) -> Result<()> {
        for child in node.children() {
            if child.is_element() {
                self.element(child, Context { depth: cx.depth + 1, name: "", ..cx })?;
            } else if child.is_text() && child.text().is_some_and(|t| !t.trim().is_empty()) {
                let at = Loc::new(cx.file, child.range().start);
                self.warnings.push(format!("{}: text between elements is ignored", self.sources.span(at)));
            }
        }
        Ok(())
    }

    fn element(&mut self, node: Node<'_, '_>, cx: Context<'_>) -> Result<()> {
        let at = Loc::new(cx.file, node.range().start);
        if cx.depth > MAX_NESTING {
            return Err(self.sources.error(at, format!("elements are nested more than {MAX_NESTING} deep")));
        }
        let tag = node.tag_name().name();
        let is_plugin = tag == "spectrum" && node.has_attribute("type");
        if let Some(category) = Category::from_tag(tag).or(is_plugin.then_some(Category::Texture)) {
            return self.object(node, cx, category);
        }
        let Some(parent) = cx.parent else {
            return Err(self.sources.error(at, format!("expected an object, not <{tag}>")));
        };
        match tag {
            "default" => self.default_value(node, cx),
            "include" => self.include(node, cx, parent),
            "alias" => self.alias(node, cx),
            "path" => self.search_path(node, cx, parent),
            "ref" => {
                let a = self.attributes(node, cx, &["id"], &["name"])?;
                let (id, value_at) = (a.text("id").to_string(), a.at("id"));
                self.add(
                    parent,
                    cx,
                    Param {
                        name: a.text("name").into(),
                        at,
                        value_at,
                        value: Value::Reference(id),
                        used: Cell::new(false),
                    },
                )
            }
            _ => self.property(node, cx, parent),
        }
    }

    fn object(&mut self, node: Node<'_, '_>, cx: Context<'_>, category: Category) -> Result<()> {
        let at = Loc::new(cx.file, node.range().start);
        let is_root = node.parent_element().is_none();
        let a = match (category, is_root) {
            (Category::Scene, true) => self.attributes(node, cx, &["version"], &["type", "id", "name"])?,
            (Category::Scene, false) => {
                return Err(self.sources.error(at, "<scene> can only be the outermost element"));
            }
            (_, true) => self.attributes(node, cx, &["version", "type"], &["id", "name"])?,
            (_, false) => self.attributes(node, cx, &["type"], &["id", "name"])?,
        };
        let id = a.text("id").to_string();
        let object = self.objects.len();
        if !id.is_empty() {
            self.check_new_id(&id, a.at("id"))?;
            self.ids.insert(id.clone(), object);
        }
        let name = if a.text("name").is_empty() { cx.name } else { a.text("name") };
        if let Some(parent) = cx.parent {
            let value = Value::Child(object);
            self.add(parent, cx, Param { name: name.into(), at, value_at: at, value, used: Cell::new(false) })?;
        }
        let (plugin, plugin_at) = (a.text("type").to_string(), a.at("type"));
        self.objects.push(Object { category, plugin, id, at, plugin_at, params: Vec::new() });
        self.children(node, Context { parent: Some(object), ..cx })?;
        if cx.legacy {
            upgrade::upgrade(&mut self.objects[object], &self.sources, &mut self.warnings);
        }
        Ok(())
    }

    /// Gives an object a parameter, under the name that today's Mitsuba has for it.
    fn add(&mut self, parent: ObjectId, cx: Context<'_>, mut param: Param) -> Result<()> {
        if cx.legacy {
            param.name = modern_name(&param.name, &self.objects[parent].plugin);
        }
        if !param.name.is_empty()
            && let Some(earlier) = self.named.insert((parent, param.name.clone()), param.at)
        {
            let first = self.sources.span(earlier);
            return Err(self.sources.error(param.at, format!("'{}' is given twice; first at {first}", param.name)));
        }
        self.objects[parent].params.push(param);
        Ok(())
    }

    fn default_value(&mut self, node: Node<'_, '_>, cx: Context<'_>) -> Result<()> {
        let a = self.attributes(node, cx, &["name", "value"], &[])?;
        self.no_children(node, cx)?;
        if a.text("name").is_empty() {
            return Err(self.sources.error(a.at("name"), "the name of a <default> must not be empty"));
        }
        self.parameters.add_default(a.text("name"), a.text("value"));
        Ok(())
    }

    fn alias(&mut self, node: Node<'_, '_>, cx: Context<'_>) -> Result<()> {
        let a = self.attributes(node, cx, &["id", "as"], &[])?;
        self.no_children(node, cx)?;
        self.check_new_id(a.text("as"), a.at("as"))?;
        let Some(&object) = self.ids.get(a.text("id")) else {
            let hint = suggestion(a.text("id"), self.ids.keys().map(String::as_str));
            let message = format!("there is no object with the id '{}' before this <alias>{hint}", a.text("id"));
            return Err(self.sources.error(a.at("id"), message));
        };
        self.ids.insert(a.text("as").into(), object);
        Ok(())
    }

    fn check_new_id(&self, id: &str, at: Loc) -> Result<()> {
        match self.ids.get(id) {
            None => Ok(()),
            Some(&object) => {
                let first = self.sources.span(self.objects[object].at);
                Err(self.sources.error(at, format!("the id '{id}' is taken; first at {first}")))
            }
        }
    }

    fn search_path(&mut self, node: Node<'_, '_>, cx: Context<'_>, parent: ObjectId) -> Result<()> {
        let a = self.attributes(node, cx, &["value"], &[])?;
        self.no_children(node, cx)?;
        if self.objects[parent].category != Category::Scene {
            return Err(self.sources.error(a.at("value"), "<path> can only stand directly inside <scene>"));
        }
        let found = find_file(&self.files, &self.search, self.sources.path(cx.file), a.text("value"));
        let folder = found.map_err(|message| self.sources.error(a.at("value"), message))?;
        self.search.insert(0, folder);
        Ok(())
    }

    fn no_children(&self, node: Node<'_, '_>, cx: Context<'_>) -> Result<()> {
        match node.first_element_child() {
            None => Ok(()),
            Some(child) => {
                let (inner, outer) = (child.tag_name().name(), node.tag_name().name());
                let at = Loc::new(cx.file, child.range().start);
                Err(self.sources.error(at, format!("<{inner}> cannot stand inside <{outer}>")))
            }
        }
    }

    fn resolve_references(&mut self) -> Result<()> {
        for param in self.objects.iter_mut().flat_map(|object| object.params.iter_mut()) {
            let Value::Reference(id) = &param.value else { continue };
            let Some(&object) = self.ids.get(id) else {
                let hint = suggestion(id, self.ids.keys().map(String::as_str));
                return Err(self.sources.error(param.value_at, format!("there is no object with the id '{id}'{hint}")));
            };
            param.value = Value::Child(object);
        }
        Ok(())
    }
}

/// The name that Mitsuba 3 has for a parameter of Mitsuba 0.x: `maxDepth` is `max_depth`.
fn modern_name(name: &str, plugin: &str) -> String {
    let mut out = String::with_capacity(name.len() + 4);
    let mut previous = ' ';
    // A run of capitals after a small letter is one word: `toUV` is `to_uv`.
    let mut in_capitals = false;
    for c in name.chars() {
        if c.is_ascii_uppercase() && (previous.is_ascii_lowercase() || in_capitals) {
            if !in_capitals {
                out.push('_');
            }
            in_capitals = true;
            out.push(c.to_ascii_lowercase());
        } else {
            in_capitals = false;
            out.push(c);
        }
        previous = c;
    }
    if plugin == "diffuse" && out == "diffuse_reflectance" { "reflectance".into() } else { out }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_names_become_new_ones() {
        for (old, new) in [("maxDepth", "max_depth"), ("toWorld", "to_world"), ("toUV", "to_uv"), ("alpha", "alpha")] {
            assert_eq!(modern_name(old, "x"), new);
        }
        assert_eq!(modern_name("diffuseReflectance", "diffuse"), "reflectance");
        assert_eq!(modern_name("diffuseReflectance", "plastic"), "diffuse_reflectance");
    }
}
