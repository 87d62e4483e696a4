//! The arguments.

mod beside;
mod bias;
mod goal;
mod keep;

pub(super) use beside::BesideArgs;
pub(super) use bias::BiasArgs;
pub(super) use goal::GoalArgs;
pub(super) use keep::{KeepArgs, MergeArgs, Shard};

use crate::accel::{Accelerator, Quality};
use crate::error::Error;
use crate::files::Memory;
use crate::film::SampleId;
use crate::image::Crop;
use crate::integrator::{Estimator, MOST_CANDIDATES};
use crate::sampler::{MOST_LOG_SAMPLES, SamplerKind};
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use std::path::PathBuf;

/// A physically based path tracer for Mitsuba 3 scenes.
#[derive(Debug, Parser)]
#[command(name = "snell", version, about, arg_required_else_help = true)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Render a scene to a picture.
    Render(Box<RenderArgs>),
    /// Show what a scene holds and needs.
    Info(SceneArgs),
    /// Compare a picture with a reference: errors, perceived difference, statistical tests.
    Diff(DiffArgs),
    /// Measure error against time and samples, of one way to render or several, and write a page, a table and figures.
    Bench(BenchArgs),
    /// Put the shards of a render together: the same picture, bit for bit, as one process would have made.
    Merge(MergeArgs),
    /// Check this snell: accelerators, spawned rays, bsdfs, lights, scenes with known answers, bits. Without an option that names a
    /// check, all there are.
    Check(CheckArgs),
    /// Print a completion script for a shell.
    Completions {
        /// Which shell.
        shell: Shell,
    },
}

/// What to check.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Nasty rays at nasty meshes: our own accelerator, Embree where it is compiled in, and slow but certain answers.
    #[arg(long)]
    pub(super) accel: bool,
    /// Rays spawned from random surfaces: none meets its own surface, none skips a neighbour.
    #[arg(long)]
    pub(super) spawn: bool,
    /// The laws of scattering, for all bsdfs and at the ends of their parameters.
    #[arg(long)]
    pub(super) bsdf: bool,
    /// Lights of all sizes and brightnesses, skies, black lights, many lights.
    #[arg(long)]
    pub(super) light: bool,
    /// Scenes with closed-form answers.
    #[arg(long)]
    pub(super) scene: bool,
    /// The same bits for one thread and for all, for all vector instructions, at all scales that are powers of two.
    #[arg(long)]
    pub(super) determinism: bool,
    /// Rays of each kind at each mesh (default 8000); of spawned rays, of each kind (default 1000000).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) rays: Option<u64>,
    /// Take hours: 10^8 random rays, 10^9 at edges and vertices of closed meshes, and 10^6 of each other kind at each mesh; 10^9
    /// spawned rays; χ² tests of all that has a density; sixteen times the samples of scenes.
    #[arg(long, conflicts_with = "rays")]
    pub(super) long: bool,
    /// Seed of meshes and rays.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) seed: u64,
    /// This mesh alone, of --accel.
    #[arg(long, value_name = "NAME")]
    pub(super) mesh: Option<String>,
    /// This kind alone: of rays, of what they are spawned from, of laws, lights, scenes or bits.
    #[arg(long, value_name = "NAME")]
    pub(super) kind: Option<String>,
    /// This ray or test alone, with what everyone says of it.
    #[arg(long, value_name = "N", requires = "kind")]
    pub(super) ray: Option<u64>,
    /// Threads; 0 for one a core.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=MAX_THREADS))]
    pub(super) threads: u32,
    /// Show answers of Embree that are wrong, too.
    #[arg(short, long)]
    pub(super) verbose: bool,
}

/// What to measure, and against what.
#[derive(Debug, Args)]
pub(super) struct BenchArgs {
    /// The scenes.
    #[arg(required = true, value_name = "SCENE")]
    pub(super) scenes: Vec<PathBuf>,
    /// Folder for bench.html, bench.json and bench.csv; made if it is not there.
    #[arg(short, long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// The picture that is right (for each scene one, in their order), with NAME_var.exr beside it if its variance is known.
    /// Default: a reference of --reference-spp samples is rendered.
    #[arg(long, value_name = "FILE")]
    pub(super) reference: Vec<PathBuf>,
    /// Samples per pixel of the reference to render. Default: at least 16 times as many as are measured.
    #[arg(long, value_name = "N", conflicts_with = "reference", value_parser = clap::value_parser!(u32).range(2..))]
    pub(super) reference_spp: Option<u32>,
    /// Samples per pixel to measure. Default: 1,4,16,64.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: Vec<u32>,
    /// CPU seconds to measure at, instead: as many samples as fit, by the time that a short render takes.
    #[arg(long, value_name = "LIST", value_delimiter = ',', conflicts_with = "spp", value_parser = seconds)]
    pub(super) seconds: Vec<f64>,
    /// Compare these values of an option of `render`: accel, sampler, integrator or rr-depth. May be repeated: everything is
    /// combined with everything, and compared with the first.
    #[arg(long, value_name = "NAME=LIST", value_parser = vary)]
    pub(super) vary: Vec<Vary>,
    /// How often to render each, with different seeds.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) seeds: u32,
    /// Take the error at the largest cost apart: by length of paths, by how light was found, by what the first surface did.
    #[arg(long)]
    pub(super) split: bool,
    /// Set a parameter that the scenes declare by `<default>`.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    pub(super) define: Vec<(String, String)>,
    /// Print errors and the table only.
    #[arg(short, long)]
    pub(super) quiet: bool,
    /// More options, as `render` has them, for all renders.
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    pub(super) options: Vec<String>,
}

/// An option of `render` and the values to compare.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Vary {
    pub(super) name: String,
    pub(super) values: Vec<String>,
}

/// Options that `bench` can vary: those that leave what the picture converges to as it is.
const VARIED: [&str; 6] = ["accel", "sampler", "integrator", "reuse", "light-samples", "rr-depth"];

/// What to compare, and how well it must agree.
#[derive(Debug, Args)]
pub(super) struct DiffArgs {
    /// The picture (.exr or .png).
    pub(super) picture: PathBuf,
    /// The picture that is right, or more so.
    pub(super) reference: PathBuf,
    /// Variance of the picture's pixels (squared standard errors). Default: NAME_var.exr beside both pictures.
    #[arg(long, value_name = "FILE")]
    pub(super) variance_a: Option<PathBuf>,
    /// Variance of the reference's pixels; without it, the reference counts as exact.
    #[arg(long, value_name = "FILE")]
    pub(super) variance_b: Option<PathBuf>,
    /// Write a map of the difference: .png for what FLIP says of each pixel, .exr for picture minus reference.
    #[arg(long, value_name = "FILE")]
    pub(super) heat: Option<PathBuf>,
    /// Write the figures as JSON; - for standard output.
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,
    /// Exit with 1 where a figure is worse: mse, relmse, max, flip, hdr-flip above, psnr, p, p-whole, p-tiles, p-pixels
    /// below VALUE; and where a pixel is not finite.
    #[arg(long, value_name = "METRIC=VALUE", value_parser = limit)]
    pub(super) fail: Vec<Limit>,
}

/// A figure that two pictures are judged by.
#[derive(Clone, Copy, Debug, ValueEnum, PartialEq, Eq)]
pub(super) enum Metric {
    Mse,
    Relmse,
    Psnr,
    Max,
    Flip,
    HdrFlip,
    P,
    PWhole,
    PTiles,
    PPixels,
}

impl Metric {
    /// Whether it comes from the z-tests.
    pub(super) fn needs_variances(self) -> bool {
        matches!(self, Self::P | Self::PWhole | Self::PTiles | Self::PPixels)
    }

    /// Whether larger values mean better agreement.
    pub(super) fn is_better_high(self) -> bool {
        self == Self::Psnr || self.needs_variances()
    }

    pub(super) fn text(self) -> String {
        self.to_possible_value().map_or_else(String::new, |v| v.get_name().into())
    }
}

/// The worst value that a figure may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limit {
    pub(super) metric: Metric,
    pub(super) value: f64,
}

/// Most threads. Reason: with very many more threads than cores the thread pool spends its time waking them.
const MAX_THREADS: i64 = 1024;

/// What to read, and what to change in it.
#[derive(Debug, Args)]
pub(super) struct SceneArgs {
    /// The scene: a Mitsuba 3 XML file, glTF 2.0 (.gltf, .glb), or a mesh (.obj, .ply) to be shown by itself.
    pub(super) scene: PathBuf,
    /// Set a parameter that the scene declares by `<default>`.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    pub(super) define: Vec<(String, String)>,
    /// Make unknown parameters and attributes warnings, not errors.
    #[arg(long)]
    pub(super) lenient: bool,
    /// Read nothing that is not inside of this folder, whatever the scene names; for scenes of strangers.
    #[arg(long, value_name = "DIR")]
    pub(super) confine: Option<PathBuf>,
    /// Most memory to use, as 500M or 2G: what would take more is refused, with the figures, before it is built.
    #[arg(long, value_name = "SIZE", value_parser = Memory::parse)]
    pub(super) memory_limit: Option<Memory>,
    /// Which of the scene's cameras, counted from 0.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) camera: usize,
    /// A picture of the surroundings in latitude and longitude (.hdr, .exr), in place of the scene's sky.
    #[arg(long, value_name = "FILE")]
    pub(super) env: Option<PathBuf>,
    /// Turn it to the left about the vertical axis (+y).
    #[arg(long, value_name = "DEG", requires = "env", allow_negative_numbers = true, value_parser = finite)]
    pub(super) env_rotate: Option<f32>,
    /// Size of the whole picture, in place of the file's.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(super) size: Option<(u32, u32)>,
    /// Render only this part of the picture.
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop)]
    pub(super) crop: Option<Crop>,
    /// Who finds what rays meet.
    #[arg(long, value_enum, default_value_t = AcceleratorName::Auto)]
    pub(super) accel: AcceleratorName,
    /// How carefully to build it: what takes longer to build takes rays less time.
    #[arg(long, value_enum, value_name = "QUALITY", default_value_t = QualityName::Auto)]
    pub(super) accel_quality: QualityName,
    /// Threads; 0 for one a core.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=MAX_THREADS))]
    pub(super) threads: u32,
}

/// How to render, and where to.
#[derive(Debug, Args)]
pub(super) struct RenderArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Where to write the picture (.exr or .png; may be repeated). Default: the scene's name with .exr, here.
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Vec<PathBuf>,
    /// Samples per pixel, in place of the file's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: Option<u32>,
    #[command(flatten)]
    pub(super) goal: GoalArgs,
    /// How to estimate, in place of the file's. All converge to the same picture, but for `direct`, which ends paths
    /// after one bounce.
    #[arg(long, value_enum)]
    pub(super) integrator: Option<IntegratorName>,
    /// Where random numbers come from.
    #[arg(long, value_enum, default_value_t = SamplerName::Sobol)]
    pub(super) sampler: SamplerName,
    /// The largest number of segments of a path, in place of the file's; -1 for no limit.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(i64).range(-1..=i64::from(u32::MAX)))]
    pub(super) max_depth: Option<i64>,
    /// The first vertex at which Russian roulette may end a path, in place of the file's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) rr_depth: Option<u32>,
    /// Whether neighbouring pixels share what their paths find: much less noise where light comes from diffuse surfaces, but
    /// alike in neighbours. 'on': those of a block of 8x8, 'eights': eight of them together. 'auto' tries what pays.
    #[arg(long, value_enum, value_name = "WHEN", default_value_t = ReuseName::Auto)]
    pub(super) reuse: ReuseName,
    /// Light samples at the first hit, half of which take a ray: a power of two up to 16. 'auto' tries whether more than one pay.
    #[arg(long, value_name = "N", default_value = "auto", value_parser = light_samples)]
    pub(super) light_samples: LightSamples,
    /// Seed of the random numbers, in place of the file's.
    #[arg(long, value_name = "N")]
    pub(super) seed: Option<u64>,
    /// Stops of exposure for PNG: 1 is twice as bright.
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub(super) exposure: f32,
    /// Write channels beside the picture, into .exr files: albedo, normal, shading_normal, depth, position, uv,
    /// primitive, shape, material of the first surface that camera rays meet, the count of samples, and the estimated
    /// standard error of the picture.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = aov)]
    pub(super) aov: Vec<AovName>,
    /// Whether the camera sees light from infinitely far away; if not, it still lights everything, and alpha tells where
    /// nothing is.
    #[arg(long, value_name = "BOOL", default_value_t = true, action = clap::ArgAction::Set)]
    pub(super) env_visible: bool,
    #[command(flatten)]
    pub(super) bias: BiasArgs,
    #[command(flatten)]
    pub(super) beside: BesideArgs,
    #[command(flatten)]
    pub(super) keep: KeepArgs,
    /// Write figures about the render as JSON.
    #[arg(long, value_name = "FILE")]
    pub(super) stats: Option<PathBuf>,
    /// Trace one sample alone and tell of every step; writes no picture.
    #[arg(long, value_name = "X,Y,S", allow_hyphen_values = true, value_parser = sample_id)]
    pub(super) replay: Option<SampleId>,
    /// Print errors only.
    #[arg(short, long, conflicts_with = "verbose")]
    pub(super) quiet: bool,
    /// Print more.
    #[arg(short, long)]
    pub(super) verbose: bool,
}

/// Whether paths are shared.
#[derive(Clone, Copy, Debug, ValueEnum, PartialEq, Eq)]
pub(super) enum ReuseName {
    Auto,
    On,
    Eights,
    Off,
}

/// Light samples at the first hit; `None` where a trial decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LightSamples(pub(super) Option<u32>);

fn light_samples(text: &str) -> Result<LightSamples, String> {
    if text == "auto" {
        return Ok(LightSamples(None));
    }
    match text.parse::<u32>() {
        Ok(n) if n.is_power_of_two() && n <= MOST_CANDIDATES => Ok(LightSamples(Some(n))),
        _ => Err(format!("expected 'auto' or a power of two up to {MOST_CANDIDATES}")),
    }
}

/// What can be written beside the picture.
#[derive(Clone, Copy, Debug, ValueEnum, PartialEq, Eq)]
pub(super) enum AovName {
    Albedo,
    Normal,
    ShadingNormal,
    Depth,
    Position,
    Uv,
    Primitive,
    Shape,
    Material,
    Samples,
    Error,
}

/// Names of [`Accelerator`]s.
#[derive(Clone, Copy, Debug, ValueEnum, PartialEq, Eq)]
pub(super) enum AcceleratorName {
    /// The faster one, which is native.
    Auto,
    /// Intel Embree, robust.
    Embree,
    /// Our own BVH.
    Native,
    /// Both, compared ray by ray; native answers.
    Both,
}

impl From<AcceleratorName> for Accelerator {
    fn from(name: AcceleratorName) -> Self {
        match name {
            AcceleratorName::Auto => Self::Auto,
            AcceleratorName::Embree => Self::Embree,
            AcceleratorName::Native => Self::Native,
            AcceleratorName::Both => Self::Both,
        }
    }
}

/// How carefully to build an accelerator.
#[derive(Clone, Copy, Debug, ValueEnum, PartialEq, Eq)]
pub(super) enum QualityName {
    /// As the number of rays to be expected makes it worth.
    Auto,
    Low,
    Medium,
    High,
}

impl From<QualityName> for Option<Quality> {
    fn from(name: QualityName) -> Self {
        match name {
            QualityName::Auto => None,
            QualityName::Low => Some(Quality::Low),
            QualityName::Medium => Some(Quality::Medium),
            QualityName::High => Some(Quality::High),
        }
    }
}

/// Names of [`Estimator`]s, and `direct`.
#[derive(Clone, Copy, Debug, ValueEnum, PartialEq, Eq)]
pub(super) enum IntegratorName {
    /// Light and bsdf sampling combined: the one for use.
    Path,
    /// `path` for at most one bounce.
    Direct,
    /// Light sampling alone.
    Nee,
    /// Bsdf sampling alone.
    Bsdf,
    /// Uniform directions.
    Naive,
}

impl IntegratorName {
    pub(super) fn estimator(self) -> Estimator {
        match self {
            Self::Path | Self::Direct => Estimator::Path,
            Self::Nee => Estimator::Nee,
            Self::Bsdf => Estimator::Bsdf,
            Self::Naive => Estimator::Naive,
        }
    }

    pub(super) fn text(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Direct => "direct",
            Self::Nee => "nee",
            Self::Bsdf => "bsdf",
            Self::Naive => "naive",
        }
    }
}

/// Names of [`SamplerKind`]s.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum SamplerName {
    /// Owen-scrambled Sobol' points, good for any number of samples.
    Sobol,
    /// The same, so shared out among pixels that the noise is blue; the number of samples must be a power of two.
    #[value(name = "zsobol")]
    ZSobol,
    /// Correlated multi-jittered points, good for the given number of samples.
    Stratified,
    /// Independent numbers.
    Independent,
}

impl SamplerName {
    /// For `samples` a pixel; fails if it cannot have that many.
    pub(super) fn kind_for(self, samples: u32) -> crate::error::Result<SamplerKind> {
        let any = match self {
            Self::Sobol => SamplerKind::Sobol,
            Self::ZSobol => SamplerKind::ZSobol { log_samples: 0 },
            Self::Stratified => SamplerKind::Stratified { samples },
            Self::Independent => SamplerKind::Independent,
        };
        any.for_samples(samples).ok_or_else(|| {
            let most = 1u32 << MOST_LOG_SAMPLES;
            Error::Usage(format!(
                "--sampler zsobol needs a power of two up to {most} for the number of samples, which is {samples}: \
                 expected another --spp, or --sampler sobol"
            ))
        })
    }

    pub(super) fn text(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::ZSobol => "zsobol",
            Self::Stratified => "stratified",
            Self::Independent => "independent",
        }
    }
}

fn vary(text: &str) -> Result<Vary, String> {
    let names = || VARIED.join(", ");
    let Some((name, list)) = text.split_once('=') else {
        return Err(format!("expected NAME=VALUE,VALUE,… with one of the names {}", names()));
    };
    if !VARIED.contains(&name) {
        return Err(format!("'{name}' cannot be varied; expected one of {}", names()));
    }
    let values: Vec<String> = list.split(',').map(|v| v.trim().to_owned()).collect();
    if let Some(twice) = values.iter().enumerate().find(|(i, v)| values[..*i].contains(v)) {
        return Err(format!("'{}' is there twice", twice.1));
    }
    Ok(Vary { name: name.into(), values })
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s: &f64| *s > 0.0 && s.is_finite());
    seconds.ok_or_else(|| "expected seconds, more than 0".into())
}

fn define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.into(), value.into())),
        _ => Err("expected NAME=VALUE".into()),
    }
}

fn numbers<T: std::str::FromStr, const N: usize>(text: &str, separator: char) -> Option<[T; N]> {
    let parsed: Option<Vec<T>> = text.split(separator).map(|part| part.trim().parse().ok()).collect();
    parsed?.try_into().ok()
}

fn size(text: &str) -> Result<(u32, u32), String> {
    match numbers(text, 'x') {
        Some([w, h]) if w > 0 && h > 0 => Ok((w, h)),
        _ => Err("expected WIDTHxHEIGHT in pixels, for example 640x480".into()),
    }
}

fn crop(text: &str) -> Result<Crop, String> {
    match numbers(text, ',') {
        Some([x, y, width, height]) if width > 0 && height > 0 => Ok(Crop { x, y, width, height }),
        _ => Err("expected X,Y,WIDTH,HEIGHT in pixels, for example 10,20,64,64".into()),
    }
}

fn sample_id(text: &str) -> Result<SampleId, String> {
    /// Beyond every film and its border, and far from overflow.
    const FARTHEST: i64 = 1 << 30;
    let place = |v: i64| i32::try_from(v).ok().filter(|v| i64::from(*v).abs() <= FARTHEST);
    let parsed = numbers(text, ',').and_then(|[x, y, index]: [i64; 3]| {
        Some(SampleId { x: place(x)?, y: place(y)?, index: u32::try_from(index).ok()? })
    });
    parsed.ok_or_else(|| "expected X,Y,SAMPLE, for example 10,20,0".into())
}

/// A channel to write. Mitsuba's and other renderers' words have underscores.
fn aov(text: &str) -> Result<AovName, String> {
    let names = || AovName::value_variants().iter().filter_map(ValueEnum::to_possible_value);
    AovName::from_str(&text.replace('_', "-"), false).map_err(|_| {
        let names: Vec<String> = names().map(|name| name.get_name().replace('-', "_")).collect();
        format!("expected some of {}, separated by commas", names.join(", "))
    })
}

fn limit(text: &str) -> Result<Limit, String> {
    let names = || Metric::value_variants().iter().map(|m| m.text()).collect::<Vec<_>>().join(", ");
    let parsed = text.split_once('=').and_then(|(name, value)| {
        let value = value.parse().ok().filter(|v: &f64| !v.is_nan())?;
        Some(Limit { metric: Metric::from_str(name, false).ok()?, value })
    });
    parsed.ok_or_else(|| format!("expected METRIC=VALUE with one of the metrics {}", names()))
}

fn finite(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|v: &f32| v.is_finite()).ok_or_else(|| "expected a finite number".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_grammar_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn values_are_parsed_strictly() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        assert!(["", "640", "0x1", "1x0", "1x2x3", "-1x2", "1e3x2"].iter().all(|t| size(t).is_err()));
        assert_eq!(crop("1,2,3,4"), Ok(Crop { x: 1, y: 2, width: 3, height: 4 }));
        assert!(["1,2,3", "1,2,0,4", "a,2,3,4"].iter().all(|t| crop(t).is_err()));
        assert_eq!(define("a=b=c"), Ok(("a".into(), "b=c".into())));
        assert_eq!(limit("hdr-flip=0.5"), Ok(Limit { metric: Metric::HdrFlip, value: 0.5 }));
        assert!(["mse", "mse=", "mse=x", "mse=nan", "rmse=1", "=1"].iter().all(|t| limit(t).is_err()));
        assert!(define("a").is_err() && define("=b").is_err());
    }
}
