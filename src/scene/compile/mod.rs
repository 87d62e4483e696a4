//! From the scene description to the compiled scene: the only place that knows both.

mod geometry;
mod lights;
mod look;
mod material;
mod tangents;
mod uvs;

use super::space::ToScene;
use super::{Features, FilmSettings, Scene};
use crate::accel::{Accel, Accelerator};
use crate::camera::{Perspective, Pinhole};
use crate::description::{Camera, FovAxis, SceneDescription};
use crate::error::{Error, Result};
use crate::light::{Light, UniformLightSampler};
use crate::material::Material;
use crate::shape::Shape;
use glam::{DVec2, DVec3};
use lights::Place;
use std::time::{Duration, Instant};

/// How to compile.
#[derive(Clone, Copy, Debug)]
pub struct CompileOptions {
    /// Who answers ray queries.
    pub accelerator: Accelerator,
    /// Threads that Embree may build with; our own builder takes the pool it is called in.
    pub threads: usize,
    /// Which of the file's cameras.
    pub camera: usize,
}

/// A compiled scene, and what compiling it was like.
pub struct Compiled {
    /// The scene.
    pub scene: Scene,
    /// What each of the scene's lights is called, with its place in the file.
    pub light_names: Vec<String>,
    /// Complaints that were not fatal.
    pub warnings: Vec<String>,
    /// Time that the accelerator took to build.
    pub accel_build: Duration,
}

/// Compiles `description` as one of its cameras sees it.
///
/// Fails where a number of the description makes no sense in f32 or for physics (a radiance below zero, a camera without
/// direction), with its place in the file, or where the accelerator cannot be built.
pub fn compile(description: &SceneDescription, options: &CompileOptions) -> Result<Compiled> {
    let count = description.cameras.len();
    let camera = description
        .cameras
        .get(options.camera)
        .ok_or_else(|| Error::Usage(format!("camera {} was asked for, but the scene has {count}", options.camera)))?;
    let mut warnings = Vec::new();
    let bounds = geometry::bounds(description);
    let to_scene = ToScene::fitting(&bounds);
    let (shapes, kept) = geometry::shapes(description, &to_scene, &mut warnings)?;
    let look = look::compile(description, &shapes, &kept, &Place { bounds, to_scene }, &mut warnings)?;
    let start = Instant::now();
    let accel = Accel::build(options.accelerator, &shapes, options.threads)?;
    let accel_build = start.elapsed();
    let lobes = look.materials.all.iter().map(Material::lobes);
    let is_sky = |l: &Light| matches!(l, Light::Constant(_) | Light::Environment(_));
    let infinite_lights: Vec<u32> = (0u32..).zip(&look.lights).filter(|(_, l)| is_sky(l)).map(|(i, _)| i).collect();
    let quadrics = shapes.iter().filter(|s| !matches!(s, Shape::Mesh(_))).count() as u64;
    let count = |kind: fn(&Light) -> bool| look.lights.iter().filter(|l| kind(l)).count() as u64;
    let features = Features {
        triangles: shapes.iter().map(|s| s.primitive_count() as u64).sum::<u64>() - quadrics,
        quadrics,
        vertex_normals: shapes.iter().any(|s| matches!(s, Shape::Mesh(m) if !m.normals.is_empty())),
        delta_lobes: lobes.clone().any(|l| l.delta),
        transmission: lobes.clone().any(|l| l.transmits),
        anisotropy: lobes.clone().any(|l| l.anisotropic),
        textures: description.textures.iter().filter(|t| t.is_varying()).count() as u64,
        area_lights: count(|l| matches!(l, Light::Area(_))),
        infinite_lights: infinite_lights.len() as u64,
        directional_lights: count(|l| matches!(l, Light::Directional(_))),
        point_lights: count(|l| matches!(l, Light::Point(_))),
        spot_lights: count(|l| matches!(l, Light::Spot(_))),
        projector_lights: count(|l| matches!(l, Light::Projector(_))),
    };
    let film = FilmSettings {
        size: (camera.film.width, camera.film.height),
        crop: camera.film.crop,
        filter: camera.film.filter,
        sample_border: camera.film.sample_border,
        component_format: camera.film.component_format,
        pixel_format: camera.film.pixel_format,
    };
    let scene = Scene {
        camera: compile_camera(camera, &to_scene)?,
        film,
        shapes,
        appearances: look.appearances,
        materials: look.materials.all,
        textures: material::textures(description),
        tangents: look.tangents,
        uvs: look.uvs,
        light_sampler: UniformLightSampler::new(look.lights.len()),
        lights: look.lights,
        infinite_lights,
        accel,
        features,
        unit: to_scene.unit,
        centre: to_scene.centre,
    };
    Ok(Compiled { scene, light_names: look.light_names, warnings, accel_build })
}

fn compile_camera(camera: &Camera, to_scene: &ToScene) -> Result<Perspective> {
    let axis = |v: DVec3| {
        let a = (camera.to_world.matrix3 * v).normalize();
        let fail = || Error::scene(&camera.at, "the camera's to_world gives it no direction");
        if a.is_finite() { Ok(a) } else { Err(fail()) }
    };
    let (width, height) = (f64::from(camera.film.width), f64::from(camera.film.height));
    let (x, y) = camera.principal_point_offset;
    let origin = to_scene.point(camera.to_world.translation);
    let clip = (camera.near_clip * to_scene.unit, camera.far_clip * to_scene.unit);
    if !origin.as_vec3().is_finite() || !(clip.0 as f32).is_finite() {
        return Err(Error::scene(&camera.at, "the camera is too far away for the size of the scene"));
    }
    Ok(Perspective::new(&Pinhole {
        origin,
        left: axis(DVec3::X)?,
        up: axis(DVec3::Y)?,
        forward: axis(DVec3::Z)?,
        film: DVec2::new(width, height),
        half_width: half_width(camera.fov, camera.fov_axis, width / height),
        principal_point: DVec2::new(x, y),
        clip,
    }))
}

/// Tangent of half the horizontal field of view, for a film of this width over height.
fn half_width(fov: f64, axis: FovAxis, aspect: f64) -> f64 {
    let tan = libm::tan(0.5 * fov.to_radians());
    let along_x = match axis {
        FovAxis::X => true,
        FovAxis::Y => false,
        FovAxis::Smaller => aspect <= 1.0,
        FovAxis::Larger => aspect >= 1.0,
        FovAxis::Diagonal => return tan / (1.0 + 1.0 / (aspect * aspect)).sqrt(),
    };
    if along_x { tan } else { tan * aspect }
}
