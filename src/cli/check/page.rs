//! The lines that checks print.

use crate::error::{Error, Result};
use std::io::{IsTerminal, Write};

/// Prints a line.
pub(super) fn print(line: std::fmt::Arguments<'_>) {
    // Nobody may be reading.
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// `ok` or `WRONG`, in green or red on a terminal.
pub(super) fn verdict(right: bool) -> &'static str {
    match (right, std::io::stdout().is_terminal()) {
        (true, false) => "ok",
        (false, false) => "WRONG",
        (true, true) => "\x1b[32mok\x1b[0m",
        (false, true) => "\x1b[31mWRONG\x1b[0m",
    }
}

/// One thing that was checked.
pub(super) fn line(check: &str, name: &str, what: &str, right: bool) {
    print(format_args!("{check:<12} {name:<30} {what:<70} {}", verdict(right)));
}

/// Prints a command that repeats what was wrong, alone.
pub(super) fn replay(command: &str) {
    print(format_args!("  {command}"));
}

/// The command that does one kind of a check again, or one ray or test of it, with its seed.
pub(super) fn command(check: &str, kind: &str, ray: Option<u64>, seed: u64) -> String {
    let kind = if kind.contains(' ') { format!("'{kind}'") } else { kind.to_owned() };
    let ray = ray.map_or(String::new(), |ray| format!(" --ray {ray}"));
    format!("snell check --{check} --kind {kind}{ray} --seed {seed}")
}

/// The places of what is named, or of all.
pub(super) fn chosen(what: &str, name: Option<&str>, names: &[&str]) -> Result<Vec<usize>> {
    let Some(name) = name else { return Ok((0..names.len()).collect()) };
    match names.iter().position(|&known| known == name) {
        Some(place) => Ok(vec![place]),
        None => {
            let known = names.join(", ");
            Err(Error::Usage(format!("--{what}: '{name}' is not known; expected one of {known}")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_name_what_was_wrong() {
        assert_eq!(command("spawn", "sliver", Some(7), 3), "snell check --spawn --kind sliver --ray 7 --seed 3");
        assert_eq!(
            command("scene", "floor in the sun", None, 0),
            "snell check --scene --kind 'floor in the sun' --seed 0"
        );
    }
}
