//! `snell check --bsdf`: whether bsdfs obey the laws.

use super::page::{self, chosen, print};
use crate::check::laws::{FALSE_ALARMS, Law, run as ask};
use crate::cli::args::CheckArgs;
use crate::error::Result;

/// What is shown of each law.
const SHOWN: usize = 5;

/// A line for each law. Returns whether none is broken.
pub(super) fn run(args: &CheckArgs) -> Result<bool> {
    let laws = chosen("kind", args.kind.as_deref(), &Law::ALL.map(Law::name))?;
    let mut right = true;
    for law in laws.into_iter().map(|place| Law::ALL[place]) {
        let verdicts = ask(law, args.long, args.ray.map(|ray| ray as usize), args.seed);
        let family = if law == Law::Density {
            format!(", χ² with {} % of false alarms in all", 100.0 * FALSE_ALARMS)
        } else {
            String::new()
        };
        let what = format!("{} bsdfs and directions{family}; {} wrong", verdicts.tests, verdicts.broken.len());
        page::line("bsdf", law.name(), &what, verdicts.broken.is_empty());
        for (number, failure) in verdicts.broken.iter().take(SHOWN) {
            print(format_args!("  {failure}"));
            page::replay(&page::command("bsdf", law.name(), Some(*number as u64), args.seed));
        }
        right &= verdicts.broken.is_empty();
    }
    Ok(right)
}
