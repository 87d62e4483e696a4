//! Integrators.

use super::find;
use crate::description::{Integrator, IntegratorKind};
use crate::error::Result;
use crate::loader::build::Builder;
use crate::loader::document::ObjectId;
use crate::loader::params::Params;

type IntegratorFn = fn(&mut Builder<'_>, &Params<'_>) -> Result<Integrator>;

/// The supported integrator plugins.
const INTEGRATORS: &[(&str, IntegratorFn)] = &[("direct", direct), ("path", path)];

/// The `<integrator>` of a scene.
pub(crate) fn integrator(b: &mut Builder<'_>, id: ObjectId) -> Result<Integrator> {
    let p = Params::new(b.document, id);
    let mut made = find(b.document, id, INTEGRATORS)?(b, &p)?;
    made.hide_emitters = p.boolean("hide_emitters", false)?;
    // How the work is cut up does not change the picture.
    p.accept(&["block_size", "samples_per_pass", "timeout"]);
    p.finish(b)?;
    Ok(made)
}

fn path(_: &mut Builder<'_>, p: &Params<'_>) -> Result<Integrator> {
    let default = Integrator::default();
    let max_depth = match p.integer("max_depth")?.unwrap_or(-1) {
        -1 => None,
        depth => Some(u32::try_from(depth).map_err(|_| {
            p.error("max_depth", format!("'max_depth' must be -1 (no limit) or at least 0, not {depth}"))
        })?),
    };
    Ok(Integrator { max_depth, rr_depth: p.unsigned("rr_depth", default.rr_depth, 1)?, ..default })
}

fn direct(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Integrator> {
    for name in ["shading_samples", "emitter_samples", "bsdf_samples"] {
        if p.unsigned(name, 1, 0)? != 1 {
            b.approximate(p.at(name), &format!("'{name}' other than 1"), "", "one sample")?;
        }
    }
    Ok(Integrator { kind: IntegratorKind::Direct, ..Integrator::default() })
}
