//! The elements that are parameters: `<float>`, `<rgb>`, `<transform>` and the others.

use super::attributes::Attributes;
use super::{Context, Reader};
use crate::error::Result;
use crate::loader::document::{Category, ObjectId, Param, Spectrum, Value};
use crate::loader::source::Loc;
use crate::loader::suggest::suggestion;
use crate::loader::{transform, values};
use glam::{DAffine3, DVec3};
use roxmltree::Node;
use std::cell::Cell;

/// Tags of parameters.
const PROPERTIES: &[&str] =
    &["float", "integer", "boolean", "string", "vector", "point", "rgb", "spectrum", "transform"];
/// Tags that are neither objects nor parameters.
const DIRECTIVES: &[&str] = &["default", "include", "alias", "path", "ref"];
/// Tags inside `<transform>`.
const STEPS: &[&str] = &["translate", "rotate", "scale", "lookat", "matrix"];

const XYZ: [&str; 3] = ["x", "y", "z"];

impl Reader {
    /// An element that is neither an object nor about the file: a value for `parent`.
    pub(super) fn property(&mut self, node: Node<'_, '_>, cx: Context<'_>, parent: ObjectId) -> Result<()> {
        let tag = node.tag_name().name();
        let at = Loc::new(cx.file, node.range().start);
        let (a, value) = match tag {
            "transform" => {
                let a = self.attributes(node, cx, &["name"], &[])?;
                let value = self.transform(node, cx)?;
                (a, value)
            }
            "vector" | "point" => {
                let a = self.attributes(node, cx, &["name"], &["value", "x", "y", "z"])?;
                if a.get("value").is_none()
                    && let Some(missing) = XYZ.iter().find(|name| a.get(name).is_none())
                {
                    return Err(self.sources.error(at, format!("<{tag}> needs the attribute '{missing}'")));
                }
                let value = Value::Vector(self.components(&a, 0.0)?);
                (a, value)
            }
            "spectrum" => {
                let a = self.attributes(node, cx, &["name"], &["value", "filename"])?;
                let value = Value::Spectrum(self.spectrum(&a, at)?);
                (a, value)
            }
            _ if PROPERTIES.contains(&tag) => {
                let a = self.attributes(node, cx, &["name", "value"], &[])?;
                let value = scalar(tag, a.text("value")).map_err(|m| self.sources.error(a.at("value"), m))?;
                (a, value)
            }
            _ => return Err(self.unknown_tag(tag, at)),
        };
        if tag != "transform" {
            self.no_children(node, cx)?;
        }
        let value_at = if a.get("value").is_some() { a.at("value") } else { at };
        self.add(parent, cx, Param { name: a.text("name").into(), at, value_at, value, used: Cell::new(false) })
    }

    fn unknown_tag(&self, tag: &str, at: Loc) -> crate::error::Error {
        if STEPS.contains(&tag) {
            return self.sources.error(at, format!("<{tag}> can only stand inside <transform>"));
        }
        let known = PROPERTIES.iter().chain(DIRECTIVES).copied().chain(Category::tags());
        self.sources.error(at, format!("unknown element <{tag}>{}", suggestion(tag, known)))
    }

    fn spectrum(&self, a: &Attributes, at: Loc) -> Result<Spectrum> {
        match (a.get("value"), a.get("filename")) {
            (Some(text), None) => values::spectrum(text).map_err(|m| self.sources.error(a.at("value"), m)),
            (None, Some(name)) => Ok(Spectrum::File(name.into())),
            _ => Err(self.sources.error(at, "<spectrum> needs either 'value' or 'filename'")),
        }
    }

    fn transform(&mut self, node: Node<'_, '_>, cx: Context<'_>) -> Result<Value> {
        let mut total = DAffine3::IDENTITY;
        for child in node.children().filter(Node::is_element) {
            let at = Loc::new(cx.file, child.range().start);
            let step = self.step(child, cx, at)?;
            self.no_children(child, cx)?;
            // Each step acts on what the steps before it made.
            total = step * total;
            if !total.is_finite() {
                return Err(self.sources.error(at, "the transformation overflows"));
            }
        }
        Ok(Value::Transform(total))
    }

    fn step(&mut self, node: Node<'_, '_>, cx: Context<'_>, at: Loc) -> Result<DAffine3> {
        let tag = node.tag_name().name();
        match tag {
            "translate" => {
                let a = self.attributes(node, cx, &[], &["value", "x", "y", "z"])?;
                Ok(DAffine3::from_translation(self.components(&a, 0.0)?))
            }
            "scale" => {
                let a = self.attributes(node, cx, &[], &["value", "x", "y", "z"])?;
                Ok(DAffine3::from_scale(self.components(&a, 1.0)?))
            }
            "rotate" => {
                let a = self.attributes(node, cx, &["angle"], &["value", "x", "y", "z"])?;
                let angle = values::number(a.text("angle")).map_err(|m| self.sources.error(a.at("angle"), m))?;
                let axis = self.components(&a, 0.0)?;
                let step = transform::rotate(axis, angle).map_err(|m| self.sources.error(at, m))?;
                if !transform::is_unit_axis(axis) {
                    let warning = "the rotation axis is not of unit length and is not normalised, as in Mitsuba";
                    self.warnings.push(format!("{}: {warning}", self.sources.span(at)));
                }
                Ok(step)
            }
            "matrix" => {
                let a = self.attributes(node, cx, &["value"], &[])?;
                transform::matrix(a.text("value")).map_err(|m| self.sources.error(a.at("value"), m))
            }
            "lookat" => self.look_at(node, cx, at),
            "lookAt" if cx.legacy => self.look_at(node, cx, at),
            _ => {
                let hint = suggestion(tag, STEPS.iter().copied());
                Err(self.sources.error(at, format!("unknown step <{tag}> of a <transform>{hint}")))
            }
        }
    }

    fn look_at(&mut self, node: Node<'_, '_>, cx: Context<'_>, at: Loc) -> Result<DAffine3> {
        let a = self.attributes(node, cx, &["origin", "target"], &["up"])?;
        let read = |name: &str| values::vector(a.text(name)).map_err(|m| self.sources.error(a.at(name), m));
        let up = transform::vector_or_zero(a.get("up")).map_err(|m| self.sources.error(a.at("up"), m))?;
        transform::look_at(read("origin")?, read("target")?, up).map_err(|m| self.sources.error(at, m))
    }

    /// `value` with three numbers or one, or `x`, `y` and `z`, each `missing` if it is not there.
    fn components(&self, a: &Attributes, missing: f64) -> Result<DVec3> {
        if let Some(text) = a.get("value") {
            if XYZ.iter().any(|name| a.get(name).is_some()) {
                return Err(self.sources.error(a.at("value"), "'value' and 'x', 'y', 'z' exclude each other"));
            }
            return values::vector_or_scalar(text).map_err(|m| self.sources.error(a.at("value"), m));
        }
        let mut v = DVec3::splat(missing);
        for (i, name) in XYZ.into_iter().enumerate() {
            if let Some(text) = a.get(name) {
                v[i] = values::number(text).map_err(|m| self.sources.error(a.at(name), m))?;
            }
        }
        Ok(v)
    }
}

fn scalar(tag: &str, text: &str) -> std::result::Result<Value, String> {
    match tag {
        "float" => values::number(text).map(Value::Float),
        "integer" => values::integer(text).map(Value::Integer),
        "boolean" => values::boolean(text).map(Value::Boolean),
        "rgb" => values::rgb(text).map(Value::Rgb),
        _ => Ok(Value::Text(text.into())),
    }
}
