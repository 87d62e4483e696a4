//! The parameters of one object, as a plugin asks for them: typed, with defaults; what was not asked for is an error.

use super::build::Builder;
use super::document::{Category, Document, Object, ObjectId, Param, Value};
use super::source::Loc;
use super::suggest::suggestion;
use crate::description::{Parameter, TextureId};
use crate::error::{Error, Result, Span};
use glam::{DAffine3, DVec3};
use std::cell::RefCell;

/// The parameters of one object.
pub(crate) struct Params<'d> {
    pub(crate) document: &'d Document,
    pub(crate) object: &'d Object,
    id: ObjectId,
    /// Every name that the plugin asked for: what the object could have.
    asked: RefCell<Vec<&'static str>>,
    /// The parameters that textures give.
    varying: RefCell<Vec<(Parameter, TextureId)>>,
}

impl<'d> Params<'d> {
    pub(crate) fn new(document: &'d Document, id: ObjectId) -> Self {
        Self { document, object: &document.objects[id], id, asked: RefCell::default(), varying: RefCell::default() }
    }

    /// For messages: `bsdf 'diffuse'`.
    pub(crate) fn title(&self) -> String {
        title(self.object)
    }

    /// Where the object is.
    pub(crate) fn span(&self) -> Span {
        self.document.sources.span(self.object.at)
    }

    /// The place of a parameter's value, or of the object if it is not there.
    pub(crate) fn at(&self, name: &str) -> Loc {
        self.object.params.iter().find(|p| p.name == name).map_or(self.object.at, |p| p.value_at)
    }

    /// The input is wrong at a parameter.
    pub(crate) fn error(&self, name: &str, message: impl Into<String>) -> Error {
        self.document.sources.error(self.at(name), message)
    }

    /// A parameter, if it is there.
    pub(crate) fn find(&self, name: &'static str) -> Option<&'d Param> {
        self.asked.borrow_mut().push(name);
        let param = self.object.params.iter().find(|p| p.name == name)?;
        param.used.set(true);
        Some(param)
    }

    /// Notes that a texture gives a parameter.
    pub(crate) fn vary(&self, parameter: Parameter, texture: TextureId) {
        self.varying.borrow_mut().push((parameter, texture));
    }

    /// The parameters that textures give.
    pub(crate) fn take_varying(&self) -> Vec<(Parameter, TextureId)> {
        self.varying.take()
    }

    /// Accepts parameters that do not change the picture.
    pub(crate) fn accept(&self, names: &[&'static str]) {
        for name in names {
            self.find(name);
        }
    }

    /// A `<float>` or `<integer>`.
    pub(crate) fn float(&self, name: &'static str) -> Result<Option<f64>> {
        self.typed(name, "float", |value| match value {
            Value::Float(v) => Some(*v),
            Value::Integer(v) => Some(*v as f64),
            _ => None,
        })
    }

    /// A `<float>` that is larger than zero.
    pub(crate) fn positive(&self, name: &'static str, default: f64) -> Result<f64> {
        let value = self.float(name)?.unwrap_or(default);
        if value > 0.0 { Ok(value) } else { Err(self.error(name, format!("'{name}' must be larger than zero"))) }
    }

    /// An `<integer>` of at least `least`.
    pub(crate) fn unsigned(&self, name: &'static str, default: u32, least: u32) -> Result<u32> {
        let Some(value) = self.integer(name)? else {
            return Ok(default);
        };
        u32::try_from(value)
            .ok()
            .filter(|v| *v >= least)
            .ok_or_else(|| self.error(name, format!("'{name}' must be between {least} and {}, not {value}", u32::MAX)))
    }

    /// An `<integer>`.
    pub(crate) fn integer(&self, name: &'static str) -> Result<Option<i64>> {
        self.typed(name, "integer", |value| if let Value::Integer(v) = value { Some(*v) } else { None })
    }

    /// A `<boolean>`.
    pub(crate) fn boolean(&self, name: &'static str, default: bool) -> Result<bool> {
        let value = self.typed(name, "boolean", |v| if let Value::Boolean(b) = v { Some(*b) } else { None })?;
        Ok(value.unwrap_or(default))
    }

    /// A `<string>`.
    pub(crate) fn text(&self, name: &'static str) -> Result<Option<&'d str>> {
        self.typed(name, "string", |value| if let Value::Text(text) = value { Some(text.as_str()) } else { None })
    }

    /// A `<string>` that must be there.
    pub(crate) fn required_text(&self, name: &'static str) -> Result<&'d str> {
        self.text(name)?.ok_or_else(|| {
            let message = format!("{} needs the parameter '{name}' (a <string>)", self.title());
            self.document.sources.error(self.object.at, message)
        })
    }

    /// A `<string>` in lower case that is one of the `choices`; the first of them if it is not there.
    pub(crate) fn choice(&self, name: &'static str, choices: &[&'static str]) -> Result<&'static str> {
        let Some(text) = self.text(name)? else {
            return Ok(choices.first().copied().unwrap_or(""));
        };
        let lower = text.to_lowercase();
        choices.iter().copied().find(|choice| *choice == lower).ok_or_else(|| {
            self.error(name, format!("'{name}' cannot be '{text}'{}", suggestion(&lower, choices.iter().copied())))
        })
    }

    /// A `<point>` or `<vector>`.
    pub(crate) fn vector(&self, name: &'static str) -> Result<Option<DVec3>> {
        self.typed(name, "vector", |value| if let Value::Vector(v) = value { Some(*v) } else { None })
    }

    /// A `<transform>`.
    pub(crate) fn transform(&self, name: &'static str) -> Result<Option<DAffine3>> {
        self.typed(name, "transform", |value| if let Value::Transform(m) = value { Some(*m) } else { None })
    }

    /// Child objects of a category, in the order of the file, with their places.
    pub(crate) fn children(&self, category: Category) -> Vec<(ObjectId, Loc)> {
        let mut found = Vec::new();
        for param in &self.object.params {
            if let Value::Child(id) = param.value
                && self.document.objects[id].category == category
            {
                param.used.set(true);
                found.push((id, param.at));
            }
        }
        found
    }

    /// The child object of a category; more than one is an error.
    pub(crate) fn child(&self, category: Category) -> Result<Option<(ObjectId, Loc)>> {
        match self.children(category)[..] {
            [] => Ok(None),
            [only] => Ok(Some(only)),
            [_, (_, second), ..] => {
                let message = format!("{} can have only one {}", self.title(), category.tag());
                Err(self.document.sources.error(second, message))
            }
        }
    }

    /// Notes that the object was used; complains about parameters that nobody asked for.
    pub(crate) fn finish(self, b: &mut Builder<'_>) -> Result<()> {
        b.note_used(self.id);
        for param in self.object.params.iter().filter(|p| !p.used.get()) {
            let sources = &self.document.sources;
            if let Value::Child(id) = param.value {
                let child = &self.document.objects[id];
                if child.category == Category::Medium {
                    return Err(sources.unsupported(param.at, title(child), ""));
                }
                if param.name.is_empty() || self.asked.borrow().is_empty() {
                    b.complain(param.at, format!("{} has no use for a {}", self.title(), title(child)))?;
                    continue;
                }
            }
            let hint = suggestion(&param.name, self.asked.borrow().iter().copied());
            b.complain(param.at, format!("{} has no parameter '{}'{hint}", self.title(), param.name))?;
        }
        Ok(())
    }

    fn typed<T>(&self, name: &'static str, wanted: &str, get: impl Fn(&'d Value) -> Option<T>) -> Result<Option<T>> {
        let Some(param) = self.find(name) else { return Ok(None) };
        match get(&param.value) {
            Some(value) => Ok(Some(value)),
            None => {
                let message = format!("'{name}' must be a <{wanted}>, not a <{}>", param.value.tag());
                Err(self.document.sources.error(param.at, message))
            }
        }
    }
}

/// For messages: `bsdf 'diffuse'`.
pub(crate) fn title(object: &Object) -> String {
    match object.category {
        Category::Scene => "<scene>".into(),
        category => format!("{} '{}'", category.tag(), object.plugin),
    }
}
