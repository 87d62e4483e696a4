//! The truth about rays, slowly: every primitive, in f64; and which of two accelerators is right.
//!
//! A triangle is tested by another formula than the accelerators': the signs of the volumes that the ray spans with the
//! edges (Plücker coordinates), e_i = d·((v_j − o) × (v_k − o)), and the distance in its plane. With u = 2⁻⁵³ the volume
//! has an error of at most γ₈·Σ|d|·|v_j − o|·|v_k − o| over the six products (`VOLUME_ROUNDINGS`).
//!
//! The accelerators may move a vertex by a few roundings of f32 ([`crate::shape::triangle`]), so near the rim of a
//! triangle both answers are in order: [`Contact::Rim`]. What is placed they meet in f64, and so the rim of a placed triangle
//! is narrower: a few roundings of f64, in the group's space.

use super::Hit;
use crate::math::float::{UNIT_ROUNDOFF, UNIT_ROUNDOFF_F64};
use crate::math::ray::{DRay, Line, Ray};
use crate::shape::Shape;
use crate::shape::triangle::{self, SHEAR_ROUNDINGS, TriangleHit};
use glam::{DVec3, Vec3};

/// Rounded operations that a volume goes through, with one for the bound's own rounding.
const VOLUME_ROUNDINGS: f64 = 8.0;

/// Roundings of f64, of the largest coordinate of v − o, that the test of placed triangles may be off by sideways: those of
/// [`SHEAR_ROUNDINGS`], one more for a product with 1/d.z in place of a quotient, and one for the products of edge functions.
/// These are off by 2·u·P², P ≤ 2·M, and a vertex that moves by u·M changes them by up to 4·P·u·M.
const PLACED_ROUNDINGS: f64 = SHEAR_ROUNDINGS as f64 + 2.0;

/// Roundings of f32, of the same, that the point of a placed triangle may be beside the ray. Edge functions have errors of
/// 4·u·P² (u = 2⁻⁵³), so that the barycentrics are off by 26·u·P²/|D| together. |D| is above 2⁻²⁵·P², or else a point of the
/// rim is taken, which is nearer. That is 26·2⁻²⁸·P, and P ≤ 2·M. The depth is off by as large a part of the triangle's own.
const BESIDE_ROUNDINGS: f64 = 4.0;

/// How a ray and one primitive stand to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contact {
    /// They do not meet in the ray's interval.
    Miss,
    /// The ray passes so near the primitive's rim, inside or outside, that f32 cannot tell (f64, if it is placed); with the
    /// distance and what that may be off by.
    Rim(f64, f64),
    /// They meet; with the distance and the rounding of f32 in it.
    Inside(f64, f64),
}

impl Contact {
    fn distance(self) -> Option<(f64, f64)> {
        match self {
            Self::Miss => None,
            Self::Rim(t, error) | Self::Inside(t, error) => Some((t, error)),
        }
    }
}

/// Who is right where two accelerators differ about a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Both: the two hits are equally far, within rounding.
    Tie,
    /// Both: the nearer hit, or the only one, is on the rim of a triangle. (In a closed mesh one of its triangles must
    /// be hit there, so a miss is a leak all the same.)
    Edge,
    /// Our own: Embree lost a true hit.
    EmbreeMiss,
    /// Embree: our own lost a true hit.
    NativeMiss,
    /// Our own: what Embree hit, the ray does not meet in its interval.
    EmbreeFalse,
    /// Embree: what our own hit, the ray does not meet in its interval.
    NativeFalse,
}

/// The closest hit and its distance: the lowest shape and primitive of those at exactly the same distance.
pub fn closest(shapes: &[Shape], ray: &Ray) -> Option<(Hit, f64)> {
    closest_but(shapes, ray, &[])
}

/// [`closest`] of all primitives but those that are `left_out`.
pub fn closest_but(shapes: &[Shape], ray: &Ray, left_out: &[Hit]) -> Option<(Hit, f64)> {
    let mut nearest: Option<(Hit, f64)> = None;
    for hit in ids(shapes, left_out) {
        let t = match crosses(shapes, hit, ray) {
            Some(t) if ray.contains(t) => t,
            _ => continue,
        };
        if nearest.is_none_or(|(_, least)| t < least) {
            nearest = Some((hit, t));
        }
    }
    nearest
}

/// Whether the ray meets anything.
pub fn occluded(shapes: &[Shape], ray: &Ray) -> bool {
    ids(shapes, &[]).any(|hit| crosses(shapes, hit, ray).is_some_and(|t| ray.contains(t)))
}

/// Whether the ray meets anything but what is `left_out`, or passes so near that it may be said to.
pub fn may_be_occluded(shapes: &[Shape], ray: &Ray, left_out: &[Hit]) -> bool {
    occluder(shapes, ray, left_out).is_some()
}

/// What that is: something that the ray meets for certain, if there is such.
pub fn occluder(shapes: &[Shape], ray: &Ray, left_out: &[Hit]) -> Option<Hit> {
    let mut on_rim = None;
    for hit in ids(shapes, left_out) {
        match contact(shapes, hit, ray) {
            Contact::Inside(..) => return Some(hit),
            Contact::Rim(..) => on_rim = on_rim.or(Some(hit)),
            Contact::Miss => {}
        }
    }
    on_rim
}

/// All primitives but those that are left out.
fn ids<'a>(shapes: &'a [Shape], left_out: &'a [Hit]) -> impl Iterator<Item = Hit> + 'a {
    let of_shape = |(shape, description): (u32, &Shape)| {
        (0..description.primitive_count() as u32).map(move |primitive| Hit { shape, primitive })
    };
    (0..).zip(shapes).flat_map(of_shape).filter(|hit| !left_out.contains(hit))
}

/// Distance at which the ray's line crosses a primitive; of several the one that counts.
fn crosses(shapes: &[Shape], hit: Hit, ray: &Ray) -> Option<f64> {
    match &shapes[hit.shape as usize] {
        Shape::Mesh(mesh) => cross_triangle(ray, mesh.triangle(hit.primitive)),
        Shape::Placed(placed) => match placed.shape() {
            Shape::Mesh(mesh) => cross_triangle(&placed.placement.ray_to_group(ray), mesh.triangle(hit.primitive)),
            _ => shapes[hit.shape as usize].intersect(0, ray).map(|_| placed.resolve_distance(0, ray)),
        },
        quadric => quadric.intersect(0, ray).map(|_| quadric.resolve_distance(0, ray)),
    }
}

fn cross_triangle(ray: &impl Line, v: [Vec3; 3]) -> Option<f64> {
    let volumes = Volumes::new(ray, v);
    volumes.same_sign(0.0).then_some(volumes.t)
}

/// How `ray` and the primitive `hit` stand to each other.
pub fn contact(shapes: &[Shape], hit: Hit, ray: &Ray) -> Contact {
    let contact = match &shapes[hit.shape as usize] {
        Shape::Mesh(mesh) => triangle_contact(ray, mesh.triangle(hit.primitive)),
        Shape::Placed(placed) if matches!(placed.shape(), Shape::Mesh(_)) => {
            let Shape::Mesh(mesh) = placed.shape() else { return Contact::Miss };
            placed_contact(&placed.placement.ray_to_group(ray), mesh.triangle(hit.primitive))
        }
        other => exact_contact(ray, other, hit.primitive),
    };
    match contact.distance() {
        // An end of the interval within rounding of the distance is as undecided as a rim.
        Some((t, _)) if ray.contains(t) => contact,
        Some((t, error)) if ray.contains(t + error) || ray.contains(t - error) => Contact::Rim(t, error),
        _ => Contact::Miss,
    }
}

fn triangle_contact(ray: &Ray, v: [Vec3; 3]) -> Contact {
    let volumes = Volumes::new(ray, v);
    let allowed = f64::from(SHEAR_ROUNDINGS) * f64::from(UNIT_ROUNDOFF) * volumes.size;
    if volumes.same_sign(volumes.error + volumes.change(ray, v, allowed)) {
        return Contact::Inside(volumes.t, volumes.rounding());
    }
    // Moving the ray sideways by what is allowed moves the distance by this much, along the slope of the plane.
    let error = volumes.rounding() + allowed * volumes.slope;
    rim_contact(ray, v, triangle::resolve(ray, v[0], v[1], v[2]), allowed, error)
}

/// The same of a placed triangle and the ray in its group's space, which is the same for whoever asks. Where edge functions
/// certainly have opposite signs it is a miss; in the plane of the triangle that is not certain, and how far beside the
/// triangle the ray passes must tell.
///
/// Of a triangle that is seen edge-on the distance is that of a point of its rim: it may be beside the ray, and as near or
/// far as any of the triangle.
fn placed_contact(ray: &DRay, v: [Vec3; 3]) -> Contact {
    let volumes = Volumes::new(ray, v);
    let margin = volumes.error + volumes.change(ray, v, PLACED_ROUNDINGS * UNIT_ROUNDOFF_F64 * volumes.size);
    if volumes.are_opposed(margin) {
        return Contact::Miss;
    }
    let beside = BESIDE_ROUNDINGS * f64::from(UNIT_ROUNDOFF);
    let depth = depth(ray, v);
    let resolved = triangle::resolve(ray, v[0], v[1], v[2]);
    if volumes.same_sign(margin) && resolved.b.iter().all(|&b| b > 0.0) {
        return Contact::Inside(volumes.t, volumes.rounding() + beside * depth);
    }
    let off = (beside * volumes.size * volumes.slope).min(depth);
    rim_contact(ray, v, resolved, beside * volumes.size, f64::from(UNIT_ROUNDOFF) * resolved.t.abs() + off)
}

/// By how much the distances of two points of a triangle differ at most.
fn depth(ray: &impl Line, v: [Vec3; 3]) -> f64 {
    let d = ray.direction();
    let axis = dominant(d);
    let depths = v.map(|v| f64::from(v[axis]) / d[axis]);
    depths.iter().copied().fold(f64::MIN, f64::max) - depths.iter().copied().fold(f64::MAX, f64::min)
}

/// Whether a ray that is not certainly inside meets the rim of a triangle: the point that is taken for the hit, whose
/// distance has this error, is at most `beside` from the ray.
fn rim_contact(ray: &impl Line, v: [Vec3; 3], resolved: TriangleHit, beside: f64, error: f64) -> Contact {
    let point: DVec3 = v.iter().zip(resolved.b).map(|(v, b)| v.as_dvec3() * b).sum();
    let gap = (ray.origin() + resolved.t * ray.direction() - point).abs().max_element();
    if gap <= beside { Contact::Rim(resolved.t, error) } else { Contact::Miss }
}

/// The accelerators decide about quadrics by the same code, in f64.
fn exact_contact(ray: &Ray, shape: &Shape, primitive: u32) -> Contact {
    let t = shape.resolve_distance(primitive, ray);
    let p = ray.o.as_dvec3() + t * ray.d.as_dvec3();
    // A root satisfies the equation to the rounding of f64; a line that passes by does not.
    let gap = (p - shape.meet(ray, primitive).point.p).length();
    let bounds = shape.primitive_bounds(primitive);
    let reach = bounds.min.abs().max(bounds.max.abs()).max_element() + ray.o.abs().max_element();
    let allowed = f64::from(UNIT_ROUNDOFF) * f64::from(reach);
    if gap <= allowed { Contact::Inside(t, f64::from(UNIT_ROUNDOFF) * t.abs()) } else { Contact::Miss }
}

/// The axis along which a direction is longest.
fn dominant(d: DVec3) -> usize {
    d.abs().to_array().iter().position(|&c| c == d.abs().max_element()).unwrap_or(0)
}

/// What the ray spans with the edges of a triangle.
struct Volumes {
    e: [f64; 3],
    /// Bound on the error of each of `e`.
    error: f64,
    /// Largest coordinate of the vertices as seen from the origin.
    size: f64,
    /// Distance in the plane.
    t: f64,
    /// Change of the distance per length that the ray is moved sideways, at most.
    slope: f64,
}

impl Volumes {
    fn new(ray: &impl Line, v: [Vec3; 3]) -> Self {
        let d = ray.direction();
        let [a, b, c] = v.map(|v| v.as_dvec3() - ray.origin());
        let e = [d.dot(b.cross(c)), d.dot(c.cross(a)), d.dot(a.cross(b))];
        let size = a.abs().max_element().max(b.abs().max_element()).max(c.abs().max_element());
        let products = 2.0 * (d.x.abs() + d.y.abs() + d.z.abs()) * size * size;
        let normal = (b - a).cross(c - a);
        let facing = normal.dot(d);
        Self {
            e,
            error: VOLUME_ROUNDINGS * UNIT_ROUNDOFF_F64 * products,
            size,
            t: normal.dot(a) / facing,
            slope: normal.length() / facing.abs(),
        }
    }

    /// What the distance may be off by where the ray is not moved: its rounding to f32, and that of f64 along the slope.
    fn rounding(&self) -> f64 {
        f64::from(UNIT_ROUNDOFF) * self.t.abs() + VOLUME_ROUNDINGS * UNIT_ROUNDOFF_F64 * self.size * self.slope
    }

    /// By how much any of `e` changes at most when vertices move sideways by `allowed`. As seen along the ray, at a depth
    /// of the dominant component d.z, e is d.z times the cross product of two vertices that are at most `spread` from it.
    fn change(&self, ray: &impl Line, v: [Vec3; 3], allowed: f64) -> f64 {
        let d = ray.direction();
        let axis = dominant(d);
        let spread = v
            .iter()
            .map(|v| {
                let a = v.as_dvec3() - ray.origin();
                (a - d * (a[axis] / d[axis])).abs().max_element()
            })
            .fold(0.0, f64::max);
        d[axis].abs() * (4.0 * spread * allowed + 2.0 * allowed * allowed)
    }

    /// Whether two have different signs and are further from 0 than `margin`.
    fn are_opposed(&self, margin: f64) -> bool {
        self.e.iter().any(|&e| e > margin) && self.e.iter().any(|&e| e < -margin)
    }

    /// Whether all have the same sign and are further from 0 than `margin` (or, with 0, not on different sides of it).
    fn same_sign(&self, margin: f64) -> bool {
        let facing = self.t.is_finite();
        facing
            && if margin > 0.0 {
                self.e.iter().all(|&e| e > margin) || self.e.iter().all(|&e| e < -margin)
            } else {
                self.e.iter().all(|&e| e >= 0.0) || self.e.iter().all(|&e| e <= 0.0)
            }
    }
}

/// Who is right about the closest hit (or any hit, where the one who found none has [`Hit::NONE`]) of a ray that meets nothing
/// that is `left_out`. The two differ.
pub fn verdict(shapes: &[Shape], ray: &Ray, left_out: &[Hit], embree: Hit, native: Hit) -> Verdict {
    let look = |hit: Hit| {
        if hit.is_some() && !left_out.contains(&hit) { contact(shapes, hit, ray) } else { Contact::Miss }
    };
    let (of_embree, of_native) = (look(embree), look(native));
    if embree.is_some() && of_embree == Contact::Miss {
        return Verdict::EmbreeFalse;
    }
    if native.is_some() && of_native == Contact::Miss {
        return Verdict::NativeFalse;
    }
    let embree_is_nearer = match (of_embree.distance(), of_native.distance()) {
        (Some((t, error)), Some((t2, error2))) if (t - t2).abs() <= error + error2 => return Verdict::Tie,
        (Some((t, _)), Some((t2, _))) => t < t2,
        (found, _) => found.is_some(),
    };
    match if embree_is_nearer { of_embree } else { of_native } {
        Contact::Inside(..) if embree_is_nearer => Verdict::NativeMiss,
        Contact::Inside(..) => Verdict::EmbreeMiss,
        _ => Verdict::Edge,
    }
}

/// How an answer compares with the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// It is what the oracle finds.
    Same,
    /// Another hit or none, and as right: as far within rounding, or decided on the rim of a triangle.
    Tie,
    /// There is a true hit that is nearer.
    Missed,
    /// What it names, the ray does not meet in its interval.
    False,
}

/// Judges what was said to be the closest hit of `ray` with primitives `left_out`; `truth` is what [`closest_but`] says.
///
/// Where the truth is on a rim, so that f32 may pass it by, the answer must still be as near as whatever the ray meets
/// for certain, and well inside of its interval: at an end f64 may have to round. Distances that are the same in f32 are the
/// same: no accelerator tells them apart.
pub fn standing(shapes: &[Shape], ray: &Ray, left_out: &[Hit], truth: Hit, answer: Hit) -> Standing {
    if answer == truth {
        return Standing::Same;
    }
    if answer.is_some() && left_out.contains(&answer) {
        return Standing::False;
    }
    match verdict(shapes, ray, left_out, truth, answer) {
        Verdict::NativeFalse => return Standing::False,
        Verdict::Tie => return Standing::Tie,
        _ => {}
    }
    let distance = |hit: Hit| if hit.is_some() { contact(shapes, hit, ray).distance() } else { None };
    let (t, error) = distance(answer).unwrap_or((f64::INFINITY, 0.0));
    // That the ray crosses it is known sooner, and needed.
    let may_be_nearer = |hit: Hit| crosses(shapes, hit, ray).is_some_and(|nearer| nearer < t);
    let is_nearer = |hit: Hit| match contact(shapes, hit, ray) {
        Contact::Inside(nearer, rounding) => {
            let is_sure = ray.contains(nearer - rounding) && ray.contains(nearer + rounding);
            is_sure && nearer + rounding + error < t && (nearer as f32) < t as f32
        }
        _ => false,
    };
    if ids(shapes, left_out).any(|hit| may_be_nearer(hit) && is_nearer(hit)) { Standing::Missed } else { Standing::Tie }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::TriangleMesh;
    use crate::shape::placed::{Group, Placed, Placement};
    use glam::{DAffine3, DVec2};
    use std::sync::Arc;

    /// The triangle x, y ≥ 0, x + y ≤ 1, z = 0.5, twice: at half its size as it is, and placed.
    fn both() -> [Shape; 2] {
        let mesh = |size: f32| {
            let positions = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|v| size * v + 0.5 * size * Vec3::Z).to_vec();
            Shape::Mesh(TriangleMesh { positions, faces: vec![[0, 1, 2]], ..Default::default() })
        };
        let placement = Arc::new(Placement::new(DAffine3::from_scale(DVec3::splat(0.5))).unwrap());
        [mesh(0.5), Shape::Placed(Placed { group: Arc::new(Group::new(vec![mesh(1.0)])), index: 0, placement })]
    }

    const PLAIN: Hit = Hit { shape: 0, primitive: 0 };
    const PLACED: Hit = Hit { shape: 1, primitive: 0 };

    #[test]
    fn placed_triangles_have_narrower_rims() {
        let contact = |hit: Hit, at: DVec2, d: Vec3| {
            let at = at.as_vec2();
            super::contact(&both(), hit, &Ray::new(Vec3::new(at.x, at.y, 0.25) - d, d))
        };
        for hit in [PLAIN, PLACED] {
            assert!(matches!(contact(hit, DVec2::splat(0.125), Vec3::Z), Contact::Inside(t, _) if t == 1.0), "{hit:?}");
            assert!(matches!(contact(hit, DVec2::new(0.125, 0.0), Vec3::Z), Contact::Rim(t, _) if t == 1.0), "{hit:?}");
            assert_eq!(contact(hit, DVec2::new(0.125, -0.01), Vec3::Z), Contact::Miss, "{hit:?}");
            assert!(matches!(contact(hit, DVec2::splat(0.125), Vec3::X), Contact::Rim(..)), "in its plane, {hit:?}");
            assert_eq!(contact(hit, DVec2::new(0.125, 0.9), Vec3::X), Contact::Miss, "in its plane, beside, {hit:?}");
        }
        // Far more than the rounding of f64, but less than that of f32.
        let near = DVec2::new(0.125, -1e-9);
        assert!(matches!(contact(PLAIN, near, Vec3::Z), Contact::Rim(..)));
        assert_eq!(contact(PLACED, near, Vec3::Z), Contact::Miss);
        assert!(matches!(contact(PLACED, -near + DVec2::splat(0.25), Vec3::Z), Contact::Inside(..)));
    }

    /// Seen at an angle of 4·10⁻⁹, f64 finds the triangle, but takes a point of its rim.
    #[test]
    fn a_placed_triangle_edge_on_is_met_on_its_rim() {
        let height = 0.25f32.next_up() - 0.25;
        let ray = Ray::new(Vec3::new(-8.0, 0.125, 0.25 + height), Vec3::new(1.0, 0.0, -height / 8.125));
        let Contact::Rim(t, error) = contact(&both(), PLACED, &ray) else { panic!("no rim") };
        assert!((t - 8.125).abs() > 1e-3 && (t - 8.125).abs() <= error && error < 0.6, "{t} ± {error}");
        assert_eq!(closest_but(&both(), &ray, &[PLAIN]).map(|(hit, _)| hit), Some(PLACED));
    }

    #[test]
    fn what_is_left_out_is_not_met() {
        let ray = Ray::new(Vec3::new(0.125, 0.125, 1.0), Vec3::NEG_Z);
        let find = |left_out: &[Hit]| closest_but(&both(), &ray, left_out).map(|(hit, _)| hit);
        assert_eq!(closest(&both(), &ray).map(|(hit, _)| hit), Some(PLAIN));
        let may = |left_out: &[Hit]| may_be_occluded(&both(), &ray, left_out);
        assert_eq!([may(&[PLAIN]), may(&[PLAIN, PLACED])], [true, false]);
        assert_eq!([find(&[PLAIN]), find(&[PLACED]), find(&[PLAIN, PLACED])], [Some(PLACED), Some(PLAIN), None]);
        let standing = |left_out: &[Hit], truth, answer| standing(&both(), &ray, left_out, truth, answer);
        assert_eq!(standing(&[PLAIN], PLACED, PLAIN), Standing::False);
        assert_eq!(standing(&[PLAIN], PLACED, Hit::NONE), Standing::Missed);
        assert_eq!(standing(&[PLAIN, PLACED], Hit::NONE, Hit::NONE), Standing::Same);
        assert_eq!(standing(&[], PLAIN, PLACED), Standing::Tie);
    }
}
