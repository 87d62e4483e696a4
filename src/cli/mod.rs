//! The command line: arguments in, exit code out. The only place that prints and exits.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "talking to the user is this module's job")]

mod args;
mod info;
mod interrupt;
mod prepare;
mod progress;
mod render;
mod replay;
mod stats;

use args::{Arguments, Command};
use clap::Parser;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// Bad usage or bad input.
const EXIT_USAGE: u8 = 2;
/// Interrupted; the picture so far is written.
const EXIT_INTERRUPTED: u8 = 130;

/// Runs the command that `arguments` (program name first) ask for. 0: done; 2: bad usage or input; 130: interrupted.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version are no errors, and go to standard output. Nobody may be reading: that is no error either.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { EXIT_USAGE } else { 0 });
        }
    };
    let result = match &arguments.command {
        Command::Render(a) => render::run(a),
        Command::Info(a) => info::run(a).map(|()| ExitCode::SUCCESS),
    };
    result.unwrap_or_else(|error| {
        let _ = writeln!(std::io::stderr(), "error: {error}");
        ExitCode::from(EXIT_USAGE)
    })
}
