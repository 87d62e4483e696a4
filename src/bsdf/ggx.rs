//! The GGX (Trowbridge–Reitz) distribution of microfacets, isotropic, sampled by visible normals.
//!
//! Symbols of the papers: α roughness, m (or ωm) the microfacet's normal, D its density, G₁ Smith's masking. Sources:
//! Walter et al. 2007, *Microfacet Models for Refraction through Rough Surfaces*; Heitz 2014, *Understanding the
//! Masking-Shadowing Function*; Heitz 2018, *Sampling the GGX Distribution of Visible Normals*; Dupuy and Benyoub 2023,
//! *Sampling Visible GGX Normals with Spherical Caps*.
//!
//! Masking and shadowing are taken as independent, G = G₁(wo)·G₁(wi), as Mitsuba takes them: the same file must give
//! the same picture.

use crate::math::float::{max, safe_sqrt, sqr};
use crate::sampling::warp::sin_cos;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Microfacets of roughness α.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ggx {
    alpha: f32,
}

impl Ggx {
    /// The smallest roughness: below it the squared slopes lose their digits in f32, and Mitsuba clamps there too.
    const MIN_ALPHA: f32 = 1e-4;

    /// Microfacets of roughness `alpha`, at least [`Self::MIN_ALPHA`].
    pub(super) fn new(alpha: f32) -> Self {
        Self { alpha: max(alpha, Self::MIN_ALPHA) }
    }

    /// Density of microfacets with normal `m` per solid angle and unit area of surface; `m` above the surface.
    #[inline]
    pub(super) fn d(&self, m: Vec3) -> f32 {
        let a2 = sqr(self.alpha);
        // In slopes: no cancellation of 1 − cos² where the roughness is small (Heitz 2014, equation 84).
        let e = (sqr(m.x) + sqr(m.y)) / a2 + sqr(m.z);
        1.0 / (PI * a2 * sqr(e))
    }

    /// Smith's masking: the visible fraction of the microfacets with normal `m` seen from `w`; 0 where `w` and `m`
    /// disagree about the side.
    #[inline]
    pub(super) fn g1(&self, w: Vec3, m: Vec3) -> f32 {
        if !(w.dot(m) * w.z > 0.0) {
            return 0.0;
        }
        // 2 / (1 + √(1 + α² tan²)), multiplied through by the cosine so that grazing directions stay finite.
        let c = w.z.abs();
        2.0 * c / (c + (sqr(c) + sqr(self.alpha) * (sqr(w.x) + sqr(w.y))).sqrt())
    }

    /// Density of [`Self::sample_visible`] per solid angle of `m` (Heitz 2018, equation 3); `w` above the surface.
    #[inline]
    pub(super) fn visible_pdf(&self, w: Vec3, m: Vec3) -> f32 {
        self.g1(w, m) * max(w.dot(m), 0.0) * self.d(m) / w.z
    }

    /// A microfacet normal as seen from `w`, above the surface: the half vector of a uniform direction in the spherical
    /// cap that a hemisphere of mirrors would reflect `w` into (Dupuy and Benyoub 2023, listing 3).
    #[inline]
    pub(super) fn sample_visible(&self, w: Vec3, u: Vec2) -> Vec3 {
        let stretched = Vec3::new(self.alpha * w.x, self.alpha * w.y, w.z).normalize();
        let (sin, cos) = sin_cos(TAU * u.x);
        let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
        let r = safe_sqrt((1.0 - z) * (1.0 + z));
        let half = Vec3::new(r * cos, r * sin, z) + stretched;
        Vec3::new(self.alpha * half.x, self.alpha * half.y, max(half.z, 0.0)).normalize_or(Vec3::Z)
    }
}
