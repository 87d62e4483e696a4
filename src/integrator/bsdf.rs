//! Bsdf sampling alone: a path counts the light that it happens to run into. Noisy where lights are small.

use super::Technique;

/// See the module.
pub(super) struct BsdfSampling;

impl Technique for BsdfSampling {
    const SAMPLES_LIGHTS: bool = false;
}
