//! Scenes and renders for the tests of whole pictures.

#![allow(dead_code, reason = "each test file uses its own part of this")]
#![allow(missing_docs, unreachable_pub, clippy::unwrap_used, reason = "test code")]

use glam::{DAffine3, DMat3, DVec3};
use snell::accel::Accelerator;
use snell::description::*;
use snell::error::Span;
use snell::image::Picture;
use snell::integrator::{Estimator, Integrator as Estimate};
use snell::render::{Progress, RenderSettings, Rendered, render};
use snell::sampler::{Sampler as Numbers, SamplerKind};
use snell::scene::Scene;
use snell::scene::compile::{CompileOptions, compile};
use snell::spectrum::Rgb;
use std::path::{Path, PathBuf};

/// The accelerators that this build has.
pub fn accelerators() -> Vec<Accelerator> {
    let mut all = vec![Accelerator::Native];
    if cfg!(feature = "embree") {
        all.push(Accelerator::Embree);
    }
    all
}

pub fn at() -> Span {
    Span::whole(Path::new("test"))
}

/// A camera at `origin` that looks at `target`, with a square film.
pub fn camera(origin: DVec3, target: DVec3, fov: f64, pixels: u32) -> Camera {
    let forward = (target - origin).normalize();
    let up = if forward.y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
    let left = up.cross(forward).normalize();
    let matrix = DMat3::from_cols(left, forward.cross(left), forward);
    let film = Film {
        at: at(),
        width: pixels,
        height: pixels,
        crop: Crop { x: 0, y: 0, width: pixels, height: pixels },
        filter: Filter::Box,
        component_format: ComponentFormat::Float,
    };
    Camera {
        at: at(),
        to_world: DAffine3::from_mat3_translation(matrix, origin),
        fov,
        fov_axis: FovAxis::X,
        near_clip: 1e-3,
        far_clip: 1e4,
        principal_point_offset: (0.0, 0.0),
        film,
        sampler: Sampler { sample_count: 16, seed: 0 },
    }
}

pub fn shape(geometry: Geometry, to_world: DAffine3, bsdf: usize, emission: Option<f32>) -> Shape {
    Shape {
        at: at(),
        name: "shape".into(),
        geometry,
        to_world,
        flip_normals: false,
        bsdf: BsdfId(bsdf),
        emission: emission.map(Rgb::splat),
    }
}

pub fn diffuse(albedo: f32) -> Bsdf {
    Bsdf { at: at(), name: String::new(), kind: BsdfKind::Diffuse { reflectance: Rgb::splat(albedo) } }
}

/// The six walls of the box [−1, 1]³ · `half`, seen from inside.
pub fn walls(half: DVec3, emission: f32) -> Vec<Shape> {
    let turn = |axis: DVec3, angle: f64| DAffine3::from_axis_angle(axis, angle);
    let quarter = std::f64::consts::FRAC_PI_2;
    let rotations = [
        DAffine3::IDENTITY,
        turn(DVec3::X, 2.0 * quarter),
        turn(DVec3::X, quarter),
        turn(DVec3::X, -quarter),
        turn(DVec3::Y, quarter),
        turn(DVec3::Y, -quarter),
    ];
    rotations
        .into_iter()
        .map(|r| {
            // The rectangle looks along +z: put it behind the middle, then turn.
            let inwards = r * DAffine3::from_translation(-DVec3::Z);
            shape(Geometry::Rectangle, DAffine3::from_scale(half) * inwards, 0, Some(emission))
        })
        .collect()
}

/// A closed room whose walls have this albedo and emit this radiance; a camera inside.
pub fn enclosure(albedo: f32, emission: f32) -> SceneDescription {
    SceneDescription {
        integrator: Integrator::default(),
        cameras: vec![camera(DVec3::new(0.3, -0.2, 0.5), DVec3::new(-1.0, 0.4, -0.7), 90.0, 24)],
        bsdfs: vec![diffuse(albedo)],
        shapes: walls(DVec3::new(1.0, 0.7, 1.3), emission),
        lights: vec![],
        warnings: vec![],
    }
}

/// Moves and scales everything that has a length in it: p becomes p·scale + offset.
pub fn transformed(mut scene: SceneDescription, scale: f64, offset: DVec3) -> SceneDescription {
    let map = DAffine3::from_scale_rotation_translation(DVec3::splat(scale), Default::default(), offset);
    for s in &mut scene.shapes {
        s.to_world = map * s.to_world;
    }
    for c in &mut scene.cameras {
        c.to_world.translation = c.to_world.translation * scale + offset;
        c.near_clip *= scale;
        c.far_clip *= scale;
    }
    scene
}

pub fn compiled(scene: &SceneDescription, accelerator: Accelerator) -> Scene {
    compile(scene, &CompileOptions { accelerator, threads: 2, camera: 0 }).expect("the scene compiles").scene
}

/// What to render, with the defaults of a file.
pub fn settings(estimator: Estimator, samples: u32) -> RenderSettings {
    RenderSettings {
        samples,
        sampler: Numbers { kind: SamplerKind::Sobol, seed: 1 },
        integrator: Estimate { estimator, max_depth: u32::MAX, rr_depth: 5, hide_emitters: false },
    }
}

pub fn rendered(scene: &Scene, settings: &RenderSettings, threads: usize) -> Rendered {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let r = render(scene, settings, &pool, &Progress::default());
    assert!(r.complete, "the render was not interrupted");
    assert_eq!(r.dropped.count, 0, "non-finite samples: {:?}", r.dropped.examples);
    r
}

pub fn picture(scene: &Scene, settings: &RenderSettings) -> Picture {
    rendered(scene, settings, 2).film.develop()
}

/// Mean over pixels and channels.
pub fn mean(picture: &Picture) -> f64 {
    let sum: f64 = picture.pixels().iter().flat_map(|p| p.to_array()).map(f64::from).sum();
    sum / (3 * picture.pixels().len()) as f64
}

/// A file of the project.
pub fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A scene file of the project, with parameters.
pub fn load(path: &str, defines: &[(&str, &str)]) -> SceneDescription {
    let defines = defines.iter().map(|(n, v)| ((*n).into(), (*v).into())).collect();
    let options = snell::loader::LoadOptions { defines, lenient: false };
    snell::loader::load(&project(path), &options).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The file's own integrator limits, with an estimator of ours.
pub fn file_settings(scene: &SceneDescription, estimator: Estimator, samples: u32) -> RenderSettings {
    let mut s = settings(estimator, samples);
    s.integrator.max_depth = scene.integrator.max_depth.unwrap_or(u32::MAX);
    s.integrator.rr_depth = scene.integrator.rr_depth;
    s
}

/// Means over 8×8 pixels and the channels, and the variances of these means, from pictures of independent seeds.
pub struct Tiles {
    pub mean: Vec<f64>,
    pub variance: Vec<f64>,
}

/// Pixels along the edge of such a tile.
const TILE: u32 = 8;

/// Means over the tiles of one picture.
pub fn tile_means(picture: &Picture) -> Vec<f64> {
    let (across, down) = (picture.width() / TILE, picture.height() / TILE);
    let tile = |i: u32| {
        let (x0, y0) = (i % across * TILE, i / across * TILE);
        let pixels = (0..TILE * TILE).map(|k| picture.get(x0 + k % TILE, y0 + k / TILE));
        pixels.flat_map(|p| p.to_array()).map(f64::from).sum::<f64>() / f64::from(3 * TILE * TILE)
    };
    (0..across * down).map(tile).collect()
}

impl Tiles {
    /// From `seeds` renders.
    pub fn of(scene: &Scene, settings: &RenderSettings, seeds: u64) -> Self {
        let pictures: Vec<Vec<f64>> = (0..seeds)
            .map(|seed| {
                let mut s = *settings;
                s.sampler.seed = 1000 + seed;
                tile_means(&picture(scene, &s))
            })
            .collect();
        let n = pictures.len() as f64;
        let mean: Vec<f64> = (0..pictures[0].len()).map(|i| pictures.iter().map(|p| p[i]).sum::<f64>() / n).collect();
        let squares = |i: usize| pictures.iter().map(|p| (p[i] - mean[i]) * (p[i] - mean[i])).sum::<f64>();
        let variance = (0..mean.len()).map(|i| squares(i) / (n - 1.0) / n).collect();
        Self { mean, variance }
    }

    /// z of the difference of the picture means, and the largest |z| of any tile.
    pub fn z_against(&self, other: &Self) -> (f64, f64) {
        let n = self.mean.len() as f64;
        let sum = |v: &[f64]| v.iter().sum::<f64>();
        // Tiles of one picture are independent, so their variances add.
        let whole = (sum(&self.mean) - sum(&other.mean)) / n;
        let whole_z = whole / ((sum(&self.variance) + sum(&other.variance)).sqrt() / n);
        let tile_z = |i: usize| {
            let v = self.variance[i] + other.variance[i];
            let d = self.mean[i] - other.mean[i];
            if d == 0.0 { 0.0 } else { (d / v.sqrt()).abs() }
        };
        (whole_z, (0..self.mean.len()).map(tile_z).fold(0.0, f64::max))
    }
}
