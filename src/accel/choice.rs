//! Which accelerator to take, and how carefully to build it: as the user says, or by the number of rays to be expected.

use super::Accel;
use super::native::Native;
use crate::shape::Shape;

/// What the user asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Accelerator {
    /// Whichever is expected to take less time: see [`Choice::new`].
    #[default]
    Auto,
    /// Embree.
    Embree,
    /// Our own.
    Native,
    /// Both, compared ray by ray; our own answers.
    Both,
}

/// What building may take, for how long rays take then.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// The least time to build: no triangle is cut.
    Low,
    /// In between: triangles are cut where that makes boxes overlap much less.
    Medium,
    /// The least time for rays: where it makes them overlap less. (Embree, in its robust mode, takes this for [`Self::Medium`].)
    #[default]
    High,
}

/// An accelerator, how carefully to build it, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Not [`Accelerator::Auto`].
    pub accelerator: Accelerator,
    /// How carefully.
    pub quality: Quality,
    /// In words, for people.
    pub reason: String,
}

impl Choice {
    /// What to take for about so many rays through `shapes`, where the user asked for `accelerator` and `quality`, if any.
    ///
    /// [`Accelerator::Auto`] is ours: it is built with the least care in 0.85 to 1.04 of the time of Embree's, and rays take 0.35 to 0.75 of the
    /// time in it where the processor has AVX2. Whole renders of one sample a pixel take 0.84 (a million triangles), 0.85 (Sponza), 0.90
    /// (classroom) and 0.96 (veach-ajar) of what they do with Embree. With SSE alone they take 1.00 to 1.12 of what they do with an Embree that uses
    /// AVX-512; a choice that depended on the processor would make checkpoints and shards of one another's.
    /// Embree is built with [`Quality::Medium`], ours with the highest that pays ([`Accel::RAYS_FOR_HIGH`], [`Accel::RAYS_FOR_MEDIUM`]).
    #[must_use]
    pub fn new(accelerator: Accelerator, quality: Option<Quality>, shapes: &[Shape], rays: f64) -> Self {
        Self::for_triangles(accelerator, quality, Native::triangles(shapes), rays)
    }

    /// The same for so many triangles outside of groups.
    #[must_use]
    pub fn for_triangles(accelerator: Accelerator, quality: Option<Quality>, triangles: usize, rays: f64) -> Self {
        let each = rays / triangles.max(1) as f64;
        let (accelerator, who) = match accelerator {
            Accelerator::Auto => (Accelerator::Native, "the faster one"),
            given => (given, "as asked for"),
        };
        let quality = quality.unwrap_or(match accelerator {
            Accelerator::Embree => Quality::Medium,
            _ if triangles <= Accel::FEW_TRIANGLES || each >= Accel::RAYS_FOR_HIGH => Quality::High,
            _ if each >= Accel::RAYS_FOR_MEDIUM => Quality::Medium,
            _ => Quality::Low,
        });
        let reason =
            if each.is_finite() && triangles > 0 { format!("{who}, some {each:.1} rays each") } else { who.into() };
        Self { accelerator, quality, reason }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::TriangleMesh;
    use glam::Vec3;

    fn triangles(count: usize) -> [Shape; 1] {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        [Shape::Mesh(TriangleMesh { positions, faces: vec![[0, 1, 2]; count], ..TriangleMesh::default() })]
    }

    #[test]
    fn what_nobody_asked_for_is_ours_as_carefully_as_pays() {
        let few = Choice::new(Accelerator::Auto, None, &triangles(Accel::FEW_TRIANGLES), 1.0);
        assert_eq!((few.accelerator, few.quality), (Accelerator::Native, Quality::High));
        let count = 2 * Accel::FEW_TRIANGLES;
        for (rays, quality) in
            [(1.0, Quality::Low), (Accel::RAYS_FOR_MEDIUM, Quality::Medium), (Accel::RAYS_FOR_HIGH, Quality::High)]
        {
            let choice = Choice::new(Accelerator::Auto, None, &triangles(count), rays * count as f64);
            assert_eq!((choice.accelerator, choice.quality), (Accelerator::Native, quality));
            assert_eq!(choice.reason, format!("the faster one, some {rays:.1} rays each"));
        }
    }

    #[test]
    fn what_is_asked_for_is_taken() {
        for quality in [Quality::Low, Quality::Medium, Quality::High] {
            for accelerator in [Accelerator::Embree, Accelerator::Native, Accelerator::Both] {
                let choice = Choice::new(accelerator, Some(quality), &triangles(1), 1.0);
                assert_eq!((choice.accelerator, choice.quality), (accelerator, quality));
                assert_eq!(choice.reason, "as asked for, some 1.0 rays each");
            }
        }
    }
}
