//! `snell check --determinism`: whether pictures are the same to the last bit.

use super::page::{self, chosen, print};
use crate::accel::Accelerator;
use crate::check::rooms::menagerie;
use crate::check::scenes::{compiled, fingerprint, picture, settings};
use crate::cli::args::CheckArgs;
use crate::cli::{EXIT_USAGE, prepare};
use crate::error::{Error, Result};
use crate::integrator::Estimator;
use crate::math::simd;
use glam::DVec3;
use rayon::ThreadPool;
use std::process::Command;

/// What is varied, and one that only tells the bits, to be compared with those of another machine.
const KINDS: [&str; 4] = ["threads", "scale", "simd", "bits"];

/// Powers of two that lengths are multiplied by.
const EXPONENTS: [i32; 6] = [-40, -13, -1, 1, 13, 40];

/// Levels of vector instructions, which not every processor has.
const LEVELS: [&str; 4] = ["sse2", "sse4.2", "avx2", "avx512"];

/// Samples of a pixel.
const SAMPLES: u32 = 16;

/// A line for each thing that is varied. Returns whether no bit changes.
pub(super) fn run(args: &CheckArgs, pool: &ThreadPool) -> Result<bool> {
    let kinds = chosen("kind", args.kind.as_deref(), &KINDS)?;
    let mut right = true;
    for kind in kinds.into_iter().map(|place| KINDS[place]) {
        let (what, is_right) = match kind {
            "threads" => threads(pool)?,
            "scale" => scale(pool)?,
            "simd" => vectors()?,
            _ if args.kind.is_some() => {
                tell(pool)?;
                continue;
            }
            _ => continue,
        };
        page::line("determinism", kind, &what, is_right);
        if !is_right {
            page::replay(&page::command("determinism", kind, None, args.seed));
        }
        right &= is_right;
    }
    Ok(right)
}

/// The accelerators that there are, with their names.
fn accelerators() -> Vec<(&'static str, Accelerator)> {
    let mut all = vec![("native", Accelerator::Native)];
    if cfg!(feature = "embree") {
        all.push(("embree", Accelerator::Embree));
    }
    all
}

fn bits(scale: f64, accelerator: Accelerator, pool: &ThreadPool) -> Result<u64> {
    let scene = compiled(&menagerie().transformed(scale, DVec3::ZERO), accelerator)?;
    let settings = settings(Estimator::Path, SAMPLES, 8);
    Ok(fingerprint(&picture(&scene, &settings, pool).0))
}

fn threads(pool: &ThreadPool) -> Result<(String, bool)> {
    let (one, three) = (prepare::pool(1)?, prepare::pool(3)?);
    let mut right = true;
    for (_, accelerator) in accelerators() {
        let first = bits(1.0, accelerator, &one)?;
        right &= first == bits(1.0, accelerator, pool)? && first == bits(1.0, accelerator, &three)?;
    }
    Ok((format!("1, 3 and {} threads", pool.current_num_threads()), right))
}

fn scale(pool: &ThreadPool) -> Result<(String, bool)> {
    let mut right = true;
    for (_, accelerator) in accelerators() {
        let first = bits(1.0, accelerator, pool)?;
        for exponent in EXPONENTS {
            right &= first == bits(libm::exp2(f64::from(exponent)), accelerator, pool)?;
        }
    }
    Ok((format!("all lengths × 2^k, k of {EXPONENTS:?}"), right))
}

/// Asks this command itself, with fewer vector instructions.
fn vectors() -> Result<(String, bool)> {
    let command = std::env::current_exe().map_err(|e| Error::Usage(format!("cannot find this command itself: {e}")))?;
    let mut told: Vec<(&str, Vec<u8>)> = Vec::new();
    let mut right = true;
    for level in LEVELS {
        let arguments = ["check", "--determinism", "--kind", "bits"];
        let output = Command::new(&command).args(arguments).env(simd::VARIABLE, level).output();
        let output = output.map_err(|e| Error::Usage(format!("cannot run this command itself: {e}")))?;
        if output.status.success() {
            told.push((level, output.stdout));
        } else {
            // A level that the processor does not have is refused; whatever else ends the command is a fault.
            right &= output.status.code() == Some(i32::from(EXIT_USAGE));
        }
    }
    // The least of them every processor of this kind has.
    right &= !told.is_empty() || !cfg!(target_arch = "x86_64");
    let names: Vec<&str> = told.iter().map(|(level, _)| *level).collect();
    right &= told.windows(2).all(|pair| pair[0].1 == pair[1].1);
    let what = if names.is_empty() { "none to choose from".into() } else { names.join(", ") };
    Ok((what, right))
}

/// The bits themselves.
fn tell(pool: &ThreadPool) -> Result<()> {
    for (name, accelerator) in accelerators() {
        print(format_args!("{name} {:016x}", bits(1.0, accelerator, pool)?));
    }
    Ok(())
}
