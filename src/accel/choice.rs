//! Which accelerator to take, and how carefully to build it: as the user says, or by the number of rays to be expected.

use super::Accel;
use super::native::Native;
use crate::math::simd;
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
    /// Our own tree is built with the least care in 0.8 to 1.0 of the time of Embree's, and rays take 0.35 to 0.75 of the time in it where the
    /// processor has AVX2, so that 32 of them go through it in turn: there it is ours. Whole renders of one sample a pixel take
    /// 0.84 (Sponza, a million triangles), 0.90 (classroom) and 0.96 (veach-ajar) of what they do with Embree. Elsewhere rays go one by one, and it is ours for few triangles, outside of groups
    /// ([`Accel::FEW_TRIANGLES`]), or for many rays a triangle ([`Accel::MANY_RAYS`]); else Embree, where it is compiled in. Embree is built with
    /// [`Quality::Medium`], ours with the highest that pays ([`Accel::RAYS_FOR_HIGH`], [`Accel::RAYS_FOR_MEDIUM`]).
    #[must_use]
    pub fn new(accelerator: Accelerator, quality: Option<Quality>, shapes: &[Shape], rays: f64) -> Self {
        Self::for_triangles(accelerator, quality, Native::triangles(shapes), rays)
    }

    /// The same for so many triangles outside of groups.
    #[must_use]
    pub fn for_triangles(accelerator: Accelerator, quality: Option<Quality>, triangles: usize, rays: f64) -> Self {
        Self::on(simd::has_avx2(), (accelerator, quality), triangles, rays)
    }

    /// The same on a processor that has AVX2 or not.
    fn on(avx2: bool, (accelerator, quality): (Accelerator, Option<Quality>), triangles: usize, rays: f64) -> Self {
        let each = rays / triangles.max(1) as f64;
        let (accelerator, who) = match accelerator {
            Accelerator::Auto if triangles <= Accel::FEW_TRIANGLES => (Accelerator::Native, "few triangles"),
            Accelerator::Auto if !cfg!(feature = "embree") => (Accelerator::Native, "there is no other"),
            Accelerator::Auto if avx2 => (Accelerator::Native, "the faster one with AVX2"),
            Accelerator::Auto if each >= Accel::MANY_RAYS => (Accelerator::Native, "many rays a triangle"),
            Accelerator::Auto => (Accelerator::Embree, "few rays a triangle"),
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
    fn what_nobody_asked_for_goes_by_rays_and_triangles() {
        let few = Choice::new(Accelerator::Auto, None, &triangles(Accel::FEW_TRIANGLES), 1.0);
        assert_eq!((few.accelerator, few.quality), (Accelerator::Native, Quality::High));
        let count = 2 * Accel::FEW_TRIANGLES;
        let on = |avx2, rays: f64| Choice::on(avx2, (Accelerator::Auto, None), count, rays * count as f64);
        let steps = [0.5 * Accel::MANY_RAYS, Accel::MANY_RAYS, Accel::RAYS_FOR_MEDIUM, Accel::RAYS_FOR_HIGH];
        let [less, more, many, most] = steps.map(|rays| on(false, rays));
        let expected = match cfg!(feature = "embree") {
            true => (Accelerator::Embree, Quality::Medium, "few rays a triangle, some 1.0 rays each"),
            false => (Accelerator::Native, Quality::Low, "there is no other, some 1.0 rays each"),
        };
        assert_eq!((less.accelerator, less.quality, &less.reason[..]), expected);
        assert_eq!((more.accelerator, more.quality), (Accelerator::Native, Quality::Low));
        assert_eq!((many.accelerator, many.quality), (Accelerator::Native, Quality::Medium));
        assert_eq!((most.accelerator, most.quality), (Accelerator::Native, Quality::High));
        let least = on(true, steps[0]);
        assert_eq!((least.accelerator, least.quality), (Accelerator::Native, Quality::Low));
        for (rays, expected) in [(steps[1], more), (steps[2], many), (steps[3], most)] {
            assert_eq!(on(true, rays).quality, expected.quality);
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
