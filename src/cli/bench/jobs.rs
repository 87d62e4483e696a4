//! What is to be rendered: all combinations of what is varied, as arguments of `render`.

use crate::bench::run::Budget;
use crate::cli::args::{Arguments, BenchArgs, Command, RenderArgs, Vary};
use crate::error::{Error, Result};
use clap::Parser;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Samples to measure at, if nobody says.
const SAMPLES: [u32; 4] = [1, 4, 16, 64];

impl Vary {
    /// As on the command line.
    pub(super) fn text(&self) -> String {
        format!("{}={}", self.name, self.values.join(","))
    }
}

/// One of the ways to render.
#[derive(Clone, Debug)]
pub(super) struct Variant {
    pub(super) name: String,
    /// Options of `render`.
    options: Vec<String>,
}

/// All combinations of the values, the last option's changing fastest. They are called by their values.
pub(super) fn variants(vary: &[Vary]) -> Vec<Variant> {
    let mut all = vec![Variant { name: String::new(), options: Vec::new() }];
    for Vary { name, values } in vary {
        let with = |variant: &Variant, value: &String| {
            let mut variant = variant.clone();
            let separator = if variant.name.is_empty() { "" } else { " · " };
            variant.name = format!("{}{separator}{value}", variant.name);
            variant.options.extend([format!("--{name}"), value.clone()]);
            variant
        };
        all = all.iter().flat_map(|variant| values.iter().map(move |value| with(variant, value))).collect();
    }
    if vary.is_empty() {
        all[0].name = "snell".into();
    }
    all
}

/// The costs, from the smallest on, each once.
pub(super) fn budget(args: &BenchArgs) -> Budget {
    if !args.seconds.is_empty() {
        let mut seconds = args.seconds.clone();
        seconds.sort_unstable_by(f64::total_cmp);
        seconds.dedup();
        return Budget::Seconds(seconds);
    }
    let mut samples = if args.spp.is_empty() { SAMPLES.to_vec() } else { args.spp.clone() };
    samples.sort_unstable();
    samples.dedup();
    Budget::Samples(samples)
}

/// What `render` would be told, for each variant.
pub(super) fn render_args(args: &BenchArgs, scene: &Path, variants: &[Variant]) -> Result<Vec<RenderArgs>> {
    variants.iter().map(|variant| of_variant(args, scene, variant)).collect()
}

fn of_variant(args: &BenchArgs, scene: &Path, variant: &Variant) -> Result<RenderArgs> {
    let mut words: Vec<OsString> = vec!["snell".into(), "render".into()];
    words.extend(args.define.iter().map(|(name, value)| format!("-D{name}={value}").into()));
    words.extend(args.options.iter().chain(&variant.options).map(OsString::from));
    words.extend(["--".into(), scene.into()]);
    let parsed = Arguments::try_parse_from(words).map_err(|error| Error::Usage(one_line(&error)))?;
    let Command::Render(mut render) = parsed.command else { return Err(Error::Usage(NO_OPTIONS.into())) };
    let writes = !render.output.is_empty() || render.stats.is_some() || !render.aov.is_empty();
    if writes || render.spp.is_some() || render.replay.is_some() || render.goal.names().is_some() {
        return Err(Error::Usage(NO_OPTIONS.into()));
    }
    for &samples in &args.spp {
        render.sampler.kind_for(samples)?;
    }
    // Any count that every sampler can have: how many there are is the bench's business.
    render.spp = Some(1);
    Ok(*render)
}

/// What is wrong with options for `render` that mean nothing here.
const NO_OPTIONS: &str =
    "expected options of render after --, but not --output, --spp, --aov, --stats or --replay: a bench has its own";

/// What is wrong with an option, without what `render` says of its usage.
fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines =
        text.lines().map(str::trim).take_while(|line| !line.starts_with("Usage") && !line.starts_with("For more"));
    let line = lines.filter(|line| !line.is_empty() && !line.starts_with("tip:")).collect::<Vec<_>>().join(" ");
    line.trim_start_matches("error: ").to_owned()
}

/// What scenes are called: by their files, or by their folders where files are all called alike.
pub(super) fn scene_names(scenes: &[PathBuf]) -> Vec<String> {
    let text = |part: Option<&std::ffi::OsStr>| part.map(|p| p.to_string_lossy().into_owned());
    let name = |path: &PathBuf| {
        let stem = text(path.file_stem()).unwrap_or_default();
        let folder = path.parent().and_then(|folder| text(folder.file_name()));
        if stem == "scene" { folder.unwrap_or(stem) } else { stem }
    };
    let names: Vec<String> = scenes.iter().map(name).collect();
    let is_unique = |name: &String| names.iter().filter(|n| *n == name).count() == 1;
    let of = |(name, path): (&String, &PathBuf)| {
        if is_unique(name) { name.clone() } else { path.display().to_string() }
    };
    names.iter().zip(scenes).map(of).collect()
}

/// The folder of the report. One that was made for it is removed again if nothing comes of it.
pub(super) struct Folder {
    path: PathBuf,
    made: bool,
}

impl Folder {
    /// Makes it if it is not there.
    pub(super) fn new(path: &Path) -> Result<Self> {
        if path.is_dir() {
            return Ok(Self { path: path.to_owned(), made: false });
        }
        std::fs::create_dir(path).map_err(|e| Error::file(path, format!("cannot make the report's folder: {e}")))?;
        Ok(Self { path: path.to_owned(), made: true })
    }

    /// Its path, if it was made.
    pub(super) fn made(&self) -> Option<&Path> {
        self.made.then_some(&self.path)
    }

    /// Something came of it.
    pub(super) fn keep(mut self) {
        self.made = false;
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if self.made {
            // What is in it stays.
            let _ = std::fs::remove_dir(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_is_combined_with_everything() {
        let vary = |name: &str, values: &[&str]| Vary {
            name: name.into(),
            values: values.iter().map(|v| (*v).to_owned()).collect(),
        };
        let all = variants(&[vary("accel", &["embree", "native"]), vary("sampler", &["a", "b"])]);
        let names: Vec<&str> = all.iter().map(|v| v.name.as_str()).collect();
        assert_eq!(names, ["embree · a", "embree · b", "native · a", "native · b"]);
        assert_eq!(all[2].options, ["--accel", "native", "--sampler", "a"]);
        assert_eq!(variants(&[])[0].options.len(), 0);
    }

    #[test]
    fn scenes_are_told_apart() {
        let names = |paths: &[&str]| scene_names(&paths.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(names(&["scenes/box/scene.xml", "a/b.xml"]), ["box", "b"]);
        assert_eq!(names(&["a/b.xml", "c/b.xml", "d.xml"]), ["a/b.xml", "c/b.xml", "d"]);
        assert_eq!(names(&["scene.xml"]), ["scene"]);
    }
}
