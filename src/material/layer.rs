//! Weighted sums of bsdfs, each in a frame of its own.

use crate::bsdf::{Bsdf, BsdfSample};
use crate::math::float::{min, sqr};
use crate::math::frame::Frame;
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;

/// A bsdf that is a part of what a surface does at a point.
#[derive(Clone, Debug)]
pub struct Layer {
    /// How much it counts, positive; all of a surface add up to 1.
    pub weight: f32,
    /// How likely it is that it is sampled; all of a surface add up to 1.
    pub chance: f32,
    /// The bsdf, with the parameters of the point.
    pub bsdf: Bsdf,
    /// Its own frame, if that is not the surface's shading frame.
    pub perturbation: Option<Perturbation>,
}

/// The frame of a layer.
#[derive(Clone, Copy, Debug)]
pub struct Perturbation {
    /// Its axes in the shading frame: to local is shading to the layer's own.
    pub frame: Frame,
    /// The normal that it was perturbed from, in the shading frame: the shading normal, or its negative where a two-sided
    /// surface is seen from behind.
    pub base: f32,
    /// Whether there is a normal of its own, not only a mirrored one: then no direction scatters to another side than
    /// that which the base normal says.
    pub is_own: bool,
    /// The normal before it was turned to the viewer, in the shading frame; zero where it may be another for another viewer for other
    /// reasons, too.
    pub given: Vec3,
    /// α² of the function by which light fades out towards the terminator of the base normal; 0 where it does not.
    pub fade: f32,
}

impl Perturbation {
    /// How much of the light to or from `wi` (in the shading frame; `own` in the layer's) is scattered at all.
    ///
    /// Estevez, Lecocq and Stein 2019, *A Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem*: Smith's
    /// masking of GGX, for the light alone.
    fn passes(&self, wi: Vec3, own: Vec3) -> f32 {
        if self.is_own && !(self.base * wi.z * own.z > 0.0) {
            return 0.0;
        }
        if self.fade == 0.0 {
            return 1.0;
        }
        2.0 / (1.0 + (1.0 + self.fade * (sqr(wi.x) + sqr(wi.y)) / sqr(wi.z)).sqrt())
    }
}

impl Perturbation {
    /// Whether it is the same seen from the directions `a` and `b` on the same side of the surface, and both see the same side of it.
    fn is_alike(&self, a: Vec3, b: Vec3) -> bool {
        [self.frame.n, self.given].into_iter().all(|n| n.dot(a) * n.dot(b) > 0.0)
    }
}

impl Layer {
    /// See [`super::Scatter::scatters_everywhere`].
    pub(super) fn scatters_everywhere(&self) -> bool {
        self.bsdf.scatters_everywhere() && self.perturbation.is_none_or(|p| p.given != Vec3::ZERO)
    }

    /// See [`super::Scatter::is_alike`].
    pub(super) fn is_alike(&self, a: Vec3, b: Vec3) -> bool {
        self.perturbation.is_none_or(|p| p.is_alike(a, b))
    }

    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        let Some(perturbation) = &self.perturbation else { return self.bsdf.eval_pdf(wo, wi) };
        let frame = &perturbation.frame;
        let own = frame.to_local(wi);
        match perturbation.passes(wi, own) {
            0.0 => (Rgb::BLACK, SolidAnglePdf(0.0)),
            part => {
                let (value, pdf) = self.bsdf.eval_pdf(frame.to_local(wo), own);
                (value * part, pdf)
            }
        }
    }

    fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let Some(perturbation) = &self.perturbation else { return self.bsdf.sample(wo, u) };
        let frame = &perturbation.frame;
        let sample = self.bsdf.sample(frame.to_local(wo), u)?;
        let wi = frame.to_world(sample.wi);
        match perturbation.passes(wi, sample.wi) {
            0.0 => None,
            part => Some(BsdfSample { wi, weight: sample.weight * part, ..sample }),
        }
    }
}

/// The sum's value, and the density with which [`sample`] finds `wi`.
#[inline(never)]
pub(super) fn eval_pdf(layers: &[Layer], &wo: &Vec3, &wi: &Vec3) -> (Rgb, SolidAnglePdf) {
    let (mut sum, mut density) = (Rgb::BLACK, 0.0);
    for layer in layers {
        let (value, SolidAnglePdf(pdf)) = layer.eval_pdf(wo, wi);
        sum += value * layer.weight;
        density += pdf * layer.chance;
    }
    (sum, SolidAnglePdf(density))
}

/// Makes the layers' chances proportional to what they send to `wo`, as far as that can be guessed. Those that light may pass
/// straight through keep their weight: alpha counts how often it does.
pub(super) fn set_chances(layers: &mut [Layer], wo: Vec3) {
    let straight = |layer: &Layer| {
        let lobes = layer.bsdf.lobes();
        lobes.delta && lobes.transmits
    };
    let (mut weights, mut sum) = (0.0, 0.0);
    for layer in layers.iter_mut().filter(|layer| !straight(layer)) {
        let own = layer.perturbation.as_ref().map_or(wo, |p| p.frame.to_local(wo));
        layer.chance = layer.weight * layer.bsdf.about_albedo(own);
        weights += layer.weight;
        sum += layer.chance;
    }
    for layer in layers.iter_mut().filter(|layer| !straight(layer)) {
        // Where nothing is sent the weights are as good.
        layer.chance = if sum > 0.0 { layer.chance * (weights / sum) } else { layer.weight };
    }
}

/// A direction from a layer chosen by its chance.
#[inline(never)]
pub(super) fn sample(layers: &[Layer], &wo: &Vec3, &u: &BsdfUniforms) -> Option<BsdfSample> {
    if let [only] = layers {
        return only.sample(wo, u);
    }
    let (layer, u) = choose(layers, u)?;
    let sample = layer.sample(wo, u)?;
    if sample.pdf.is_none() {
        // A delta lobe, which no other layer finds.
        return Some(BsdfSample { weight: sample.weight * (layer.weight / layer.chance), ..sample });
    }
    let (value, pdf) = eval_pdf(layers, &wo, &sample.wi);
    (pdf.0 > 0.0).then(|| BsdfSample { weight: value / pdf.0, pdf: Some(pdf), ..sample })
}

/// The layer that the number for the lobe falls on, and the numbers with what is left of it.
fn choose(layers: &[Layer], u: BsdfUniforms) -> Option<(&Layer, BsdfUniforms)> {
    /// The largest number below 1.
    const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
    let mut rest = u.lobe();
    let last = layers.iter().rfind(|layer| layer.chance > 0.0)?;
    for layer in layers {
        // The chances may add up to a little less than 1.
        if rest < layer.chance || std::ptr::eq(layer, last) {
            return Some((layer, u.with_lobe(min(rest / layer.chance, BELOW_ONE))));
        }
        rest -= layer.chance;
    }
    None
}
