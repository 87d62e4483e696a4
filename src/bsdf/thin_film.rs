//! Reflectance of a thin film on a base: interference of what its two faces reflect, in linear sRGB.
//!
//! With real amplitudes r₁₂ and r₂₃ of the faces and the phase δ = 2π·D/λ of the path D = 2·n₂·d·cos θ₂ through the film and
//! back, Airy's sum is R = 1 − K·(1 − q²)/(1 − 2q·cos δ + q²), q = −r₁₂·r₂₃, K = (1−r₁₂²)(1−r₂₃²)/(1−q²). Poisson's kernel is
//! a series, 1 + 2·Σ qᵐ·cos mδ, so that a channel of weights w(λ) sees 1 − K·(1 + 2·Σ qᵐ·C(m·D)) with C(D) = Σ w(λ)·cos 2πD/λ:
//! the idea of Belcour and Barla 2017, *A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence*,
//! with C tabulated from the CIE's curves instead of fitted. As in `KHR_materials_iridescence`, the base has a real index that
//! makes its reflectance at normal incidence, per channel.

use crate::math::float::{max, min, safe_sqrt, sqr};
use crate::spectrum::{Rgb, reflectance_weights};
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Distance between entries of [`COHERENCE`] in nanometres: a 90th of the shortest wavelength that counts, where the error of
/// interpolation is 6·10⁻⁴.
const STEP_NM: f32 = 5.0;

/// Entries of [`COHERENCE`]: longer paths than 16 µm no channel tells from each other.
const STEPS: usize = 3200;

/// C of the head of the module by path.
static COHERENCE: LazyLock<Vec<[f32; 3]>> = LazyLock::new(|| {
    let weights = reflectance_weights();
    let entry = |i: usize| {
        let path = i as f64 * f64::from(STEP_NM);
        let mut sum = [0.0; 3];
        for (nm, weight) in &weights {
            let cos = libm::cos(TAU * path / nm);
            for (s, w) in sum.iter_mut().zip(weight) {
                *s += w * cos;
            }
        }
        sum.map(|s| s as f32)
    };
    (0..STEPS).map(entry).collect()
});

/// A film.
#[derive(Clone, Copy, Debug)]
pub(super) struct Film {
    /// Its index of refraction relative to the outside, at least 1.
    pub(super) eta: f32,
    /// Its thickness in nanometres.
    pub(super) thickness: f32,
}

/// The index of refraction that reflects `normal` at normal incidence.
#[inline]
fn index_of(normal: f32) -> f32 {
    /// Of a mirror the index would be infinite.
    const MOST: f32 = 0.9999;
    let root = min(max(normal, 0.0), MOST).sqrt();
    (1.0 + root) / (1.0 - root)
}

impl Film {
    /// Makes the table, that nobody has to wait for it later.
    pub(super) fn prepare() {
        LazyLock::force(&COHERENCE);
    }

    /// Reflectance under the cosine `cos` on the outside, on a base that by itself reflects `normal` at normal incidence.
    pub(super) fn reflectance(&self, cos: f32, normal: Rgb) -> Rgb {
        let cos = min(max(cos, 0.0), 1.0);
        let sin2 = (1.0 - cos) * (1.0 + cos);
        let cos_2 = safe_sqrt(1.0 - sin2 / sqr(self.eta));
        let path = 2.0 * self.eta * self.thickness * cos_2;
        let channel = |normal: f32, c: usize| {
            let base = index_of(normal);
            let cos_3 = safe_sqrt(1.0 - sin2 / sqr(base));
            let [s12, p12] = amplitudes(1.0, cos, self.eta, cos_2);
            let [s23, p23] = amplitudes(self.eta, cos_2, base, cos_3);
            0.5 * (airy(s12, s23, path, c) + airy(p12, p23, path, c))
        };
        let [r, g, b] = normal.to_array();
        Rgb::new(channel(r, 0), channel(g, 1), channel(b, 2))
    }
}

/// Amplitudes that the face from index `n` to `k` reflects, perpendicular and parallel (Born and Wolf, section 1.5.2).
#[inline]
fn amplitudes(n: f32, cos_n: f32, k: f32, cos_k: f32) -> [f32; 2] {
    let ratio = |a: f32, b: f32| if a + b > 0.0 { (a - b) / (a + b) } else { 0.0 };
    [ratio(n * cos_n, k * cos_k), ratio(k * cos_n, n * cos_k)]
}

/// What channel `channel` sees reflected.
#[inline]
fn airy(r12: f32, r23: f32, path: f32, channel: usize) -> f32 {
    /// What is left of the series then has no effect on an 8-bit picture, twice.
    const NEGLIGIBLE: f32 = 1e-4;
    /// Where the series converges slowly nearly everything is reflected, and K is small.
    const TERMS: usize = 24;
    let q = -r12 * r23;
    let rest = (1.0 - q) * (1.0 + q);
    if !(rest > 0.0) {
        return 1.0;
    }
    let k = (1.0 - r12) * (1.0 + r12) * (1.0 - r23) * (1.0 + r23) / rest;
    let (mut sum, mut power) = (1.0, 1.0f32);
    for m in 1..=TERMS {
        power *= q;
        if power.abs() < NEGLIGIBLE {
            break;
        }
        sum += 2.0 * power * coherence(m as f32 * path, channel);
    }
    min(max(1.0 - k * sum, 0.0), 1.0)
}

/// C of a path in nanometres.
#[inline]
fn coherence(path: f32, channel: usize) -> f32 {
    let x = path / STEP_NM;
    // NaN is far, too.
    if !(x < (STEPS - 1) as f32) {
        return 0.0;
    }
    let i = x as usize;
    let (a, b) = (COHERENCE[i][channel], COHERENCE[i + 1][channel]);
    a + (x - i as f32) * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::fresnel;

    #[test]
    fn without_thickness_there_is_no_film() {
        for cos in [1.0, 0.7, 0.3, 0.05] {
            let film = Film { eta: 1.3, thickness: 0.0 };
            let got = film.reflectance(cos, Rgb::splat(0.04)).0.x;
            let expected = fresnel::dielectric(cos, 1.5).reflectance;
            assert!((got - expected).abs() < 1e-3, "cosine {cos}: {got} instead of {expected}");
        }
    }

    #[test]
    fn a_thick_film_is_two_faces_without_phase() {
        // No channel tells the phase: R = r₁ + r₂·(1−r₁)²/(1−r₁r₂) at normal incidence.
        let film = Film { eta: 1.4, thickness: 1e5 };
        let (r1, r2) = (sqr(0.4f32 / 2.4), sqr((1.4f32 - 2.0) / 3.4));
        let expected = r1 + r2 * sqr(1.0 - r1) / (1.0 - r1 * r2);
        let got = film.reflectance(1.0, Rgb::splat(1.0 / 9.0)).0.x;
        assert!((got - expected).abs() < 1e-4, "{got} instead of {expected}");
    }

    #[test]
    fn channels_are_integrals_of_airy_s_formula() {
        // By wavelengths, without the series; the tolerance is that of the interpolation and of the terms left out.
        const ERROR: f64 = 2e-3;
        for (eta, thickness, normal, cos) in [
            (1.3f32, 400.0f32, 0.04f32, 1.0f32),
            (1.8, 250.0, 0.3, 0.6),
            (1.33, 900.0, 0.9, 0.3),
            (2.2, 150.0, 0.04, 0.1),
        ] {
            let got = Film { eta, thickness }.reflectance(cos, Rgb::splat(normal)).to_array();
            let sin2 = f64::from(1.0 - cos * cos);
            let base = f64::from(index_of(normal));
            let n = [1.0, f64::from(eta), base];
            let c = n.map(|n| (1.0 - sin2 / (n * n)).sqrt());
            let faces = |a: usize, b: usize| {
                let (s, p) = ((n[a] * c[a], n[b] * c[b]), (n[b] * c[a], n[a] * c[b]));
                [s, p].map(|(x, y)| (x - y) / (x + y))
            };
            let (f, g) = (faces(0, 1), faces(1, 2));
            let mut expected = [0.0; 3];
            for (nm, weight) in reflectance_weights() {
                let phase = TAU * 2.0 * n[1] * f64::from(thickness) * c[1] / nm;
                let r = |p: usize| {
                    let (a, b) = (f[p], g[p]);
                    let top = a * a + b * b + 2.0 * a * b * phase.cos();
                    top / (1.0 + a * a * b * b + 2.0 * a * b * phase.cos())
                };
                for (e, w) in expected.iter_mut().zip(weight) {
                    *e += 0.5 * w * (r(0) + r(1));
                }
            }
            for (got, e) in got.into_iter().zip(expected) {
                let e = e.clamp(0.0, 1.0);
                assert!((f64::from(got) - e).abs() < ERROR, "{eta} {thickness} {normal} {cos}: {got} instead of {e}");
            }
        }
    }
}
