//! Where a light is and where it shines, and how much of it can arrive at a point: an upper bound, but for visibility and what a
//! viewer sees of it.
//!
//! Conty Estevez and Kulla 2018, *Importance Sampling of Many Lights with Adaptive Tree Splitting*, sections 4.1 and 4.4; the
//! angles by cosines and sines as in pbrt-v4, section 12.6.3.

use super::Light;
use crate::math::bounds::Bounds;
use crate::math::float::{max, min};
use crate::shape::Shape;
use crate::spectrum::Rgb;
use glam::{DVec2, DVec3, Vec3};
use std::f32::consts::PI;
use std::f64;

/// A light, or several together.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// A box around all points.
    pub bounds: Bounds,
    /// The middle of all normals.
    pub axis: Vec3,
    /// Cosine of the largest angle of a normal with the axis.
    pub cos_normals: f32,
    /// Cosine of the largest angle with a normal in which light leaves.
    pub cos_emission: f32,
    /// π times the irradiance of a small surface that faces the light at distance 1, as far as distance and angles do not
    /// lessen it: π·L·A of a surface, π·I of a point.
    pub power: f32,
    /// Whether light leaves on either side of a normal.
    pub both_sides: bool,
}

/// Where light arrives.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// The point, in the compiled scene's space.
    pub p: Vec3,
    /// The normal on the side from which light is scattered; zero where it is from both sides.
    pub n: Vec3,
    /// Where most of what the viewer sees comes from.
    pub lobe: Lobe,
}

/// What a surface scatters to its viewer, roughly: a part in a lobe of the shape of Trowbridge and Reitz's around one direction, the
/// rest in proportion to the cosine.
#[derive(Clone, Copy, Debug)]
pub struct Lobe {
    /// Unit vector of the middle: where a mirror's light would come from.
    pub axis: Vec3,
    /// The square of the lobe's angle, positive: 4α², as directions turn twice as much as the microfacets that mirror them.
    pub spread: f32,
    /// Which part is in the lobe, below 1; 0 where there is none.
    pub share: f32,
}

impl Lobe {
    /// There is none.
    pub const NONE: Self = Self { axis: Vec3::Z, spread: 1.0, share: 0.0 };

    /// What is scattered of a light in the direction `wi`, as a multiple of what would be if it were scattered all around and met the
    /// surface head on: `cos` is the light's cosine there, and `sin` the sine of the angle that it fills around `wi`.
    ///
    /// Spread over its angle, a lobe's density is q/(π·(q + c²)²), where c is the chord between its axis and a direction and q its
    /// spread; a light that is not small against the lobe widens it by as much as itself.
    #[inline(always)]
    pub(super) fn scattered(&self, wi: Vec3, cos: f32, sin: f32) -> f32 {
        let to = wi - self.axis;
        let wide = self.spread + sin * sin;
        let off = wide + to.length_squared();
        (1.0 - self.share) * cos + self.share * (wide / (off * off))
    }
}

impl Receiver {
    /// One that scatters in proportion to the cosine, as far as is known.
    pub fn new(p: Vec3, n: Vec3) -> Self {
        Self { p, n, lobe: Lobe::NONE }
    }

    /// Whether a lobe matters: not where light is scattered from both sides.
    #[inline(always)]
    pub(super) fn has_lobe(&self) -> bool {
        self.lobe.share > 0.0 && self.n != Vec3::ZERO
    }
}

/// Cosines this far beyond the limits of what a light reaches still count, as this much: the bounds are rounded, and what is
/// never chosen would be missing.
pub(super) const SLACK: f32 = 1e-3;

/// Sine of an angle of [0, π] by its cosine.
fn sine(cos: f32) -> f32 {
    max(0.0, 1.0 - cos * cos).sqrt()
}

/// An angle of [0, π] by its cosine and its sine.
#[derive(Clone, Copy, Debug)]
pub(super) struct Angle {
    pub(super) cos: f32,
    pub(super) sin: f32,
}

impl Angle {
    #[inline(always)]
    fn of_cos(cos: f32) -> Self {
        Self { cos, sin: sine(cos) }
    }

    /// max(0, self − other).
    #[inline(always)]
    fn less(self, other: Self) -> Self {
        if self.cos > other.cos {
            return Self { cos: 1.0, sin: 0.0 };
        }
        let cos = self.cos * other.cos + self.sin * other.sin;
        Self { cos, sin: self.sin * other.cos - self.cos * other.sin }
    }
}

/// A [`Reach`], ready to be asked what it sends.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Centre and radius of the sphere around the box.
    pub(super) centre: Vec3,
    pub(super) radius: f32,
    pub(super) axis: Vec3,
    pub(super) normals: Angle,
    pub(super) cos_emission: f32,
    pub(super) power: f32,
    pub(super) both_sides: bool,
}

impl Beam {
    /// Of this reach.
    pub fn new(reach: &Reach) -> Self {
        let half = reach.bounds.extent() * 0.5;
        Self {
            centre: reach.bounds.min + half,
            radius: half.length(),
            axis: reach.axis,
            normals: Angle::of_cos(reach.cos_normals),
            cos_emission: reach.cos_emission,
            power: reach.power,
            both_sides: reach.both_sides,
        }
    }

    /// A bound on what arrives at a receiver, or, where that has a lobe, a guess of what its viewer sees: [`Reach::power`], lessened by
    /// the square of the distance and by the cosines of the smallest angles at either end.
    #[inline]
    pub fn importance(&self, at: &Receiver) -> f32 {
        let to = self.centre - at.p;
        let (radius_squared, distance_squared) = (self.radius * self.radius, to.length_squared());
        let near = max(distance_squared, radius_squared);
        if !(near > 0.0) {
            // A light without size shines on everything but itself.
            return 0.0;
        }
        let (wi, around) = if distance_squared > radius_squared {
            let per_distance = 1.0 / distance_squared.sqrt();
            let sin = min(self.radius * per_distance, 1.0);
            (to * per_distance, Angle { cos: sine(sin), sin })
        } else {
            // From inside the sphere the directions to it are all there are.
            (to.normalize_or_zero(), Angle { cos: -1.0, sin: 0.0 })
        };
        let filled = if distance_squared > radius_squared { around.sin } else { 1.0 };
        let along = -self.axis.dot(wi);
        let axis = Angle::of_cos(if self.both_sides { along.abs() } else { along });
        let cos_light = axis.less(self.normals).less(around).cos;
        if cos_light < self.cos_emission - SLACK {
            return 0.0;
        }
        let mut importance = self.power * max(cos_light, SLACK) / near;
        if at.n != Vec3::ZERO {
            let cos_receiver = Angle::of_cos(at.n.dot(wi)).less(around).cos;
            if cos_receiver < -SLACK {
                return 0.0;
            }
            let cos_receiver = max(cos_receiver, SLACK);
            importance *= match at.lobe.share > 0.0 {
                true => at.lobe.scattered(wi, cos_receiver, filled),
                false => cos_receiver,
            };
        }
        min(importance, Reach::MOST)
    }
}

impl Reach {
    /// Largest bound, so that sums of bounds are finite.
    pub const MOST: f32 = 1e30;

    /// Where a light is and shines that is at some distance, of power 1, and its power, of the luminance of its colour, before
    /// it is rounded; `None` at infinity.
    pub fn of(light: &Light, shapes: &[Shape]) -> Option<(Self, f64)> {
        let power = weigh_power(light.power(shapes)?);
        let point = |p: DVec3, cone: Option<(DVec3, f64)>| {
            let (axis, cos_normals, cos_emission) = match cone {
                // The axis is the only normal; light leaves at angles up to that of the cone.
                Some((axis, angle)) => (axis.as_vec3(), 1.0, libm::cos(angle) as f32),
                None => (Vec3::Z, -1.0, 0.0),
            };
            let bounds = Bounds::of([p.as_vec3()]);
            Self { bounds, axis, cos_normals, cos_emission, power: 1.0, both_sides: false }
        };
        Some(match light {
            Light::Area(light) => (Self::of_surface(&shapes[light.shape as usize], false), power),
            Light::Varying(light) => {
                let both = light.both_sides();
                let sides = if both { 2.0 } else { 1.0 };
                (Self::of_surface(&shapes[light.shape() as usize], both), power / sides)
            }
            Light::Point(light) => (point(light.position, None), power / 4.0),
            Light::Spot(light) => {
                let mean_intensity = power / light.effective_solid_angle();
                (point(light.point.position, Some((light.axis, light.cutoff))), f64::consts::PI * mean_intensity)
            }
            Light::Projector(light) => {
                let (axis, angle, depth_one) = light.cone();
                (point(light.point.position, Some((axis, angle))), f64::consts::PI * power / depth_one)
            }
            Light::Constant(_) | Light::Environment(_) | Light::Directional(_) => return None,
        })
    }

    /// The bounds of a surface and of the normals of its front.
    fn of_surface(shape: &Shape, both_sides: bool) -> Self {
        let bounds =
            (0..shape.primitive_count() as u32).fold(Bounds::EMPTY, |all, i| all.union(shape.primitive_bounds(i)));
        let (axis, cos_normals) = match shape {
            Shape::Mesh(mesh) => {
                let normals = || (0..mesh.faces.len() as u32).map(|face| mesh.plane(face).n);
                let sum = normals().zip(mesh.areas()).map(|(n, area)| n.as_dvec3() * area).sum::<DVec3>();
                match sum.try_normalize().map(|axis| axis.as_vec3()) {
                    // Rounded outwards, as the cosines of two unit vectors are.
                    Some(axis) => (axis, normals().map(|n| n.dot(axis)).fold(1.0, min) - 4.0 * f32::EPSILON),
                    None => (Vec3::Z, -1.0),
                }
            }
            Shape::Disk(disk) => (disk.point(DVec2::ZERO).point.n, 1.0),
            Shape::Sphere(_) | Shape::Cylinder(_) | Shape::Placed(_) => (Vec3::Z, -1.0),
        };
        Self { bounds, axis, cos_normals: max(cos_normals, -1.0), cos_emission: 0.0, power: 1.0, both_sides }
    }

    /// Both together.
    pub fn union(&self, other: &Self) -> Self {
        let (axis, cos_normals) = cone_union((self.axis, self.cos_normals), (other.axis, other.cos_normals));
        Self {
            bounds: self.bounds.union(other.bounds),
            axis,
            cos_normals,
            cos_emission: min(self.cos_emission, other.cos_emission),
            power: self.power + other.power,
            both_sides: self.both_sides || other.both_sides,
        }
    }

    /// What a split costs besides power: the solid angle into which light is sent, its limits softened (the M_Ω of the
    /// paper's section 4.4).
    pub fn orientation_cost(&self) -> f32 {
        let (normals, emission) = (libm::acosf(self.cos_normals), libm::acosf(self.cos_emission));
        let wide = min(normals + emission, PI);
        let (sin, cos) = (sine(self.cos_normals), self.cos_normals);
        2.0 * PI * (1.0 - cos)
            + PI / 2.0 * (2.0 * wide * sin - libm::cosf(normals - 2.0 * wide) - 2.0 * normals * sin + cos)
    }
}

/// The luminance of a power.
fn weigh_power(power: [f64; 3]) -> f64 {
    power.iter().zip(Rgb::LUMINANCE).map(|(c, weight)| c * f64::from(weight)).sum()
}

/// A cone around two cones, each an axis and the cosine of its half angle.
fn cone_union(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (wide, narrow) = if a.1 <= b.1 { (a, b) } else { (b, a) };
    let whole = (wide.0, -1.0);
    let between = libm::acosf(wide.0.dot(narrow.0).clamp(-1.0, 1.0));
    let (half_wide, half_narrow) = (libm::acosf(wide.1), libm::acosf(narrow.1));
    if min(between + half_narrow, PI) <= half_wide {
        return wide;
    }
    let half = 0.5 * (half_wide + between + half_narrow);
    let side = wide.0.cross(narrow.0);
    let Some(side) = side.try_normalize().filter(|_| half < PI) else { return whole };
    // The wide cone's axis, turned towards the narrow one's by what it lacks.
    let (sin, cos) = (libm::sinf(half - half_wide), libm::cosf(half - half_wide));
    let axis = wide.0 * cos + side.cross(wide.0) * sin;
    // Rounded outwards.
    (axis.normalize_or(wide.0), max(-1.0, libm::cosf(half) - 4.0 * f32::EPSILON))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn direction() -> impl Strategy<Value = Vec3> {
        (-1.0_f32..1.0, 0.0_f32..6.3).prop_map(|(z, phi)| {
            let r = sine(z);
            Vec3::new(r * libm::cosf(phi), r * libm::sinf(phi), z).normalize()
        })
    }

    proptest! {
        /// Whatever is in one of two cones is in their union.
        #[test]
        fn cones_contain_their_parts(a in direction(), b in direction(), w in direction(), x in -1.0_f32..1.0, y in -1.0_f32..1.0) {
            let (axis, cos) = cone_union((a, x), (b, y));
            for (part, cos_part) in [(a, x), (b, y)] {
                if w.dot(part) >= cos_part {
                    prop_assert!(w.dot(axis) >= cos - 1e-5, "{} {}", w.dot(axis), cos);
                }
            }
        }

        /// No surface element of a light sends more to a receiver than the bound says.
        #[test]
        fn importance_is_a_bound(
            corner in direction(), size in direction(), n in direction(), axis in direction(), cone in -1.0_f32..1.0,
            inside in [0.0_f32..1.0, 0.0..1.0, 0.0..1.0], m in direction(),
        ) {
            let bounds = Bounds::of([corner * 1.5, corner * 1.5 + size * 0.7]);
            let reach = Reach { bounds, axis, cos_normals: cone, cos_emission: 0.0, power: 1.0, both_sides: false };
            // A point of the box with a normal of the cone.
            let q = bounds.min + bounds.extent() * Vec3::from(inside);
            prop_assume!(m.dot(axis) >= cone);
            for receiver in [n, Vec3::ZERO] {
                let to = q;
                let (d2, wi) = (to.length_squared(), to.normalize());
                let cos_receiver = if receiver == Vec3::ZERO { 1.0 } else { max(0.0, wi.dot(receiver)) };
                let sent = max(0.0, -wi.dot(m)) * cos_receiver / d2;
                let bound = Beam::new(&reach).importance(&Receiver::new(Vec3::ZERO, receiver));
                // From inside the sphere around the box the distance is that of the sphere's rim: no bound any more, but
                // never nothing.
                let half = bounds.extent() * 0.5;
                if (bounds.min + half).length() > half.length() {
                    let nearest = (bounds.min + half).length() - half.length();
                    let scale = d2 / (bounds.min + half).length_squared();
                    prop_assert!(sent * scale <= bound * (1.0 + 1e-4) + 1e-6, "{sent} {bound} {nearest}");
                } else if sent > 0.0 {
                    prop_assert!(bound > 0.0);
                }
            }
        }
    }

    #[test]
    fn a_point_shines_on_all_but_itself() {
        let point = Reach {
            bounds: Bounds::of([Vec3::X]),
            axis: Vec3::Z,
            cos_normals: -1.0,
            cos_emission: 0.0,
            power: 2.0,
            both_sides: false,
        };
        let at = |p, n| Beam::new(&point).importance(&Receiver::new(p, n));
        assert_eq!(at(Vec3::X, Vec3::ZERO), 0.0);
        assert!((at(Vec3::X * 3.0, Vec3::ZERO) - 0.5).abs() < 1e-6);
        assert_eq!(at(Vec3::X * 3.0, Vec3::X), 0.0);
        assert!(at(Vec3::X * (1.0 + f32::EPSILON), Vec3::ZERO) <= Reach::MOST);
    }
}
