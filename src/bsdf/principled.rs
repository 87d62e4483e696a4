//! The principled bsdf: a blend of diffuse reflection, metal and rough glass under a clear coat, with sheen ([`super::disney`]).
//!
//! Seen from outside: (1−metallic)·(1−spec_trans)·diffuse + (1−metallic)·sheen + coat + microfacets whose reflectance blends
//! that of metal (Schlick's approximation of the base colour) and of a dielectric, and whose transmittance has the weight
//! g = (1−metallic)·spec_trans and the root of the base colour, so that the way in and out has all of it. Seen from inside it
//! is rough glass of weight g. The microfacets' terms are those of [`super::rough_dielectric`].
//!
//! As Mitsuba 3 defines it, oddities included: without any contrast (η = 1) there is no specular reflection, even of metal.
//! Lobes are chosen by guesses of their albedos, where Mitsuba takes sampling rates from the file: only the noise differs.

use super::disney::{Disney, share};
use super::fresnel::{self, Interface};
use super::gtr1::Gtr1;
use super::microfacet::{Distribution, Microfacets, Mirrored};
use super::parameter::{Parameter, up_to};
use super::rough_dielectric::Crossing;
use super::{BsdfSample, Gloss, Lobes, NOTHING};
use crate::math::float::{min, sqr};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::spectrum::Rgb;
use glam::{Vec2, Vec3};

/// The principled bsdf; the normal points to the outside. Scalars in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Principled {
    /// What it shares with the thin one.
    pub disney: Disney,
    /// Share of metal.
    pub metallic: f32,
    /// Strength of the clear coat.
    pub clearcoat: f32,
    /// Gloss of the clear coat.
    pub clearcoat_gloss: f32,
}

/// The same with what depends on nothing but the viewer's direction worked out ahead, for one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenPrincipled {
    own: Principled,
    wo: Vec3,
    /// `None` if nothing comes from there.
    seen: Option<Seen>,
}

/// What all directions to one viewer have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen {
    wo: Vec3,
    shares: Shares,
    facets: Microfacets,
    /// What they reflect, if there are some; seen from outside.
    view: Mirrored,
    /// [`Principled::eta_seen_from`] there.
    eta: f32,
}

/// How often each lobe is sampled; the microfacets otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shares {
    diffuse: f32,
    coat: f32,
    facets: f32,
    /// The guesses of their albedos together.
    all: f32,
}

/// What microfacets do that are seen under a given angle.
struct Facet {
    reflectance: Rgb,
    /// Without 1/η².
    transmittance: Rgb,
    /// How likely it is that reflection is sampled of the two; NaN if neither carries anything.
    reflects: f32,
}

impl Principled {
    /// The index that takes the place of 1 where something is transmitted, which needs an interface; as in Mitsuba.
    pub const LEAST_CONTRAST: f32 = 1.001;

    /// The index of refraction whose reflectance at normal incidence is 0.08·`specular` (Burley 2012, section 5.4), with
    /// `specular` in [0, 1].
    pub fn eta_of_specular(specular: f32) -> f32 {
        2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
    }

    pub(super) fn lobes(&self) -> Lobes {
        let transmits = self.disney.spec_trans > 0.0;
        Lobes { smooth: true, delta: false, transmits, anisotropic: self.disney.anisotropic > 0.0 }
    }

    /// See [`super::Bsdf::regularized`].
    pub(super) fn regularized(self) -> Self {
        Self { disney: self.disney.regularized(), ..self }
    }

    /// See [`super::Bsdf::scatters_everywhere`]. So does every coat.
    pub(super) fn scatters_everywhere(&self) -> bool {
        let reflects = !(self.disney.spec_trans > 0.0);
        reflects && (!self.has_facets() || self.disney.facets(self.disney.roughness).scatters_everywhere(false))
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::Metallic => self.metallic = up_to(1.0, value),
            Parameter::Clearcoat => self.clearcoat = up_to(1.0, value),
            Parameter::ClearcoatGloss => self.clearcoat_gloss = up_to(1.0, value),
            other => return self.disney.set(other, value),
        }
        true
    }

    /// Weight of glass.
    #[inline]
    fn glass(&self) -> f32 {
        (1.0 - self.metallic) * self.disney.spec_trans
    }

    /// Index beyond the interface relative to that on the side of `w`.
    #[inline]
    fn eta_seen_from(&self, w: Vec3) -> f32 {
        let eta = if self.has_contrast() { self.disney.eta } else { Self::LEAST_CONTRAST };
        if w.z > 0.0 { eta } else { 1.0 / eta }
    }

    #[inline]
    fn has_contrast(&self) -> bool {
        self.disney.eta != 1.0
    }

    /// Whether there are microfacets.
    #[inline]
    fn has_facets(&self) -> bool {
        self.has_contrast() || self.glass() > 0.0
    }

    /// Whether microfacets only reflect.
    #[inline]
    fn only_mirrors(&self) -> bool {
        !(self.glass() > 0.0)
    }

    /// What microfacets reflect, if there are some, that are seen from outside under the cosine `cos`, where those of a dielectric would
    /// reflect so much.
    #[inline]
    fn mirrored(&self, cos: f32, dielectric: f32) -> Rgb {
        let Disney { base_color, spec_tint, .. } = self.disney;
        let mut dielectric = Rgb::splat((1.0 - spec_tint) * dielectric);
        if spec_tint > 0.0 {
            dielectric += self.disney.tinted_fresnel(cos) * spec_tint;
        }
        match self.metallic > 0.0 {
            true => dielectric * (1.0 - self.metallic) + self.disney.schlick(base_color, cos) * self.metallic,
            false => dielectric,
        }
    }

    /// What microfacets do that are seen from the side of `wo` under the cosine `cos`, where a dielectric's would do
    /// as `interface` says, if some of them transmit.
    #[inline(never)]
    fn facet(&self, wo: Vec3, cos: f32, interface: Interface) -> Facet {
        let glass = self.glass();
        let reflectance = match wo.z > 0.0 {
            true => self.mirrored(cos, interface.reflectance),
            false => Rgb::splat(glass * interface.reflectance),
        };
        let transmittance = self.disney.base_color.map(f32::sqrt) * (glass * interface.transmittance);
        let (r, t) = (reflectance.mean(), transmittance.mean());
        Facet { reflectance, transmittance, reflects: r / (r + t) }
    }

    /// How often each lobe is sampled, seen from `wo`. `None` if nothing comes from there.
    #[inline]
    fn shares(&self, wo: Vec3) -> Option<Shares> {
        let Disney { base_color, spec_trans, sheen, .. } = self.disney;
        if wo.z < 0.0 {
            return (self.glass() > 0.0).then_some(Shares { diffuse: 0.0, coat: 0.0, facets: 1.0, all: self.glass() });
        }
        let cos = min(wo.z, 1.0);
        let reflected = if self.only_mirrors() {
            // Transmittance is not worked out for nothing: most are so.
            share(
                self.has_facets(),
                self.mirrored(cos, fresnel::dielectric(cos, self.eta_seen_from(wo)).reflectance).mean(),
            )
        } else {
            let facet = self.facet(wo, cos, fresnel::dielectric(cos, self.eta_seen_from(wo)));
            share(true, facet.reflectance.mean() + facet.transmittance.mean())
        };
        let (dielectric, brdf) = (1.0 - self.metallic, (1.0 - self.metallic) * (1.0 - spec_trans));
        let is_diffuse = brdf > 0.0 && !base_color.is_black() || dielectric * sheen > 0.0;
        let diffuse = share(is_diffuse, brdf * self.disney.diffuse_albedo(cos));
        // The density of the coat's normals is for the cosine of normal incidence, twice.
        let coat = share(self.clearcoat > 0.0, self.clearcoat * self.coat_fresnel(cos) * sqr(cos));
        let all = diffuse + coat + reflected;
        (all > 0.0).then(|| Shares { diffuse: diffuse / all, coat: coat / all, facets: reflected / all, all })
    }

    /// What all directions have in common, seen from `wo`. `None` if nothing comes from there.
    #[inline]
    fn seen_from(&self, wo: Vec3) -> Option<Seen> {
        if wo.z == 0.0 {
            return None;
        }
        let (shares, facets) = (self.shares(wo)?, self.disney.facets(self.disney.roughness));
        let reflects = self.has_facets() && wo.z > 0.0;
        let view = if reflects { facets.mirrored(wo) } else { Mirrored { masking: 0.0, density: 0.0 } };
        Some(Seen { wo, shares, facets, view, eta: self.eta_seen_from(wo) })
    }

    /// See [`super::Bsdf::varied`].
    #[inline]
    pub(super) fn look_from(&self, wo: Vec3) -> SeenPrincipled {
        SeenPrincipled { own: *self, wo, seen: self.seen_from(wo) }
    }

    /// See [`super::Bsdf::about_albedo`].
    pub(super) fn about_albedo(&self, wo: Vec3) -> f32 {
        self.shares(wo).map_or(0.0, |shares| shares.all)
    }

    /// See [`super::Bsdf::gloss`].
    pub(super) fn gloss(&self, wo: Vec3) -> Option<Gloss> {
        self.shares(wo).map(|shares| self.gloss_of(&shares))
    }

    /// That of all narrow lobes, as if they were the facets'.
    fn gloss_of(&self, shares: &Shares) -> Gloss {
        let facets = self.disney.facets(self.disney.roughness);
        Gloss { alpha_squared: facets.alpha_squared(), share: 1.0 - shares.diffuse }
    }

    #[inline]
    fn coat_fresnel(&self, cos: f32) -> f32 {
        /// Of an index of 1.5, whatever the base's.
        const NORMAL: Rgb = Rgb::splat(0.04);
        self.disney.schlick(NORMAL, cos).0.x
    }

    #[inline]
    fn coat(&self) -> Gtr1 {
        /// α of a coat without gloss, and of one with all.
        const DULL: f32 = 0.1;
        const GLOSSY: f32 = 1e-3;
        let alpha = DULL + self.clearcoat_gloss * (GLOSSY - DULL);
        Gtr1::new(if self.disney.regularized { Microfacets::regularized_alpha(alpha) } else { alpha })
    }

    /// The coat's value times cos θi, and the density of its samples. Not inlined: few have one.
    #[inline(never)]
    fn coat_eval_pdf(&self, &wo: &Vec3, &wi: &Vec3, &m: &Vec3) -> (f32, f32) {
        /// Masking and shadowing are those of GGX with this α, whatever the coat's (Burley 2012, section 5.4).
        const MASKING_ALPHA: f32 = 0.25;
        let cos = min(wo.dot(m), 1.0);
        let masking = Microfacets::new(Distribution::Ggx, MASKING_ALPHA, MASKING_ALPHA);
        let d = self.coat().d(m);
        let value = 0.25 * self.clearcoat * self.coat_fresnel(cos) * d * masking.g1(wo, m) * masking.g1(wi, m) * wi.z;
        // Normals are not sampled by visibility: a facet that is seen nearly edge-on spreads to next to no solid angle.
        (value, min(d * m.z / (4.0 * cos), f32::MAX))
    }

    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        self.seen_from(wo).map_or(NOTHING, |seen| self.towards(&seen, wi))
    }

    /// Value and density of a direction.
    #[inline]
    fn towards(&self, seen: &Seen, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if wi.z == 0.0 {
            return NOTHING;
        }
        if seen.wo.z > 0.0 && wi.z > 0.0 { self.reflection(seen, wi) } else { self.interface(seen, wi) }
    }

    /// Value and density of reflection on the outside, where all lobes meet.
    #[inline]
    fn reflection(&self, &Seen { wo, ref shares, ref facets, view, eta }: &Seen, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        let Some(m) = (wo + wi).try_normalize() else { return NOTHING };
        let cos = min(wo.dot(m), 1.0);
        let (mut value, mut pdf) = (Rgb::BLACK, 0.0);
        if shares.diffuse > 0.0 {
            let (metallic, spec_trans) = (self.metallic, self.disney.spec_trans);
            value += self.disney.diffuse(wo.z, wi.z, cos) * ((1.0 - metallic) * (1.0 - spec_trans));
            if self.disney.sheen > 0.0 {
                value += self.disney.sheen(cos) * ((1.0 - metallic) * wi.z);
            }
            pdf += shares.diffuse * warp::square_to_cosine_hemisphere_pdf(wi).0;
        }
        if shares.coat > 0.0 {
            let (coat, coat_pdf) = self.coat_eval_pdf(&{ wo }, &{ wi }, &{ m });
            value += Rgb::splat(coat);
            pdf += shares.coat * coat_pdf;
        }
        // Without facets their share is nought.
        let (reflectance, reflects, density) = if !(shares.facets > 0.0) {
            (Rgb::BLACK, 0.0, 0.0)
        } else if self.only_mirrors() {
            (self.mirrored(cos, fresnel::dielectric(cos, eta).reflectance), 1.0, view.density)
        } else {
            let facet = self.facet(wo, cos, fresnel::dielectric(cos, eta));
            // Where some of the normals refract, they are all that are visible; the density of those is GGX's own masking.
            (facet.reflectance, facet.reflects, view.masking)
        };
        if reflects > 0.0 && !reflectance.is_black() {
            let d = 0.25 * facets.d(m);
            value += reflectance * (d * view.masking * facets.g1(wi, m));
            pdf += shares.facets * reflects * (d * density);
        }
        (value, SolidAnglePdf(pdf))
    }

    /// Value and density of transmission, and of reflection inside.
    #[inline(never)]
    fn interface(&self, &Seen { wo, ref shares, ref facets, eta, .. }: &Seen, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if self.only_mirrors() {
            return NOTHING;
        }
        let reflects = (wo.z > 0.0) == (wi.z > 0.0);
        let Some(m) = (if reflects { wo + wi } else { wo + eta * wi }).try_normalize() else { return NOTHING };
        let m = if m.z < 0.0 { -m } else { m };
        let (dot_o, dot_i) = (wo.dot(m), wi.dot(m));
        // Microfacets are seen from the same side as the surface, both ways.
        if !(dot_o * wo.z > 0.0 && dot_i * wi.z > 0.0) {
            return NOTHING;
        }
        let (cos_o, cos_i) = (min(dot_o.abs(), 1.0), min(dot_i.abs(), 1.0));
        // Both cosines are known; Snell's law would lose the digits of the one near the critical angle.
        let interface = if reflects { fresnel::dielectric(cos_o, eta) } else { fresnel::refraction(cos_o, cos_i, eta) };
        let facet = self.facet(wo, cos_o, interface);
        let (view, d) = (facets.view(wo), facets.d(m));
        let (masking, visible) = (view.masking / wo.z.abs() * facets.g1(wi, m), view.visible / wo.z.abs());
        let (factor, p, share) = if reflects {
            (facet.reflectance, 0.25 * d, facet.reflects)
        } else {
            let p = d * cos_o * Crossing { eta, cos_o, cos_i }.jacobian();
            (facet.transmittance, p, (1.0 - facet.reflects) * sqr(eta))
        };
        if factor.is_black() {
            return NOTHING;
        }
        (factor * (p * masking), SolidAnglePdf(shares.facets * share * p * visible))
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        self.seen_from(wo).and_then(|seen| self.sample_seen(&seen, u))
    }

    #[inline]
    fn sample_seen(&self, seen: &Seen, u: BsdfUniforms) -> Option<BsdfSample> {
        let &Seen { wo, ref shares, .. } = seen;
        let lobe = u.lobe() - shares.diffuse;
        if lobe < 0.0 {
            return self.reflected(seen, u.hemisphere());
        }
        let lobe = lobe - shares.coat;
        if lobe < 0.0 {
            let m = self.coat().sample(u.direction());
            return self.reflected(seen, 2.0 * wo.dot(m) * m - wo);
        }
        if self.only_mirrors() {
            return self.reflected(seen, seen.facets.sample_mirrored(wo, u.direction()));
        }
        self.sample_facets(seen, u.direction(), lobe / shares.facets)
    }

    /// The sample of a direction on the outside.
    #[inline]
    fn reflected(&self, seen: &Seen, wi: Vec3) -> Option<BsdfSample> {
        let wi = wi.normalize();
        if !(wi.z > 0.0) {
            return None;
        }
        let (value, pdf) = self.reflection(seen, wi);
        (pdf.0 > 0.0).then(|| BsdfSample { wi, weight: value / pdf.0, pdf: Some(pdf), eta: 1.0 })
    }

    /// A direction by way of a microfacet, which reflects where the uniform number `lobe` says so.
    #[inline(never)]
    fn sample_facets(&self, seen: &Seen, u: Vec2, lobe: f32) -> Option<BsdfSample> {
        let &Seen { wo, ref shares, ref facets, .. } = seen;
        // Seen from below everything is mirrored, and the distribution is its own mirror image.
        let mirror = Vec3::new(1.0, 1.0, 1.0f32.copysign(wo.z));
        let above = wo * mirror;
        let m = facets.sample_visible(above, u);
        let cos_o = min(above.dot(m), 1.0);
        if !(cos_o > 0.0) {
            return None;
        }
        let eta = self.eta_seen_from(wo);
        let interface = fresnel::dielectric(cos_o, eta);
        let facet = self.facet(wo, cos_o, interface);
        let view = facets.view(above);
        let density = shares.facets * facets.visible_pdf(above, view, m);
        let masking = view.masking / view.visible / shares.facets;
        let (wi, pdf, weight, eta) = if lobe < facet.reflects {
            let wi = 2.0 * cos_o * m - above;
            if wo.z > 0.0 {
                return self.reflected(seen, wi);
            }
            (wi, facet.reflects * density / (4.0 * cos_o), facet.reflectance / facet.reflects, 1.0)
        } else {
            let through = 1.0 - facet.reflects;
            let jacobian = Crossing { eta, cos_o, cos_i: interface.cos_t }.jacobian() * sqr(eta);
            let wi = (cos_o / eta - interface.cos_t) * m - above / eta;
            (wi, through * density * jacobian, facet.transmittance / (through * sqr(eta)), eta)
        };
        let wi = wi.normalize();
        let weight = weight * (masking * facets.g1(wi, m));
        // On the wrong side, or seen edge-on; NaN falls here, too.
        let stays = (eta == 1.0) == (wi.z > 0.0) && pdf > 0.0;
        stays.then_some(BsdfSample { wi: wi * mirror, weight, pdf: Some(SolidAnglePdf(pdf)), eta })
    }
}

impl SeenPrincipled {
    /// See [`super::Bsdf::regularized`].
    pub(super) fn regularized(self) -> Self {
        self.own.regularized().look_from(self.wo)
    }

    pub(super) fn lobes(&self) -> Lobes {
        self.own.lobes()
    }

    /// See [`super::Bsdf::scatters_everywhere`].
    pub(super) fn scatters_everywhere(&self) -> bool {
        self.own.scatters_everywhere()
    }

    /// See [`super::Bsdf::about_albedo`].
    pub(super) fn about_albedo(&self, wo: Vec3) -> f32 {
        if wo == self.wo { self.seen.map_or(0.0, |seen| seen.shares.all) } else { self.own.about_albedo(wo) }
    }

    /// See [`super::Bsdf::gloss`].
    pub(super) fn gloss(&self, wo: Vec3) -> Option<Gloss> {
        match wo == self.wo {
            true => self.seen.map(|seen| self.own.gloss_of(&seen.shares)),
            false => self.own.gloss(wo),
        }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        let known = self.own.set(parameter, value);
        *self = self.own.look_from(self.wo);
        known
    }

    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if wo == self.wo {
            return self.seen.as_ref().map_or(NOTHING, |seen| self.own.towards(seen, wi));
        }
        self.own.eval_pdf(wo, wi)
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        if wo == self.wo {
            return self.seen.as_ref().and_then(|seen| self.own.sample_seen(seen, u));
        }
        self.own.sample(wo, u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::Bsdf;
    use crate::sampler::{Sampler, SamplerKind};

    #[test]
    fn what_is_worked_out_ahead_changes_no_answer() {
        let white = Disney { roughness: 0.4, sheen: 0.5, spec_tint: 0.3, ..Disney::default() };
        let metal = Principled { disney: white, metallic: 0.7, clearcoat: 0.6, clearcoat_gloss: 0.5 };
        let glass = Principled { disney: Disney { spec_trans: 0.8, flatness: 0.4, ..white }, ..Principled::default() };
        let nothing = Principled { disney: Disney { base_color: Rgb::BLACK, eta: 1.0, ..white }, ..metal };
        let sampler = Sampler { kind: SamplerKind::Independent, seed: 3 };
        let direction = |i, set| warp::square_to_cosine_hemisphere(sampler.stream(set, 0, i).film());
        for own in [Principled::default(), metal, glass, nothing].map(Bsdf::Principled) {
            for i in 0..100 {
                let (a, b, wi) = (direction(i, 0), direction(i, 1), direction(i, 2));
                let a = if i % 3 == 0 { -a } else { a };
                let mut ahead = own.varied(std::iter::empty(), a, |bsdf| bsdf);
                ahead.set(Parameter::Roughness, Rgb::splat(0.2));
                let mut own = own.clone();
                own.set(Parameter::Roughness, Rgb::splat(0.2));
                for wo in [a, b] {
                    assert_eq!(ahead.eval_pdf(wo, wi), own.eval_pdf(wo, wi), "{own:?} {wo} {wi}");
                    assert_eq!(ahead.about_albedo(wo), own.about_albedo(wo), "{own:?} {wo}");
                    let u = sampler.stream(3, 0, i).bsdf(0);
                    let [x, y] = [&ahead, &own].map(|bsdf| bsdf.sample(wo, u).map(|s| (s.wi, s.weight, s.pdf)));
                    assert_eq!(x, y, "{own:?} {wo}");
                }
            }
        }
    }
}
