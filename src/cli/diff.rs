//! `snell diff`: how different two pictures are.

use super::EXIT_FAILED;
use super::args::{DiffArgs, Limit, Metric};
use crate::error::{Error, Result};
use crate::image::compare::{self, Errors, Family, Flip, HdrFlip, Significance};
use crate::image::{
    ComponentFormat, Crop, Format, Metadata, OutputFile, Picture, PictureFile, Reserved, WriteOptions, read_picture,
};
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What `--json` writes. Where there is no such number (the ratio of equal pictures, a test without variances), it is
/// null.
#[derive(Debug, Serialize)]
struct Report {
    width: u32,
    height: u32,
    non_finite_pixels: u64,
    mean: f64,
    reference_mean: f64,
    mse: f64,
    relmse: f64,
    psnr: f64,
    max: f64,
    max_at: (u32, u32),
    flip: f64,
    hdr_flip: Option<f64>,
    significance: Option<Tests>,
    failed: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Tests {
    p: f64,
    whole: Test,
    tiles: Test,
    pixels: Test,
    without_variance: u64,
}

#[derive(Debug, Serialize)]
struct Test {
    worst_z: f64,
    tests: u64,
    p: f64,
}

impl From<Family> for Test {
    fn from(f: Family) -> Self {
        Self { worst_z: f.worst_z, tests: f.tests, p: f.p }
    }
}

impl From<Significance> for Tests {
    fn from(s: Significance) -> Self {
        let (whole, tiles, pixels) = (s.whole.into(), s.tiles.into(), s.pixels.into());
        Self { p: s.p(), whole, tiles, pixels, without_variance: s.without_variance }
    }
}

/// Everything that was found.
struct Comparison {
    errors: Errors,
    flip: Flip,
    hdr_flip: Option<HdrFlip>,
    significance: Option<Significance>,
}

/// Compares, prints, writes; 1 where a limit is passed.
pub(super) fn run(args: &DiffArgs) -> Result<ExitCode> {
    let a = read_picture(&args.picture)?;
    let b = read_picture(&args.reference)?;
    check_same(&args.picture, &a, &args.reference, &b)?;
    let variances = variances(args, &a)?;
    if let Some(limit) = args.fail.iter().find(|l| l.metric.needs_variances())
        && variances.iter().all(Option::is_none)
    {
        let name = limit.metric.text();
        return Err(Error::Usage(format!("--fail {name} needs variances: --variance-a FILE, --variance-b FILE")));
    }
    let heat = args.heat.as_deref().map(OutputFile::reserve).transpose()?;
    let to_stdout = args.json.as_deref() == Some(Path::new("-"));
    let json = args.json.as_deref().filter(|_| !to_stdout);
    let json = json.map(|path| Reserved::new(path, "the figures")).transpose()?;
    let c = comparison(&a.picture, &b.picture, &variances);
    let failed: Vec<String> = args.fail.iter().filter_map(|limit| passed(limit, &c)).collect();
    let report = report(&a.picture, &c, failed);
    // The numbers of a report are finite or null, and its keys are texts: JSON can say all of it.
    let figures = serde_json::to_string_pretty(&report).unwrap_or_default() + "\n";
    print(&if to_stdout { figures.clone() } else { text(&report, &c) });
    if let (Some(output), Some(path)) = (heat, &args.heat) {
        write_heat(output, path, &a, &b, &c)?;
    }
    if let Some(file) = json {
        file.write(|file| file.write_all(figures.as_bytes()))?;
    }
    Ok(if report.failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(EXIT_FAILED) })
}

/// Nobody may be reading.
fn print(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn check_same(path_a: &Path, a: &PictureFile, path_b: &Path, b: &PictureFile) -> Result<()> {
    let place = |f: &PictureFile| {
        let (x, y) = f.offset;
        let at = if f.offset == (0, 0) { String::new() } else { format!(" from {x},{y}") };
        format!("{}x{} pixels{at}", f.picture.width(), f.picture.height())
    };
    let (place_a, place_b) = (place(a), place(b));
    if place_a == place_b {
        return Ok(());
    }
    let (path_a, path_b) = (path_a.display(), path_b.display());
    Err(Error::Usage(format!("only pictures of one size can be compared: {path_a} has {place_a}, {path_b} {place_b}")))
}

/// The variances of both pictures: those that were named, or those that lie beside both, as NAME_var.exr.
fn variances(args: &DiffArgs, a: &PictureFile) -> Result<[Option<Picture>; 2]> {
    let named = [args.variance_a.clone(), args.variance_b.clone()];
    let paths = if named.iter().any(Option::is_some) {
        named
    } else {
        let found = [variance_beside(&args.picture), variance_beside(&args.reference)];
        // A picture whose variance is not known is not exact, so one alone says nothing.
        if found.iter().all(Option::is_some) { found } else { [None, None] }
    };
    let [first, second] = paths.map(|path| path.map(|path| read_variance(&path, &args.picture, a)).transpose());
    Ok([first?, second?])
}

/// The file of a picture's variance, if it lies beside it.
pub(super) fn variance_beside(path: &Path) -> Option<PathBuf> {
    let name = format!("{}_var.exr", path.file_stem()?.to_string_lossy());
    Some(path.with_file_name(name)).filter(|p| p.is_file())
}

/// The variance in the file `path`, of the size of `picture` from the file `beside`.
pub(super) fn read_variance(path: &Path, beside: &Path, picture: &PictureFile) -> Result<Picture> {
    let file = read_picture(path)?;
    check_same(path, &file, beside, picture)?;
    if file.picture.pixels().iter().any(|p| p.0.min_element() < 0.0) {
        return Err(Error::file(path, "a variance is below zero"));
    }
    Ok(file.picture)
}

fn comparison(a: &Picture, b: &Picture, variances: &[Option<Picture>; 2]) -> Comparison {
    let errors = compare::errors(a, b);
    let significance = variances
        .iter()
        .any(Option::is_some)
        .then(|| compare::significance([a, b], [variances[0].as_ref(), variances[1].as_ref()]));
    let (a, b) = compare::without_non_finite(a, b);
    Comparison { errors, flip: compare::flip(&a, &b), hdr_flip: compare::hdr_flip(&a, &b), significance }
}

/// What a limit has to complain of.
fn passed(limit: &Limit, c: &Comparison) -> Option<String> {
    let p = |f: &dyn Fn(&Significance) -> f64| c.significance.as_ref().map_or(1.0, f);
    let value = match limit.metric {
        Metric::Mse => c.errors.mse,
        Metric::Relmse => c.errors.rel_mse,
        Metric::Psnr => c.errors.psnr,
        Metric::Max => c.errors.max,
        Metric::Flip => c.flip.mean,
        Metric::HdrFlip => c.hdr_flip.as_ref().map_or(c.flip.mean, |h| h.flip.mean),
        Metric::P => p(&Significance::p),
        Metric::PWhole => p(&|s| s.whole.p),
        Metric::PTiles => p(&|s| s.tiles.p),
        Metric::PPixels => p(&|s| s.pixels.p),
    };
    let name = limit.metric.text();
    let (fails, relation) =
        if limit.metric.is_better_high() { (value < limit.value, "below") } else { (value > limit.value, "above") };
    if c.errors.non_finite_pixels > 0 {
        return Some(format!("{name}: {} pixels are not finite", c.errors.non_finite_pixels));
    }
    fails.then(|| format!("{name} {value} is {relation} {}", limit.value))
}

fn write_heat(output: OutputFile, path: &Path, a: &PictureFile, b: &PictureFile, c: &Comparison) -> Result<()> {
    let (width, height) = (a.picture.width(), a.picture.height());
    let picture = match Format::of(path)? {
        Format::Exr => compare::difference(&a.picture, &b.picture),
        Format::Png => compare::heat(width, height, &c.flip.map),
    };
    let options = WriteOptions {
        full_size: (width, height),
        crop: Crop { x: 0, y: 0, width, height },
        component_format: ComponentFormat::Float,
        exposure: 0.0,
        metadata: Metadata::default(),
    };
    output.write((&picture).into(), &options).map(|_| ())
}

fn report(a: &Picture, c: &Comparison, failed: Vec<String>) -> Report {
    let e = &c.errors;
    Report {
        width: a.width(),
        height: a.height(),
        non_finite_pixels: e.non_finite_pixels,
        mean: e.mean,
        reference_mean: e.reference_mean,
        mse: e.mse,
        relmse: e.rel_mse,
        psnr: e.psnr,
        max: e.max,
        max_at: e.max_at,
        flip: c.flip.mean,
        hdr_flip: c.hdr_flip.as_ref().map(|h| h.flip.mean),
        significance: c.significance.map(Tests::from),
        failed,
    }
}

fn text(r: &Report, c: &Comparison) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name:<12} {value}");
    };
    line("pixels", format!("{}x{}", r.width, r.height));
    if r.non_finite_pixels > 0 {
        line("not finite", format!("{} pixels, left out of all that follows", r.non_finite_pixels));
    }
    line("mean", format!("{:.6}, of the reference {:.6}", r.mean, r.reference_mean));
    line("mse", format!("{:.6e}", r.mse));
    line("relmse", format!("{:.6e}", r.relmse));
    line("psnr", format!("{:.3} dB", r.psnr));
    line("max", format!("{:.6} at {},{}", r.max, r.max_at.0, r.max_at.1));
    line("flip", format!("{:.6}", r.flip));
    if let Some(h) = &c.hdr_flip {
        let (first, last, count) = h.exposures;
        line("hdr-flip", format!("{:.6} over {count} exposures from {first:.2} to {last:.2}", h.flip.mean));
    }
    if let Some(s) = &r.significance {
        for (name, test) in [("p-whole", &s.whole), ("p-tiles", &s.tiles), ("p-pixels", &s.pixels)] {
            line(name, format!("{:.4}: largest |z| of {} is {:.3}", test.p, test.tests, test.worst_z));
        }
        line("p", format!("{:.4}: all of these", s.p));
        if s.without_variance > 0 {
            line("untested", format!("{} values differ, but have no variance", s.without_variance));
        }
    }
    for failure in &r.failed {
        line("failed", failure.clone());
    }
    text
}
