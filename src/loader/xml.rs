//! Mitsuba 3 XML to a [`Document`]: includes, defaults, references, and the place of everything.

mod attributes;
mod property;

use super::LoadOptions;
use super::document::{Category, Document, Object, ObjectId, Param, Value, find_file};
use super::source::{Loc, MAX_TEXT_BYTES, Sources, read_bytes};
use super::substitute::Parameters;
use super::suggest::suggestion;
use crate::error::{Error, Result, Span};
use roxmltree::Node;
use std::cell::Cell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Deepest nesting of elements. Reason: the reader and the builders recurse; real scenes nest less than ten deep.
pub(crate) const MAX_NESTING: usize = 64;

/// Deepest nesting of includes; Mitsuba's number.
const MAX_INCLUDE_DEPTH: usize = 15;

/// Most files that a scene may include in all. Reason: files that include others several times grow exponentially.
const MAX_FILES: usize = 4096;

/// Most XML nodes of one file. Reason: they are many times larger than their text.
const MAX_NODES: u32 = 1 << 24;

/// Reads a scene file and what it includes.
pub(crate) fn read(path: &Path, options: &LoadOptions) -> Result<Document> {
    let mut reader = Reader {
        sources: Sources::default(),
        objects: Vec::new(),
        ids: HashMap::new(),
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
    let Reader {
        sources,
        objects,
        search,
        warnings,
        ..
    } = reader;
    let document = Document {
        sources,
        objects,
        search,
        warnings,
    };
    document.check_cycles()?;
    Ok(document)
}

struct Reader {
    sources: Sources,
    objects: Vec<Object>,
    /// Objects by `id` and alias.
    ids: HashMap<String, ObjectId>,
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

/// Where an include stands.
#[derive(Clone, Copy)]
struct IncludedAt<'a> {
    parent: ObjectId,
    name: &'a str,
    depth: usize,
}

impl Reader {
    fn file(&mut self, path: &Path, included: Option<IncludedAt<'_>>) -> Result<()> {
        let bytes = read_bytes(path, MAX_TEXT_BYTES).map_err(|e| Error::file(path, e))?;
        let text = String::from_utf8(bytes).map_err(|e| not_utf8(path, &e))?;
        let text: Arc<str> = text.into();
        let file = self.sources.add(path, text.clone());
        let options = roxmltree::ParsingOptions {
            allow_dtd: false,
            nodes_limit: MAX_NODES,
            ..Default::default()
        };
        let xml = roxmltree::Document::parse_with_options(&text, options).map_err(|e| broken_xml(path, &e))?;
        let root = xml.root_element();
        let at = Loc::new(file, root.range().start);
        let version = root.attribute("version").ok_or_else(|| {
            self.sources.error(
                at,
                format!("the root element <{}> has no version attribute", root.tag_name().name()),
            )
        })?;
        let major = parse_version(version).ok_or_else(|| {
            self.sources.error(
                at,
                format!("the version '{version}' is not three numbers, for example 3.0.0"),
            )
        })?;
        // Names were changed to lower case with underscores in version 2.
        let legacy = major < 2;
        self.open
            .push(path.canonicalize().unwrap_or_else(|_| path.to_path_buf()));
        match included {
            None if root.tag_name().name() != "scene" => {
                return Err(self
                    .sources
                    .error(at, format!("expected <scene>, not <{}>", root.tag_name().name())));
            }
            None => self.element(
                root,
                Context {
                    file,
                    legacy,
                    parent: None,
                    name: "",
                    depth: 0,
                },
            )?,
            Some(i) => {
                let cx = Context {
                    file,
                    legacy,
                    parent: Some(i.parent),
                    name: i.name,
                    depth: i.depth,
                };
                if root.tag_name().name() == "scene" {
                    self.attributes(root, cx, &["version"], &["type", "id", "name"])?;
                    self.children(root, cx)?;
                } else {
                    self.element(root, cx)?;
                }
            }
        }
        self.open.pop();
        Ok(())
    }

    fn children(&mut self, node: Node<'_, '_>, cx: Context<'_>) -> Result<()> {
        for child in node.children() {
            if child.is_element() {
                self.element(
                    child,
                    Context {
                        depth: cx.depth + 1,
                        name: "",
                        ..cx
                    },
                )?;
            } else if child.is_text() && child.text().is_some_and(|t| !t.trim().is_empty()) {
                let at = Loc::new(cx.file, child.range().start);
                self.warnings
                    .push(format!("{}: text between elements is ignored", self.sources.span(at)));
            }
        }
        Ok(())
    }

    fn element(&mut self, node: Node<'_, '_>, cx: Context<'_>) -> Result<()> {
        let at = Loc::new(cx.file, node.range().start);
        if cx.depth > MAX_NESTING {
            return Err(self
                .sources
                .error(at, format!("elements are nested more than {MAX_NESTING} deep")));
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
        let name = if a.text("name").is_empty() {
            cx.name
        } else {
            a.text("name")
        };
        if let Some(parent) = cx.parent {
            let value = Value::Child(object);
            self.add(
                parent,
                cx,
                Param {
                    name: name.into(),
                    at,
                    value_at: at,
                    value,
                    used: Cell::new(false),
                },
            )?;
        }
        let (plugin, plugin_at) = (a.text("type").to_string(), a.at("type"));
        self.objects.push(Object {
            category,
            plugin,
            id,
            at,
            plugin_at,
            params: Vec::new(),
        });
        self.children(
            node,
            Context {
                parent: Some(object),
                ..cx
            },
        )
    }

    /// Gives an object a parameter, under the name that today's Mitsuba has for it.
    fn add(&mut self, parent: ObjectId, cx: Context<'_>, mut param: Param) -> Result<()> {
        if cx.legacy {
            param.name = modern_name(&param.name, &self.objects[parent].plugin);
        }
        let earlier = self.objects[parent]
            .params
            .iter()
            .find(|p| !p.name.is_empty() && p.name == param.name);
        if let Some(earlier) = earlier {
            let first = self.sources.span(earlier.at);
            return Err(self
                .sources
                .error(param.at, format!("'{}' is given twice; first at {first}", param.name)));
        }
        self.objects[parent].params.push(param);
        Ok(())
    }

    fn default_value(&mut self, node: Node<'_, '_>, cx: Context<'_>) -> Result<()> {
        let a = self.attributes(node, cx, &["name", "value"], &[])?;
        self.no_children(node, cx)?;
        if a.text("name").is_empty() {
            return Err(self
                .sources
                .error(a.at("name"), "the name of a <default> must not be empty"));
        }
        self.parameters.add_default(a.text("name"), a.text("value"));
        Ok(())
    }

    fn include(&mut self, node: Node<'_, '_>, cx: Context<'_>, parent: ObjectId) -> Result<()> {
        let a = self.attributes(node, cx, &["filename"], &["name"])?;
        self.no_children(node, cx)?;
        let at = a.at("filename");
        let beside = self
            .sources
            .path(cx.file)
            .parent()
            .unwrap_or(Path::new(""))
            .to_path_buf();
        let search: Vec<PathBuf> = std::iter::once(beside).chain(self.search.iter().cloned()).collect();
        let found = find_file(&search, self.sources.path(cx.file), a.text("filename"));
        let path = found.map_err(|message| self.sources.error(at, message))?;
        let canonical = path.canonicalize().unwrap_or_else(|_| path.clone());
        if let Some(first) = self.open.iter().position(|open| *open == canonical) {
            let chain: Vec<String> = self.open[first..]
                .iter()
                .chain([&canonical])
                .map(|p| file_name(p))
                .collect();
            return Err(self
                .sources
                .error(at, format!("the file includes itself: {}", chain.join(" → "))));
        }
        if self.open.len() > MAX_INCLUDE_DEPTH {
            let message = format!("includes are nested more than {MAX_INCLUDE_DEPTH} deep");
            return Err(self.sources.error(at, message));
        }
        if self.sources.len() >= MAX_FILES {
            return Err(self
                .sources
                .error(at, format!("the scene includes more than {MAX_FILES} files")));
        }
        self.file(
            &path,
            Some(IncludedAt {
                parent,
                name: a.text("name"),
                depth: cx.depth,
            }),
        )
        .map_err(|e| match e {
            Error::File { path, message } => self
                .sources
                .error(at, format!("cannot read '{}': {message}", path.display())),
            other => other,
        })
    }

    fn alias(&mut self, node: Node<'_, '_>, cx: Context<'_>) -> Result<()> {
        let a = self.attributes(node, cx, &["id", "as"], &[])?;
        self.no_children(node, cx)?;
        self.check_new_id(a.text("as"), a.at("as"))?;
        let Some(&object) = self.ids.get(a.text("id")) else {
            let hint = suggestion(a.text("id"), self.ids.keys().map(String::as_str));
            let message = format!(
                "there is no object with the id '{}' before this <alias>{hint}",
                a.text("id")
            );
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
                Err(self
                    .sources
                    .error(at, format!("the id '{id}' is taken; first at {first}")))
            }
        }
    }

    fn search_path(&mut self, node: Node<'_, '_>, cx: Context<'_>, parent: ObjectId) -> Result<()> {
        let a = self.attributes(node, cx, &["value"], &[])?;
        self.no_children(node, cx)?;
        if self.objects[parent].category != Category::Scene {
            return Err(self
                .sources
                .error(a.at("value"), "<path> can only stand directly inside <scene>"));
        }
        let found = find_file(&self.search, self.sources.path(cx.file), a.text("value"));
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
                Err(self
                    .sources
                    .error(at, format!("<{inner}> cannot stand inside <{outer}>")))
            }
        }
    }

    fn resolve_references(&mut self) -> Result<()> {
        for param in self.objects.iter_mut().flat_map(|object| object.params.iter_mut()) {
            let Value::Reference(id) = &param.value else { continue };
            let Some(&object) = self.ids.get(id) else {
                let hint = suggestion(id, self.ids.keys().map(String::as_str));
                return Err(self
                    .sources
                    .error(param.value_at, format!("there is no object with the id '{id}'{hint}")));
            };
            param.value = Value::Child(object);
        }
        Ok(())
    }
}

fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

fn not_utf8(path: &Path, e: &std::string::FromUtf8Error) -> Error {
    let valid = &e.as_bytes()[..e.utf8_error().valid_up_to()];
    let line = valid.iter().filter(|&&b| b == b'\n').count() + 1;
    let column = String::from_utf8_lossy(valid.rsplit(|&b| b == b'\n').next().unwrap_or(valid))
        .chars()
        .count()
        + 1;
    Error::scene(
        &Span::text(path, line as u32, column as u32),
        "the file is not UTF-8 text",
    )
}

fn broken_xml(path: &Path, e: &roxmltree::Error) -> Error {
    if matches!(e, roxmltree::Error::DtdDetected) {
        let message = "document type declarations (<!DOCTYPE …>, entities) are not accepted in scene files";
        return Error::scene(&Span::whole(path), message);
    }
    let (at, text) = (e.pos(), e.to_string());
    let message = text
        .strip_suffix(&format!(" at {}:{}", at.row, at.col))
        .unwrap_or(&text);
    Error::scene(&Span::text(path, at.row, at.col), format!("broken XML: {message}"))
}

/// The first of the three numbers of a version.
fn parse_version(text: &str) -> Option<u32> {
    let numbers: Vec<u32> = text.split('.').map(|n| n.trim().parse().ok()).collect::<Option<_>>()?;
    if let [major, _, _] = numbers[..] {
        Some(major)
    } else {
        None
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
    if plugin == "diffuse" && out == "diffuse_reflectance" {
        "reflectance".into()
    } else {
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_names_become_new_ones() {
        for (old, new) in [
            ("maxDepth", "max_depth"),
            ("toWorld", "to_world"),
            ("toUV", "to_uv"),
            ("alpha", "alpha"),
        ] {
            assert_eq!(modern_name(old, "x"), new);
        }
        assert_eq!(modern_name("diffuseReflectance", "diffuse"), "reflectance");
        assert_eq!(modern_name("diffuseReflectance", "plastic"), "diffuse_reflectance");
    }

    #[test]
    fn versions_are_three_numbers() {
        assert_eq!(parse_version("0.6.0"), Some(0));
        for bad in ["3.0", "", "3.0.x", "3.0.0.0", "-1.0.0"] {
            assert_eq!(parse_version(bad), None, "{bad}");
        }
    }
}
