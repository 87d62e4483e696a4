//! The estimator for use: light sampling and bsdf sampling at every vertex, combined by the power heuristic (Veach 1997,
//! section 9.2.3), so that small lights and sharp lobes are each found by the technique that is good at them.

use super::Technique;
use super::variant::{Any, Variant};
use crate::sampling::mis::power_heuristic;
use crate::sampling::pdf::SolidAnglePdf;
use std::marker::PhantomData;

/// See the module. It is the one for use, and so the one that is compiled for what scenes have.
pub(super) struct Path<V = Any>(PhantomData<V>);

impl<V: Variant> Technique for Path<V> {
    type Variant = V;

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
