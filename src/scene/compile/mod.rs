//! From the scene description to the compiled scene: the only place that knows both.

mod camera;
mod fold;
mod geometry;
mod instances;
mod lights;
mod look;
mod material;
mod mesh_values;
mod tangents;
mod textures;
mod uvs;

use super::space::ToScene;
use super::{Features, FilmSettings, Panes, Scene};
use crate::accel::{Accel, Accelerator, Choice, Quality};
use crate::camera::Camera;
use crate::description::SceneDescription;
use crate::error::{Error, Result};
use crate::light::{Light, LightSampler};
use crate::material::Material;
use crate::shape::Shape;
pub use fold::{Beyond, fold};
use lights::Place;
use look::Look;
use std::collections::HashSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How to compile.
#[derive(Clone, Copy, Debug)]
pub struct CompileOptions {
    /// Who answers ray queries.
    pub accelerator: Accelerator,
    /// How carefully to build for them; by their number if not given.
    pub quality: Option<Quality>,
    /// Threads that Embree may build with; our own builder takes the pool it is called in.
    pub threads: usize,
    /// Which of the file's cameras.
    pub camera: usize,
    /// Samples a pixel, if they are not as many as the file says: [`Accelerator::Auto`] goes by them.
    pub samples: Option<u32>,
}

/// Rays that a sample takes, about: those of the shared scenes take 3.5 to 8.5.
const RAYS_PER_SAMPLE: f64 = 6.0;

/// A compiled scene, and what compiling it was like.
pub struct Compiled {
    /// The scene.
    pub scene: Scene,
    /// What each of the scene's lights is called, with its place in the file.
    pub light_names: Vec<String>,
    /// Complaints that were not fatal.
    pub warnings: Vec<String>,
    /// Which accelerator was taken, and why.
    pub accel_choice: Choice,
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
    textures::check(description)?;
    material::check(description)?;
    let mut warnings = Vec::new();
    let bounds = geometry::bounds(description);
    let to_scene = ToScene::fitting(&bounds);
    let compiled = geometry::shapes(description, &to_scene, &mut warnings)?;
    let place = Place { bounds, to_scene, textures: Arc::new(textures::compile(description)) };
    let mut look = look::compile(description, &compiled, &place, &mut warnings)?;
    let shapes = compiled.shapes;
    let start = Instant::now();
    let accel_choice = Choice::new(options.accelerator, options.quality, &shapes, rays(description, options));
    let accel = Accel::build(accel_choice.accelerator, &shapes, options.threads, accel_choice.quality)?;
    let accel_build = start.elapsed();
    let seen_by = camera::compile(camera, &to_scene)?;
    let features = features(description, &shapes, &look, &seen_by);
    let infinite_lights: Vec<u32> = (0u32..).zip(&look.lights).filter(|(_, l)| l.is_sky()).map(|(i, _)| i).collect();
    let light_sampler = LightSampler::new(&look.lights, &shapes);
    let film = FilmSettings {
        size: (camera.film.width, camera.film.height),
        crop: camera.film.crop,
        filter: camera.film.filter,
        sample_border: camera.film.sample_border,
        component_format: camera.film.component_format,
        pixel_format: camera.film.pixel_format,
    };
    features.allow();
    let panes = match look.lights.iter().any(Light::can_be_met) {
        true => Panes::new(&shapes, &look.appearances),
        false => Panes::default(),
    };
    let scene = Scene {
        camera: seen_by,
        film,
        shapes,
        appearances: look.appearances,
        absorption: look.materials.absorption(),
        materials: look.materials.all,
        rougher: Vec::new(),
        textures: place.textures,
        tangents: look.tangents,
        uvs: look.uvs,
        mesh_values: look.mesh_values,
        light_sampler,
        lights: look.lights,
        infinite_lights,
        panes,
        accel,
        features,
        unit: to_scene.unit,
        centre: to_scene.centre,
    };
    Ok(Compiled { scene, light_names: look.light_names, warnings, accel_choice, accel_build })
}

/// How many rays are to be expected; none where there is no such camera.
pub(super) fn rays(description: &SceneDescription, options: &CompileOptions) -> f64 {
    let Some(camera) = description.cameras.get(options.camera) else { return 0.0 };
    let samples = options.samples.unwrap_or(camera.sampler.sample_count);
    let pixels = f64::from(camera.film.crop.width) * f64::from(camera.film.crop.height);
    RAYS_PER_SAMPLE * pixels * f64::from(samples)
}

/// What the scene has; of a group once, however often it is placed.
fn features(description: &SceneDescription, shapes: &[Shape], look: &Look, camera: &Camera) -> Features {
    let mut groups = HashSet::new();
    let stored: Vec<&Shape> = shapes
        .iter()
        .flat_map(|shape| match shape {
            Shape::Placed(placed) if groups.insert(Arc::as_ptr(&placed.group)) => &placed.group.shapes[..],
            Shape::Placed(_) => &[],
            own => std::slice::from_ref(own),
        })
        .collect();
    let quadrics = stored.iter().filter(|s| !matches!(s, Shape::Mesh(_))).count() as u64;
    let lobes = look.materials.all.iter().map(Material::lobes);
    let count = |kind: fn(&Light) -> bool| look.lights.iter().filter(|l| kind(l)).count() as u64;
    Features {
        triangles: stored.iter().map(|s| s.primitive_count() as u64).sum::<u64>() - quadrics,
        quadrics,
        instances: description.instances.len() as u64,
        vertex_normals: stored.iter().any(|s| matches!(s, Shape::Mesh(m) if !m.normals.is_empty())),
        delta_lobes: lobes.clone().any(|l| l.delta),
        transmission: lobes.clone().any(|l| l.transmits),
        anisotropy: lobes.clone().any(|l| l.anisotropic),
        volumes: look.materials.absorbs(),
        lens: camera.has_lens(),
        varying_materials: look.materials.all.iter().filter(|m| matches!(m, Material::Varying(_))).count() as u64,
        masks: look.materials.all.iter().any(|m| matches!(m, Material::Varying(graph) if graph.has_masks())),
        textures: description.textures.iter().filter(|t| t.is_varying()).count() as u64,
        area_lights: count(|l| matches!(l, Light::Area(_) | Light::Varying(_))),
        infinite_lights: count(Light::is_sky),
        directional_lights: count(|l| matches!(l, Light::Directional(_))),
        point_lights: count(|l| matches!(l, Light::Point(_))),
        spot_lights: count(|l| matches!(l, Light::Spot(_))),
        projector_lights: count(|l| matches!(l, Light::Projector(_))),
    }
}
