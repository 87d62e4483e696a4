//! `snell check --scene`: whether scenes with closed-form answers show them.

use super::page::{self, chosen};
use crate::accel::Accelerator;
use crate::check::rooms::cases;
use crate::check::scenes::{MOST, read};
use crate::cli::args::CheckArgs;
use crate::error::Result;
use crate::integrator::Estimator;
use rayon::ThreadPool;

/// Samples of a pixel and seed.
const SAMPLES: u32 = 16;

/// A line for each scene. Returns whether all show what they should.
pub(super) fn run(args: &CheckArgs, pool: &ThreadPool) -> Result<bool> {
    let cases = cases();
    let names: Vec<&str> = cases.iter().map(|case| case.name).collect();
    let asked = chosen("kind", args.kind.as_deref(), &names)?;
    let samples = if args.long { 16 * SAMPLES } else { SAMPLES };
    let mut right = true;
    for case in asked.into_iter().map(|place| &cases[place]) {
        let mut worst: Option<(f64, String)> = None;
        let mut is_right = true;
        for (name, estimator, accelerator) in ways(case.name) {
            let reading = read(case, estimator, accelerator, samples, pool)?;
            is_right &= reading.is_right();
            let z = reading.z();
            if worst.as_ref().is_none_or(|(most, _)| z.abs() > most.abs()) {
                worst = Some((z, format!("{name}: {:.6} ± {:.1e}", reading.mean, reading.error)));
            }
        }
        let (z, text) = worst.unwrap_or_default();
        let what = format!("{:.6}; the worst {text}, z {z:.1} of at most {MOST}", case.expected);
        page::line("scene", case.name, &what, is_right);
        if !is_right {
            page::replay(&page::command("scene", case.name, None, args.seed));
        }
        right &= is_right;
    }
    Ok(right)
}

/// Estimators and accelerators, by name. What only light sampling finds, only those look for that do it.
fn ways(case: &str) -> Vec<(&'static str, Estimator, Accelerator)> {
    let mut ways = vec![("path", Estimator::Path, Accelerator::Native), ("nee", Estimator::Nee, Accelerator::Native)];
    if case.starts_with("furnace") || case.contains("under the sky") {
        ways.push(("bsdf", Estimator::Bsdf, Accelerator::Native));
    }
    if cfg!(feature = "embree") {
        ways.push(("path, embree", Estimator::Path, Accelerator::Embree));
    }
    ways
}
