//! Distributions of microfacets, Beckmann's and GGX (Trowbridge and Reitz), isotropic or not, sampled by visible normals.
//!
//! Symbols of the papers: α roughness along the tangents s and t, m (or ωm) the microfacet's normal, D its density, G₁
//! Smith's masking. Sources: Walter et al. 2007, *Microfacet Models for Refraction through Rough Surfaces*; Heitz 2014,
//! *Understanding the Masking-Shadowing Function*; Heitz and d'Eon 2014, *Importance Sampling Microfacet-Based BSDFs using
//! the Distribution of Visible Normals*; Dupuy and Benyoub 2023, *Sampling Visible GGX Normals with Spherical Caps*; Tokuyoshi
//! and Eto 2023, *Bounded VNDF Sampling for Smith–GGX Reflections*, and 2024, *Bounded VNDF Sampling for the Smith-GGX BRDF*.
//!
//! Lobes that only reflect, so that directions into the surface would be lost, sample GGX within a bound of Tokuyoshi and Eto
//! ([`Microfacets::sample_mirrored`]); whatever chooses between reflection and refraction at the sampled normal cannot.
//!
//! Masking and shadowing are taken as independent, G = G₁(wo)·G₁(wi), and Beckmann's G₁ is Walter's rational
//! approximation, as in Mitsuba: the same file must give the same picture. *Where we depart:* the density of visible
//! normals has Beckmann's exact G₁, because that is what is sampled; Mitsuba's density has the approximation there, too,
//! which is off by up to 0.35 % and biases what it finds by bsdf sampling by as much.

use super::beckmann;
use crate::math::float::{max, min, safe_sqrt, sqr};
use crate::sampling::warp::{sin_cos_turns, square_to_disk};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// The shape of a distribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Slopes of a Gaussian random surface.
    Beckmann,
    /// Slopes with long tails; Trowbridge and Reitz 1975.
    Ggx,
}

/// Microfacets of a shape and a roughness along each tangent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacets {
    distribution: Distribution,
    alpha: Vec2,
    /// Whether roughness that is given later is raised, too: see [`Self::regularized`].
    raises: bool,
}

/// How much of the microfacets is seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// G₁ as the value of a bsdf has it.
    pub(super) masking: f32,
    /// G₁ as it normalises the density of visible normals.
    pub(super) visible: f32,
}

/// What microfacets that are mirrors show to a direction above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mirrored {
    /// G₁/cos θ.
    pub(super) masking: f32,
    /// Density of [`Microfacets::sample_mirrored`] per solid angle of the reflected direction, over D/4.
    pub(super) density: f32,
}

impl Microfacets {
    /// The smallest roughness: below it the squared slopes lose their digits in f32, and Mitsuba clamps there too.
    pub(super) const MIN_ALPHA: f32 = 1e-4;

    /// Microfacets of roughness `alpha_u` along the first tangent and `alpha_v` along the second, at least
    /// [`Self::MIN_ALPHA`].
    pub fn new(distribution: Distribution, alpha_u: f32, alpha_v: f32) -> Self {
        let alpha = Vec2::new(max(alpha_u, Self::MIN_ALPHA), max(alpha_v, Self::MIN_ALPHA));
        Self { distribution, alpha, raises: false }
    }

    /// The least roughness of what is regularized.
    pub(super) const REGULARIZED_ALPHA: f32 = 0.1;

    /// The roughness of the twin that a path meets once it is regularized (pbrt-v4's `TrowbridgeReitzDistribution::Regularize`).
    /// Kaplanyan and Dachsbacher 2013, *Path Space Regularization for Holistic and Robust Light Transport*, widen lobes until light
    /// can be sampled for them, and no more.
    #[inline]
    pub(super) fn regularized_alpha(alpha: f32) -> f32 {
        /// What is as rough as this is found well as it is.
        const ROUGH_ENOUGH: f32 = 0.3;
        if alpha < ROUGH_ENOUGH { (2.0 * alpha).clamp(Self::REGULARIZED_ALPHA, ROUGH_ENOUGH) } else { alpha }
    }

    /// Those of what was smooth.
    pub(super) fn of_smooth_twin() -> Self {
        Self::new(Distribution::Ggx, 0.0, 0.0).regularized()
    }

    /// Rougher ones, as is whatever roughness they are given later.
    #[must_use]
    pub(super) fn regularized(self) -> Self {
        let alpha = Vec2::new(Self::regularized_alpha(self.alpha.x), Self::regularized_alpha(self.alpha.y));
        Self { alpha, raises: true, ..self }
    }

    /// The roughness that is meant by `alpha`.
    #[inline]
    fn meant(&self, alpha: f32) -> f32 {
        let alpha = max(alpha, Self::MIN_ALPHA);
        if self.raises { Self::regularized_alpha(alpha) } else { alpha }
    }

    /// Another roughness along the first tangent, at least [`Self::MIN_ALPHA`].
    #[inline]
    pub(super) fn set_alpha_u(&mut self, alpha: f32) {
        self.alpha.x = self.meant(alpha);
    }

    /// Another roughness along the second tangent, at least [`Self::MIN_ALPHA`].
    #[inline]
    pub(super) fn set_alpha_v(&mut self, alpha: f32) {
        self.alpha.y = self.meant(alpha);
    }

    /// Of another shape.
    #[inline(always)]
    pub(super) fn of_shape(&self, distribution: Distribution) -> Self {
        Self { distribution, ..*self }
    }

    /// Its shape.
    #[inline]
    pub(super) fn distribution(&self) -> Distribution {
        self.distribution
    }

    /// Whether it matters where the tangents point.
    pub fn is_anisotropic(&self) -> bool {
        self.alpha.x != self.alpha.y
    }

    /// α², of uneven ones the product.
    #[inline]
    pub(super) fn alpha_squared(&self) -> f32 {
        self.alpha.x * self.alpha.y
    }

    /// The smaller roughness.
    pub(super) fn smallest_alpha(&self) -> f32 {
        self.alpha.min_element()
    }

    /// See [`super::Bsdf::scatters_everywhere`]. `sure` says that something else scatters in all directions in all channels.
    pub(super) fn scatters_everywhere(&self, sure: bool) -> bool {
        /// The least α: what is still narrower is a mirror that shares nothing but the work.
        const LEAST: f32 = 1e-3;
        // Beckmann's density far from the normal is too small for f32; that of GGX is α²/π and more.
        self.smallest_alpha() >= LEAST && (sure || self.distribution == Distribution::Ggx)
    }

    /// Density of microfacets with normal `m` per solid angle and unit area of surface; `m` above the surface.
    #[inline]
    pub(super) fn d(&self, m: Vec3) -> f32 {
        let a = self.alpha;
        // In slopes: no cancellation of 1 − cos² where the roughness is small (Heitz 2014, appendix A).
        let (slope2_cos2, cos2) = (sqr(m.x / a.x) + sqr(m.y / a.y), sqr(m.z));
        match self.distribution {
            Distribution::Ggx => 1.0 / (PI * a.x * a.y * sqr(slope2_cos2 + cos2)),
            Distribution::Beckmann => {
                /// From here on exp(−x) is 0 in f32; a library says so in some hundred cycles, for it signals an underflow.
                const NOTHING_LEFT: f32 = 104.0;
                let e = if slope2_cos2 < NOTHING_LEFT * cos2 { libm::expf(-slope2_cos2 / cos2) } else { 0.0 };
                // Zero before the cosines can be; NaN falls here, too.
                if e > 0.0 { e / (PI * (a.x * cos2) * (a.y * cos2)) } else { 0.0 }
            }
        }
    }

    /// Smith's masking: the visible fraction of the microfacets with normal `m` seen from `w`; 0 where `w` and `m`
    /// disagree about the side.
    #[inline]
    pub(super) fn g1(&self, w: Vec3, m: Vec3) -> f32 {
        if w.dot(m) * w.z > 0.0 { self.masking(self.cos_and_spread(w)) } else { 0.0 }
    }

    /// What is seen from `w`, which must not lie in the surface.
    #[inline]
    pub(super) fn view(&self, w: Vec3) -> View {
        let (cos, spread) = self.cos_and_spread(w);
        let masking = self.masking((cos, spread));
        let visible = match self.distribution {
            Distribution::Ggx => masking,
            Distribution::Beckmann => beckmann::exact_g1(cos / spread),
        };
        View { masking, visible }
    }

    /// What is seen from `w`, above the surface, where all facets are mirrors.
    #[inline]
    pub(super) fn mirrored(&self, w: Vec3) -> Mirrored {
        let (cos, spread) = self.cos_and_spread(w);
        // The quotients by the cosine come before any product: they stay finite where the cosine is tiny.
        match self.distribution {
            Distribution::Ggx => {
                let root = (sqr(cos) + sqr(spread)).sqrt();
                Mirrored { masking: 2.0 / (cos + root), density: 2.0 / (self.bound(w) * cos + root) }
            }
            Distribution::Beckmann => {
                Mirrored { masking: beckmann::g1(cos / spread) / cos, density: beckmann::exact_g1(cos / spread) / cos }
            }
        }
    }

    /// By what the lower end of the spherical cap of visible normals is multiplied so that it still has all that reflect `w` to
    /// above the surface (Tokuyoshi and Eto 2024; of two roughnesses the smaller): at most 1.
    #[inline]
    fn bound(&self, w: Vec3) -> f32 {
        let a2 = sqr(min(self.alpha.min_element(), 1.0));
        let s2 = sqr(1.0 + w.truncate().length());
        (1.0 - a2) * s2 / (s2 + a2 * sqr(w.z))
    }

    /// |cos θ| and √(α_u² cos²φ + α_v² sin²φ)·sin θ; their quotient is 1/(α tan θ).
    #[inline]
    fn cos_and_spread(&self, w: Vec3) -> (f32, f32) {
        (w.z.abs(), (self.alpha * w.truncate()).length())
    }

    #[inline]
    fn masking(&self, (cos, spread): (f32, f32)) -> f32 {
        match self.distribution {
            // 2 / (1 + √(1 + α² tan²)), multiplied through by the cosine so that grazing directions stay finite.
            Distribution::Ggx => 2.0 * cos / (cos + (sqr(cos) + sqr(spread)).sqrt()),
            Distribution::Beckmann => beckmann::g1(cos / spread),
        }
    }

    /// Density of [`Self::sample_visible`] per solid angle of `m` (Heitz 2014, equation 16), given what is seen from `w`.
    #[inline]
    pub(super) fn visible_pdf(&self, w: Vec3, view: View, m: Vec3) -> f32 {
        // The quotient first: it stays finite where the cosine is tiny.
        (view.visible / w.z.abs()) * w.dot(m).abs() * self.d(m)
    }

    /// A microfacet normal as seen from `w`, above the surface.
    #[inline]
    pub(super) fn sample_visible(&self, w: Vec3, u: Vec2) -> Vec3 {
        match self.distribution {
            Distribution::Ggx => self.sample_ggx(w, 1.0, u),
            Distribution::Beckmann => self.sample_beckmann(w, u),
        }
    }

    /// The direction that `w`, above the surface, is reflected to by a microfacet: for GGX a bounded set of them, which spares
    /// most of those that would reflect into the surface.
    #[inline]
    pub(super) fn sample_mirrored(&self, w: Vec3, u: Vec2) -> Vec3 {
        let m = match self.distribution {
            Distribution::Ggx => self.sample_ggx(w, self.bound(w), u),
            Distribution::Beckmann => self.sample_beckmann(w, u),
        };
        (2.0 * w.dot(m) * m - w).normalize()
    }

    /// The half vector of a uniform direction in the spherical cap that a hemisphere of mirrors would reflect `w` into
    /// (Dupuy and Benyoub 2023, listing 3), whose lower end is `bound` times as low.
    #[inline]
    fn sample_ggx(&self, w: Vec3, bound: f32, u: Vec2) -> Vec3 {
        let stretched = (self.alpha * w.truncate()).extend(w.z).normalize();
        let (sin, cos) = sin_cos_turns(u.x);
        let lowest = bound * stretched.z;
        let z = (1.0 - u.y) * (1.0 + lowest) - lowest;
        let r = safe_sqrt((1.0 - z) * (1.0 + z));
        let half = Vec3::new(r * cos, r * sin, z) + stretched;
        (self.alpha * half.truncate()).extend(max(half.z, 0.0)).normalize_or(Vec3::Z)
    }

    /// What [`Self::visible_line`] makes of a uniform number for what is across the plane of view.
    pub(super) fn across(&self, u: f32) -> f32 {
        match self.distribution {
            Distribution::Ggx => u,
            Distribution::Beckmann => beckmann::slope(u),
        }
    }

    /// Microfacet normals as seen from `w`, which lies in the plane of z and x, by two uniform numbers: `along`, and that of
    /// the function, which decides what is across that plane, symmetrically, and has been through [`Self::across`]: it is the
    /// same whatever the view. Like [`Self::sample_visible`], but for GGX by
    /// another map, from a hemisphere that is seen as a disk and half a disk (Heitz 2018, *Sampling the GGX Distribution of
    /// Visible Normals*), which is Mitsuba's: for quadratures whose result is to be Mitsuba's, error included.
    #[inline(always)]
    pub(super) fn visible_line(&self, w: Vec3, along: f32) -> impl Fn(f32) -> Vec3 {
        let Self { distribution, alpha, .. } = *self;
        let t = (alpha * w.truncate()).extend(w.z).normalize();
        let slope = match distribution {
            Distribution::Ggx => 0.0,
            Distribution::Beckmann => beckmann::visible_slope(f64::from(t.z) / f64::from(t.x), along),
        };
        #[inline(always)]
        move |across| {
            if distribution == Distribution::Beckmann {
                let slope = alpha * Vec2::new(slope, across);
                return (-slope).extend(1.0).normalize();
            }
            let p = square_to_disk(Vec2::new(across, along));
            let s = 0.5 * (1.0 + t.z);
            let y = (1.0 - s) * safe_sqrt(1.0 - sqr(p.x)) + s * p.y;
            let z = safe_sqrt(1.0 - sqr(p.x) - sqr(y));
            // In the frame of t, the y axis, and what is perpendicular to both.
            let half = z * t + p.x * Vec3::Y + y * Vec3::new(-t.z, 0.0, t.x);
            (alpha * half.truncate()).extend(max(half.z, 0.0)).normalize_or(Vec3::Z)
        }
    }

    /// Slopes along and across the direction of view, as if the roughness were 1, then stretched (Heitz and d'Eon 2014,
    /// algorithm 1).
    #[inline]
    fn sample_beckmann(&self, w: Vec3, u: Vec2) -> Vec3 {
        let view = self.alpha * w.truncate();
        let spread = view.length();
        let to_view = if spread > 0.0 { view / spread } else { Vec2::X };
        let along = beckmann::visible_slope(f64::from(w.z) / f64::from(spread), u.x);
        let slope = self.alpha * to_view.rotate(Vec2::new(along, beckmann::slope(u.y)));
        (-slope).extend(1.0).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Sampler, SamplerKind};

    #[test]
    fn bounds_lose_fewer_directions_and_none_that_is_above() {
        // The same 10⁴ independent numbers with and without a bound: what is lost below the surface is what bounding is for.
        // At α = 1 the bound cuts the cap to a hemisphere, and the loss at least in half.
        const SAMPLES: u32 = 10_000;
        for alpha in [Vec2::splat(0.05), Vec2::splat(0.5), Vec2::splat(1.0), Vec2::new(0.3, 0.9), Vec2::splat(1.5)] {
            for cos in [1.0, 0.7, 0.3, 0.02] {
                let facets = Microfacets::new(Distribution::Ggx, alpha.x, alpha.y);
                let sine = safe_sqrt(1.0 - sqr(cos));
                let w = Vec3::new(0.6 * sine, 0.8 * sine, cos);
                let view = facets.mirrored(w);
                let (mut lost, mut unbounded, mut outside) = (0, 0, 0);
                for i in 0..SAMPLES {
                    let u = Sampler { kind: SamplerKind::Independent, seed: 8 }.stream(0, 0, i).film();
                    lost += u32::from(facets.sample_mirrored(w, u).z <= 0.0);
                    let m = facets.sample_visible(w, u);
                    let wi = 2.0 * w.dot(m) * m - w;
                    unbounded += u32::from(wi.z <= 0.0);
                    // The half vector's height in the cap, of what leaves above the surface.
                    let stretched = (facets.alpha * w.truncate()).extend(w.z).normalize();
                    let standard = (m.truncate() / facets.alpha).extend(m.z).normalize();
                    let height = (2.0 * stretched.dot(standard) * standard - stretched).z;
                    outside += u32::from(wi.z > 1e-4 && height < -facets.bound(w) * stretched.z - 1e-4);
                }
                assert_eq!(outside, 0, "{alpha}, {cos}: directions above the surface are beyond the bound");
                assert!(lost <= unbounded, "{alpha}, {cos}: {lost} lost, without a bound {unbounded}");
                // The density is that of the unbounded one over what the bound leaves.
                assert!(view.density >= view.masking, "{alpha}, {cos}: {view:?}");
                if alpha == Vec2::splat(1.0) {
                    assert!(lost < unbounded / 2 || unbounded == 0, "{alpha}, {cos}: {lost} lost, of {unbounded}");
                }
            }
        }
    }
}
