//! The report as text: aligned columns, everything relative to the first configuration.

use super::fit::Spread;
use super::report::{Configuration, Figures, ReferenceFacts, Report, Scene};
use std::fmt::Write;
use std::ops::Range;

/// Stands for a number that does not exist.
const NONE: &str = "-";

/// The whole report.
pub fn text(report: &Report) -> String {
    let mut text = String::new();
    report.scenes.iter().for_each(|scene| of_scene(&mut text, scene));
    let count = report.scenes.first().map_or(0, |s| s.configurations.len());
    if count > 1 {
        text.push_str("Efficiency, 1/(CPU seconds x relMSE), beside that of the first configuration:\n\n");
        overview(&mut text, report);
    }
    text
}

fn of_scene(text: &mut String, scene: &Scene) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{}  {}x{}, against {}\n", scene.name, scene.width, scene.height, against(&scene.reference));
    let head = ["", "samples", "CPU s", "relMSE", "from", "to", "efficiency", "x first", "from", "to"];
    let mut rows = vec![head.map(str::to_owned)];
    for configuration in &scene.configurations {
        rows.extend(configuration.rows.iter().map(|row| columns(configuration, row)));
    }
    text.push_str(&aligned(&rows));
    for c in &scene.configurations {
        let slopes = [("samples", c.slope_samples), ("CPU seconds", c.slope_seconds)];
        for (of, slope) in slopes.into_iter().filter_map(|(of, slope)| Some((of, slope?))) {
            let _ = writeln!(text, "  {}: error ~ {of}^{slope:.2}", c.name);
        }
        let _ = writeln!(text, "  {}: {} CPU s to load and build", c.name, significant(c.load_cpu_seconds));
        for row in &c.rows {
            if let Some(why) = &row.refusal {
                let _ = writeln!(text, "  {}, {} samples REFUSED: {why}", c.name, row.samples);
            }
        }
        of_split(text, c);
    }
    text.push('\n');
}

/// What a scene was measured against.
pub(super) fn against(reference: &ReferenceFacts) -> String {
    let what = match (&reference.file, reference.samples) {
        (Some(file), _) => file.clone(),
        (None, Some(samples)) => format!("{samples} samples rendered for this"),
        (None, None) => "nothing".into(),
    };
    match reference.own_error {
        Some(own) => format!("{what} (own error {own:.1e}, {})", reference.own_error_from),
        None => format!("{what} (own error {})", reference.own_error_from),
    }
}

fn columns(configuration: &Configuration, row: &Figures) -> [String; 10] {
    let median = |s: Option<Spread>, show: &dyn Fn(f64) -> String| s.map_or(NONE.into(), |s| show(s.median));
    let ends = |s: Option<Spread>, show: &dyn Fn(f64) -> String| {
        s.map_or([NONE.to_owned(), NONE.to_owned()], |s| [show(s.low), show(s.high)])
    };
    let error = |v: f64| format!("{v:.2e}");
    let [error_low, error_high] = ends(row.relmse, &error);
    let [ratio_low, ratio_high] = ends(row.efficiency_ratio, &ratio);
    [
        configuration.name.clone(),
        row.samples.to_string(),
        median(row.cpu_seconds, &significant),
        median(row.relmse, &error),
        error_low,
        error_high,
        if row.accepted { median(row.efficiency, &significant) } else { "refused".into() },
        median(row.efficiency_ratio, &ratio),
        ratio_low,
        ratio_high,
    ]
}

fn of_split(text: &mut String, configuration: &Configuration) {
    let Some(split) = &configuration.split else { return };
    let name = &configuration.name;
    let _ = writeln!(text, "\n  {name}: what carries the error of {} samples, {:.2e}\n", split.samples, split.error);
    for partition in &split.partitions {
        let part = |error: f64| format!("{:.1} %", 100.0 * error / split.error.max(f64::MIN_POSITIVE));
        let mut rows = vec![[partition.by.to_owned(), "of the light".into(), "of the error".into()]];
        let class = |c: &super::split::Class| [c.name.clone(), format!("{:.1} %", 100.0 * c.light), part(c.error)];
        rows.extend(partition.shown().map(class));
        rows.push(["in common".into(), String::new(), part(partition.covariance)]);
        text.push_str(&aligned(&rows));
        text.push('\n');
    }
}

/// Scenes by configurations.
fn overview(text: &mut String, report: &Report) {
    let Some(first) = report.scenes.first() else { return };
    let names = first.configurations.iter().map(|c| c.name.clone());
    let mut rows = vec![std::iter::once(String::new()).chain(names).collect::<Vec<_>>()];
    for scene in &report.scenes {
        let cell = |c: &Configuration| match c.efficiency_ratio {
            Some(s) if s.low < s.high => format!("{:.2} ({:.2} to {:.2})", s.median, s.low, s.high),
            Some(s) => format!("{:.2}", s.median),
            None => NONE.into(),
        };
        rows.push(std::iter::once(scene.name.clone()).chain(scene.configurations.iter().map(cell)).collect());
    }
    if report.scenes.len() > 1 {
        let mean = report.efficiency_ratios.iter().map(|r| r.map_or(NONE.into(), |r| format!("{r:.2}")));
        rows.push(std::iter::once("geometric mean".to_owned()).chain(mean).collect());
    }
    text.push_str(&aligned(&rows));
}

/// Rows of cells, the first column flush left, the others right.
fn aligned<T: AsRef<[String]>>(rows: &[T]) -> String {
    let columns = rows.iter().map(|row| row.as_ref().len()).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.as_ref().get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (i, (cell, width)) in row.as_ref().iter().zip(&widths).enumerate() {
            let _ = if i == 0 { write!(line, "  {cell:<width$}") } else { write!(line, "  {cell:>width$}") };
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// A positive number with three digits that count.
pub(super) fn significant(v: f64) -> String {
    /// Below this, and from this on, with a power of ten.
    const RANGE: Range<f64> = 1e-3..1e6;
    if !RANGE.contains(&v) {
        return if v == 0.0 { "0".into() } else { format!("{v:.2e}") };
    }
    let digits = (2 - libm::floor(libm::log10(v)) as i32).max(0) as usize;
    format!("{v:.digits$}")
}

/// A ratio: two digits behind the point, and more where they would be zeros.
pub(super) fn ratio(v: f64) -> String {
    /// Where these are three digits at least, and not many more.
    const RANGE: Range<f64> = 0.1..100.0;
    if RANGE.contains(&v) { format!("{v:.2}") } else { significant(v) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_count() {
        let known = [
            (0.0, "0"),
            (0.000_123_4, "1.23e-4"),
            (0.012_34, "0.0123"),
            (1.0, "1.00"),
            (12.345, "12.3"),
            (99_999.4, "99999"),
            (1_234_567.0, "1.23e6"),
        ];
        for (value, text) in known {
            assert_eq!(significant(value), text);
        }
    }

    #[test]
    fn columns_are_aligned() {
        let row = |cells: [&str; 2]| cells.map(str::to_owned);
        assert_eq!(aligned(&[row(["", "b"]), row(["long", "1.5"])]), "          b\n  long  1.5\n");
    }
}
