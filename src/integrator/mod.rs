//! Estimators of the radiance that arrives at a point of the film.
//!
//! # What is estimated
//!
//! The rendering equation (Kajiya 1986) for radiance L leaving a point in direction ωo,
//!
//! L(ωo) = Le(ωo) + ∫ f(ωo, ωi) · L(ωi) · |cos θi| dωi,
//!
//! where L(ωi) arrives from the next surface in direction ωi. Unrolled it is a sum over paths from the camera to a
//! light; `throughput` (β in the literature) is the product of f·|cos|/pdf along a path so far. All estimators here walk
//! the same paths, vertex by vertex ([`wave`]); they differ in how a vertex gets its light ([`Technique`]), and converge
//! to the same picture.
//!
//! An integrator knows no threads and no files, and cannot fail.

mod bsdf;
mod naive;
mod nee;
mod path;
mod path_state;
pub mod record;
mod technique;
mod wave;

pub use technique::Technique;
pub use wave::RayCounts;

use crate::film::{SampleId, Tile};
use crate::sampler::Sampler;
use crate::scene::Scene;
use record::Record;
use std::ops::Range;

/// The estimators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// Light and bsdf sampling, combined by multiple importance sampling: [`path`].
    Path,
    /// Light sampling alone: [`nee`].
    Nee,
    /// Bsdf sampling alone: [`bsdf`].
    Bsdf,
    /// Uniform directions: [`naive`].
    Naive,
}

impl Estimator {
    /// Whether it samples lights: those that do not never find a light without size.
    pub fn samples_lights(self) -> bool {
        match self {
            Self::Path => path::Path::SAMPLES_LIGHTS,
            Self::Nee => nee::Nee::SAMPLES_LIGHTS,
            Self::Bsdf => bsdf::BsdfSampling::SAMPLES_LIGHTS,
            Self::Naive => naive::Naive::SAMPLES_LIGHTS,
        }
    }
}

/// An estimator with its limits.
#[derive(Clone, Copy, Debug)]
pub struct Integrator {
    /// Which estimator.
    pub estimator: Estimator,
    /// The largest number of segments of a path, the camera ray included; 0 gives black.
    pub max_depth: u32,
    /// Russian roulette decides from the vertex of this number on; the first hit is number 1.
    pub rr_depth: u32,
    /// Emitters are invisible to camera rays, which pass through those that are surfaces.
    pub hide_emitters: bool,
}

impl Integrator {
    /// Takes the samples `samples` of every pixel of `tile`, and counts the rays they took.
    pub fn sample_tile(&self, scene: &Scene, sampler: &Sampler, samples: Range<u32>, tile: &mut Tile) -> RayCounts {
        let bounds = tile.bounds();
        // Sample by sample of each pixel: neighbours in a wave see much the same.
        let ids = (bounds.y..bounds.y + bounds.height.cast_signed()).flat_map(|y| {
            let samples = samples.clone();
            (bounds.x..bounds.x + bounds.width.cast_signed())
                .flat_map(move |x| samples.clone().map(move |index| SampleId { x, y, index }))
        });
        let mut counts = RayCounts::default();
        self.walk(scene, sampler, ids, &mut (), &mut counts, &mut |id, radiance| {
            tile.add_sample(id, radiance, || {
                sampler.stream(id.x.cast_unsigned(), id.y.cast_unsigned(), id.index).film()
            });
        });
        counts
    }

    /// Walks one path and tells `record` of every step.
    pub fn replay(&self, scene: &Scene, sampler: &Sampler, id: SampleId, record: &mut impl Record) {
        let mut counts = RayCounts::default();
        self.walk(scene, sampler, [id].into_iter(), record, &mut counts, &mut |_, _| {});
    }

    fn walk(
        &self,
        scene: &Scene,
        sampler: &Sampler,
        ids: impl Iterator<Item = SampleId>,
        record: &mut impl Record,
        counts: &mut RayCounts,
        sink: &mut impl FnMut(SampleId, crate::spectrum::Rgb),
    ) {
        let walker = wave::Walker { scene, sampler, limits: self, level: fearless_simd::Level::new() };
        match self.estimator {
            Estimator::Path => walker.run::<path::Path>(ids, record, counts, sink),
            Estimator::Nee => walker.run::<nee::Nee>(ids, record, counts, sink),
            Estimator::Bsdf => walker.run::<bsdf::BsdfSampling>(ids, record, counts, sink),
            Estimator::Naive => walker.run::<naive::Naive>(ids, record, counts, sink),
        }
    }
}
