//! `snell check --light`: whether lights hold at their edges.

use super::page::{self, chosen, print};
use crate::check::lights::{FALSE_ALARMS, Part, run as ask};
use crate::cli::args::CheckArgs;
use crate::error::Result;

/// What is shown of each part.
const SHOWN: usize = 5;

/// A line for each part. Returns whether nothing is wrong.
pub(super) fn run(args: &CheckArgs) -> Result<bool> {
    let parts = chosen("kind", args.kind.as_deref(), &Part::ALL.map(Part::name))?;
    let mut right = true;
    for part in parts.into_iter().map(|place| Part::ALL[place]) {
        let verdicts = ask(part, args.seed, args.long, args.ray.map(|ray| ray as usize));
        let family = match part {
            Part::Skies => format!(", χ² with {} % of false alarms in all", 100.0 * FALSE_ALARMS),
            _ => String::new(),
        };
        let (tests, wrong) = (verdicts.tests, verdicts.broken.len());
        let what = format!("{tests} tests, {} samples{family}; {wrong} wrong", verdicts.samples);
        page::line("light", part.name(), &what, wrong == 0);
        for (number, failure) in verdicts.broken.iter().take(SHOWN) {
            print(format_args!("  {failure}"));
            page::replay(&page::command("light", part.name(), Some(*number as u64), args.seed));
        }
        right &= wrong == 0;
    }
    Ok(right)
}
