//! The report as one page of HTML that needs nothing else: plots, pictures, maps of errors.

mod pictures;
mod plot;
mod scene;

use super::fit::Spread;
use super::report::{Configuration, Report, Scene};
use super::table::{ratio, significant};
use std::fmt::Write;

/// Colours that the page's style defines.
const COLOURS: usize = 9;

/// The page.
pub fn html(report: &Report) -> String {
    let names: Vec<&str> = report.scenes.iter().map(|s| s.name.as_str()).collect();
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\"><title>snell bench: {}</title>\n<style>\n{}</style></head><body><main>\n",
        escaped(&names.join(", ")),
        include_str!("style.css")
    );
    header(&mut page, report);
    headline(&mut page, report);
    report.scenes.iter().for_each(|scene| scene::section(&mut page, scene, report));
    footer(&mut page, report);
    page.push_str("</main></body></html>\n");
    page
}

/// Text as it may stand between tags and in attributes.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// `one thing`, `2 things`.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn header(page: &mut String, report: &Report) {
    let (machine, settings) = (&report.machine, &report.settings);
    let processor = machine.processor.as_ref().map_or(String::new(), |p| format!("{}, ", escaped(p)));
    let costs: Vec<String> = settings.costs.iter().map(f64::to_string).collect();
    let unit = if settings.budget == "samples" { "samples per pixel" } else { "CPU seconds" };
    // Writing to a string cannot fail.
    let _ = write!(
        page,
        "<h1>Error for the time it takes</h1>\n<p class=\"facts\">snell {} · {} · {processor}{}, {} used · {}</p>\n<p \
         class=\"facts\">{} {unit}, {} each</p>\n",
        report.version,
        escaped(&report.date),
        counted(machine.cores, "core"),
        counted(machine.threads, "thread"),
        escaped(&machine.system),
        costs.join(", "),
        counted(settings.seeds, "seed"),
    );
    if report.refused > 0 {
        let _ = writeln!(
            page,
            "<div class=\"note\">{} refused: the reference cannot measure them. They are marked below, and count \
             nowhere.</div>",
            counted(report.refused, "row")
        );
    }
}

/// The table to be seen first: scenes by configurations.
fn headline(page: &mut String, report: &Report) {
    let Some(first) = report.scenes.first() else { return };
    let many = first.configurations.len() > 1;
    let title = if many {
        format!("How many times as efficient as {}", escaped(&first.configurations[0].name))
    } else {
        "Efficiency".to_owned()
    };
    let _ = write!(
        page,
        "<section class=\"card\"><h2>{title}</h2><p class=\"small\">Efficiency is 1/(CPU seconds of rendering × relMSE). \
         Median over seeds, smallest to largest in brackets, at the largest cost that counts.</p><div \
         class=\"scroll\"><table class=\"headline\"><tr><th>scene</th>"
    );
    for (i, c) in first.configurations.iter().enumerate() {
        let _ = write!(page, "<th>{}{}</th>", swatch(i), escaped(&c.name));
    }
    page.push_str("</tr>");
    for scene in &report.scenes {
        let _ = write!(page, "<tr><td class=\"name\">{}</td>", escaped(&scene.name));
        for (i, configuration) in scene.configurations.iter().enumerate() {
            let cell = if i == 0 { first_cell(configuration, many) } else { ratio_cell(configuration, scene) };
            let _ = write!(page, "<td>{cell}</td>");
        }
        page.push_str("</tr>");
    }
    if many && report.scenes.len() > 1 {
        page.push_str("<tr class=\"mean\"><td class=\"name\">geometric mean</td>");
        for ratio in &report.efficiency_ratios {
            let _ = write!(page, "<td class=\"big\">{}</td>", ratio.map_or("–".into(), times));
        }
        page.push_str("</tr>");
    }
    page.push_str("</table></div></section>\n");
}

fn times(factor: f64) -> String {
    format!("{}×", ratio(factor))
}

/// A square of a configuration's colour.
fn swatch(index: usize) -> String {
    format!("<i class=\"swatch scale-{}\"></i>", index % COLOURS)
}

/// What the others are compared with: what it took, and what error that left.
fn first_cell(configuration: &Configuration, many: bool) -> String {
    let Some(row) = configuration.rows.iter().rev().find(|row| row.efficiency.is_some()) else {
        return "<span class=\"bad\">refused</span>".into();
    };
    let number = |s: Option<Spread>| s.map_or("–".into(), |s| significant(s.median));
    let big = if many { "1×".to_owned() } else { number(row.efficiency) };
    format!(
        "<div class=\"big\">{big}</div><div class=\"small\">{} CPU s, relMSE {} at {}</div>",
        number(row.cpu_seconds),
        number(row.relmse),
        counted(row.samples as usize, "sample")
    )
}

fn ratio_cell(configuration: &Configuration, scene: &Scene) -> String {
    let base = scene.configurations.first().map_or(&[][..], |c| &c.rows);
    let pairs = configuration.rows.iter().zip(base).rev();
    let Some((spread, row, base)) = pairs.filter_map(|(row, base)| Some((row.efficiency_ratio?, row, base))).next()
    else {
        return "<span class=\"bad\">refused</span>".into();
    };
    // Where seeds disagree, there is nothing to be glad or sorry about.
    let class = match spread {
        Spread { low, .. } if low > 1.0 => "big good",
        Spread { high, .. } if high < 1.0 => "big bad",
        _ => "big",
    };
    let error = match (row.relmse, base.relmse) {
        (Some(own), Some(first)) if own.median > 0.0 => ratio(own.median / first.median),
        _ => "–".into(),
    };
    let time = row.speed_ratio.map_or("–".into(), |s| ratio(1.0 / s.median));
    let samples = if row.samples == base.samples { String::new() } else { format!(", {} samples", row.samples) };
    format!(
        "<div class=\"{class}\">{}</div><div class=\"small\">({} – {}) {error}× the error, {time}× the time{samples}</div>",
        times(spread.median),
        ratio(spread.low),
        ratio(spread.high),
    )
}

fn footer(page: &mut String, report: &Report) {
    let _ = writeln!(
        page,
        "<section class=\"card\"><h2>How to read this</h2><p>relMSE is the mean over pixels and channels of (x − r)²/(r² + \
         0.01), with r the reference, whose own error is subtracted where it is known. Points are single seeds, lines go \
         through their medians, bands from the smallest to the largest; the dotted line falls as the errors of independent \
         samples do. CPU seconds are those of all threads while rendering; loading and building are stated apart. \
         Configurations were rendered in turn.</p><p class=\"muted\"><code>{}</code></p></section>",
        escaped(&report.command)
    );
}
