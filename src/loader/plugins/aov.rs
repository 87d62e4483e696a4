//! Integrators around others: `aov` and `moment`, which add channels to the picture of the one inside.

use super::integrator::integrator;
use crate::description::{Aov, AovKind, Integrator};
use crate::error::Result;
use crate::loader::build::Builder;
use crate::loader::document::{Category, Value};
use crate::loader::params::Params;
use crate::loader::source::Loc;
use crate::loader::suggest::suggestion;
use std::collections::BTreeSet;

/// Most integrators around another. Reason: each `moment` doubles the channels.
const MAX_AROUND: u32 = 4;

/// Most channels. Reason: a pixel takes 16 bytes for each; no picture needs more.
const MAX_CHANNELS: usize = 256;

/// Longest name of a channel: OpenEXR's limit.
const MAX_NAME: usize = 255;

/// Quantities of the surface that is seen, by Mitsuba's names.
const KINDS: &[(&str, AovKind)] = &[
    ("albedo", AovKind::Albedo),
    ("depth", AovKind::Depth),
    ("position", AovKind::Position),
    ("uv", AovKind::Uv),
    ("geo_normal", AovKind::GeometricNormal),
    ("sh_normal", AovKind::ShadingNormal),
    ("prim_index", AovKind::PrimitiveIndex),
    ("shape_index", AovKind::ShapeIndex),
];

/// Those that Mitsuba has and snell has not.
const UNSUPPORTED: &[&str] = &["boundary_test", "dp_du", "dp_dv", "duv_dx", "duv_dy"];

/// Surfaces as the camera sees them, beside the picture of the integrator inside, if there is one.
pub(crate) fn aov(b: &mut Builder<'_>, p: &Params<'_>, around: u32) -> Result<Integrator> {
    let mut made = match inner(b, p, around)? {
        Some((name, inner)) => {
            let within = inner.aovs.iter().map(|aov| renamed(aov, &name));
            let aovs = [named(&name, AovKind::Radiance), named(&name, AovKind::Alpha)].into_iter().chain(within);
            Integrator { aovs: aovs.collect(), ..inner }
        }
        // Nothing but what is asked for: the picture is black.
        None => Integrator { max_depth: Some(0), ..Integrator::default() },
    };
    let list = p.required_text("aovs")?;
    let at = p.at("aovs");
    for item in list.split([' ', ',', '\t', '\n', '\r']).filter(|item| !item.is_empty()) {
        let (name, kind) = match item.split(':').collect::<Vec<_>>()[..] {
            [name, kind] if !name.is_empty() && !kind.is_empty() => (name, kind),
            _ => return Err(p.error("aovs", format!("'aovs' lists pairs NAME:TYPE, and '{item}' is none"))),
        };
        match KINDS.iter().find(|row| row.0 == kind) {
            Some(&(_, kind)) => made.aovs.push(named(name, kind)),
            None => unknown(b, at, kind)?,
        }
    }
    check(b, at, &made)?;
    Ok(made)
}

/// The picture's samples in XYZ, and the squares of that and of all that the integrator inside adds.
pub(crate) fn moment(b: &mut Builder<'_>, p: &Params<'_>, around: u32) -> Result<Integrator> {
    let at = p.object.at;
    let Some((name, inner)) = inner(b, p, around)? else {
        return Err(b.document.sources.error(at, format!("{} needs an integrator inside", p.title())));
    };
    let mut aovs: Vec<Aov> = inner.aovs.iter().map(|aov| renamed(aov, &name)).collect();
    aovs.push(named(&name, AovKind::Xyz));
    if aovs.iter().any(|aov| aov.squared || aov.kind.is_index()) {
        return Err(b.document.sources.unsupported(at, "the second moment of an index or of a second moment", ""));
    }
    let squares: Vec<Aov> = aovs.iter().map(squared).collect();
    aovs.extend(squares);
    let made = Integrator { aovs, ..inner };
    check(b, at, &made)?;
    Ok(made)
}

/// The integrator inside of another, and its name.
fn inner(b: &mut Builder<'_>, p: &Params<'_>, around: u32) -> Result<Option<(String, Integrator)>> {
    // What is hidden is for the integrator inside to say.
    p.accept(&["hide_emitters"]);
    let children = p.children(Category::Integrator);
    let Some(&(id, at)) = children.first() else { return Ok(None) };
    if let Some(&(_, second)) = children.get(1) {
        b.approximate(second, "a second integrator inside of another", "", "the first")?;
    }
    if around >= MAX_AROUND {
        let message = format!("integrators are nested more than {MAX_AROUND} deep");
        return Err(b.document.sources.error(at, message));
    }
    let is_it = |value: &Value| matches!(value, Value::Child(child) if *child == id);
    let name = p.object.params.iter().find(|param| is_it(&param.value)).map_or("", |param| &param.name);
    // What Mitsuba calls a child without a name.
    let name = if name.is_empty() { "_arg_0" } else { name };
    Ok(Some((name.into(), integrator(b, id, around + 1)?)))
}

fn named(name: &str, kind: AovKind) -> Aov {
    let names = kind.components().iter().map(|end| format!("{name}{end}")).collect();
    Aov { names, kind, squared: false }
}

/// What the integrator inside adds, as the one around it calls that.
fn renamed(aov: &Aov, inner: &str) -> Aov {
    Aov { names: aov.names.iter().map(|name| format!("{inner}.{name}")).collect(), ..*aov }
}

fn squared(aov: &Aov) -> Aov {
    Aov { names: aov.names.iter().map(|name| format!("m2_{name}")).collect(), squared: true, ..*aov }
}

fn unknown(b: &mut Builder<'_>, at: Loc, kind: &str) -> Result<()> {
    let known = || KINDS.iter().map(|row| row.0);
    if UNSUPPORTED.contains(&kind) {
        let hint = format!("; supported: {}", known().collect::<Vec<_>>().join(", "));
        return b.approximate(at, &format!("the aov type '{kind}'"), &hint, "no such channel");
    }
    let hint = suggestion(kind, known());
    Err(b.document.sources.error(at, format!("there is no aov type '{kind}'{hint}")))
}

/// Refuses channels that no file can hold.
fn check(b: &Builder<'_>, at: Loc, integrator: &Integrator) -> Result<()> {
    let mut seen = BTreeSet::new();
    for name in integrator.aovs.iter().flat_map(|aov| &aov.names) {
        if name.len() > MAX_NAME || !name.chars().all(|c| c.is_ascii_graphic()) {
            let message =
                format!("a channel cannot be called '{name}': at most {MAX_NAME} ASCII letters, digits and signs");
            return Err(b.document.sources.error(at, message));
        }
        if !seen.insert(name) {
            return Err(b.document.sources.error(at, format!("two channels are called '{name}'")));
        }
    }
    if seen.len() > MAX_CHANNELS {
        let message = format!("{} channels are too many; at most {MAX_CHANNELS} can be written", seen.len());
        return Err(b.document.sources.error(at, message));
    }
    Ok(())
}
