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
use crate::camera::Camera;
use crate::image::{ComponentFormat, Crop, Filter};
use crate::light::{Light, UniformLightSampler};
use crate::math::frame::Frame;
use crate::math::ray::Ray;
use crate::shape::Shape;
use crate::shape::offset::SurfacePoint;
use crate::shape::tangent::TangentField;
use glam::{DVec3, Vec3};

/// The picture that the scene's camera takes.
#[derive(Clone, Copy, Debug)]
pub struct FilmSettings {
    /// Pixels across and down of the whole film.
    pub size: (u32, u32),
    /// The part to render.
    pub crop: Crop,
    /// The reconstruction filter.
    pub filter: Filter,
    /// Whether samples are taken around the part, too, wherever one reaches into it.
    pub sample_border: bool,
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
    /// Whether the file gives it an emitter, be it a black one: then `hide_emitters` hides it.
    pub is_emitter: bool,
    /// Index into [`Scene::tangents`], if its material is anisotropic.
    pub tangents: Option<u32>,
}

/// A compiled scene.
pub struct Scene {
    /// The camera.
    pub camera: Camera,
    /// The picture it takes.
    pub film: FilmSettings,
    /// Every shape.
    pub shapes: Vec<Shape>,
    /// What each shape looks like.
    pub appearances: Vec<Appearance>,
    /// Every surface description in use.
    pub materials: Vec<Material>,
    /// Tangents of every shape whose material is anisotropic.
    pub tangents: Vec<TangentField>,
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
    #[inline(always)]
    pub fn surface(&self, ray: &Ray, hit: Hit) -> Surface<'_> {
        let appearance = self.appearances[hit.shape as usize];
        let material = &self.materials[appearance.material as usize];
        // Twice the same: a point that came from either would have to be put into memory, and read too soon after.
        let mut surface = match &self.shapes[hit.shape as usize] {
            Shape::Mesh(mesh) => Surface::new(mesh.meet(ray, hit.primitive), -ray.d, material, appearance.light),
            quadric => Surface::new(quadric.meet(ray, hit.primitive), -ray.d, material, appearance.light),
        };
        if let Some(field) = appearance.tangents {
            surface.frame = self.anisotropic_frame(field, hit.primitive, surface.frame.n, surface.point);
        }
        surface
    }

    /// The frame of the shading normal `n` along the tangents of a shape. Not inlined, and given copies: most scenes have
    /// nothing anisotropic.
    #[inline(never)]
    fn anisotropic_frame(&self, field: u32, primitive: u32, n: Vec3, at: SurfacePoint) -> Frame {
        Frame::from_tangent(n, self.tangents[field as usize].at(primitive, &at))
    }

    /// The largest radiance that any light emits, in its largest channel; of a light without size, one of the order
    /// that it makes ([`crate::light::PointLight::scale`]).
    pub fn brightest(&self) -> f32 {
        let radiance = |l: &Light| match l {
            Light::Area(l) => l.radiance.max_component(),
            Light::Constant(l) => l.radiance.max_component(),
            Light::Point(l) => l.scale(),
        };
        self.lights.iter().map(radiance).fold(0.0, f32::max)
    }
}
