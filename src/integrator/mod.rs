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

mod absorption;
pub mod aov;
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
use crate::image::Area;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::spectrum::Rgb;
use aov::{AovSink, Aovs, Sink};
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
    /// Light from infinitely far away is invisible to camera rays, but lights everything.
    pub hide_environment: bool,
}

impl Integrator {
    /// Takes the samples `samples` of every pixel of `tile`, and counts the rays they took.
    pub fn sample_tile(&self, scene: &Scene, sampler: &Sampler, samples: Range<u32>, tile: &mut Tile) -> RayCounts {
        let bounds = tile.bounds();
        let ids = sample_ids(bounds, samples);
        let mut counts = RayCounts::default();
        self.walk(scene, sampler, ids, &mut (), &mut counts, &mut |id: SampleId, radiance: Rgb| {
            tile.add_sample(id, radiance, || {
                sampler.stream(id.x.cast_unsigned(), id.y.cast_unsigned(), id.index).film()
            });
        });
        counts
    }

    /// [`Self::sample_tile`], with everything that goes beside radiance.
    pub fn sample_tile_with(
        &self,
        scene: &Scene,
        sampler: &Sampler,
        aovs: &Aovs,
        samples: Range<u32>,
        tile: &mut Tile,
    ) -> RayCounts {
        let ids = sample_ids(tile.bounds(), samples);
        let mut counts = RayCounts::default();
        let mut sink = AovSink::new(scene, aovs, tile, self.max_depth > 0 && !self.hides_sky());
        self.walk(scene, sampler, ids, &mut (), &mut counts, &mut sink);
        counts
    }

    /// Walks the paths of the samples `samples` of every pixel of `pixels`, tells `record` of every step, and keeps nothing.
    pub fn record(
        &self,
        scene: &Scene,
        sampler: &Sampler,
        pixels: Area,
        samples: Range<u32>,
        record: &mut impl Record,
    ) {
        let ids = sample_ids(pixels, samples);
        self.walk(scene, sampler, ids, record, &mut RayCounts::default(), &mut |_: SampleId, _: Rgb| {});
    }

    /// Whether camera rays do not see light from infinitely far away.
    fn hides_sky(&self) -> bool {
        self.hide_emitters || self.hide_environment
    }

    /// Walks one path and tells `record` of every step.
    pub fn replay(&self, scene: &Scene, sampler: &Sampler, id: SampleId, record: &mut impl Record) {
        let mut counts = RayCounts::default();
        self.walk(scene, sampler, [id].into_iter(), record, &mut counts, &mut |_: SampleId, _: Rgb| {});
    }

    fn walk(
        &self,
        scene: &Scene,
        sampler: &Sampler,
        ids: impl Iterator<Item = SampleId>,
        record: &mut impl Record,
        counts: &mut RayCounts,
        sink: &mut impl Sink,
    ) {
        let walker = wave::Walker { scene, sampler, limits: self, level: fearless_simd::Level::new() };
        match self.estimator {
            Estimator::Path => walker.run::<path::Path, _>(ids, record, counts, sink),
            Estimator::Nee => walker.run::<nee::Nee, _>(ids, record, counts, sink),
            Estimator::Bsdf => walker.run::<bsdf::BsdfSampling, _>(ids, record, counts, sink),
            Estimator::Naive => walker.run::<naive::Naive, _>(ids, record, counts, sink),
        }
    }
}

/// The samples `samples` of every pixel, sample by sample of each: neighbours in a wave see much the same.
fn sample_ids(pixels: Area, samples: Range<u32>) -> impl Iterator<Item = SampleId> {
    (pixels.y..pixels.y + pixels.height.cast_signed()).flat_map(move |y| {
        let samples = samples.clone();
        (pixels.x..pixels.x + pixels.width.cast_signed())
            .flat_map(move |x| samples.clone().map(move |index| SampleId { x, y, index }))
    })
}
