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
//! So with eᵢ = u·|pᵢ| + γ₈·Eᵢ the origin is moved along the geometric normal n by δ = Σ|nᵢ|·eᵢ, in f64, and then rounded
//! to f32 away from the surface. It follows pbrt-v4 section 6.8.6 with the bound of the hit point replaced by that of its
//! rounding, and the extents after Andersson et al. 2023, *Solving Self-Intersection Artifacts in DirectX Raytracing*.
//! The factor 8 covers Embree's test; our own decides doubtful cases in f64 and needs none of it.

use crate::math::float::{UNIT_ROUNDOFF, gamma, round_down, round_up};
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
    /// Extent of the primitive along each axis, as far as an f32 intersection test's error depends on it (zero for
    /// primitives that are intersected in f64).
    pub extent: Vec3,
}

impl SurfacePoint {
    /// The origin of a ray that leaves the surface in direction `w`, on the side that `w` points to.
    #[inline]
    pub fn origin_towards(&self, w: Vec3) -> Vec3 {
        self.offset(w, self.extent)
    }

    /// The end of a segment that comes from the side `w` points to and has these absolute extents along the axes: near
    /// the surface, but before it. The farther away an intersection test starts, the more it errs.
    #[inline]
    pub fn end_towards(&self, w: Vec3, segment: Vec3) -> Vec3 {
        self.offset(w, self.extent + segment)
    }

    #[inline]
    fn offset(&self, w: Vec3, extent: Vec3) -> Vec3 {
        let n = if self.n.dot(w) < 0.0 { -self.n } else { self.n };
        let e = UNIT_ROUNDOFF * self.p.abs().as_vec3() + gamma(INTERSECTION_ROUNDINGS) * extent;
        let delta = f64::from(n.abs().dot(e));
        let moved = self.p + n.as_dvec3() * delta;
        let away = |x: f64, n: f32| {
            if n > 0.0 {
                round_up(x)
            } else if n < 0.0 {
                round_down(x)
            } else {
                x as f32
            }
        };
        Vec3::new(away(moved.x, n.x), away(moved.y, n.y), away(moved.z, n.z))
    }
}
