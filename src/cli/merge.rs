//! `snell merge`: puts the parts of a render together.

use super::args::MergeArgs;
use super::finish;
use super::record::Record;
use super::render::reserve_pictures;
use crate::error::{Error, Result};
use crate::error_estimate::Estimates;
use crate::render::State;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// How certain the interval of the picture's error is, as by default in a render.
const CONFIDENCE: f64 = 0.95;

/// One part.
struct Part {
    path: PathBuf,
    record: Record,
    state: State,
}

/// Reads the parts, adds them up, and writes the picture; `command` is what the arguments come from, as a shell takes it.
pub(super) fn run(args: &MergeArgs, command: &str) -> Result<ExitCode> {
    let say = |text: std::fmt::Arguments<'_>| {
        if !args.quiet {
            // Nobody may be reading.
            let _ = writeln!(std::io::stderr(), "{text}");
        }
    };
    if let Some(both) = args.output.iter().find(|output| args.shards.contains(output)) {
        return Err(Error::file(both, "cannot write the picture: this is one of the shards"));
    }
    let pictures = reserve_pictures(&args.output, &[])?;
    let mut parts = args.shards.iter().map(read).collect::<Result<Vec<_>>>()?;
    parts.sort_by_key(|part| (part.record.samples.start, part.record.samples.end));
    check(&parts)?;
    let mut parts = parts.into_iter();
    // There is at least one: the arguments ask for it.
    let Some(Part { mut record, state: State { film, .. }, path: first }) = parts.next() else {
        return Ok(ExitCode::SUCCESS);
    };
    let mut outcome = record.outcome();
    for part in parts {
        film.add_film(&part.state.film).ok_or_else(|| Error::file(&part.path, of_another(&first)))?;
        outcome = outcome.and(&part.record.outcome());
    }
    record.finish.about.insert("snell.command".into(), command.into());
    let mut failures = Vec::new();
    let estimates = film.has_parts().then(|| Estimates::from_halves(&film));
    outcome.error = estimates.as_ref().map(|estimates| (estimates.whole(CONFIDENCE), CONFIDENCE));
    record.finish.develop((&film, estimates.as_ref()), &outcome, args.exposure, None, |layers, options| {
        finish::write(layers, options, pictures, &say, &mut failures)
    });
    finish::last_of(failures).map(|()| ExitCode::SUCCESS)
}

fn read(path: &PathBuf) -> Result<Part> {
    let (record, sums) = Record::open(path)?;
    if record.is_adaptive() {
        let message = "this is no part of a picture: it is of a render with --adaptive or --target-error";
        return Err(Error::file(path, message));
    }
    Ok(Part { state: record.state(path, &sums)?, path: path.clone(), record })
}

fn of_another(first: &Path) -> String {
    format!("this is of another render than {}", first.display())
}

/// An error unless the parts, in the order of their samples, are all of one render, each of them once and whole.
fn check(parts: &[Part]) -> Result<()> {
    let mut next = 0;
    let mut last: Option<&Part> = None;
    for part in parts {
        let Part { path, record, .. } = part;
        if let Some(first) = parts.first() {
            first.record.identity.expect(&record.identity, path, &of_another(&first.path))?;
        }
        if !record.complete {
            return Err(Error::file(path, "this part is not finished: resume it, or render it again"));
        }
        if let Some(last) = last
            && record.samples.start < next
        {
            let message = format!(
                "samples {} to {} are in {}, too",
                record.samples.start,
                next.min(record.samples.end) - 1,
                last.path.display()
            );
            return Err(Error::file(path, message));
        }
        gap(next, record.samples.start, path)?;
        next = record.samples.end;
        last = Some(part);
    }
    match last {
        Some(Part { path, record, .. }) => gap(next, record.all_samples, path),
        None => Ok(()),
    }
}

/// An error if there are samples from `start` to before `end`, which no part has.
fn gap(start: u32, end: u32, near: &Path) -> Result<()> {
    if start >= end {
        return Ok(());
    }
    Err(Error::file(near, format!("samples {start} to {} of each pixel are in none of the parts", end - 1)))
}
