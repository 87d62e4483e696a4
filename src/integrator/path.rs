//! The estimator for use: light sampling and bsdf sampling at every vertex, combined by the power heuristic (Veach 1997,
//! section 9.2.3), so that small lights and sharp lobes are each found by the technique that is good at them.

use super::Technique;
use crate::sampling::mis::power_heuristic;
use crate::sampling::pdf::SolidAnglePdf;

/// See the module.
pub(super) struct Path;

impl Technique for Path {
    const SAMPLES_LIGHTS: bool = true;
    const COMBINES: bool = true;

    #[inline]
    fn found_weight(bsdf: SolidAnglePdf, light: SolidAnglePdf) -> f32 {
        power_heuristic(bsdf, light)
    }

    #[inline]
    fn sampled_weight(light: SolidAnglePdf, bsdf: SolidAnglePdf) -> f32 {
        power_heuristic(light, bsdf)
    }
}
