//! How a ray avoids its own origin: the one place where a point is moved off its surface.
//!
//! Every hit point is computed in f64 from the primitive's f32 vertices, so it lies on its surface to about 10⁻¹⁵ of the
//! coordinates. What remains is
//!
//! - rounding the point to f32, at most u·|pᵢ| along axis i (u = 2⁻²⁴), and
//! - what an f32 ray–primitive test may err by: it rounds the vertices' positions relative to the origin and the
//!   products made of them, which displaces the primitive by a few u times its extent Eᵢ along each axis. Measured in
//!   the direction of the normal, an axis-aligned plane is exact.
//!
//! So the origin is moved along the geometric normal n by δ = 2u·Σ|nᵢpᵢ| + γ₈·Σ|nᵢ|Eᵢ, in f64, and rounded to f32. The
//! first u pays for the rounding, the second leaves the point strictly off its surface; along an axis-aligned plane's
//! normal, where the point's own coordinate is all there is, an f32 test has nothing to err by. What doubtful cases are
//! decided by, the distance in f64, has: it rounds along all axes. Where that coordinate is 0, nothing else would keep
//! the origin from its plane, so δ grows by γ₃₂·ΣEᵢ of f64, which is 2⁻²⁴ of an f32's rounding. It follows pbrt-v4 section
//! 6.8.6 with the bound of the hit point replaced by that of its rounding, and the extents after Andersson et al. 2023,
//! *Solving Self-Intersection Artifacts in DirectX Raytracing*. The factor 8 covers Embree's test; our own decides
//! doubtful cases in f64 and needs none of it.
//!
//! Curved surfaces are met in f64, but the rounding of the origin along the surface, by at most u·|p|, takes it to the outside by
//! the sagitta ½κ·(u·|p|)², κ being the largest curvature there. Where n is nearly perpendicular to p that is more than the rounding
//! along n, so that rays inside of thin things would meet them at once. δ of a curved surface grows by twice that.

use crate::math::float::{UNIT_ROUNDOFF, gamma};
use glam::{DVec3, Vec3};

/// Rounded operations that a primitive's extent passes through in an f32 ray–triangle test, with a margin of two.
const INTERSECTION_ROUNDINGS: u32 = 8;

/// What the distance to a triangle in f64 may err by along its normal, relative to its extents: moving and shearing a
/// vertex are four roundings a coordinate, √2 of which show along the normal; the edge functions are three of a product of
/// two, their quotient and the sum behind it six more. A grazing view magnifies the distance, not the height. Twice that.
const EXACT_ROUNDINGS: f32 = 32.0 * (f64::EPSILON / 2.0) as f32;

/// A point of a surface with what bounds its error.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// The point, on the surface to f64 accuracy.
    pub p: DVec3,
    /// Unit geometric normal of the front side; zero of a point in free space, which needs no offset.
    pub n: Vec3,
    /// What an intersection test may displace the primitive by, along n: zero for primitives that are intersected in
    /// f64; of curved ones, what rounding along the surface amounts to.
    pub slack: f32,
}

/// What an f32 intersection test, and the f64 one behind it, may displace a primitive with unit normal `n` by, along n,
/// where they see these extents along the axes.
#[inline]
pub(super) fn slack(n: Vec3, extent: Vec3) -> f32 {
    gamma(INTERSECTION_ROUNDINGS) * n.abs().dot(extent) + exact_slack(extent.element_sum())
}

/// What the intersection test in f64 alone may displace a primitive by along any axis, where the sum of the extents along
/// the axes is this.
#[inline]
pub(super) fn exact_slack(extents: f32) -> f32 {
    EXACT_ROUNDINGS * extents
}

/// What the rounding of a point along a surface of this curvature takes it off to the outside by, twice; what is smaller than the
/// rounding it may leave by all of that.
#[inline]
pub(super) fn sagitta(p: DVec3, curvature: f64) -> f32 {
    let along = UNIT_ROUNDOFF * p.length() as f32;
    (along * along * curvature as f32).min(2.0 * along)
}

impl SurfacePoint {
    /// The origin of a ray that leaves the surface in direction `w`, on the side that `w` points to.
    #[inline]
    pub fn origin_towards(&self, w: Vec3) -> Vec3 {
        self.offset(w, self.slack).as_vec3()
    }

    /// The end of a segment that comes from the side `w` points to and has these absolute extents along the axes: near
    /// the surface, but before it. The farther away an intersection test starts, the more it errs.
    #[inline]
    pub fn end_towards(&self, w: Vec3, segment: Vec3) -> Vec3 {
        self.before(w, segment).as_vec3()
    }

    /// The same before its coordinates are rounded: where several surfaces meet, each moves it in turn.
    #[inline]
    pub fn before(&self, w: Vec3, segment: Vec3) -> DVec3 {
        self.offset(w, self.slack + slack(self.n, segment))
    }

    #[inline]
    fn offset(&self, w: Vec3, slack: f32) -> DVec3 {
        let delta = 2.0 * UNIT_ROUNDOFF * self.n.abs().dot(self.p.abs().as_vec3()) + slack;
        let delta = delta.copysign(self.n.dot(w));
        self.p + self.n.as_dvec3() * f64::from(delta)
    }
}
