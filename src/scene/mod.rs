//! The compiled scene: everything a render needs, in f32, immutable, shared by all threads.
//!
//! # Space
//!
//! The compiled scene is the file's, moved so that the centre of its surfaces is the origin and scaled by a power of two
//! so that the farthest coordinate of a surface is in [½, 1). Both happen in f64, before anything is rounded. So a scene
//! far from the origin loses nothing, no square or product overflows, and a file whose lengths are all multiplied by a
//! power of two gives the same compiled scene, bit for bit. Radiance does not depend on the unit of length.

pub mod compile;
mod features;
mod space;
mod surface;

pub use features::Features;
pub use surface::Surface;

use crate::accel::{Accel, Hit};
use crate::bsdf::Material;
use crate::camera::Perspective;
use crate::image::{ComponentFormat, Crop};
use crate::light::{Light, UniformLightSampler};
use crate::math::ray::Ray;
use crate::shape::Shape;
use crate::spectrum::Rgb;
use glam::DVec3;

/// The picture that the scene's camera takes.
#[derive(Clone, Copy, Debug)]
pub struct FilmSettings {
    /// Pixels across and down of the whole film.
    pub size: (u32, u32),
    /// The part to render.
    pub crop: Crop,
    /// Type of an EXR's values.
    pub component_format: ComponentFormat,
}

/// What a shape looks like.
#[derive(Clone, Copy, Debug)]
pub struct Appearance {
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// Index into [`Scene::lights`], if it emits.
    pub light: Option<u32>,
}

/// A compiled scene.
pub struct Scene {
    /// The camera.
    pub camera: Perspective,
    /// The picture it takes.
    pub film: FilmSettings,
    /// Every shape.
    pub shapes: Vec<Shape>,
    /// What each shape looks like.
    pub appearances: Vec<Appearance>,
    /// Every surface description in use.
    pub materials: Vec<Material>,
    /// Every light that is not black.
    pub lights: Vec<Light>,
    /// Which of them are at infinity.
    pub infinite_lights: Vec<u32>,
    /// Chooses among the lights.
    pub light_sampler: UniformLightSampler,
    /// Answers ray queries.
    pub accel: Accel,
    /// What the scene has.
    pub features: Features,
    /// Factor from the file's unit of length to the compiled scene's: a power of two.
    pub unit: f64,
    /// The point of the file's space that is the compiled scene's origin.
    pub centre: DVec3,
}

impl Scene {
    /// The surface that `ray` meets, as seen from its origin.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: Hit) -> Surface<'_> {
        let appearance = self.appearances[hit.shape as usize];
        let shape_point = self.shapes[hit.shape as usize].meet(ray, hit.primitive);
        Surface::new(shape_point, -ray.d, &self.materials[appearance.material as usize], appearance.light)
    }

    /// The largest radiance that any light emits, in its largest channel.
    pub fn brightest(&self) -> f32 {
        let radiance = |l: &Light| match l {
            Light::Area(l) => l.radiance,
            Light::Constant(l) => l.radiance,
        };
        self.lights.iter().map(radiance).map(Rgb::max_component).fold(0.0, f32::max)
    }
}
