//! Plots on logarithmic axes, as SVG that takes its colours from the page.

use super::COLOURS;
use crate::bench::fit::Spread;
use std::fmt::Write;

/// Size of the drawing, in its own units.
const SIZE: (f64, f64) = (640.0, 400.0);
/// What the axes' labels take at the left, right, top and bottom.
const MARGIN: [f64; 4] = [78.0, 16.0, 12.0, 50.0];
/// Part of the range that is left free at each end.
const AIR: f64 = 0.06;
/// Marks of one axis that can have labels of their own.
const MOST_LABELS: usize = 9;

/// Points of one kind.
pub(super) struct Series {
    /// Of each cost: the points of its seeds, and whether they count.
    pub(super) costs: Vec<(Vec<(f64, f64)>, bool)>,
}

/// A plot.
pub(super) struct Plot {
    /// What goes to the right.
    pub(super) x_name: &'static str,
    /// Labels of its own for the horizontal axis, unless they are too many.
    pub(super) x_marks: Vec<f64>,
    /// The smallest error that can be measured.
    pub(super) floor: Option<f64>,
    /// In order of their colours.
    pub(super) series: Vec<Series>,
}

/// A logarithmic axis: value → place.
struct Axis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

impl Axis {
    /// From `start` to `end`, for these values, all positive.
    fn over(values: impl Iterator<Item = f64>, start: f64, end: f64) -> Option<Self> {
        /// Least range, in powers of ten: a single cost is still a plot.
        const LEAST: f64 = 0.5;
        let logarithms: Vec<f64> = values.map(libm::log10).filter(|v| v.is_finite()).collect();
        let low = logarithms.iter().copied().min_by(f64::total_cmp)?;
        let high = logarithms.iter().copied().max_by(f64::total_cmp)?;
        let missing = (LEAST - (high - low)).max(0.0) / 2.0;
        let (low, high) = (low - missing, high + missing);
        let air = AIR * (high - low);
        Some(Self { low: low - air, high: high + air, start, end })
    }

    fn at(&self, value: f64) -> f64 {
        let t = (libm::log10(value) - self.low) / (self.high - self.low);
        self.start + t * (self.end - self.start)
    }

    fn shows(&self, value: f64) -> bool {
        let v = libm::log10(value);
        v >= self.low && v <= self.high
    }

    /// Values 1 to 9 times a power of ten that it shows, with the digit.
    fn marks(&self) -> Vec<(f64, u32)> {
        let powers = libm::floor(self.low) as i32..=libm::floor(self.high) as i32;
        let all = powers.flat_map(|p| (1..10).map(move |d| (f64::from(d) * libm::pow(10.0, f64::from(p)), d)));
        all.filter(|(v, _)| self.shows(*v)).collect()
    }

    /// Whether marks with this digit get a label: all powers of ten, more where those would be few.
    fn labels(&self, digit: u32) -> bool {
        /// Powers of ten up to which 2 and 5 are labelled as well.
        const FEW: f64 = 2.4;
        digit == 1 || (matches!(digit, 2 | 5) && self.high - self.low < FEW)
    }
}

/// The median of each cost, with its lowest and highest point: (x, y, y, y).
fn middles(series: &Series) -> Vec<(f64, f64, f64, f64)> {
    let of = |points: &[(f64, f64)]| {
        let (x, y) = (Spread::of(points.iter().map(|p| p.0))?, Spread::of(points.iter().map(|p| p.1))?);
        Some((x.median, y.median, y.low, y.high))
    };
    series.costs.iter().filter(|(_, counts)| *counts).filter_map(|(points, _)| of(points)).collect()
}

/// The drawing; empty where there is nothing to draw.
pub(super) fn svg(plot: &Plot) -> String {
    let points = || plot.series.iter().flat_map(|s| &s.costs).flat_map(|(points, _)| points).filter(|p| is_drawn(p));
    let [left, right, top, bottom] = MARGIN;
    let x = Axis::over(points().map(|p| p.0), left, SIZE.0 - right);
    let y = Axis::over(points().map(|p| p.1), SIZE.1 - bottom, top);
    let (Some(x), Some(y)) = (x, y) else { return String::new() };
    let mut svg =
        format!(r#"<svg viewBox="0 0 {} {}" role="img" aria-label="relMSE against {}">"#, SIZE.0, SIZE.1, plot.x_name);
    grid(&mut svg, plot, &x, &y);
    // Writing to a string cannot fail.
    if let Some(floor) = plot.floor.filter(|f| *f > 0.0 && y.shows(*f)) {
        let at = y.at(floor);
        let _ = write!(
            svg,
            r#"<rect x="{left}" y="{at:.1}" width="{:.1}" height="{:.1}" fill="var(--warn)" fill-opacity="0.1"/><text x="{:.1}" y="{:.1}" text-anchor="start" style="fill:var(--warn)">below what the reference can measure</text>"#,
            x.end - left,
            y.start - at,
            left + 8.0,
            (at + 15.0).min(y.start - 4.0)
        );
    }
    guide(&mut svg, plot, &x, &y);
    for (i, series) in plot.series.iter().enumerate() {
        draw(&mut svg, i, series, &x, &y);
    }
    svg.push_str("</svg>");
    svg
}

fn is_drawn(&(x, y): &(f64, f64)) -> bool {
    x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite()
}

fn grid(svg: &mut String, plot: &Plot, x: &Axis, y: &Axis) {
    let mut vertical = |value: f64, strong: bool, label: Option<String>| {
        let at = x.at(value);
        let colour = if strong { "grid" } else { "fine" };
        let _ = write!(
            svg,
            r#"<line x1="{at:.1}" x2="{at:.1}" y1="{:.1}" y2="{:.1}" stroke="var(--{colour})"/>"#,
            y.start, y.end
        );
        if let Some(label) = label {
            let _ = write!(svg, r#"<text x="{at:.1}" y="{:.1}" text-anchor="middle">{label}</text>"#, y.start + 17.0);
        }
    };
    if (1..=MOST_LABELS).contains(&plot.x_marks.len()) {
        plot.x_marks.iter().for_each(|&mark| vertical(mark, true, Some(format!("{mark}"))));
    } else {
        for (mark, digit) in x.marks() {
            vertical(mark, digit == 1, x.labels(digit).then(|| plain(mark)));
        }
    }
    for (mark, digit) in y.marks() {
        let at = y.at(mark);
        let colour = if digit == 1 { "grid" } else { "fine" };
        let _ = write!(
            svg,
            r#"<line x1="{:.1}" x2="{:.1}" y1="{at:.1}" y2="{at:.1}" stroke="var(--{colour})"/>"#,
            x.start, x.end
        );
        if y.labels(digit) {
            let (power, label_x, label_y) = (libm::floor(libm::log10(mark * 1.5)) as i32, x.start - 8.0, at + 4.0);
            let factor = if digit == 1 { String::new() } else { format!("{digit}·") };
            let sign = if power < 0 { "−" } else { "" };
            let _ = write!(
                svg,
                r#"<text x="{label_x:.1}" y="{label_y:.1}" text-anchor="end">{factor}10<tspan dy="-5" font-size="9.5">{sign}{}</tspan></text>"#,
                power.abs()
            );
        }
    }
    let (middle_x, middle_y) = ((x.start + x.end) / 2.0, (y.start + y.end) / 2.0);
    let _ = write!(
        svg,
        r#"<text class="axis" x="{middle_x:.1}" y="{:.1}" text-anchor="middle">{}</text><text class="axis" transform="translate(14 {middle_y:.1}) rotate(-90)" text-anchor="middle">relMSE</text>"#,
        SIZE.1 - 10.0,
        plot.x_name
    );
}

/// A value of an axis without powers of ten.
fn plain(value: f64) -> String {
    /// More digits than any mark has.
    const ROUND: f64 = 1e12;
    format!("{}", (value * ROUND).round() / ROUND)
}

/// A line of slope −1 through the first series' first median: what independent samples do.
fn guide(svg: &mut String, plot: &Plot, x: &Axis, y: &Axis) {
    let Some((x0, y0, ..)) = plot.series.first().and_then(|s| middles(s).first().copied()) else { return };
    if !is_drawn(&(x0, y0)) {
        return;
    }
    // In powers of ten, from the point to where the first edge is reached.
    let span = (x.high - libm::log10(x0)).min(libm::log10(y0) - y.low);
    let factor = libm::pow(10.0, span);
    let (x1, y1) = (x.at(x0 * factor), y.at(y0 / factor));
    let _ = write!(
        svg,
        r#"<line x1="{:.1}" y1="{:.1}" x2="{x1:.1}" y2="{y1:.1}" stroke="var(--muted)" stroke-dasharray="2 5" stroke-opacity="0.8"><title>error in inverse proportion</title></line>"#,
        x.at(x0),
        y.at(y0)
    );
}

/// The spread as a band, the medians as a line, each seed as a point; what does not count hollow.
fn draw(svg: &mut String, index: usize, series: &Series, x: &Axis, y: &Axis) {
    let colour = format!("var(--c{})", index % COLOURS);
    let middles: Vec<_> = middles(series).into_iter().filter(|m| is_drawn(&(m.0, m.2))).collect();
    let place = |px: f64, py: f64| format!("{:.1},{:.1}", x.at(px), y.at(py));
    if middles.len() > 1 {
        let there = middles.iter().map(|m| place(m.0, m.3));
        let back = middles.iter().rev().map(|m| place(m.0, m.2));
        let band = there.chain(back).collect::<Vec<_>>().join(" ");
        let line = middles.iter().map(|m| place(m.0, m.1)).collect::<Vec<_>>().join(" ");
        let _ = write!(
            svg,
            r#"<polygon points="{band}" fill="{colour}" fill-opacity="0.14"/><polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2.4" stroke-linejoin="round"/>"#
        );
    }
    for (points, counts) in &series.costs {
        for &(px, py) in points.iter().filter(|p| is_drawn(p)) {
            let look = if *counts {
                format!(r#"fill="{colour}" fill-opacity="0.45""#)
            } else {
                format!(r#"fill="none" stroke="{colour}" stroke-opacity="0.6""#)
            };
            let _ = write!(svg, r#"<circle cx="{:.1}" cy="{:.1}" r="3" {look}/>"#, x.at(px), y.at(py));
        }
    }
    for m in &middles {
        let (cx, cy) = (x.at(m.0), y.at(m.1));
        let _ = write!(
            svg,
            r#"<path d="{}" transform="translate({cx:.1} {cy:.1})" fill="{colour}" stroke="var(--card)" stroke-width="1.2"/>"#,
            MARKERS[index % MARKERS.len()]
        );
    }
}

/// Disk, square, triangle, diamond: for those who do not tell colours apart.
const MARKERS: [&str; 4] =
    ["M-5 0a5 5 0 1 0 10 0a5 5 0 1 0 -10 0z", "M-4.5 -4.5h9v9h-9z", "M0 -5.5l5.5 9.5h-11z", "M0 -6l6 6l-6 6l-6 -6z"];

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>) -> Plot {
        let series = vec![Series { costs: vec![(points, true)] }];
        Plot { x_name: "samples", x_marks: vec![], floor: Some(0.1), series }
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        assert!(svg(&plot(vec![])).is_empty());
        assert!(svg(&plot(vec![(1.0, 0.0), (0.0, 1.0), (1.0, f64::NAN)])).is_empty());
        let one = svg(&plot(vec![(1.0, 1.0), (2.0, -1.0)]));
        assert!(one.matches("<circle").count() == 1 && !one.contains("NaN") && !one.contains("inf"), "{one}");
    }

    #[test]
    fn axes_are_logarithmic() {
        let axis = Axis { low: -1.0, high: 3.0, start: 0.0, end: 400.0 };
        assert!((axis.at(10.0) - 200.0).abs() < 0.01 && axis.shows(999.0) && !axis.shows(0.09));
        assert_eq!(axis.marks().iter().filter(|(_, digit)| *digit == 1).count(), 5);
        assert_eq!(plain(0.002), "0.002");
    }
}
