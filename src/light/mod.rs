//! Where light comes from: radiance, sampling of directions towards a light, and the density of that sampling.
//!
//! Lights ask no rays: whether a sampled point is visible is the integrator's business.

mod area;
mod constant;
mod uniform;

pub use area::AreaLight;
pub use constant::ConstantLight;
pub use uniform::UniformLightSampler;

use crate::sampling::pdf::SolidAnglePdf;
use crate::shape::Shape;
use crate::shape::offset::SurfacePoint;
use crate::spectrum::Rgb;
use glam::{DVec3, Vec2, Vec3};

/// A light.
#[derive(Clone, Debug)]
pub enum Light {
    /// A surface that emits.
    Area(AreaLight),
    /// A sky of one colour.
    Constant(ConstantLight),
}

/// A direction towards a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub wi: Vec3,
    /// Radiance that arrives from there if nothing is in the way, in W·sr⁻¹·m⁻²; not black.
    pub radiance: Rgb,
    /// Density of `wi`, positive.
    pub pdf: SolidAnglePdf,
    /// The point on the light; `None` at infinity.
    pub end: Option<SurfacePoint>,
}

impl Light {
    /// A direction from `p` towards the light; `None` where this sample would bring nothing.
    #[inline]
    pub fn sample(&self, shapes: &[Shape], p: DVec3, u: Vec2) -> Option<LightSample> {
        match self {
            Self::Area(light) => light.sample(&shapes[light.shape as usize], p, u),
            Self::Constant(light) => Some(light.sample(u)),
        }
    }
}
