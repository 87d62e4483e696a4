//! A surface that is not there: it bounds a shape and leaves light alone.

use super::parameter::Parameter;
use super::{BsdfSample, Lobes, NOTHING};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;

/// Lets everything pass straight on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Null;

impl Null {
    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: false, delta: true, transmits: true, anisotropic: false }
    }

    /// It has no parameter to override.
    pub(super) fn set(&mut self, _parameter: Parameter, _value: Rgb) -> bool {
        false
    }

    pub(super) fn eval_pdf(&self, _wo: Vec3, _wi: Vec3) -> (Rgb, SolidAnglePdf) {
        NOTHING
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, _u: BsdfUniforms) -> Option<BsdfSample> {
        Some(BsdfSample { wi: -wo, weight: Rgb::WHITE, pdf: None, eta: 1.0 })
    }
}
