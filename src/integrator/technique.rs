//! What tells estimators apart: how a path vertex samples directions, and how much each way of finding a light counts.

use super::variant::Variant;
use crate::bsdf::BsdfSample;
use crate::material::Scatter;
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use glam::Vec3;

/// A way to estimate the light at path vertices. Delta lobes leave only one way, which every technique takes.
pub trait Technique {
    /// What the scene may have.
    type Variant: Variant;

    /// Whether vertices sample lights.
    const SAMPLES_LIGHTS: bool;

    /// Whether light that sampling lights leaves out is found by the bsdf.
    const COMBINES: bool = false;

    /// How the path goes on; `None` where it ends.
    #[inline(always)]
    fn sample_bsdf(bsdf: &Scatter<'_>, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        bsdf.sample(wo, u)
    }

    /// Weight of light that a path ran into by a direction of density `bsdf`, which light sampling finds with density
    /// `light`. All of it counts where lights are not sampled.
    #[inline]
    fn found_weight(_bsdf: SolidAnglePdf, _light: SolidAnglePdf) -> f32 {
        1.0
    }

    /// Weight of light that was sampled with density `light`, in a direction that the bsdf finds with density `bsdf`.
    /// Nothing of it counts where lights are not sampled.
    #[inline]
    fn sampled_weight(_light: SolidAnglePdf, _bsdf: SolidAnglePdf) -> f32 {
        0.0
    }
}
