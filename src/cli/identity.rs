//! What decides the bits of a render, by name, so that a checkpoint can tell whether it is of the same one.

use super::args::RenderArgs;
use super::finish::Finish;
use super::prepare::Prepared;
use super::record::Identity;
use crate::error::{Error, Result};
use crate::render::RenderSettings;
use crate::sampler::MOST_OF_RUN;
use rayon::ThreadPool;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// The identity of a render; reads all its files once more.
///
/// Fails where one cannot be read any more.
pub(super) fn identity(
    args: &RenderArgs,
    prepared: &Prepared,
    settings: &RenderSettings,
    finish: &Finish,
    pool: &ThreadPool,
) -> Result<Identity> {
    let files = pool.install(|| hashes(&prepared.files, &args.scene.scene))?;
    Ok(Identity { settings: by_name(args, prepared, settings, finish), files })
}

fn by_name(
    args: &RenderArgs,
    prepared: &Prepared,
    settings: &RenderSettings,
    finish: &Finish,
) -> BTreeMap<String, String> {
    let (scene, film, integrator) = (&args.scene, &prepared.scene.film, &settings.integrator);
    let defines: Vec<String> = scene.define.iter().map(|(name, value)| format!("{name}={value}")).collect();
    let name = scene.scene.file_name().unwrap_or_default().to_string_lossy();
    let crop = film.crop;
    let is_open = settings.samples == MOST_OF_RUN;
    let named: [(&str, String); 23] = [
        ("version", env!("CARGO_PKG_VERSION").into()),
        ("scene", name.into_owned()),
        ("parameters", if defines.is_empty() { "none".into() } else { defines.join(" ") }),
        ("lenient", scene.lenient.to_string()),
        ("camera", scene.camera.to_string()),
        ("env-rotate", scene.env_rotate.unwrap_or(0.0).to_string()),
        ("size", format!("{}x{}", film.size.0, film.size.1)),
        ("crop", format!("{},{},{},{}", crop.x, crop.y, crop.width, crop.height)),
        ("filter", format!("{:?}", film.filter)),
        ("sample border", film.sample_border.to_string()),
        ("spp", if is_open { "no limit".into() } else { settings.samples.to_string() }),
        // In passes, time decides nothing but the end.
        ("ends by time", (args.goal.time.is_some() && !args.goal.is_adaptive()).to_string()),
        ("sampler", format!("{:?}", settings.sampler.kind)),
        ("seed", settings.sampler.seed.to_string()),
        ("integrator", format!("{:?}", integrator.estimator)),
        (
            "max-depth",
            if integrator.max_depth == u32::MAX { "no limit".into() } else { integrator.max_depth.to_string() },
        ),
        ("rr-depth", integrator.rr_depth.to_string()),
        ("hidden emitters", integrator.hide_emitters.to_string()),
        ("env-visible", (!integrator.hide_environment).to_string()),
        ("light-samples", integrator.light_samples.to_string()),
        ("reuse", format!("{:?}", integrator.reuse)),
        ("bias", args.bias.text()),
        // Where the two differ about a ray, so do the pictures.
        ("accelerator", prepared.scene.accel.name()),
    ];
    let mut named: BTreeMap<String, String> = named.map(|(name, value)| (name.into(), value)).into();
    if let Some(count) = args.beside.aov_spp {
        named.insert("aov-spp".into(), count.to_string());
    }
    let channels: Vec<&str> = finish.channels.names().collect();
    let format = format!("{:?} {:?}", finish.pixel_format, finish.component_format);
    named.insert("channels".into(), [&[format.as_str()], channels.as_slice()].concat().join(" "));
    named
}

/// A hash of each file by its path, relative to the scene's folder if it is in there.
fn hashes(files: &[PathBuf], scene: &Path) -> Result<BTreeMap<String, String>> {
    let folder = scene.canonicalize().ok().and_then(|scene| scene.parent().map(Path::to_owned)).unwrap_or_default();
    let hash = |path: &PathBuf| {
        let fail = |e: std::io::Error| Error::file(path, format!("cannot read it again for the checkpoint: {e}"));
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(File::open(path).map_err(fail)?).map_err(fail)?;
        let name = path.strip_prefix(&folder).unwrap_or(path).to_string_lossy().into_owned();
        Ok((name, hasher.finalize().to_hex().to_string()))
    };
    files.par_iter().map(hash).collect()
}
