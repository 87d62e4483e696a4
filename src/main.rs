//! The `snell` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    snell::cli::run(std::env::args_os())
}
