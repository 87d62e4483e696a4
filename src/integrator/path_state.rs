//! A path on its way: all that its next vertex needs to know.

use crate::accel::Hit;
use crate::film::SampleId;
use crate::light::Lobe;
use crate::math::ray::Ray;
use crate::sampler::Stream;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::{DVec3, Vec3};

/// How the current segment was sampled, as far as light at its end is concerned.
#[derive(Clone, Copy, Debug)]
pub(super) enum Segment {
    /// From the camera, or by a delta lobe: no light could have been sampled instead.
    Delta,
    /// The same in a mirror in which the sky has been looked for ([`super::glint`]): its map does not count again.
    Mirror,
    /// By a bsdf with a density, from a vertex that sampled lights too (if the technique does).
    Smooth {
        /// Density of the direction.
        pdf: SolidAnglePdf,
        /// The vertex.
        from: DVec3,
        /// The normal and the lobe by which lights were chosen there: see [`crate::light::Receiver`].
        n: Vec3,
        /// See [`Self::Smooth::n`].
        lobe: Lobe,
        /// Whether lights were sought through glass there ([`super::through`]).
        seeks: bool,
    },
    /// The same where glass was passed since.
    Through {
        /// See [`Self::Smooth`].
        pdf: SolidAnglePdf,
        /// See [`Self::Smooth`].
        from: DVec3,
        /// See [`Self::Smooth`].
        n: Vec3,
        /// See [`Self::Smooth`].
        lobe: Lobe,
        /// The direction at that vertex.
        d: Vec3,
        /// Whether that was the first.
        first: bool,
    },
}

/// No index: the path is outside of everything that absorbs.
pub(super) const NOTHING_INSIDE: u32 = u32::MAX;

/// One path.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathState {
    /// The current segment.
    pub(super) ray: Ray,
    /// What it starts on; [`Hit::NONE`] where that is no surface.
    pub(super) from: Hit,
    /// How it was sampled.
    pub(super) segment: Segment,
    /// Product of f·|cos|/pdf over the vertices so far.
    pub(super) throughput: Rgb,
    /// What the throughput was divided by when others began to share in what the path finds; white before.
    pub(super) carried: Rgb,
    /// Light found so far, weighted; once it is shared, what was found since, per unit of [`Self::carried`].
    pub(super) radiance: Rgb,
    /// Product of η² over the refractions so far: what radiance, and so the throughput, was divided by.
    pub(super) eta_squared: f32,
    /// What absorbs along the current segment: an index into [`crate::scene::Scene::absorption`], or [`NOTHING_INSIDE`].
    pub(super) inside: u32,
    /// Vertices so far; the first hit makes it 1.
    pub(super) depth: u32,
    /// Which sample.
    pub(super) id: SampleId,
    /// Its uniform numbers.
    pub(super) stream: Stream,
    /// Whether it met a surface: what alpha counts.
    pub(super) met: bool,
    /// Whether it was scattered by something that is no mirror. Kept only where paths are regularized.
    pub(super) scattered: bool,
    /// Whether lights are sought through glass at the current vertex ([`super::through`]).
    pub(super) seeks: bool,
    /// Whether it goes on.
    pub(super) alive: bool,
}
