//! The estimator that assumes nothing: every direction as likely as any other. Delta lobes, which such directions never
//! meet, are sampled as themselves. The noisiest, and the hardest to get wrong.

use super::Technique;
use super::variant::Any;
use crate::bsdf::BsdfSample;
use crate::material::Scatter;
use crate::sampler::BsdfUniforms;
use crate::sampling::warp;
use glam::Vec3;

/// See the module.
pub(super) struct Naive;

impl Technique for Naive {
    type Variant = Any;

    const SAMPLES_LIGHTS: bool = false;

    #[inline]
    fn sample_bsdf(bsdf: &Scatter<'_>, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let lobes = bsdf.lobes();
        if lobes.delta {
            return bsdf.sample(wo, u);
        }
        let (wi, pdf) = if lobes.transmits {
            (warp::square_to_uniform_sphere(u.direction()), warp::square_to_uniform_sphere_pdf())
        } else {
            let wi = warp::square_to_uniform_hemisphere(u.direction());
            (wi, warp::square_to_uniform_hemisphere_pdf(wi))
        };
        let weight = bsdf.eval_pdf(wo, wi).0 / pdf.0;
        (!weight.is_black()).then_some(BsdfSample { wi, weight, pdf: Some(pdf), eta: 1.0 })
    }
}
