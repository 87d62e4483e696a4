//! Where light comes from: radiance, sampling of directions towards a light, and the density of that sampling.
//!
//! Lights ask no rays: whether a sampled point is visible is the integrator's business.

mod area;
mod constant;
mod point;
mod uniform;

pub use area::AreaLight;
pub use constant::ConstantLight;
pub use point::PointLight;
pub use uniform::UniformLightSampler;

use crate::sampling::pdf::SolidAnglePdf;
use crate::shape::offset::SurfacePoint;
use crate::shape::{Hit, Shape};
use crate::spectrum::Rgb;
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// A light.
#[derive(Clone, Debug)]
pub enum Light {
    /// A surface that emits.
    Area(AreaLight),
    /// A sky of one colour.
    Constant(ConstantLight),
    /// A point.
    Point(PointLight),
}

/// A direction towards a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub wi: Vec3,
    /// Radiance that arrives from there if nothing is in the way, in W·sr⁻¹·m⁻²; not black. Of a light without size the
    /// irradiance of a surface that faces it, in W·m⁻².
    pub radiance: Rgb,
    /// Density of `wi`, positive and finite; `None` of a light without size, which has no other direction.
    pub pdf: Option<SolidAnglePdf>,
    /// The point on the light; `None` at infinity.
    pub end: Option<SurfacePoint>,
    /// What it is a point of; [`Hit::NONE`] at infinity and in free space.
    pub on: Hit,
}

impl Light {
    /// A direction from `p` towards the light; `None` where this sample would bring nothing.
    #[inline(always)]
    pub fn sample(&self, shapes: &[Shape], p: DVec3, u: Vec2) -> Option<LightSample> {
        match self {
            Self::Area(light) => light.sample(&shapes[light.shape as usize], p, u),
            Self::Constant(light) => Some(light.sample(u)),
            Self::Point(light) => light.sample(&p),
        }
    }

    /// Radiant flux that leaves the light, per channel, in W where the compiled scene's unit of length stands for the
    /// metre: π·A·L of a surface, 4π·I of a point; `None` at infinity, where it is not finite.
    pub fn power(&self, shapes: &[Shape]) -> Option<[f64; 3]> {
        let (factor, colour) = match self {
            Self::Area(light) => (PI * shapes[light.shape as usize].area(), light.radiance),
            Self::Constant(_) => return None,
            Self::Point(light) => (4.0 * PI, light.intensity),
        };
        Some(colour.to_array().map(|c| f64::from(c) * factor))
    }
}

#[cfg(test)]
mod tests;
