//! Which surface does a ray meet first, and is a segment free? Answered by Embree or by our own BVH, in batches.
//!
//! Both say only *which* primitive it is. Where the ray meets it, [`crate::shape`] computes, once and in f64, so that the
//! picture does not depend on who found the hit; and only hits whose distance by that computation lies in the ray's
//! open interval are hits, so that no ray meets the surface it starts on. Spheres are always our own business: Embree
//! gets the triangles.
//!
//! [`oracle`] answers by brute force, for tests and to settle disputes; [`Accelerator::Both`] traces every ray with both
//! and counts where they differ.

#[cfg(feature = "embree")]
mod both;
pub mod comparison;
#[cfg(feature = "embree")]
mod embree;
mod native;
pub mod oracle;

use crate::error::{Error, Result};
use crate::math::ray::Ray;
use crate::shape::Shape;
use comparison::ComparisonCounts;
use native::Native;

/// Which primitive a ray met.
///
/// Only the identity: the distance and the point are computed from it, once, by [`crate::shape`], so that they do not
/// depend on who found the hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
pub struct Hit {
    /// Index of the shape, or [`Hit::NONE`]'s.
    pub shape: u32,
    /// Index of the primitive in the shape: the face of a mesh, 0 of a sphere.
    pub primitive: u32,
}

impl Hit {
    /// No hit.
    pub const NONE: Self = Self { shape: u32::MAX, primitive: u32::MAX };

    /// Whether there is one.
    #[inline]
    pub fn is_some(self) -> bool {
        self.shape != u32::MAX
    }
}

/// What the user asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Accelerator {
    /// Embree where it is compiled in, else our own.
    #[default]
    Auto,
    /// Embree.
    Embree,
    /// Our own.
    Native,
    /// Both, compared ray by ray; our own answers.
    Both,
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
    /// Builds over `shapes`. Embree builds with `threads` threads (0: all there are), our own builder on the current
    /// rayon pool.
    ///
    /// Keeps copies of what it needs. Fails where Embree is asked for and not compiled in, cannot be started, is of
    /// another version than snell was compiled with, or runs out of memory; and with more than 2³¹ primitives.
    pub fn build(which: Accelerator, shapes: &[Shape], threads: usize) -> Result<Self> {
        let primitives: usize = shapes.iter().map(Shape::primitive_count).sum();
        if primitives > i32::MAX as usize {
            return Err(Error::Accelerator(format!(
                "{primitives} primitives are more than the accelerators can number"
            )));
        }
        Ok(Self(match which {
            Accelerator::Native => Kind::Native(Native::build(shapes)),
            #[cfg(feature = "embree")]
            Accelerator::Both => Kind::Both(Box::new(both::Both::build(shapes, threads)?)),
            #[cfg(feature = "embree")]
            Accelerator::Auto | Accelerator::Embree => Kind::Embree(embree::Embree::build(shapes, threads)?),
            #[cfg(not(feature = "embree"))]
            Accelerator::Auto => Kind::Native(Native::build(shapes)),
            #[cfg(not(feature = "embree"))]
            Accelerator::Embree | Accelerator::Both => {
                let _ = threads;
                return Err(Error::Accelerator(
                    "this snell was built without Embree; use --accel native or auto".into(),
                ));
            }
        }))
    }

    /// The first surface that each ray meets in its open interval, or [`Hit::NONE`]. Of surfaces at the same distance
    /// (as f32), our own accelerator returns the one of lowest shape, then lowest primitive. `hits` is as long as
    /// `rays`; some tens to hundreds are a good number, and they need not be coherent. No direction may be zero, no
    /// `tmin` negative.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "one hit a ray");
        match &self.0 {
            Kind::Native(native) => native.closest_hits(rays, hits),
            #[cfg(feature = "embree")]
            Kind::Embree(embree) => embree.closest_hits(rays, hits),
            #[cfg(feature = "embree")]
            Kind::Both(both) => both.closest_hits(rays, hits),
        }
    }

    /// Whether each ray meets any surface in its open interval; see [`Self::closest_hits`].
    pub fn occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one answer a ray");
        occluded.fill(false);
        match &self.0 {
            Kind::Native(native) => native.occluded(rays, occluded),
            #[cfg(feature = "embree")]
            Kind::Embree(embree) => embree.occluded(rays, occluded),
            #[cfg(feature = "embree")]
            Kind::Both(both) => both.occluded(rays, occluded),
        }
    }

    /// Name and version, for example `embree 3.13.5 (robust)` or `native`.
    pub fn name(&self) -> String {
        match &self.0 {
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
