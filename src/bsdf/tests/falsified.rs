//! Seeded bugs, each of which the laws must reject. Where it can, a bug is consistent with itself (its samples carry the
//! wrong density, and the weight that follows from it), so that nothing but the law it breaks can find it.

use super::*;
use crate::check::laws::table::{glass, metal};
use crate::math::float::sqr;

/// A bsdf whose density is wrong by a factor.
struct WrongPdf<F> {
    bsdf: Bsdf,
    factor: F,
}

impl<F: Fn(Vec3, Vec3) -> f32> Subject for WrongPdf<F> {
    fn value_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        let (f, p) = self.bsdf.eval_pdf(wo, wi);
        (f, p * (self.factor)(wo, wi))
    }

    fn draw(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let s = self.bsdf.sample(wo, u)?;
        let (f, p) = self.value_and_pdf(wo, s.wi);
        Some(BsdfSample { weight: f / p.0, pdf: Some(p), ..s })
    }
}

/// Samples of one bsdf under the name of another.
struct WrongSamples {
    said: Bsdf,
    done: Bsdf,
}

impl Subject for WrongSamples {
    fn value_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        self.said.eval_pdf(wo, wi)
    }

    fn draw(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let s = self.done.sample(wo, u)?;
        let (f, p) = self.value_and_pdf(wo, s.wi);
        Some(BsdfSample { weight: f / p.0, pdf: Some(p), ..s })
    }
}

/// A bsdf whose value is wrong by a factor.
struct WrongValue<F> {
    bsdf: Bsdf,
    factor: F,
}

impl<F: Fn(Vec3, Vec3) -> f32> Subject for WrongValue<F> {
    fn value_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        let (f, p) = self.bsdf.eval_pdf(wo, wi);
        (f * (self.factor)(wo, wi), p)
    }

    fn draw(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let s = self.bsdf.sample(wo, u)?;
        Some(BsdfSample { weight: s.weight * (self.factor)(wo, s.wi), ..s })
    }
}

const ETA: f32 = 1.5;
const WO: Vec3 = Vec3::new(0.36, 0.48, 0.8);

fn reflects(wo: Vec3, wi: Vec3) -> bool {
    (wo.z > 0.0) == (wi.z > 0.0)
}

/// The reflectance of the microfacet between the two, seen from above.
fn reflectance(wo: Vec3, wi: Vec3) -> f32 {
    let h = if reflects(wo, wi) { wo + wi } else { wo + ETA * wi };
    fresnel::dielectric(wo.dot(h.normalize()).abs().min(1.0), ETA).reflectance
}

fn rejected_density(subject: &impl Subject) {
    // The level of a family of a thousand: stricter about rejecting than that of the table.
    let verdict = laws::density(subject, WO, (1000, SEED));
    assert!(verdict.is_err(), "the bug was not found");
}

#[test]
fn a_missing_jacobian_of_reflection_is_rejected() {
    let bsdf = metal(Distribution::Ggx, (0.3, 0.3));
    rejected_density(&WrongPdf { bsdf, factor: |wo: Vec3, wi: Vec3| 4.0 * wo.dot((wo + wi).normalize()) });
}

#[test]
fn a_missing_cosine_of_visibility_is_rejected() {
    // The density of visible normals without its wo·m.
    let bsdf = metal(Distribution::Beckmann, (0.3, 0.3));
    rejected_density(&WrongPdf { bsdf, factor: |wo: Vec3, wi: Vec3| 1.0 / wo.dot((wo + wi).normalize()) });
}

#[test]
fn a_wrong_lobe_probability_is_rejected() {
    let bsdf = glass(Distribution::Ggx, (0.3, 0.3), ETA);
    let factor = |wo: Vec3, wi: Vec3| {
        let r = reflectance(wo, wi);
        0.5 / if reflects(wo, wi) { r } else { 1.0 - r }
    };
    rejected_density(&WrongPdf { bsdf, factor });
}

#[test]
fn a_wrong_jacobian_of_refraction_is_rejected() {
    // The half vector's Jacobian without the η² of the denser side, and that of reflection instead.
    let bsdf = glass(Distribution::Beckmann, (0.3, 0.3), ETA);
    let factor = |wo: Vec3, wi: Vec3| if reflects(wo, wi) { 1.0 } else { 1.0 / sqr(ETA) };
    rejected_density(&WrongPdf { bsdf: bsdf.clone(), factor });
    let factor = |wo: Vec3, wi: Vec3| {
        if reflects(wo, wi) {
            return 1.0;
        }
        let h = wo + ETA * wi;
        let cos_i = wi.dot(h.normalize()).abs();
        h.length_squared() / (sqr(ETA) * 4.0 * sqr(cos_i))
    };
    rejected_density(&WrongPdf { bsdf, factor });
}

#[test]
fn swapped_roughnesses_are_rejected() {
    for distribution in [Distribution::Ggx, Distribution::Beckmann] {
        let (said, done) = (metal(distribution, (0.2, 0.3)), metal(distribution, (0.3, 0.2)));
        rejected_density(&WrongSamples { said, done });
        let (said, done) = (glass(distribution, (0.2, 0.3), ETA), glass(distribution, (0.3, 0.2), ETA));
        rejected_density(&WrongSamples { said, done });
    }
}

#[test]
fn a_slightly_wrong_roughness_is_rejected() {
    // Five per cent.
    for distribution in [Distribution::Ggx, Distribution::Beckmann] {
        let (said, done) = (metal(distribution, (0.2, 0.2)), metal(distribution, (0.21, 0.21)));
        rejected_density(&WrongSamples { said, done });
    }
}

#[test]
fn a_missing_cosine_is_rejected() {
    // Uniform instead of cosine-weighted, and a value without its cosine: found by the density and by reciprocity.
    let bsdf = Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.8) });
    rejected_density(&WrongPdf { bsdf: bsdf.clone(), factor: |_: Vec3, wi: Vec3| 0.5 / wi.z.max(1e-9) });
    let wrong = WrongValue { bsdf, factor: |_: Vec3, wi: Vec3| 1.0 / wi.z.max(1e-9) };
    assert!(laws::reciprocity(&wrong, WO, 1.0, |_, _| false, SEED).is_err());
}

#[test]
fn a_wrong_value_is_rejected() {
    // Radiance that is not compressed by η²: found by reciprocity and by energy.
    let bsdf = glass(Distribution::Ggx, (0.3, 0.3), ETA);
    let compressed_twice = |wo: Vec3, wi: Vec3| {
        let eta = if wo.z > 0.0 { ETA } else { 1.0 / ETA };
        if reflects(wo, wi) { 1.0 } else { sqr(eta) }
    };
    let wrong = WrongValue { bsdf: bsdf.clone(), factor: compressed_twice };
    assert!(laws::reciprocity(&wrong, WO, ETA, |_, _| false, SEED).is_err());
    assert!(laws::energy(&wrong, WO, 0.0, SEED).is_err());
    // Masking of one direction only.
    let facets = Microfacets::new(Distribution::Ggx, 0.3, 0.3);
    let half_masked = WrongValue { bsdf, factor: |_: Vec3, wi: Vec3| 1.0 / facets.view(wi).masking };
    assert!(laws::reciprocity(&half_masked, WO, ETA, |_, _| false, SEED).is_err());
}

#[test]
fn a_weight_that_does_not_follow_is_rejected() {
    struct Heavy(Bsdf);
    impl Subject for Heavy {
        fn value_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
            self.0.eval_pdf(wo, wi)
        }
        fn draw(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
            self.0.sample(wo, u).map(|s| BsdfSample { weight: s.weight * 1.001, ..s })
        }
    }
    for bsdf in [metal(Distribution::Ggx, (0.3, 0.1)), glass(Distribution::Beckmann, (0.3, 0.3), ETA)] {
        assert!(laws::weight(&bsdf, WO, SEED).is_ok());
        assert!(laws::weight(&Heavy(bsdf), WO, SEED).is_err());
    }
}
