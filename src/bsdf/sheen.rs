//! Sheen: light that fibres scatter which stand up from the surface.
//!
//! Normals of the distribution D(m) = (2 + 1/α)·sin^(1/α) θ / 2π with the fitted masking of Estevez and Kulla 2017, *Production
//! Friendly Microfacet Sheen BRDF*, as `KHR_materials_sheen` has it: f·cos θi = D / ((1 + Λo + Λi)·4·cos θo).
//!
//! *Where we depart:* the fit does not preserve energy. Seen nearly edge-on the lobe would return more than there is (its
//! albedo grows as 1/cos θo), and is scaled down there, for both directions alike.

use super::energy::{Grid, Table};
use crate::math::float::{max, min, safe_sqrt, sqr};
use crate::math::quadrature::gauss_legendre;
use glam::Vec3;
use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

/// Sheen of some roughness.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sheen {
    alpha: f32,
}

/// The smallest α: even there the lobe is seen only where both directions are within a few degrees of the surface.
const MIN_ALPHA: f32 = 0.01;

/// Albedo times cosine, by cosine and the logarithm of α: 0 stands for the smallest, 1 for 1. The error is that of linear
/// interpolation between roughnesses, half a per cent.
static ALBEDO: LazyLock<Table<1>> = LazyLock::new(|| {
    /// Nodes over the cosine of the other direction, and over half of the azimuths.
    const COSINES: usize = 32;
    const AZIMUTHS: usize = 24;
    let (cosines, azimuths) = (gauss_legendre(COSINES), gauss_legendre(AZIMUTHS));
    Table::new(Grid::Root, |row, cos| {
        let sheen = Sheen { alpha: libm::powf(MIN_ALPHA, 1.0 - row.sqrt()) };
        let wo = Vec3::new(safe_sqrt(1.0 - sqr(cos)), 0.0, cos);
        let masking = sheen.lambda(cos);
        let mut sum = 0.0;
        for &(z, weight) in &cosines {
            let (z, weight) = (z as f32, weight as f32);
            let (r, both) = (safe_sqrt(1.0 - sqr(z)), 1.0 + masking + sheen.lambda(z));
            let line = azimuths.iter().map(|&(x, w)| {
                let (sin, cos) = crate::sampling::warp::sin_cos(PI * x as f32);
                w as f32 * sheen.d((wo + Vec3::new(r * cos, r * sin, z)).normalize())
            });
            sum += weight * line.sum::<f32>() / (4.0 * both);
        }
        [TAU * sum]
    })
});

impl Sheen {
    /// Of a roughness in [0, 1], the root of α.
    pub(super) fn new(roughness: f32) -> Self {
        Self { alpha: max(sqr(roughness), MIN_ALPHA) }
    }

    /// Makes the table, that nobody has to wait for it later.
    pub(super) fn prepare() {
        LazyLock::force(&ALBEDO);
    }

    /// Density of normals.
    #[inline]
    fn d(&self, m: Vec3) -> f32 {
        /// Nobody sees less, and it would soon be below the normal numbers.
        const NEGLIGIBLE: f32 = 1e-20;
        let exponent = 1.0 / self.alpha;
        // Of sin², whose root is not worth taking.
        let sin2 = sqr(m.x) + sqr(m.y);
        let part = libm::powf(sin2, 0.5 * exponent);
        if part > NEGLIGIBLE { (2.0 + exponent) * part / TAU } else { 0.0 }
    }

    /// Λ under the cosine `cos`: a fit between a smooth and a rough one (section 3 of the paper).
    #[inline]
    fn lambda(&self, cos: f32) -> f32 {
        const ROUGH: [f32; 5] = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
        const SMOOTH: [f32; 5] = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
        let part = sqr(1.0 - min(self.alpha, 1.0));
        let [a, b, c, d, e] = std::array::from_fn(|i| ROUGH[i] + part * (SMOOTH[i] - ROUGH[i]));
        let fit = |x: f32| a / (1.0 + b * libm::powf(x, c)) + d * x + e;
        let exponent = if cos < 0.5 { fit(cos) } else { 2.0 * fit(0.5) - fit(max(1.0 - cos, 0.0)) };
        libm::expf(exponent)
    }

    /// The fit's albedo times cosine.
    #[inline]
    fn scaled_albedo(&self, cos: f32) -> f32 {
        // The table takes the root.
        ALBEDO.at(sqr(1.0 - libm::logf(self.alpha) / libm::logf(MIN_ALPHA)), cos)[0]
    }

    /// What comes back of white light seen under the cosine `cos`, at most 1.
    #[inline]
    pub(super) fn albedo(&self, cos: f32) -> f32 {
        // 0/0 counts as everything.
        min(self.scaled_albedo(cos) / cos, 1.0)
    }

    /// Value times cos θi; both directions are above.
    #[inline]
    pub(super) fn value(&self, wo: Vec3, wi: Vec3) -> f32 {
        let Some(m) = (wo + wi).try_normalize() else { return 0.0 };
        let albedo = |cos: f32| max(self.scaled_albedo(cos) / cos, 1.0);
        let scale = max(albedo(wo.z), albedo(wi.z));
        // The quotient of what grows comes first: it stays finite where the cosine is tiny.
        self.d(m) / (4.0 * (1.0 + self.lambda(wo.z) + self.lambda(wi.z)) * max(wo.z * scale, f32::MIN_POSITIVE))
    }
}
