//! The part of the page that is about one scene.

use super::pictures::{self, exposure, quantile};
use super::plot::{Plot, Series, svg};
use super::{counted, escaped, swatch, times};
use crate::bench::fit::Spread;
use crate::bench::report::{Configuration, Figures, Report, RunFigures, Scene};
use crate::bench::split::Partition;
use crate::bench::table::{against, significant};
use std::fmt::Write;

/// Part of the pixels whose errors are within the colours of the maps.
const WITHIN_RAMP: f64 = 0.99;

/// Everything about `scene`.
pub(super) fn section(page: &mut String, scene: &Scene, report: &Report) {
    // Writing to a string cannot fail.
    let _ = write!(
        page,
        "<section class=\"card\"><h2>{}</h2><p class=\"facts\">{} × {} pixels, measured against {}</p>",
        escaped(&scene.name),
        scene.width,
        scene.height,
        escaped(&against(&scene.reference)),
    );
    refusals(page, scene);
    page.push_str("<div class=\"plots\"><div>");
    page.push_str(&svg(&plot(scene, report, "CPU seconds of rendering", &|_, run| run.cpu_seconds)));
    page.push_str("</div><div>");
    page.push_str(&svg(&plot(scene, report, "samples per pixel", &|row, _| f64::from(row.samples))));
    page.push_str("</div></div>");
    legend(page, scene);
    show_pictures(page, scene);
    splits(page, scene);
    details(page, scene);
    page.push_str("</section>\n");
}

fn refusals(page: &mut String, scene: &Scene) {
    for c in &scene.configurations {
        for (row, why) in c.rows.iter().filter_map(|row| Some((row, row.refusal.as_ref()?))) {
            let samples = counted(row.samples as usize, "sample");
            let _ = write!(
                page,
                "<div class=\"note\"><b>Refused: {}, {samples}.</b> {}</div>",
                escaped(&c.name),
                escaped(why)
            );
        }
    }
}

fn plot(scene: &Scene, report: &Report, x_name: &'static str, x: &dyn Fn(&Figures, &RunFigures) -> f64) -> Plot {
    let points = |row: &Figures| (row.runs.iter().map(|run| (x(row, run), run.relmse)).collect(), row.accepted);
    let series = |c: &Configuration| Series { costs: c.rows.iter().map(points).collect() };
    let by_samples = report.settings.budget == "samples" && x_name.starts_with("samples");
    Plot {
        x_name,
        x_marks: if by_samples { report.settings.costs.clone() } else { Vec::new() },
        floor: scene.reference.least_measurable,
        series: scene.configurations.iter().map(series).collect(),
    }
}

fn legend(page: &mut String, scene: &Scene) {
    let many = scene.configurations.len() > 1;
    page.push_str(
        "<div class=\"scroll\"><table><tr><th>configuration</th><th>error falls as</th><th></th><th>efficiency</th><th>from – \
         to</th>",
    );
    if many {
        page.push_str("<th>beside the first</th>");
    }
    page.push_str("<th>loading</th><th>accelerator</th><th>sampler</th><th>integrator</th></tr>");
    for (i, c) in scene.configurations.iter().enumerate() {
        let slope = |of: &str, s: Option<f64>| s.map_or("–".into(), |s| format!("{of}<sup>{}</sup>", signed(s)));
        let (middle, range) = spread(c.efficiency);
        let _ = write!(
            page,
            "<tr><td>{}{}</td><td>{}</td><td>{}</td><td>{middle}</td><td>{range}</td>",
            swatch(i),
            escaped(&c.name),
            slope("samples", c.slope_samples),
            slope("seconds", c.slope_seconds),
        );
        if many {
            let _ = write!(page, "<td>{}</td>", c.efficiency_ratio.map_or("–".into(), |r| times(r.median)));
        }
        let loading = significant(c.load_cpu_seconds);
        let names = [&c.accelerator, &c.sampler, &c.integrator].map(|n| format!("<td>{}</td>", escaped(n))).concat();
        let _ = write!(page, "<td>{loading} CPU s</td>{names}</tr>");
    }
    page.push_str("</table></div>");
}

/// With a minus sign that looks like one.
fn signed(v: f64) -> String {
    format!("{v:.2}").replace('-', "−")
}

/// Middle, and ends.
fn spread(s: Option<Spread>) -> (String, String) {
    let dash = || "–".to_owned();
    s.map_or((dash(), dash()), |s| (significant(s.median), format!("{} – {}", significant(s.low), significant(s.high))))
}

/// The reference, and for each configuration its picture and its errors.
fn show_pictures(page: &mut String, scene: &Scene) {
    let Some(reference) = &scene.picture else { return };
    let stops = exposure(reference);
    let maps = scene.configurations.iter().filter_map(|c| c.shown.as_ref());
    let top = quantile(maps.flat_map(|(_, map)| map.iter().copied()).collect(), WITHIN_RAMP);
    let exposed = if stops == 0.0 { String::new() } else { format!(", exposure {stops:+} EV") };
    let _ = write!(
        page,
        "<div class=\"pictures\"><div><figure>{}<figcaption>reference{exposed}</figcaption></figure><div \
         class=\"ramp\">{}<div class=\"ends\"><span>0</span><span>{} and more</span></div><p>Maps: relative error of each \
         pixel, root of the mean square over seeds.</p></div></div>",
        pictures::image(reference, stops, "reference"),
        pictures::ramp(),
        significant(f64::from(top)),
    );
    for (i, c) in scene.configurations.iter().enumerate() {
        let Some((picture, map)) = &c.shown else { continue };
        let samples = c.rows.iter().rev().find(|row| !row.runs.is_empty()).map_or(0, |row| row.samples);
        let (name, size) = (escaped(&c.name), (picture.width(), picture.height()));
        let _ = write!(
            page,
            "<div><figure>{}<figcaption>{}{name}, {}</figcaption></figure><figure>{}<figcaption>its \
             error</figcaption></figure></div>",
            pictures::image(picture, stops, &name),
            swatch(i),
            counted(samples as usize, "sample"),
            pictures::heat(size, map, top, &format!("errors of {name}")),
        );
    }
    page.push_str("</div>");
}

/// What carries the error: for each way to split, a bar for each configuration.
fn splits(page: &mut String, scene: &Scene) {
    let with = || scene.configurations.iter().filter_map(|c| Some((c, c.split.as_ref()?)));
    let Some((_, first)) = with().next() else { return };
    page.push_str("<div class=\"splits\">");
    for (which, partition) in first.partitions.iter().enumerate() {
        let _ = write!(page, "<div><h3>error by {}</h3>", partition.by);
        // The same class has the same colour in all bars.
        let mut names: Vec<&str> = Vec::new();
        for class in with().flat_map(|(_, split)| split.partitions[which].shown()) {
            if !names.contains(&class.name.as_str()) {
                names.push(&class.name);
            }
        }
        for (c, split) in with() {
            let parts = bar(&split.partitions[which], &names);
            let common = split.partitions[which].covariance / split.error.max(f64::MIN_POSITIVE);
            let _ = write!(
                page,
                "<div class=\"bar\" title=\"in common between classes: {:.1} % of the whole\"><span>{}</span><div \
                 class=\"parts\">{parts}</div></div>",
                100.0 * common,
                escaped(&c.name)
            );
        }
        page.push_str("<div class=\"keys\">");
        for (i, name) in names.iter().enumerate() {
            let _ = write!(page, "<span>{}{}</span>", swatch(i), escaped(name));
        }
        page.push_str("</div></div>");
    }
    page.push_str("</div>");
    let commons = with().map(|(c, split)| {
        let parts = split.partitions.iter().map(|p| percent(p.covariance, split.error)).collect::<Vec<_>>();
        format!("{}: {}", escaped(&c.name), parts.join(", "))
    });
    let _ = write!(
        page,
        "<p class=\"small\">Bars show the variances of the classes, in proportion. What the classes have in common is none \
         of them; it is this part of the whole error, in the same order: {}.</p>",
        commons.collect::<Vec<_>>().join("; ")
    );
}

fn percent(part: f64, whole: f64) -> String {
    format!("{:.0} %", 100.0 * part / whole.max(f64::MIN_POSITIVE)).replace('-', "−")
}

fn bar(partition: &Partition, names: &[&str]) -> String {
    /// Least part that has room for its number.
    const LABELLED: f64 = 0.09;
    let all: f64 = partition.classes.iter().map(|c| c.error).sum();
    let mut text = String::new();
    for class in partition.shown().filter(|c| c.error > 0.0) {
        let index = names.iter().position(|n| *n == class.name).unwrap_or(0);
        let part = class.error / all;
        let label = if part >= LABELLED { format!("{:.0} %", 100.0 * part) } else { String::new() };
        let _ = write!(
            text,
            "<i class=\"scale-{}\" style=\"width:{:.2}%\" title=\"{}: {:.1} % of the error, {:.1} % of the \
             light\">{label}</i>",
            index % super::COLOURS,
            100.0 * part,
            escaped(&class.name),
            100.0 * part,
            100.0 * class.light,
        );
    }
    text
}

fn details(page: &mut String, scene: &Scene) {
    page.push_str(
        "<details><summary>All figures</summary><div class=\"scroll\"><table><tr><th>configuration</th><th>samples</th><th>CPU \
         s</th><th>from – to</th><th>relMSE</th><th>from – to</th><th>efficiency</th><th>with \
         loading</th><th>beside the first</th><th>from – to</th></tr>",
    );
    for (i, c) in scene.configurations.iter().enumerate() {
        for row in &c.rows {
            let (seconds, seconds_range) = spread(row.cpu_seconds);
            let (error, error_range) = spread(row.relmse);
            let (ratio, ratio_range) = spread(row.efficiency_ratio);
            let efficiency = if row.accepted { spread(row.efficiency).0 } else { "refused".into() };
            let whole = spread(row.whole_efficiency).0;
            let _ = write!(
                page,
                "<tr><td>{}{}</td><td>{}</td><td>{seconds}</td><td>{seconds_range}</td><td>{error}</td><td>{error_range}</td>\
                 <td>{efficiency}</td><td>{whole}</td><td>{ratio}</td><td>{ratio_range}</td></tr>",
                swatch(i),
                escaped(&c.name),
                row.samples,
            );
        }
    }
    page.push_str("</table></div></details>");
}
