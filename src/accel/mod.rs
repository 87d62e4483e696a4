//! Which surface does a ray meet first, and is a segment free? Answered by Embree or by our own BVH, in batches.
//!
//! Both say only *which* primitive it is. Where the ray meets it, [`crate::shape`] computes, once and in f64, so that the
//! picture does not depend on who found the hit; and only hits whose distance by that computation lies in the ray's
//! open interval are hits, so that no ray meets the surface it starts on. Quadrics and placed groups are always our own
//! business: Embree gets the triangles.
//!
//! [`oracle`] answers by brute force, for tests and to settle disputes; [`Accelerator::Both`] traces every ray with both
//! and counts where they differ.

#[cfg(feature = "embree")]
mod both;
mod choice;
pub mod comparison;
#[cfg(feature = "embree")]
mod embree;
mod native;
pub mod oracle;

pub use crate::shape::Hit;
pub use choice::{Accelerator, Choice, Quality};
#[cfg(feature = "embree")]
pub use embree::EmbreeMode;

use crate::error::{Error, Result};
use crate::math::ray::Ray;
use crate::shape::Shape;
use comparison::ComparisonCounts;
use native::Native;
use std::collections::HashSet;

/// What is known of where rays start.
#[derive(Clone, Copy, Debug)]
pub enum Start<'a> {
    /// Nothing.
    Anywhere,
    /// At one point or nearly so, each ray going much the way of its neighbours: Embree takes them in packets.
    Camera,
    /// On these primitives, as many as rays; [`Hit::NONE`] for what starts elsewhere. A triangle is none that a ray can
    /// meet that starts on it, and to know that saves the time to find it out.
    Primitives(&'a [Hit]),
}

impl<'a> Start<'a> {
    fn primitives(self) -> &'a [Hit] {
        if let Self::Primitives(hits) = self { hits } else { &[] }
    }

    #[cfg(feature = "embree")]
    fn is_coherent(self) -> bool {
        matches!(self, Self::Camera)
    }
}

/// The surfaces of a scene, ready for rays. Immutable, and shared by all threads.
#[derive(Debug)]
pub struct Accel(Kind);

#[derive(Debug)]
enum Kind {
    Native(Native),
    #[cfg(feature = "embree")]
    Embree(embree::Embree),
    #[cfg(feature = "embree")]
    Both(Box<both::Both>),
}

impl Accel {
    /// Most primitives, over all shapes: their numbers take 31 bits.
    pub const MAX_PRIMITIVES: usize = i32::MAX as usize;

    /// Up to so many triangles our own tree is built with [`Quality::High`], however few the rays: in some milliseconds.
    pub const FEW_TRIANGLES: usize = 8192;

    /// From so many rays a triangle on, our own tree is built with [`Quality::High`] if the user does not say how: over
    /// [`Quality::Medium`] that takes up to 0.3 µs more for each triangle, and a ray up to 0.03 µs less.
    pub const RAYS_FOR_HIGH: f64 = 24.0;

    /// The same for [`Quality::Medium`] over [`Quality::Low`]: 0.02 to 0.11 µs, and up to 0.07 µs. Whole renders of four samples, of two to six rays
    /// a triangle, take 0.97 to 1.02 of their time with it.
    pub const RAYS_FOR_MEDIUM: f64 = 8.0;

    /// About so many bytes are in use for each triangle while an accelerator is built, at most: measured as peaks with a million
    /// triangles of a relief (220 with [`Quality::Low`], else 235) or each for itself (200, 215) and 300,000 long thin ones (210, 240), and rounded up.
    #[must_use]
    pub fn bytes_per_triangle(accelerator: Accelerator, quality: Quality) -> u64 {
        const EMBREE: u64 = 160;
        let native = match quality {
            Quality::Low => 250,
            Quality::Medium | Quality::High => 280,
        };
        match accelerator {
            Accelerator::Embree => EMBREE,
            Accelerator::Native => native,
            Accelerator::Auto | Accelerator::Both => EMBREE + native,
        }
    }

    /// Builds over `shapes`; [`Accelerator::Auto`] as for any number of rays. Embree builds with `threads` threads (0: all there are), our own builder on the current
    /// rayon pool.
    ///
    /// Keeps copies of what it needs. Fails where Embree is asked for and not compiled in, cannot be started, is of
    /// another version than snell was compiled with, or runs out of memory; and with more than 2³¹ primitives.
    pub fn build(which: Accelerator, shapes: &[Shape], threads: usize, quality: Quality) -> Result<Self> {
        check_number(shapes)?;
        Ok(Self(match Choice::new(which, Some(quality), shapes, f64::INFINITY).accelerator {
            Accelerator::Auto | Accelerator::Native => Kind::Native(Native::build(shapes, quality)),
            #[cfg(feature = "embree")]
            Accelerator::Both => Kind::Both(Box::new(both::Both::build(shapes, threads, quality)?)),
            #[cfg(feature = "embree")]
            Accelerator::Embree => Kind::Embree(embree::Embree::build(shapes, threads, quality, EmbreeMode::Robust)?),
            #[cfg(not(feature = "embree"))]
            Accelerator::Embree | Accelerator::Both => {
                let _ = threads;
                return Err(Error::Accelerator(
                    "this snell was built without Embree; use --accel native or auto".into(),
                ));
            }
        }))
    }

    /// Embree by another arithmetic than renders take, to be compared with. Fails as [`Self::build`] does.
    #[cfg(feature = "embree")]
    pub fn build_embree(shapes: &[Shape], threads: usize, quality: Quality, mode: EmbreeMode) -> Result<Self> {
        check_number(shapes)?;
        Ok(Self(Kind::Embree(embree::Embree::build(shapes, threads, quality, mode)?)))
    }

    /// Our own accelerator as processors have it that can do no more than all of their kind, one ray at a time, and built with the
    /// least care. It must give the same answers. Fails as [`Self::build`] does.
    pub fn build_baseline(shapes: &[Shape]) -> Result<Self> {
        check_number(shapes)?;
        Ok(Self(Kind::Native(Native::build(shapes, Quality::Low).at_baseline())))
    }

    /// The first surface that each ray meets in its open interval, or [`Hit::NONE`]. Of surfaces at the same distance
    /// (as f32), our own accelerator returns the one of lowest shape, then lowest primitive. `hits` is as long as
    /// `rays`; some tens to hundreds are a good number, and they need not be coherent. A ray whose direction is
    /// zero, as a segment may round to, meets nothing. No `tmin` may be negative.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Hit]) {
        self.closest_hits_from(rays, Start::Anywhere, hits);
    }

    /// [`Self::closest_hits`] of rays of which is known where they start, which saves time.
    pub fn closest_hits_from(&self, rays: &[Ray], start: Start<'_>, hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "one hit a ray");
        assert!(start.primitives().is_empty() || start.primitives().len() == rays.len(), "one start a ray");
        match &self.0 {
            Kind::Native(native) => native.closest_hits(rays, start, hits),
            #[cfg(feature = "embree")]
            Kind::Embree(embree) => embree.closest_hits(rays, start, hits),
            #[cfg(feature = "embree")]
            Kind::Both(both) => both.closest_hits(rays, start, hits),
        }
    }

    /// Whether each ray meets any surface in its open interval; see [`Self::closest_hits`].
    pub fn occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        self.occluded_between(rays, &[], occluded);
    }

    /// [`Self::occluded`] of rays of which is known on which primitives they start and end, as in
    /// [`Start::Primitives`]; `ends` may be empty.
    pub fn occluded_between(&self, rays: &[Ray], ends: &[[Hit; 2]], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one answer a ray");
        assert!(ends.is_empty() || ends.len() == rays.len(), "two ends a ray");
        occluded.fill(false);
        match &self.0 {
            Kind::Native(native) => native.occluded(rays, ends, occluded),
            #[cfg(feature = "embree")]
            Kind::Embree(embree) => embree.occluded(rays, ends, occluded),
            #[cfg(feature = "embree")]
            Kind::Both(both) => both.occluded(rays, ends, occluded),
        }
    }

    /// Name and version, for example `embree 3.13.5 (robust)`, `native` or, where the triangles are few, `native (list)`.
    pub fn name(&self) -> String {
        match &self.0 {
            Kind::Native(native) if native.is_flat() => "native (list)".into(),
            Kind::Native(_) => "native".into(),
            #[cfg(feature = "embree")]
            Kind::Embree(embree) => embree.name(),
            #[cfg(feature = "embree")]
            Kind::Both(both) => both.name(),
        }
    }

    /// Bytes held now, the copies of the geometry included.
    pub fn memory_bytes(&self) -> u64 {
        match &self.0 {
            Kind::Native(native) => native.memory_bytes(),
            #[cfg(feature = "embree")]
            Kind::Embree(embree) => embree.memory_bytes(),
            #[cfg(feature = "embree")]
            Kind::Both(both) => both.memory_bytes(),
        }
    }

    /// How often Embree took a ray to meet a triangle that it does not meet in its interval (mostly the one it starts
    /// on), and was asked again; `None` where Embree is not in use.
    pub fn embree_false_hits(&self) -> Option<u64> {
        match &self.0 {
            Kind::Native(_) => None,
            #[cfg(feature = "embree")]
            Kind::Embree(embree) => Some(embree.false_hits()),
            #[cfg(feature = "embree")]
            Kind::Both(both) => Some(both.embree_false_hits()),
        }
    }

    /// What [`Accelerator::Both`] has found so far; `None` for the others.
    pub fn comparison(&self) -> Option<ComparisonCounts> {
        match &self.0 {
            #[cfg(feature = "embree")]
            Kind::Both(both) => Some(both.counts()),
            #[cfg(feature = "embree")]
            Kind::Embree(_) => None,
            Kind::Native(_) => None,
        }
    }
}

/// Fails with more primitives than have numbers.
fn check_number(shapes: &[Shape]) -> Result<()> {
    let primitives = stored_primitives(shapes);
    if primitives > Accel::MAX_PRIMITIVES {
        return Err(Error::Accelerator(format!("{primitives} primitives are more than the accelerators can number")));
    }
    Ok(())
}

/// How many primitives hierarchies are built over: those of a group once, and each of its placements counts as one.
fn stored_primitives(shapes: &[Shape]) -> usize {
    let mut groups = HashSet::new();
    let of_shape = |shape: &Shape| match shape {
        Shape::Placed(placed) if groups.insert(std::sync::Arc::as_ptr(&placed.group)) => {
            placed.group.shapes.iter().map(Shape::primitive_count).sum()
        }
        Shape::Placed(_) => 1,
        other => other.primitive_count(),
    };
    shapes.iter().map(of_shape).sum()
}
