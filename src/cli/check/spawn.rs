//! `snell check --spawn`: whether rays leave surfaces.

use super::page::{self, chosen, print};
use crate::check::spawn::pairs::Kind;
use crate::check::spawn::{self, Counts, Failure, Fault, WHO};
use crate::cli::args::CheckArgs;
use crate::error::Result;
use std::io::Write;
use std::time::Instant;

/// Rays of each kind, unless the user says how many.
const RAYS: u64 = 1_000_000;

/// Rays of `--long`, in all.
const LONG: u64 = 1_000_000_000;

/// After so many rays a line says how far it is.
const STEP: u64 = 1 << 24;

/// A line for each kind of surface. Returns whether nothing is wrong but what Embree loses.
pub(super) fn run(args: &CheckArgs) -> Result<bool> {
    let kinds = chosen("kind", args.kind.as_deref(), &Kind::ALL.map(Kind::name))?;
    let mut right = true;
    for kind in kinds.into_iter().map(|place| Kind::ALL[place]) {
        let counts = match args.ray {
            Some(index) => spawn::run(kind, args.seed, index, index.saturating_add(1))?,
            None => many(args, kind)?,
        };
        let wrong = counts.failures[0] + counts.failures[1] - counts.lost_by_embree;
        let what = format!(
            "{} rays, {} to a neighbour, {} met it, {} segments, {} asked of embree, which lost {}; {wrong} wrong",
            counts.trials, counts.towards, counts.met, counts.segments, counts.of_embree, counts.lost_by_embree
        );
        page::line("spawn", kind.name(), &what, wrong == 0);
        for failure in counts.examples.iter().filter(|failure| args.verbose || !is_lost(failure)) {
            show(args, kind, failure);
        }
        right &= wrong == 0;
    }
    Ok(right)
}

/// Whether it is a hit that Embree did not find.
fn is_lost(failure: &Failure) -> bool {
    failure.who == 1 && failure.fault == Fault::Missed
}

fn many(args: &CheckArgs, kind: Kind) -> Result<Counts> {
    let wanted = if args.long { LONG.div_ceil(Kind::ALL.len() as u64) } else { args.rays.unwrap_or(RAYS) };
    let start = Instant::now();
    let (mut counts, mut next) = (Counts::default(), 0);
    while counts.trials < wanted {
        let step = STEP.min(wanted - counts.trials);
        counts = counts.and(spawn::run(kind, args.seed, next, next + step)?);
        next += step;
        if args.long && counts.trials < wanted {
            let (percent, seconds) = (100 * counts.trials / wanted, start.elapsed().as_secs_f64());
            let _ = writeln!(std::io::stderr(), "{}: {percent} % after {seconds:.0} s", kind.name());
        }
    }
    Ok(counts)
}

fn show(args: &CheckArgs, kind: Kind, failure: &Failure) {
    let Failure { index, who, fault, ray, met } = failure;
    print(format_args!("  {}: {fault:?}, met {met:?}: {ray:?}", WHO[*who]));
    page::replay(&page::command("spawn", kind.name(), Some(*index), args.seed));
}
