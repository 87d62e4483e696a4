//! Light sampling alone (next-event estimation): light that a path runs into counts only where no light could have been
//! sampled, straight from the camera and after a delta lobe. Noisy where a light is close or a lobe is sharp.

use super::Technique;
use super::variant::Any;
use crate::sampling::pdf::SolidAnglePdf;

/// See the module.
pub(super) struct Nee;

impl Technique for Nee {
    type Variant = Any;

    const SAMPLES_LIGHTS: bool = true;

    #[inline]
    fn found_weight(_bsdf: SolidAnglePdf, _light: SolidAnglePdf) -> f32 {
        0.0
    }

    #[inline]
    fn sampled_weight(_light: SolidAnglePdf, _bsdf: SolidAnglePdf) -> f32 {
        1.0
    }
}
