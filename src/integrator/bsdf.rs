//! Bsdf sampling alone: a path counts the light that it happens to run into. Noisy where lights are small.

use super::Technique;
use super::variant::Any;

/// See the module.
pub(super) struct BsdfSampling;

impl Technique for BsdfSampling {
    type Variant = Any;

    const SAMPLES_LIGHTS: bool = false;
}
