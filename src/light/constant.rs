//! The same radiance from every direction, from infinitely far away.

use super::LightSample;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::shape::Hit;
use crate::spectrum::Rgb;
use glam::Vec2;

/// A sky of one colour.
#[derive(Clone, Copy, Debug)]
pub struct ConstantLight {
    /// Radiance in W·sr⁻¹·m⁻².
    pub radiance: Rgb,
}

impl ConstantLight {
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> LightSample {
        LightSample {
            wi: warp::square_to_uniform_sphere(u),
            radiance: self.radiance,
            pdf: Some(self.pdf()),
            end: None,
            on: Hit::NONE,
        }
    }

    /// Density with which any direction is sampled.
    #[inline]
    pub fn pdf(&self) -> SolidAnglePdf {
        warp::square_to_uniform_sphere_pdf()
    }
}
