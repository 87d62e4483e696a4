//! The microfacets of a clear coat: generalised Trowbridge–Reitz with exponent 1, whose tails are longer than GGX's
//! (Burley 2012, *Physically Based Shading at Disney*, appendix B.2).

use crate::math::float::{safe_sqrt, sqr};
use crate::sampling::warp::sin_cos_turns;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Isotropic microfacets.
pub(super) struct Gtr1 {
    alpha2: f32,
    /// −ln α².
    log: f32,
}

impl Gtr1 {
    /// Of roughness α in (0, 1).
    #[inline]
    pub(super) fn new(alpha: f32) -> Self {
        let alpha2 = sqr(alpha);
        Self { alpha2, log: -libm::logf(alpha2) }
    }

    /// Density of microfacets with normal `m` per solid angle and unit area of surface; `m` above the surface.
    #[inline]
    pub(super) fn d(&self, m: Vec3) -> f32 {
        // sin² + α² cos² as a sum: 1 − (1 − α²)·cos² would lose the digits of a narrow peak.
        (1.0 - self.alpha2) / (PI * self.log * (sqr(m.x) + sqr(m.y) + self.alpha2 * sqr(m.z)))
    }

    /// A microfacet's normal, with density D(m)·m.z: what is seen from above.
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> Vec3 {
        // sin² = α²·(α^(−2u) − 1) / (1 − α²).
        let sin2 = self.alpha2 * libm::expm1f(u.y * self.log) / (1.0 - self.alpha2);
        let (sin, cos) = sin_cos_turns(u.x);
        let r = safe_sqrt(sin2);
        Vec3::new(r * cos, r * sin, safe_sqrt(1.0 - sin2))
    }
}
