//! One line for each render, as comma-separated values (RFC 4180).

use super::report::Report;
use std::fmt::Write;

/// Names of the columns.
const HEAD: &str =
    "scene,configuration,accelerator,sampler,integrator,samples,seed,cpu_seconds,wall_seconds,relmse,accepted";

/// Every render of the report.
pub fn csv(report: &Report) -> String {
    let mut text = format!("{HEAD}\n");
    for scene in &report.scenes {
        for c in &scene.configurations {
            let names = [&scene.name, &c.name, &c.accelerator, &c.sampler, &c.integrator].map(|n| quoted(n)).join(",");
            for (row, run) in c.rows.iter().flat_map(|row| row.runs.iter().map(move |run| (row, run))) {
                let (samples, accepted) = (row.samples, row.accepted);
                let (seed, cpu, wall, relmse) = (run.seed, run.cpu_seconds, run.wall_seconds, run.relmse);
                // Writing to a string cannot fail.
                let _ = writeln!(text, "{names},{samples},{seed},{cpu},{wall},{relmse},{accepted}");
            }
        }
    }
    text
}

/// A text in quotes where it needs them.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn texts_are_quoted_where_they_need_it() {
        assert_eq!([quoted("a b"), quoted("a,b"), quoted("a\"b")], ["a b", "\"a,b\"", "\"a\"\"b\""]);
    }
}
