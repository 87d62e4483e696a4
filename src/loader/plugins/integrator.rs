//! Integrators.

use super::{aov, find};
use crate::description::{Integrator, IntegratorKind};
use crate::error::Result;
use crate::loader::build::Builder;
use crate::loader::document::ObjectId;
use crate::loader::params::Params;

/// The last argument counts the integrators around this one.
type IntegratorFn = fn(&mut Builder<'_>, &Params<'_>, u32) -> Result<Integrator>;

/// The supported integrator plugins.
const INTEGRATORS: &[(&str, IntegratorFn)] =
    &[("aov", aov::aov), ("direct", direct), ("moment", aov::moment), ("path", path)];

/// The `<integrator>` of a scene, or one inside of `around` others.
pub(crate) fn integrator(b: &mut Builder<'_>, id: ObjectId, around: u32) -> Result<Integrator> {
    let p = Params::new(b.document, id);
    let made = find(b.document, id, INTEGRATORS)?(b, &p, around)?;
    // How the work is cut up does not change the picture.
    p.accept(&["block_size", "samples_per_pass", "timeout"]);
    p.finish(b)?;
    Ok(made)
}

fn path(b: &mut Builder<'_>, p: &Params<'_>, _: u32) -> Result<Integrator> {
    let default = Integrator::default();
    if p.boolean("strict_normals", false)? {
        b.warn(p.at("strict_normals"), "'strict_normals' is of Mitsuba 0.6 and has no effect, as in Mitsuba 3");
    }
    let max_depth = match p.integer("max_depth")?.unwrap_or(-1) {
        -1 => None,
        depth => Some(u32::try_from(depth).map_err(|_| {
            p.error("max_depth", format!("'max_depth' must be -1 (no limit) or at least 0, not {depth}"))
        })?),
    };
    let rr_depth = p.unsigned("rr_depth", default.rr_depth, 1)?;
    Ok(Integrator { max_depth, rr_depth, hide_emitters: p.boolean("hide_emitters", false)?, ..default })
}

fn direct(b: &mut Builder<'_>, p: &Params<'_>, _: u32) -> Result<Integrator> {
    for name in ["shading_samples", "emitter_samples", "bsdf_samples"] {
        if p.unsigned(name, 1, 0)? != 1 {
            b.approximate(p.at(name), &format!("'{name}' other than 1"), "", "one sample")?;
        }
    }
    let hide_emitters = p.boolean("hide_emitters", false)?;
    Ok(Integrator { kind: IntegratorKind::Direct, hide_emitters, ..Integrator::default() })
}
