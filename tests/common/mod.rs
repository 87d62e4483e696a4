//! Scenes and renders for the tests of whole pictures.

#![allow(dead_code, reason = "each test file uses its own part of this")]
#![allow(missing_docs, unreachable_pub, clippy::unwrap_used, reason = "test code")]

mod estimate;
#[path = "../../scenes/million/generate.rs"]
pub mod million;
mod references;

#[allow(unused_imports, reason = "each test file uses its own part of this")]
pub use snell::check::rooms::*;

#[allow(unused_imports, reason = "each test file uses its own part of this")]
pub use estimate::{Estimate, Worst};
#[allow(unused_imports, reason = "each test file uses its own part of this")]
pub use references::{HEAVY_TAILED, REFERENCES, RES, Reference, read_reference};

use glam::DVec3;
use snell::accel::Accelerator;
use snell::description::*;
use snell::image::Picture;
use snell::integrator::Estimator;
use snell::render::{Progress, RenderSettings, Rendered, render};
use snell::sampler::{Sampler as Numbers, SamplerKind};
use snell::scene::Scene;
use snell::scene::compile::{CompileOptions, compile};
use std::path::{Path, PathBuf};

/// The accelerators that this build has.
pub fn accelerators() -> Vec<Accelerator> {
    let mut all = vec![Accelerator::Native];
    if cfg!(feature = "embree") {
        all.push(Accelerator::Embree);
    }
    all
}

/// Moves and scales everything that has a length in it: p becomes p·scale + offset.
pub fn transformed(scene: SceneDescription, scale: f64, offset: DVec3) -> SceneDescription {
    scene.transformed(scale, offset)
}

pub fn compiled(scene: &SceneDescription, accelerator: Accelerator) -> Scene {
    compile(scene, &CompileOptions { accelerator, quality: None, threads: 2, camera: 0, samples: None })
        .expect("the scene compiles")
        .scene
}

/// What to render, with the defaults of a file.
pub fn settings(estimator: Estimator, samples: u32) -> RenderSettings {
    RenderSettings {
        samples,
        sampler: Numbers { kind: SamplerKind::Sobol, seed: 1 },
        clamp: None,
        integrator: snell::integrator::Integrator {
            estimator,
            max_depth: u32::MAX,
            rr_depth: 5,
            hide_emitters: false,
            hide_environment: false,
            light_samples: 1,
            reuse: snell::integrator::PathReuse::Off,
        },
    }
}

pub fn rendered(scene: &Scene, settings: &RenderSettings, threads: usize) -> Rendered {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let r = render(scene, settings, &pool, &Progress::default());
    assert!(r.is_complete(), "the render was not interrupted");
    assert_eq!(r.dropped.count, 0, "non-finite samples: {:?}", r.dropped.examples);
    r
}

pub fn picture(scene: &Scene, settings: &RenderSettings) -> Picture {
    rendered(scene, settings, 2).film.develop()
}

/// The variance of pixels over the pictures of eight seeds, relative to the squares of their means as relMSE is, summed.
pub fn relative_variance(scene: &Scene, settings: &RenderSettings) -> f64 {
    let pictures: Vec<_> = (0..8)
        .map(|seed| {
            let mut settings = *settings;
            settings.sampler.seed = seed;
            picture(scene, &settings)
        })
        .collect();
    let value = |k: usize, i: usize| f64::from(pictures[k].pixels()[i].luminance());
    let of_pixel = |i: usize| {
        let mean = (0..8).map(|k| value(k, i)).sum::<f64>() / 8.0;
        (0..8).map(|k| (value(k, i) - mean).powi(2)).sum::<f64>() / 7.0 / (mean * mean + 1e-2)
    };
    (0..pictures[0].pixels().len()).map(of_pixel).sum()
}

/// Mean over pixels and channels.
pub fn mean(picture: &Picture) -> f64 {
    let sum: f64 = picture.pixels().iter().flat_map(|p| p.to_array()).map(f64::from).sum();
    sum / (3 * picture.pixels().len()) as f64
}

/// The mean of pictures of 16 seeds, and its standard error.
pub fn mean_of_seeds(scene: &Scene, settings: &RenderSettings) -> (f64, f64) {
    let means: Vec<f64> = (0..16)
        .map(|seed| {
            let mut s = *settings;
            s.sampler.seed = seed;
            mean(&picture(scene, &s))
        })
        .collect();
    let n = means.len() as f64;
    let m = means.iter().sum::<f64>() / n;
    (m, (means.iter().map(|x| (x - m) * (x - m)).sum::<f64>() / (n - 1.0) / n).sqrt())
}

/// A file of the project.
pub fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A scene file of the project, with parameters.
pub fn load(path: &str, defines: &[(&str, &str)]) -> SceneDescription {
    let defines = defines.iter().map(|(n, v)| ((*n).into(), (*v).into())).collect();
    let options = snell::loader::LoadOptions { defines, ..Default::default() };
    snell::loader::load(&project(path), &options).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The parameters of an own scene, `res` pixels wide and high. The mesh of `million` is made in `scratch`.
pub fn scene_parameters(name: &str, res: u32, scratch: &Path) -> Vec<(String, String)> {
    let mut parameters = vec![("res".to_owned(), res.to_string())];
    if name == "million" {
        let mesh = scratch.join("mesh.ply");
        million::write_mesh(&mesh, million::SIZE).expect("the mesh can be written");
        parameters.push(("mesh".to_owned(), mesh.to_str().expect("a path in UTF-8").to_owned()));
    }
    parameters
}

/// An own scene with these parameters.
pub fn load_scene(name: &str, res: u32, scratch: &Path) -> SceneDescription {
    let parameters = scene_parameters(name, res, scratch);
    let parameters: Vec<(&str, &str)> = parameters.iter().map(|(n, v)| (n.as_str(), v.as_str())).collect();
    let scene = load(&format!("scenes/{name}/scene.xml"), &parameters);
    assert!(scene.warnings.is_empty(), "{name}: {:?}", scene.warnings);
    scene
}

/// The file's own integrator limits, with an estimator of ours.
pub fn file_settings(scene: &SceneDescription, estimator: Estimator, samples: u32) -> RenderSettings {
    let mut s = settings(estimator, samples);
    s.integrator.max_depth = scene.integrator.max_depth.unwrap_or(u32::MAX);
    s.integrator.rr_depth = scene.integrator.rr_depth;
    s
}
