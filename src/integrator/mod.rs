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
mod direct;
mod found;
mod glint;
mod naive;
mod nee;
mod path;
mod path_state;
pub mod record;
mod reuse;
mod technique;
mod through;
mod together;
mod trial;
pub mod variant;
mod wave;
mod work;

pub use direct::MOST_CANDIDATES;
pub use reuse::PathReuse;
pub use technique::Technique;
pub use trial::Undecided;
pub use wave::RayCounts;
pub use work::Work;

use crate::facts::{self, Feature};
use crate::film::{SampleId, tile_around};
use crate::image::Area;
use crate::sampler::Sampler;
use crate::scene::Scene;
use aov::{AovSink, Aovs, Sink};
use path_state::PathState;
use record::Record;
use std::ops::Range;
use variant::Of;
use work::Tiles;

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
            Self::Path => <path::Path>::SAMPLES_LIGHTS,
            Self::Nee => nee::Nee::SAMPLES_LIGHTS,
            Self::Bsdf => bsdf::BsdfSampling::SAMPLES_LIGHTS,
            Self::Naive => naive::Naive::SAMPLES_LIGHTS,
        }
    }
}

/// Edge of the blocks of pixels that may share what their paths find, aligned in the whole film.
pub const BLOCK_SIZE: u32 = reuse::BLOCK.cast_unsigned();

/// An estimator with its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// How many light samples the first vertex takes, a power of two up to [`MOST_CANDIDATES`]: see [`direct`]. Only
    /// [`Estimator::Path`] takes more than one.
    pub light_samples: u32,
    /// Neighbouring pixels share what their paths find, where that is possible: see [`reuse`].
    pub reuse: PathReuse,
}

impl Integrator {
    /// Takes some samples of every pixel of some tiles, with what goes beside radiance if anything does, and counts the rays they took.
    /// Not inlined, so that `scripts/absence` finds it.
    #[inline(never)]
    pub fn sample_tiles(&self, scene: &Scene, sampler: &Sampler, aovs: &Aovs, work: &mut [Work<'_>]) -> RayCounts {
        facts::allow(Feature::Aovs, !aovs.is_empty());
        let areas: Vec<_> = work.iter().map(|work| (work.tile.bounds(), work.samples.clone())).collect();
        let ids = areas.into_iter().flat_map(|(bounds, samples)| self.sample_ids(scene, bounds, samples));
        let (mut counts, mut tiles) = (RayCounts::default(), Tiles::new(work));
        if aovs.is_empty() {
            self.walk(scene, sampler, ids, &mut (), &mut counts, &mut |path: &PathState| {
                tiles.of_finished(path).add_sample(path.id, path.radiance, || path.stream.film());
            });
        } else if Feature::Aovs.is_built() {
            let mut sink = AovSink::new(scene, aovs, tiles, self.max_depth > 0 && !self.hides_sky());
            self.walk(scene, sampler, ids, &mut (), &mut counts, &mut sink);
        }
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
        self.walk(scene, sampler, ids, record, &mut RayCounts::default(), &mut |_: &PathState| {});
    }

    /// Whether paths share what they find: only where there is something to share, and nothing on the way absorbs.
    pub fn shares(&self, scene: &Scene) -> bool {
        self.reuse != PathReuse::Off
            && self.estimator == Estimator::Path
            && self.max_depth > 2
            && self.rr_depth > 1
            && !scene.absorbs()
    }

    /// Samples in the order in which they are taken.
    fn sample_ids(&self, scene: &Scene, pixels: Area, samples: Range<u32>) -> Box<dyn Iterator<Item = SampleId>> {
        match self.shares(scene) {
            true => Box::new(reuse::grouped_ids(pixels, samples)),
            false => Box::new(sample_ids(pixels, samples)),
        }
    }

    /// Whether camera rays do not see light from infinitely far away.
    fn hides_sky(&self) -> bool {
        self.hide_emitters || self.hide_environment
    }

    /// Walks one path, and those that share with it, and tells `record` of every step of the one. The picture is cut as in a render of
    /// the scene's crop: into tiles, or with `blocks` into blocks, as where samples go where the error is.
    pub fn replay(&self, scene: &Scene, sampler: &Sampler, id: SampleId, blocks: bool, record: &mut impl Record) {
        let mut counts = RayCounts::default();
        let mut only = record::Only { id, to: record, spoken_of: false };
        let group = match self.shares(scene) {
            true => {
                let film = &scene.film;
                let sampled = film.filter.sampled_area(film.crop, film.sample_border);
                // Then a group is cut by nothing but the edge of the picture.
                let tile = if blocks { sampled } else { tile_around(sampled, id.x, id.y) };
                reuse::grouped_ids(tile, id.index..id.index + 1)
                    .filter(|&other| reuse::Group::of(other, self.reuse) == reuse::Group::of(id, self.reuse))
                    .collect()
            }
            false => vec![id],
        };
        self.walk(scene, sampler, group.into_iter(), &mut only, &mut counts, &mut |_: &PathState| {});
    }

    fn walk<R: Record>(
        &self,
        scene: &Scene,
        sampler: &Sampler,
        ids: impl Iterator<Item = SampleId>,
        record: &mut R,
        counts: &mut RayCounts,
        sink: &mut impl Sink,
    ) {
        let count = if self.estimator == Estimator::Path { self.light_samples } else { 1 };
        facts::allow(Feature::Sharing, self.shares(scene));
        facts::allow(Feature::Candidates, count > 1);
        let candidates = direct::Candidates::new(count, sampler.kind);
        let walker = wave::Walker { scene, sampler, limits: self, candidates, level: crate::math::simd::level() };
        match self.estimator {
            // Who listens has time.
            Estimator::Path if R::LISTENS => walker.run::<path::Path, _>(ids, record, counts, sink),
            Estimator::Path => match variant::needs(scene) {
                (false, false) => walker.run::<path::Path<Of<false, false>>, _>(ids, record, counts, sink),
                (false, true) => walker.run::<path::Path<Of<false, true>>, _>(ids, record, counts, sink),
                (true, false) => walker.run::<path::Path<Of<true, false>>, _>(ids, record, counts, sink),
                (true, true) => walker.run::<path::Path, _>(ids, record, counts, sink),
            },
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
