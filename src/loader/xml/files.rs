//! Files: the scene's own and those it includes.

use super::{Context, Reader};
use crate::error::{Error, Result, Span};
use crate::loader::document::{ObjectId, find_file};
use crate::loader::source::{Loc, MAX_TEXT_BYTES};
use roxmltree::Node;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Deepest nesting of includes; Mitsuba's number.
const MAX_INCLUDE_DEPTH: usize = 15;

/// Most files that a scene may include in all. Reason: files that include others several times grow exponentially.
const MAX_FILES: usize = 4096;

/// Most XML nodes of one file. Reason: they are many times larger than their text.
const MAX_NODES: u32 = 1 << 24;

/// Most bytes of memory that a byte of XML takes while it is read: four bytes can be an element, and five an attribute.
const TREE_BYTES: u64 = 32;

/// Where an include stands.
#[derive(Clone, Copy)]
pub(super) struct IncludedAt<'a> {
    parent: ObjectId,
    name: &'a str,
    depth: usize,
}

impl Reader {
    /// Reads a file into the scene, or into the object that includes it.
    pub(super) fn file(&mut self, path: &Path, included: Option<IncludedAt<'_>>) -> Result<()> {
        let bytes = self.files.read(path, MAX_TEXT_BYTES).map_err(|e| Error::file(path, e))?;
        let text = String::from_utf8(bytes).map_err(|e| not_utf8(path, &e))?;
        let memory = self.files.memory();
        memory
            .check(TREE_BYTES * text.len() as u64)
            .and_then(|()| memory.keep(text.len() as u64))
            .map_err(|m| Error::scene(&Span::whole(path), format!("the tree of its elements {m}")))?;
        let text: Arc<str> = text.into();
        let file = self.sources.add(path, text.clone());
        let options = roxmltree::ParsingOptions { allow_dtd: false, nodes_limit: MAX_NODES, ..Default::default() };
        let xml = roxmltree::Document::parse_with_options(&text, options).map_err(|e| broken_xml(path, &e))?;
        self.open.push(self.files.identity(path));
        self.root(xml.root_element(), file, included)?;
        self.open.pop();
        Ok(())
    }

    fn root(&mut self, root: Node<'_, '_>, file: usize, included: Option<IncludedAt<'_>>) -> Result<()> {
        let at = Loc::new(file, root.range().start);
        let tag = root.tag_name().name();
        let Some(version) = root.attribute("version") else {
            return Err(self.sources.error(at, format!("the root element <{tag}> has no version attribute")));
        };
        let Some(major) = parse_version(version) else {
            let message = format!("the version '{version}' is not three numbers, for example 3.0.0");
            return Err(self.sources.error(at, message));
        };
        // Names were changed to lower case with underscores in version 2.
        let legacy = major < 2;
        let cx = Context { file, legacy, parent: None, name: "", depth: 0 };
        match included {
            None if tag != "scene" => Err(self.sources.error(at, format!("expected <scene>, not <{tag}>"))),
            None => self.element(root, cx),
            Some(i) => {
                let cx = Context { parent: Some(i.parent), name: i.name, depth: i.depth, ..cx };
                if tag != "scene" {
                    return self.element(root, cx);
                }
                self.attributes(root, cx, &["version"], &["type", "id", "name"])?;
                self.children(root, cx)
            }
        }
    }

    /// An `<include>`: reads the file into `parent`, or gives it the object that the file is.
    pub(super) fn include(&mut self, node: Node<'_, '_>, cx: Context<'_>, parent: ObjectId) -> Result<()> {
        let a = self.attributes(node, cx, &["filename"], &["name"])?;
        self.no_children(node, cx)?;
        let at = a.at("filename");
        let beside = self.sources.path(cx.file).parent().unwrap_or(Path::new("")).to_path_buf();
        let search: Vec<PathBuf> = std::iter::once(beside).chain(self.search.iter().cloned()).collect();
        let found = find_file(&self.files, &search, self.sources.path(cx.file), a.text("filename"));
        let path = found.map_err(|message| self.sources.error(at, message))?;
        let canonical = self.files.identity(&path);
        if let Some(first) = self.open.iter().position(|open| *open == canonical) {
            let chain: Vec<String> = self.open[first..].iter().chain([&canonical]).map(|p| file_name(p)).collect();
            return Err(self.sources.error(at, format!("the file includes itself: {}", chain.join(" → "))));
        }
        if self.open.len() > MAX_INCLUDE_DEPTH {
            let message = format!("includes are nested more than {MAX_INCLUDE_DEPTH} deep");
            return Err(self.sources.error(at, message));
        }
        if self.sources.len() >= MAX_FILES {
            return Err(self.sources.error(at, format!("the scene includes more than {MAX_FILES} files")));
        }
        self.file(&path, Some(IncludedAt { parent, name: a.text("name"), depth: cx.depth })).map_err(|e| match e {
            Error::File { path, message } => {
                self.sources.error(at, format!("cannot read '{}': {message}", path.display()))
            }
            other => other,
        })
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn not_utf8(path: &Path, e: &std::string::FromUtf8Error) -> Error {
    let valid = &e.as_bytes()[..e.utf8_error().valid_up_to()];
    let line = valid.iter().filter(|&&b| b == b'\n').count() + 1;
    let column = String::from_utf8_lossy(valid.rsplit(|&b| b == b'\n').next().unwrap_or(valid)).chars().count() + 1;
    Error::scene(&Span::text(path, line as u32, column as u32), "the file is not UTF-8 text")
}

fn broken_xml(path: &Path, e: &roxmltree::Error) -> Error {
    if matches!(e, roxmltree::Error::DtdDetected) {
        let message = "document type declarations (<!DOCTYPE …>, entities) are not accepted in scene files";
        return Error::scene(&Span::whole(path), message);
    }
    let (at, text) = (e.pos(), e.to_string());
    let message = text.strip_suffix(&format!(" at {}:{}", at.row, at.col)).unwrap_or(&text);
    Error::scene(&Span::text(path, at.row, at.col), format!("broken XML: {message}"))
}

/// The first of the three numbers of a version.
fn parse_version(text: &str) -> Option<u32> {
    let numbers: Vec<u32> = text.split('.').map(|n| n.trim().parse().ok()).collect::<Option<_>>()?;
    if let [major, _, _] = numbers[..] { Some(major) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_three_numbers() {
        assert_eq!(parse_version("0.6.0"), Some(0));
        for bad in ["3.0", "", "3.0.x", "3.0.0.0", "-1.0.0"] {
            assert_eq!(parse_version(bad), None, "{bad}");
        }
    }
}
