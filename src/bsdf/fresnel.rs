//! Fresnel reflectance of dielectrics and conductors, for unpolarised light.

use crate::math::float::{max, min, safe_sqrt, sqr};
use crate::spectrum::Rgb;

/// What an interface does to light that meets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Interface {
    /// Reflectance in [0, 1].
    pub(super) reflectance: f32,
    /// 1 − reflectance, which keeps its digits where nearly everything is reflected.
    pub(super) transmittance: f32,
    /// |cos| of the refracted direction; 0 under total internal reflection.
    pub(super) cos_t: f32,
}

/// A dielectric interface for light that meets it under the cosine `cos_i` in [0, 1], where `eta` is the index of
/// refraction beyond the interface relative to that in front of it.
#[inline]
pub(super) fn dielectric(cos_i: f32, eta: f32) -> Interface {
    // sin² from (1 − cos)(1 + cos): near grazing it is cos that has the digits, near normal 1 − cos is exact.
    let sin2_i = max((1.0 - cos_i) * (1.0 + cos_i), 0.0);
    let cos2_t = 1.0 - sin2_i / sqr(eta);
    // Also where cos_i is NaN: no transmission.
    if !(cos2_t > 0.0) {
        return Interface { reflectance: 1.0, transmittance: 0.0, cos_t: 0.0 };
    }
    refraction(cos_i, cos2_t.sqrt(), eta)
}

/// The same where light is known to be refracted, to a direction with the cosine `cos_t` (Born and Wolf, *Principles of
/// Optics*, section 1.5.2).
#[inline]
pub(super) fn refraction(cos_i: f32, cos_t: f32, eta: f32) -> Interface {
    let (parallel, perpendicular) = (eta * cos_i + cos_t, cos_i + eta * cos_t);
    let r_parallel = (eta * cos_i - cos_t) / parallel;
    let r_perpendicular = (cos_i - eta * cos_t) / perpendicular;
    let through = 2.0 * eta * cos_i * cos_t;
    Interface {
        reflectance: min(0.5 * (sqr(r_parallel) + sqr(r_perpendicular)), 1.0),
        transmittance: min(through / sqr(parallel) + through / sqr(perpendicular), 1.0),
        cos_t,
    }
}

/// How reflectance rises from normal incidence to the horizon, for an interface of some index: in terms of g, which is 0 at
/// normal incidence and 1 where everything is reflected, it is r₀ + (1 − r₀)·g. Schlick's approximation of g is (1 − cos)⁵.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contrast {
    /// The reflectance r₀ at normal incidence.
    pub(super) normal: f32,
}

impl Contrast {
    /// Of the index of refraction inside relative to outside.
    #[inline]
    pub(super) fn new(eta: f32) -> Self {
        Self { normal: sqr((eta - 1.0) / (eta + 1.0)) }
    }

    /// g where the interface's reflectance is `reflectance`.
    #[inline]
    pub(super) fn part(self, reflectance: f32) -> f32 {
        // Where there is an interface at all, an index below 10⁷ leaves something.
        if self.normal < 1.0 { (reflectance - self.normal) / (1.0 - self.normal) } else { 0.0 }
    }
}

/// Reflectance of a conductor with index η − ik relative to the outside, for light under the cosine `cos_i` in [0, 1],
/// per channel. The exact equations for a complex index (Born and Wolf, section 14.2), arranged after Lagarde 2013,
/// *Memo on Fresnel equations*.
#[inline]
pub(super) fn conductor(cos_i: f32, eta: Rgb, k: Rgb) -> Rgb {
    let channel = |eta: f32, k: f32| {
        let cos2 = sqr(cos_i);
        let sin2 = max((1.0 - cos_i) * (1.0 + cos_i), 0.0);
        let t0 = sqr(eta) - sqr(k) - sin2;
        let a2_plus_b2 = safe_sqrt(sqr(t0) + sqr(2.0 * eta * k));
        let t1 = a2_plus_b2 + cos2;
        let t2 = 2.0 * cos_i * safe_sqrt(0.5 * (a2_plus_b2 + t0));
        let perpendicular = (t1 - t2) / (t1 + t2);
        let t3 = cos2 * a2_plus_b2 + sqr(sin2);
        let t4 = t2 * sin2;
        let parallel = perpendicular * (t3 - t4) / (t3 + t4);
        let r = 0.5 * (parallel + perpendicular);
        // 0/0 only exactly at grazing incidence with nothing to refract; everything reflects there.
        if r.is_finite() { r.clamp(0.0, 1.0) } else { 1.0 }
    };
    let ([e0, e1, e2], [k0, k1, k2]) = (eta.to_array(), k.to_array());
    Rgb::new(channel(e0, k0), channel(e1, k1), channel(e2, k2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectric_at_normal_incidence_and_beyond_the_critical_angle() {
        for eta in [1.1f32, 1.5, 2.4, 1.0 / 1.5] {
            let expected = sqr((eta - 1.0) / (eta + 1.0));
            assert!((dielectric(1.0, eta).reflectance - expected).abs() < 1e-6, "eta {eta}");
            assert!((dielectric(0.0, eta).reflectance - 1.0).abs() < 1e-6, "grazing, eta {eta}");
        }
        let critical = (1.0f32 - sqr(1.0 / 1.5)).sqrt();
        assert_eq!(dielectric(critical - 1e-3, 1.0 / 1.5).reflectance, 1.0);
        assert!(dielectric(critical + 1e-3, 1.0 / 1.5).reflectance < 1.0);
        // No interface: everything passes, straight on.
        assert!(dielectric(0.3, 1.0).reflectance < 1e-12);
    }

    #[test]
    fn transmittance_is_what_is_not_reflected() {
        for i in 0..=1000 {
            for eta in [1.0f32, 1.5, 2.4, 1.0 / 1.5, 1.0 + 1e-6] {
                let interface = dielectric(i as f32 / 1000.0, eta);
                let sum = interface.reflectance + interface.transmittance;
                // Where both cosines are 0 everything is 0/0, and counts as reflected.
                assert!((sum - 1.0).abs() < 1e-6, "cos {i}/1000, eta {eta}: {interface:?}");
            }
        }
    }

    #[test]
    fn conductor_without_absorption_is_a_dielectric() {
        for i in 1..=100 {
            let cos = i as f32 / 100.0;
            for eta in [1.2f32, 1.5, 3.0] {
                let (c, d) = (conductor(cos, Rgb::splat(eta), Rgb::BLACK).0.x, dielectric(cos, eta).reflectance);
                assert!((c - d).abs() < 1e-5, "cos {cos} eta {eta}: {c} {d}");
            }
        }
        // A perfect mirror, as Mitsuba's preset `none` is.
        assert_eq!(conductor(0.4, Rgb::BLACK, Rgb::WHITE), Rgb::WHITE);
    }
}
