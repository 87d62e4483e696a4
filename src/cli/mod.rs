//! The command line: arguments in, exit code out. The only place that prints and exits.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "talking to the user is this module's job")]

mod aov;
mod args;
mod bench;
mod check;
mod diff;
mod finish;
mod goal;
mod identity;
mod info;
mod interrupt;
mod keeper;
mod merge;
mod prepare;
mod progress;
mod record;
mod render;
mod replay;
mod stats;

use crate::error::Error;
use crate::image::sums_file::Sums;
use crate::math::simd;
use args::{Arguments, Command};
use clap::{CommandFactory, Parser};
use record::Record;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// A comparison failed, a reference was too noisy for what was to be measured, or a render ended short of its target.
const EXIT_FAILED: u8 = 1;
/// Bad usage or bad input.
const EXIT_USAGE: u8 = 2;
/// Interrupted; the picture so far is written.
const EXIT_INTERRUPTED: u8 = 130;

/// The words of a command as a shell takes them; bytes that are no text are shown as such, not kept.
fn shell_line(words: &[OsString]) -> String {
    let quoted = words.iter().map(|word| {
        let word = word.to_string_lossy();
        // No argument holds a NUL: systems end arguments with it.
        shlex::try_quote(&word).unwrap_or_default().into_owned()
    });
    quoted.collect::<Vec<_>>().join(" ")
}

/// What `merge` and `render --resume` ask of a file, and the picture that it makes: for those who get such files from strangers.
///
/// Fails, with the reason, where record and sums do not fit together; as they do not where samples went where the error is, and a filter
/// mixed them or paths were shared, which only the scene tells.
pub fn check_sums(sums: &Sums) -> Result<(), String> {
    let (record, film) = Record::show(sums)?;
    record.finish.develop((&film, None), &record.outcome(), 0.0, None, |_, _| ());
    Ok(())
}

/// Prints an error. Nobody may be reading.
fn print_error(error: &Error) {
    let _ = writeln!(std::io::stderr(), "error: {error}");
}

/// Runs the command that `arguments` (program name first) ask for. 0: done; 1: a comparison failed; 2: bad usage or input;
/// 130: interrupted.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let words: Vec<OsString> = arguments.into_iter().collect();
    let arguments = match Arguments::try_parse_from(&words) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version are no errors, and go to standard output. Nobody may be reading: that is no error either.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { EXIT_USAGE } else { 0 });
        }
    };
    let result = simd::check().map_err(Error::Usage).and_then(|()| match &arguments.command {
        Command::Render(a) => render::run(a, &shell_line(&words)),
        Command::Info(a) => info::run(a).map(|()| ExitCode::SUCCESS),
        Command::Diff(a) => diff::run(a),
        Command::Bench(a) => bench::run(a, &shell_line(&words)),
        Command::Merge(a) => merge::run(a, &shell_line(&words)),
        Command::Check(a) => check::run(a),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Arguments::command(), "snell", &mut script);
            // Nobody may be reading.
            let _ = std::io::stdout().write_all(&script);
            Ok(ExitCode::SUCCESS)
        }
    });
    result.unwrap_or_else(|error| {
        print_error(&error);
        ExitCode::from(EXIT_USAGE)
    })
}
