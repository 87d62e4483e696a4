//! Bsdf sampling alone: a path counts the light that it happens to run into. Noisy where lights are small.

use super::Technique;
use crate::sampling::pdf::SolidAnglePdf;

pub(super) struct BsdfSampling;

impl Technique for BsdfSampling {
    const SAMPLES_LIGHTS: bool = false;

    #[inline]
    fn found_weight(_bsdf: SolidAnglePdf, _light: SolidAnglePdf) -> f32 {
        1.0
    }

    #[inline]
    fn sampled_weight(_light: SolidAnglePdf, _bsdf: SolidAnglePdf) -> f32 {
        0.0
    }
}
