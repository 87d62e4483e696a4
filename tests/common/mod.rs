//! Scenes and renders for the tests of whole pictures.

#![allow(dead_code, reason = "each test file uses its own part of this")]
#![allow(missing_docs, unreachable_pub, clippy::unwrap_used, reason = "test code")]

mod estimate;
#[path = "../../scenes/million/generate.rs"]
pub mod million;
mod references;

#[allow(unused_imports, reason = "each test file uses its own part of this")]
pub use estimate::{Estimate, Worst};
#[allow(unused_imports, reason = "each test file uses its own part of this")]
pub use references::{REFERENCES, RES, Reference, read_reference};

use glam::{DAffine3, DMat3, DVec3};
use snell::accel::Accelerator;
use snell::description::*;
use snell::error::Span;
use snell::image::Picture;
use snell::integrator::Estimator;
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
        sample_border: false,
        component_format: ComponentFormat::Float,
        pixel_format: PixelFormat::Rgb,
    };
    Camera {
        at: at(),
        to_world: DAffine3::from_mat3_translation(matrix, origin),
        projection: perspective(fov, FovAxis::X),
        near_clip: 1e-3,
        far_clip: 1e4,
        film,
        sampler: Sampler { sample_count: 16, seed: 0 },
    }
}

pub fn perspective(degrees: f64, axis: FovAxis) -> Projection {
    Projection::Perspective { fov: FieldOfView { degrees, axis }, principal_point_offset: (0.0, 0.0) }
}

pub fn shape(geometry: Geometry, to_world: DAffine3, bsdf: usize, emission: Option<f32>) -> Shape {
    Shape {
        at: at(),
        name: "shape".into(),
        geometry,
        to_world,
        flip_normals: false,
        bsdf: BsdfId(bsdf),
        emission: emission.map(|v| Emission::uniform(Rgb::splat(v))),
    }
}

pub fn diffuse(albedo: f32) -> Bsdf {
    Bsdf { at: at(), name: String::new(), kind: BsdfKind::Diffuse { reflectance: Rgb::splat(albedo) }, varying: vec![] }
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

/// A point light.
pub fn point_light(position: DVec3, intensity: Rgb) -> Light {
    Light { at: at(), kind: LightKind::Point { position, intensity } }
}

/// A light of the scene's own.
pub fn light(kind: LightKind) -> Light {
    Light { at: at(), kind }
}

/// A picture of these values.
pub fn map(width: u32, height: u32, value: impl Fn(u32, u32) -> Rgb) -> std::sync::Arc<Picture> {
    let mut map = Picture::new(width, height);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        map.set(x, y, value(x, y));
    }
    std::sync::Arc::new(map)
}

/// A texture of these values.
pub fn picture_texture(width: u32, height: u32, value: impl Fn(u32, u32) -> Rgb) -> Texture {
    let image = std::sync::Arc::new(snell::image::Raster::from(&*map(width, height, value)));
    let kind = TextureKind::Bitmap { image, bilinear: true, wrap: [Wrap::Repeat; 2] };
    Texture { at: at(), kind, uv_set: 0, to_uv: glam::DAffine2::IDENTITY }
}

/// The side of a cylinder and the disks that close its ends, under an affine map, fronts inside.
pub fn closed_cylinder(map: DAffine3, emission: Option<f32>) -> Vec<Shape> {
    let side = Geometry::Cylinder { p0: DVec3::NEG_Z, p1: DVec3::Z, radius: 1.0 };
    let end = |z: f64| map * DAffine3::from_translation(DVec3::new(0.0, 0.0, z));
    let mut side = shape(side, map, 0, emission);
    side.flip_normals = true;
    let mut top = shape(Geometry::Disk, end(1.0), 0, emission);
    top.flip_normals = true;
    vec![side, shape(Geometry::Disk, end(-1.0), 0, emission), top]
}

/// A closed room whose walls have this albedo and emit this radiance; a camera inside.
pub fn enclosure(albedo: f32, emission: f32) -> SceneDescription {
    SceneDescription {
        integrator: Integrator::default(),
        cameras: vec![camera(DVec3::new(0.3, -0.2, 0.5), DVec3::new(-1.0, 0.4, -0.7), 90.0, 24)],
        bsdfs: vec![diffuse(albedo)],
        textures: vec![],
        wants_uvs: false,
        shapes: walls(DVec3::new(1.0, 0.7, 1.3), emission),
        groups: vec![],
        instances: vec![],
        lights: vec![],
        warnings: vec![],
        inventory: Default::default(),
    }
}

/// Moves and scales everything that has a length in it: p becomes p·scale + offset.
pub fn transformed(mut scene: SceneDescription, scale: f64, offset: DVec3) -> SceneDescription {
    let map = DAffine3::from_scale_rotation_translation(DVec3::splat(scale), Default::default(), offset);
    for s in &mut scene.shapes {
        s.to_world = map * s.to_world;
    }
    for s in scene.groups.iter_mut().flat_map(|g| &mut g.shapes) {
        s.to_world = DAffine3::from_scale(DVec3::splat(scale)) * s.to_world;
    }
    for i in &mut scene.instances {
        i.to_world.translation = i.to_world.translation * scale + offset;
    }
    for l in &mut scene.lights {
        if let LightKind::Point { position, intensity } | LightKind::Spot { position, intensity, .. } = &mut l.kind {
            *position = *position * scale + offset;
            *intensity = intensity.map(|c| (f64::from(c) * scale * scale) as f32);
        }
        if let LightKind::Projector { to_world, scale: brightness, .. } = &mut l.kind {
            to_world.translation = to_world.translation * scale + offset;
            *brightness *= scale * scale;
        }
    }
    for b in &mut scene.bsdfs {
        if let BsdfKind::Perturbed { normal: NormalSource::Bump { scale: height, .. }, .. } = &mut b.kind {
            *height *= scale;
        }
    }
    for c in &mut scene.cameras {
        c.to_world.translation = c.to_world.translation * scale + offset;
        c.near_clip *= scale;
        c.far_clip *= scale;
        match &mut c.projection {
            Projection::ThinLens { aperture_radius, focus_distance, .. } => {
                *aperture_radius *= scale;
                *focus_distance *= scale;
            }
            Projection::Orthographic => {
                // The clip planes move with the axis that the camera looks along.
                c.to_world.matrix3.x_axis *= scale;
                c.to_world.matrix3.y_axis *= scale;
            }
            Projection::Perspective { .. } | Projection::Panorama => {}
        }
    }
    scene
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
    assert!(r.complete, "the render was not interrupted");
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
