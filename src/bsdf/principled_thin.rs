//! The thin principled bsdf: a sheet that reflects and transmits diffusely, blended with a rough pane ([`super::disney`]).
//!
//! It looks the same from both sides. Light that passes the pane leaves as if reflected and mirrored at the sheet, by
//! microfacets whose roughness is scaled by the index of refraction (Burley 2015, section 5.5): f·cos θi = s·c·(1−F)·D·G /
//! (4·cos θo), with the half vector h of wo and the mirrored wi.
//!
//! As Mitsuba 3 defines it, oddities included: shadowing takes wi itself and counts what does not lie on the far side of the
//! facets' plane, wi·h ≥ 0, as blocked. That part of the lobe is lost, and since it is asked of wi only, a few pairs of
//! directions pass light one way but not the other. Lobes are chosen by guesses of their albedos, where Mitsuba takes
//! sampling rates from the file: only the noise differs.

use super::disney::{Disney, share};
use super::microfacet::Microfacets;
use super::parameter::{Parameter, up_to};
use super::{BsdfSample, Lobes, NOTHING, fresnel};
use crate::math::float::min;
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::spectrum::Rgb;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// The thin principled bsdf.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PrincipledThin {
    /// What it shares with the solid one.
    pub disney: Disney,
    /// How much of the diffuse part is transmitted, in [0, 2]: 2 is everything.
    pub diff_trans: f32,
}

/// How often each lobe is sampled; diffuse transmission otherwise.
struct Shares {
    mirror: f32,
    pane: f32,
    reflection: f32,
    transmission: f32,
    /// The guesses of their albedos together.
    all: f32,
}

/// A sheet seen from above, mirrored at its plane.
const MIRROR: Vec3 = Vec3::new(1.0, 1.0, -1.0);

impl PrincipledThin {
    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: false, transmits: true, anisotropic: self.disney.anisotropic > 0.0 }
    }

    /// See [`super::Bsdf::regularized`].
    pub(super) fn regularized(self) -> Self {
        Self { disney: self.disney.regularized(), ..self }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::DiffTrans => self.diff_trans = up_to(2.0, value),
            other => return self.disney.set(other, value),
        }
        true
    }

    /// The microfacets that reflect.
    #[inline]
    fn reflecting(&self) -> Microfacets {
        self.disney.facets(self.disney.roughness)
    }

    /// The microfacets that transmit.
    #[inline]
    fn transmitting(&self) -> Microfacets {
        // Rougher or smoother than those that reflect by a fit (Burley 2015, figure 15).
        self.disney.facets((0.65 * self.disney.eta - 0.35) * self.disney.roughness)
    }

    /// Reflectance and transmittance of microfacets that are seen under the cosine `cos`.
    #[inline]
    fn facet(&self, cos: f32) -> (Rgb, Rgb) {
        let Disney { base_color, spec_trans, spec_tint, eta, .. } = self.disney;
        let interface = fresnel::dielectric(cos, eta);
        let mut reflectance = Rgb::splat((1.0 - spec_tint) * interface.reflectance);
        if spec_tint > 0.0 {
            reflectance += self.disney.tinted_fresnel(cos) * spec_tint;
        }
        (reflectance * spec_trans, base_color * (spec_trans * interface.transmittance))
    }

    /// Weights of diffuse reflection and transmission.
    #[inline]
    fn diffuse_weights(&self) -> (f32, f32) {
        let (diffuse, through) = (1.0 - self.disney.spec_trans, 0.5 * self.diff_trans);
        (diffuse * (1.0 - through), diffuse * through)
    }

    /// How often each lobe is sampled, seen from above under the cosine `cos`. `None` if nothing comes from there.
    #[inline]
    fn shares(&self, cos: f32) -> Option<Shares> {
        let base = self.disney.base_color;
        let (mirror, pane) = self.facet(min(cos, 1.0));
        let (reflection, transmission) = self.diffuse_weights();
        let is_pane = self.disney.spec_trans > 0.0;
        let (has_base, has_sheen) = (!base.is_black(), self.disney.sheen > 0.0);
        let mirror = share(is_pane, mirror.mean());
        let pane = share(is_pane && has_base, pane.mean());
        let albedo = self.disney.diffuse_albedo(cos);
        let reflection = share(reflection > 0.0 && (has_base || has_sheen), reflection * albedo);
        let transmission = share(transmission > 0.0 && has_base, transmission * base.mean());
        let all = mirror + pane + reflection + transmission;
        (all > 0.0).then(|| Shares {
            mirror: mirror / all,
            pane: pane / all,
            reflection: reflection / all,
            transmission: transmission / all,
            all,
        })
    }

    /// See [`super::Bsdf::about_albedo`].
    pub(super) fn about_albedo(&self, wo: Vec3) -> f32 {
        self.shares(wo.z.abs()).map_or(0.0, |shares| shares.all)
    }

    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return NOTHING;
        }
        let side = 1.0f32.copysign(wo.z);
        match self.shares(wo.z.abs()) {
            Some(shares) => self.eval_pdf_above(wo * side, wi * side, &shares),
            None => NOTHING,
        }
    }

    /// See [`Self::eval_pdf`]; `wo` is above.
    #[inline]
    fn eval_pdf_above(&self, wo: Vec3, wi: Vec3, shares: &Shares) -> (Rgb, SolidAnglePdf) {
        let reflects = wi.z > 0.0;
        let above = if reflects { wi } else { wi * MIRROR };
        let Some(m) = (wo + above).try_normalize() else { return NOTHING };
        let cos = min(wo.dot(m), 1.0);
        let cosine = warp::square_to_cosine_hemisphere_pdf(above).0;
        let (reflection, transmission) = self.diffuse_weights();
        let (mut value, mut pdf) = if reflects {
            let diffuse = self.disney.diffuse(wo.z, wi.z, cos) + self.disney.sheen(cos) * wi.z;
            (diffuse * reflection, shares.reflection * cosine)
        } else {
            (self.disney.base_color * (transmission * FRAC_1_PI * above.z), shares.transmission * cosine)
        };
        // What is transmitted must lie beyond the facet.
        if shares.mirror > 0.0 && reflects == (wi.dot(m) > 0.0) {
            let (reflectance, transmittance) = self.facet(cos);
            let (facets, factor, share) = if reflects {
                (self.reflecting(), reflectance, shares.mirror)
            } else {
                (self.transmitting(), transmittance, shares.pane)
            };
            let view = facets.mirrored(wo);
            let d = 0.25 * facets.d(m);
            value += factor * (d * view.masking * facets.g1(wi, m));
            pdf += share * (d * view.density);
        }
        (value, SolidAnglePdf(pdf))
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let side = 1.0f32.copysign(wo.z);
        let wo = wo * side;
        let shares = self.shares(wo.z)?;
        let (lobe, hemisphere, u) = (u.lobe(), u.hemisphere(), u.direction());
        let specular = shares.mirror + shares.pane;
        let wi = if lobe < specular {
            let facets = if lobe < shares.mirror { self.reflecting() } else { self.transmitting() };
            let above = facets.sample_mirrored(wo, u);
            let m = (wo + above).try_normalize()?;
            let wi = if lobe < shares.mirror { above } else { above * MIRROR };
            // Lost: on the wrong side of the surface, or of the facet.
            let stays = above.z > 0.0 && (wi.z > 0.0) == (wi.dot(m) > 0.0);
            stays.then_some(wi)?
        } else {
            let wi = hemisphere;
            let wi = if lobe < specular + shares.reflection { wi } else { wi * MIRROR };
            (wi.z != 0.0).then_some(wi)?
        };
        let (value, pdf) = self.eval_pdf_above(wo, wi, &shares);
        (pdf.0 > 0.0).then(|| BsdfSample { wi: wi * side, weight: value / pdf.0, pdf: Some(pdf), eta: 1.0 })
    }
}
