//! Parallel light from one direction, infinitely far away.

use super::LightSample;
use crate::shape::Hit;
use crate::spectrum::Rgb;
use glam::Vec3;

/// A light without size: only sampling it finds it.
#[derive(Clone, Copy, Debug)]
pub struct DirectionalLight {
    /// Unit vector towards the light.
    pub wi: Vec3,
    /// Irradiance of a surface that faces the light, in W·m⁻².
    pub irradiance: Rgb,
}

impl DirectionalLight {
    #[inline]
    pub(super) fn sample(&self) -> LightSample {
        LightSample { wi: self.wi, radiance: self.irradiance, pdf: None, end: None, on: Hit::NONE }
    }
}
