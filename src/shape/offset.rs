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
//! normal, where the point's own coordinate is all there is, a test has nothing to err by. It follows pbrt-v4 section
//! 6.8.6 with the bound of the hit point replaced by that of its rounding, and the extents after Andersson et al. 2023,
//! *Solving Self-Intersection Artifacts in DirectX Raytracing*. The factor 8 covers Embree's test; our own decides
//! doubtful cases in f64 and needs none of it.

use crate::math::float::{UNIT_ROUNDOFF, gamma};
use glam::{DVec3, Vec3};

/// Rounded operations that a primitive's extent passes through in an f32 ray–triangle test, with a margin of two.
const INTERSECTION_ROUNDINGS: u32 = 8;

/// A point of a surface with what bounds its error.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// The point, on the surface to f64 accuracy.
    pub p: DVec3,
    /// Unit geometric normal of the front side.
    pub n: Vec3,
    /// What an f32 intersection test may displace the primitive by, along n: zero for primitives that are intersected in
    /// f64.
    pub slack: f32,
}

/// What an f32 intersection test may displace a primitive with unit normal `n` by, along n, where it sees these extents
/// along the axes.
#[inline]
pub(super) fn slack(n: Vec3, extent: Vec3) -> f32 {
    gamma(INTERSECTION_ROUNDINGS) * n.abs().dot(extent)
}

impl SurfacePoint {
    /// The origin of a ray that leaves the surface in direction `w`, on the side that `w` points to.
    #[inline]
    pub fn origin_towards(&self, w: Vec3) -> Vec3 {
        self.offset(w, self.slack)
    }

    /// The end of a segment that comes from the side `w` points to and has these absolute extents along the axes: near
    /// the surface, but before it. The farther away an intersection test starts, the more it errs.
    #[inline]
    pub fn end_towards(&self, w: Vec3, segment: Vec3) -> Vec3 {
        self.offset(w, self.slack + slack(self.n, segment))
    }

    #[inline]
    fn offset(&self, w: Vec3, slack: f32) -> Vec3 {
        let delta = 2.0 * UNIT_ROUNDOFF * self.n.abs().dot(self.p.abs().as_vec3()) + slack;
        let delta = delta.copysign(self.n.dot(w));
        (self.p + self.n.as_dvec3() * f64::from(delta)).as_vec3()
    }
}
