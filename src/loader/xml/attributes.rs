//! The attributes of one element, after substitution, each with its place.

use super::{Context, Reader};
use crate::error::Result;
use crate::loader::source::Loc;
use crate::loader::suggest::suggestion;
use roxmltree::Node;

struct Attribute {
    name: String,
    value: String,
    at: Loc,
}

/// The attributes of an element.
pub(super) struct Attributes {
    list: Vec<Attribute>,
    element: Loc,
}

impl Attributes {
    /// The value of an attribute, if it is there.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.list.iter().find(|a| a.name == name).map(|a| a.value.as_str())
    }

    /// The value of an attribute, empty if it is not there.
    pub(super) fn text(&self, name: &str) -> &str {
        self.get(name).unwrap_or("")
    }

    /// The place of the value, or of the element if it is not there.
    pub(super) fn at(&self, name: &str) -> Loc {
        self.list.iter().find(|a| a.name == name).map_or(self.element, |a| a.at)
    }
}

impl Reader {
    /// The attributes of an element, which must be the `required` ones and may be the `optional` ones.
    pub(super) fn attributes(
        &mut self,
        node: Node<'_, '_>,
        cx: Context<'_>,
        required: &[&str],
        optional: &[&str],
    ) -> Result<Attributes> {
        let element = Loc::new(cx.file, node.range().start);
        let tag = node.tag_name().name();
        let mut list = Vec::new();
        for attribute in node.attributes() {
            let name = attribute.name();
            if !required.contains(&name) && !optional.contains(&name) {
                let known = required.iter().chain(optional).copied();
                let message = format!("<{tag}> has no attribute '{name}'{}", suggestion(name, known));
                self.complain(Loc::new(cx.file, attribute.range().start), message)?;
                continue;
            }
            let at = Loc::new(cx.file, attribute.range_value().start);
            let value = self.parameters.substitute(attribute.value()).map_err(|m| self.sources.error(at, m))?;
            list.push(Attribute { name: name.into(), value, at });
        }
        match required.iter().find(|name| list.iter().all(|a| a.name != **name)) {
            Some(missing) => Err(self.sources.error(element, format!("<{tag}> needs the attribute '{missing}'"))),
            None => Ok(Attributes { list, element }),
        }
    }

    /// An error, or a warning for who is lenient.
    pub(super) fn complain(&mut self, at: Loc, message: String) -> Result<()> {
        let error = self.sources.error(at, message);
        if !self.lenient {
            return Err(error);
        }
        self.warnings.push(error.to_string());
        Ok(())
    }
}
