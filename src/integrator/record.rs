//! Telling of paths while they are walked, for those who replay one sample or take errors apart.

use crate::accel::Hit;
use crate::film::SampleId;
use crate::math::ray::Ray;
use crate::spectrum::Rgb;

/// Something that happened to a path.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// A segment was traced: the `vertex`-th, counted from 1.
    Traced {
        /// Number of the vertex at its end.
        vertex: u32,
        /// The segment, in the compiled scene's space.
        ray: Ray,
        /// What it met.
        hit: Hit,
    },
    /// Light was found at the end of the segment.
    Found {
        /// Weighted radiance, throughput included.
        radiance: Rgb,
        /// Multiple-importance weight.
        weight: f32,
    },
    /// A light was sampled, or the sky looked for in a mirror; whether it is visible is told by [`Event::Shadow`].
    Sampled {
        /// Weighted radiance if nothing is in the way, throughput included.
        radiance: Rgb,
        /// Multiple-importance weight.
        weight: f32,
    },
    /// A sampled light was looked for.
    Shadow {
        /// The segment that must be free, in the compiled scene's space.
        ray: Ray,
        /// What it adds if it is: weighted radiance, throughput and absorption on the way included.
        radiance: Rgb,
        /// It lies where a delta lobe scatters to: no other direction would have been sampled.
        delta: bool,
        /// Something is in the way.
        occluded: bool,
    },
    /// The path goes on.
    Scattered {
        /// Throughput after the vertex, before roulette.
        throughput: Rgb,
        /// Probability of surviving roulette; 1 where there was none.
        survival: f32,
        /// By a delta lobe.
        delta: bool,
    },
    /// The path goes no further. A light sampled at its last vertex is looked for after this.
    Ended {
        /// Why.
        reason: &'static str,
    },
    /// What the path found beyond its second vertex is shared with neighbours, and what they found with it: the sum of
    /// what was told is not the sample's radiance.
    Shared,
    /// All is told.
    Finished {
        /// Radiance of the whole sample.
        radiance: Rgb,
    },
}

/// Listens to paths. The unit type listens to nothing, and costs nothing.
pub trait Record {
    /// Whether anybody listens.
    const LISTENS: bool = true;

    /// The events that follow are of the path that `id` tells. Many paths are walked together, a vertex of each in turn.
    #[inline(always)]
    fn at(&mut self, _id: impl FnOnce() -> SampleId) {}

    /// Something happened.
    fn event(&mut self, event: Event);
}

impl Record for () {
    const LISTENS: bool = false;

    #[inline(always)]
    fn event(&mut self, _: Event) {}
}

/// Passes on what is told of one path.
pub(super) struct Only<'a, R> {
    /// Which.
    pub(super) id: SampleId,
    /// Who listens.
    pub(super) to: &'a mut R,
    /// Whether it is spoken of.
    pub(super) spoken_of: bool,
}

impl<R: Record> Record for Only<'_, R> {
    fn at(&mut self, id: impl FnOnce() -> SampleId) {
        self.spoken_of = id() == self.id;
    }

    fn event(&mut self, event: Event) {
        if self.spoken_of {
            self.to.event(event);
        }
    }
}

impl<F: FnMut(Event)> Record for F {
    fn event(&mut self, event: Event) {
        self(event);
    }
}
