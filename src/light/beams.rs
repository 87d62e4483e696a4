//! What eight lights can send to a point, at once: [`Beam::importance`] on vectors, the same bits.

use super::reach::{Beam, Lobe, Reach, Receiver, SLACK};
use super::weights::mixed;
use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x8};
use glam::Vec3;

/// Lights at a time.
pub(super) const LANES: usize = 8;

/// Up to eight beams side by side; the others send nothing.
#[derive(Clone, Debug)]
#[repr(align(32))]
pub(super) struct Beams {
    centre: [[f32; LANES]; 3],
    radius: [f32; LANES],
    axis: [[f32; LANES]; 3],
    /// Cosine and sine of the largest angle of a normal.
    normals: [[f32; LANES]; 2],
    cos_emission: [f32; LANES],
    power: [f32; LANES],
    /// 1 where light leaves on either side of a normal, else 0.
    both_sides: [f32; LANES],
}

impl Beams {
    /// Of at most eight.
    pub(super) fn new(beams: &[Beam]) -> Self {
        let mut all = Self {
            centre: [[0.0; LANES]; 3],
            radius: [0.0; LANES],
            axis: [[0.0; LANES]; 3],
            normals: [[0.0; LANES]; 2],
            cos_emission: [0.0; LANES],
            power: [0.0; LANES],
            both_sides: [0.0; LANES],
        };
        for (lane, beam) in beams.iter().enumerate() {
            for axis in 0..3 {
                all.centre[axis][lane] = beam.centre[axis];
                all.axis[axis][lane] = beam.axis[axis];
            }
            all.radius[lane] = beam.radius;
            all.normals[0][lane] = beam.normals.cos;
            all.normals[1][lane] = beam.normals.sin;
            all.cos_emission[lane] = beam.cos_emission;
            all.power[lane] = beam.power;
            all.both_sides[lane] = f32::from(u8::from(beam.both_sides));
        }
        all
    }

    /// What each can send to a receiver, and what of it is seen by the viewer.
    #[inline]
    pub(super) fn importances(&self, level: Level, at: &Receiver) -> [[f32; LANES]; 2] {
        dispatch!(level, simd => self.compute(simd, at))
    }

    /// The same, where it is known what the processor can do.
    #[inline(always)]
    pub(super) fn compute<S: Simd>(&self, simd: S, at: &Receiver) -> [[f32; LANES]; 2] {
        let load = |numbers: &[f32; LANES]| f32x8::from_slice(simd, numbers);
        let splat = |x: f32| f32x8::splat(simd, x);
        let (zero, one) = (splat(0.0), splat(1.0));
        let to = Vector {
            x: load(&self.centre[0]) - at.p.x,
            y: load(&self.centre[1]) - at.p.y,
            z: load(&self.centre[2]) - at.p.z,
        };
        let radius = load(&self.radius);
        let (radius_squared, distance_squared) = (radius * radius, to.dot(to));
        let outside = distance_squared.simd_gt(radius_squared);
        let near = outside.select(distance_squared, radius_squared);
        let per_distance = one / distance_squared.sqrt();
        // Of what is in the same place there is no direction.
        let per_distance = distance_squared.simd_gt(zero).select(per_distance, zero);
        let wi = to.scaled(per_distance);
        let sin = radius * per_distance;
        let sin = sin.simd_lt(one).select(sin, one);
        // From inside the sphere the directions to it are all there are.
        let around = Angles { cos: outside.select(sine(sin, zero, one), splat(-1.0)), sin: outside.select(sin, zero) };
        let filled = outside.select(sin, one);
        let axis = Vector { x: load(&self.axis[0]), y: load(&self.axis[1]), z: load(&self.axis[2]) };
        let along = zero - axis.dot(wi);
        let along = load(&self.both_sides).simd_gt(zero).select(along.abs(), along);
        let axis = Angles { cos: along, sin: sine(along, zero, one) };
        let normals = Angles { cos: load(&self.normals[0]), sin: load(&self.normals[1]) };
        let cos_light = axis.less(normals, zero, one).less(around, zero, one).cos;
        let slack = splat(SLACK);
        let at_least_slack = |cos: f32x8<S>| cos.simd_gt(slack).select(cos, slack);
        let mut importance = load(&self.power) * at_least_slack(cos_light) / near;
        let mut seen = zero;
        if at.n != Vec3::ZERO {
            let cos = wi.x * at.n.x + wi.y * at.n.y + wi.z * at.n.z;
            let cos_receiver = Angles { cos, sin: sine(cos, zero, one) }.less(around, zero, one).cos;
            let cos = at_least_slack(cos_receiver);
            if at.lobe.share > 0.0 {
                seen = importance * scattered(&at.lobe, wi, cos, filled);
            }
            importance *= cos;
            let reaches_nothing = cos_receiver.simd_lt(zero - slack);
            importance = reaches_nothing.select(zero, importance);
            seen = reaches_nothing.select(zero, seen);
        }
        let most = splat(Reach::MOST);
        let leaves_nothing = cos_light.simd_lt(load(&self.cos_emission) - slack);
        // A light without size shines on everything but itself; and lanes of no light on nothing.
        let sends = near.simd_gt(zero) & load(&self.power).simd_gt(zero);
        let stored = |importance: f32x8<S>| {
            let importance = importance.simd_lt(most).select(importance, most);
            let importance = leaves_nothing.select(zero, importance);
            let mut out = [0.0; LANES];
            sends.select(importance, zero).store_slice(&mut out);
            out
        };
        let sent = stored(importance);
        [sent, if at.has_lobe() { stored(seen) } else { sent }]
    }

    /// The weights of a choice among them.
    #[inline(always)]
    pub(super) fn weights<S: Simd>(&self, simd: S, at: &Receiver) -> [f32; LANES] {
        let importances = self.compute(simd, at);
        if at.has_lobe() { mixed(importances) } else { importances[0] }
    }
}

/// Eight vectors.
#[derive(Clone, Copy)]
struct Vector<S: Simd> {
    x: f32x8<S>,
    y: f32x8<S>,
    z: f32x8<S>,
}

impl<S: Simd> Vector<S> {
    #[inline(always)]
    fn dot(self, other: Self) -> f32x8<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    fn scaled(self, factor: f32x8<S>) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}

/// [`Lobe::scattered`] for eight lights.
#[inline(always)]
fn scattered<S: Simd>(lobe: &Lobe, wi: Vector<S>, cos: f32x8<S>, sin: f32x8<S>) -> f32x8<S> {
    let to = Vector { x: wi.x - lobe.axis.x, y: wi.y - lobe.axis.y, z: wi.z - lobe.axis.z };
    let wide = sin * sin + lobe.spread;
    let off = wide + to.dot(to);
    cos * (1.0 - lobe.share) + wide / (off * off) * lobe.share
}

/// Eight angles, as [`super::reach`] has them.
#[derive(Clone, Copy)]
struct Angles<S: Simd> {
    cos: f32x8<S>,
    sin: f32x8<S>,
}

impl<S: Simd> Angles<S> {
    /// max(0, self − other).
    #[inline(always)]
    fn less(self, other: Self, zero: f32x8<S>, one: f32x8<S>) -> Self {
        let nothing = self.cos.simd_gt(other.cos);
        let cos = self.cos * other.cos + self.sin * other.sin;
        let sin = self.sin * other.cos - self.cos * other.sin;
        Self { cos: nothing.select(one, cos), sin: nothing.select(zero, sin) }
    }
}

/// Sines of angles of [0, π] by their cosines, or the other way round.
#[inline(always)]
fn sine<S: Simd>(cos: f32x8<S>, zero: f32x8<S>, one: f32x8<S>) -> f32x8<S> {
    let squared = one - cos * cos;
    squared.simd_gt(zero).select(squared, zero).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::bounds::Bounds;
    use proptest::prelude::*;

    proptest! {
        /// Eight at once are eight, one after the other: the same bits, at every level.
        #[test]
        fn eight_are_as_eight(
            corners in prop::array::uniform8(prop::array::uniform3(-2.0_f32..2.0)), size in prop::array::uniform3(0.0_f32..1.0),
            axes in prop::array::uniform8(prop::array::uniform3(-1.0_f32..1.0)), cones in prop::array::uniform8(-1.0_f32..=1.0),
            both in prop::array::uniform8(prop::bool::ANY), n in prop::array::uniform3(-1.0_f32..1.0), count in 1_usize..=8,
            scale in -40_i32..40, is_point in prop::bool::ANY, at in 0_usize..8, spread in 1e-8_f32..4.0,
        ) {
            let scale = libm::ldexpf(1.0, scale);
            let beams: Vec<Beam> = (0..count)
                .map(|i| {
                    let corner = Vec3::from(corners[i]) * scale;
                    let size = if is_point { Vec3::ZERO } else { Vec3::from(size) * scale };
                    let bounds = Bounds::of([corner, corner + size]);
                    let axis = Vec3::from(axes[i]).normalize_or(Vec3::Z);
                    let power = libm::ldexpf(1.0, 3 * i as i32 - 9);
                    Beam::new(&Reach { bounds, axis, cos_normals: cones[i], cos_emission: 0.0, power, both_sides: both[i] })
                })
                .collect();
            for p in [Vec3::ZERO, Vec3::from(corners[at]) * scale] {
                let n = Vec3::from(n).normalize_or_zero();
                let lobe = Lobe { axis: Vec3::from(axes[at]).normalize_or(Vec3::Z), spread, share: 0.75 };
                for at in [Receiver::new(p, Vec3::ZERO), Receiver::new(p, n), Receiver { p, n, lobe }] {
                    let mut expected = [[0.0; LANES]; 2];
                    for (lane, beam) in beams.iter().enumerate() {
                        expected[0][lane] = beam.importance(&Receiver::new(at.p, at.n));
                        expected[1][lane] = beam.importance(&at);
                    }
                    for level in [Level::new(), Level::baseline()] {
                        let found = Beams::new(&beams).importances(level, &at);
                        prop_assert_eq!(found.map(|all| all.map(f32::to_bits)), expected.map(|all| all.map(f32::to_bits)));
                    }
                }
            }
        }
    }
}
