//! `snell check`: whether the installed command answers right.

mod accel;
mod determinism;
mod laws;
mod light;
mod page;
mod scene;
mod spawn;

use super::args::CheckArgs;
use super::{EXIT_FAILED, prepare};
use crate::error::{Error, Result};
use rayon::ThreadPool;
use std::process::ExitCode;
use std::time::Instant;

/// Runs the checks that are asked for: 0 if all is right, 1 if anything is wrong.
pub(super) fn run(args: &CheckArgs) -> Result<ExitCode> {
    let pool = prepare::pool(args.threads)?;
    let asked = [args.accel, args.spawn, args.bsdf, args.light, args.scene, args.determinism];
    let count = asked.iter().filter(|&&asked| asked).count();
    let right = match count {
        // What names a mesh or a ray speaks of accelerators.
        0 if args.mesh.is_some() || args.kind.is_some() => pool.install(|| accel::run(args))?,
        0 => all(args, &pool)?,
        1 => one(args, &pool, asked)?,
        _ if args.kind.is_some() => {
            return Err(Error::Usage("--kind: of which check? Expected one of them only".into()));
        }
        _ => one(args, &pool, asked)?,
    };
    Ok(if right { ExitCode::SUCCESS } else { ExitCode::from(EXIT_FAILED) })
}

/// Everything, on a page.
fn all(args: &CheckArgs, pool: &ThreadPool) -> Result<bool> {
    let start = Instant::now();
    let mut right = pool.install(|| accel::summary(args))?;
    right &= one(args, pool, [false, true, true, true, true, true])?;
    let seconds = start.elapsed().as_secs_f64();
    page::line("all", "", &format!("{seconds:.0} s"), right);
    Ok(right)
}

/// The checks that are asked for, in the order of [`run`].
fn one(args: &CheckArgs, pool: &ThreadPool, asked: [bool; 6]) -> Result<bool> {
    let [accel, spawn, bsdf, light, scene, determinism] = asked;
    let mut right = true;
    if accel {
        right &= pool.install(|| accel::run(args))?;
    }
    if spawn {
        right &= pool.install(|| spawn::run(args))?;
    }
    if bsdf {
        right &= pool.install(|| laws::run(args))?;
    }
    if light {
        right &= pool.install(|| light::run(args))?;
    }
    if scene {
        right &= scene::run(args, pool)?;
    }
    if determinism {
        right &= determinism::run(args, pool)?;
    }
    Ok(right)
}
