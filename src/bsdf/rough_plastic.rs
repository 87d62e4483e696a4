//! Rough plastic: a diffuse base under a coat of microfacets.
//!
//! As [`super::plastic`], with the coat's transmittance averaged over its microfacets, F·D·G / (4·cos θo) on top, and the same
//! light inside: f·cos θi = F·D·G / (4·cos θo) + T(θo)·T(θi)/η² · ρ/(1 − ρ·R) · cos θi/π.
//!
//! T and R are defined as Mitsuba does, whose pictures are to be met: T is tabulated at [`ANGLES`] cosines and interpolated
//! linearly, and R is the plain mean of 2·r(μ)·μ over the same cosines, which are both ends and 62 between. That is no
//! quadrature: it gives the end μ = 1 its full weight and so is 1.5 % below the integral. The plastic's albedo is lower than
//! it should be by up to 3 %, the more the brighter.
//!
//! On demand also what the coat scatters several times ([`super::energy`]). Then T is what the coat does not reflect, and
//! R = 1 − T̄/η², so that white plastic returns everything. Under a rough coat of less index than its surroundings that may be
//! below zero: what such a coat reflects inside is guessed from outside.

use super::energy::{self, Interface, Spread};
use super::microfacet::{Distribution, Microfacets, Mirrored};
use super::parameter::{Parameter, not_negative};
use super::plastic::{Base, coat_probability};
use super::{BsdfSample, Gloss, Lobes, NOTHING, fresnel};
use crate::math::float::{max, min, safe_sqrt, sqr};
use crate::math::quadrature::gauss_legendre;
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::spectrum::Rgb;
use glam::Vec3;

/// Cosines that the coat's transmittance is tabulated for, from 0 to 1: as many as in Mitsuba.
const ANGLES: usize = 64;

/// Rough plastic, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughPlastic {
    facets: Microfacets,
    eta: f32,
    base: Base,
    reflectance: Rgb,
    /// The coat's transmittance from outside, by cosine.
    transmittance: [f32; ANGLES],
    /// What the coat scatters several times, if that counts.
    several: Option<Several>,
}

/// What the coat scatters several times.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Several {
    tables: &'static Interface,
    alpha: f32,
    /// The reflectance at normal incidence.
    normal: f32,
    /// What one scattering loses over the hemisphere, and which part of it comes back.
    mean_lost: f32,
    back: f32,
}

/// What all directions to one viewer have in common.
#[derive(Clone, Copy, Debug)]
pub struct SeenRoughPlastic {
    /// The coat's transmittance for the viewer.
    through: f32,
    /// How likely it is that the coat's reflection is sampled.
    coat: f32,
    /// The base's albedo under the coat.
    albedo: Rgb,
    mirrored: Mirrored,
    /// [`Several::often`].
    often: f32,
}

impl Several {
    /// What the coat scatters once and several times, seen under the cosine `cos`.
    fn albedos(&self, cos: f32) -> [f32; 2] {
        let returned = self.tables.returned(self.alpha, min(cos, 1.0));
        [self.normal * returned.all + (1.0 - self.normal) * returned.part, self.back * (1.0 - returned.all)]
    }

    /// How often it is several scatterings that are sampled where it is the coat.
    fn often(&self, cos: f32) -> f32 {
        let [once, often] = self.albedos(cos);
        often / (once + often)
    }

    /// Value and density of several scatterings.
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let lost = |w: Vec3| 1.0 - self.tables.returned(self.alpha, min(w.z, 1.0)).all;
        let lobe = energy::missing(lost(wo), lost(wi), self.mean_lost);
        (self.back * lobe * warp::square_to_cosine_hemisphere_pdf(wi).0, Spread::new(self.alpha).pdf(wi))
    }
}

impl RoughPlastic {
    /// From the coat's microfacets, the index of refraction inside relative to outside, the base's albedo, a factor on the
    /// coat's reflection, and whether to account for the change of hue by scattering inside.
    pub fn new(
        facets: Microfacets,
        eta: f32,
        diffuse_reflectance: Rgb,
        specular_reflectance: Rgb,
        nonlinear: bool,
    ) -> Self {
        let rule = Rule::new(&facets, 1.0 / eta);
        let seen = |wo: Vec3| rule.mean(wo, |facets, m| reflected(facets, wo, 1.0 / eta, m)) * f64::from(wo.z);
        let inside = (2.0 * tabulated().map(seen).sum::<f64>() / ANGLES as f64) as f32;
        let base = Base { reflectance: diffuse_reflectance, inside, nonlinear };
        Self::over(facets, eta, base, specular_reflectance)
    }

    /// The same where the base loses nothing if it is white: R = 1 − T̄/η², as under a smooth coat, instead of Mitsuba's mean. Takes
    /// of `base` but its colour, and whether that counts each time.
    pub(super) fn returning_all(facets: Microfacets, eta: f32, base: Base, specular_reflectance: Rgb) -> Self {
        let mut this = Self::over(facets, eta, base, specular_reflectance);
        // Exact for what is interpolated linearly: 2∫T·μ dμ over an interval from a to b.
        let step = 1.0 / (ANGLES - 1) as f64;
        let between = |(i, t): (usize, &[f32])| {
            let (a, t) = (i as f64 * step, [f64::from(t[0]), f64::from(t[1])]);
            step * (a * (t[0] + t[1]) + step * (t[0] + 2.0 * t[1]) / 3.0)
        };
        let mean: f64 = this.transmittance.windows(2).enumerate().map(between).sum();
        this.base.inside = (1.0 - mean / f64::from(eta).powi(2)) as f32;
        this
    }

    /// The same over a base for which it is known what the coat reflects inside.
    fn over(facets: Microfacets, eta: f32, base: Base, specular_reflectance: Rgb) -> Self {
        let mut transmittance = [0.0; ANGLES];
        let rule = Rule::new(&facets, eta);
        for (t, wo) in transmittance.iter_mut().zip(tabulated()) {
            *t = rule.mean(wo, |facets, m| refracted(facets, wo, eta, m)) as f32;
        }
        Self { facets, eta, base, reflectance: specular_reflectance, transmittance, several: None }
    }

    /// See [`super::Bsdf::regularized`].
    pub(super) fn regularized(self) -> Self {
        let Self { facets, eta, base, reflectance, several, .. } = self;
        let twin = Self::new(facets.regularized(), eta, base.reflectance, reflectance, base.nonlinear);
        if several.is_some() { twin.with_multiple_scattering() } else { twin }
    }

    /// The same with what is scattered several times.
    pub(super) fn with_multiple_scattering(mut self) -> Self {
        let (tables, alpha) = (Interface::of(self.facets.distribution(), self.eta), energy::tabulated(&self.facets));
        let returned = tables.mean_returned(alpha).all;
        let several = Several {
            tables,
            alpha,
            normal: fresnel::Contrast::new(self.eta).normal,
            mean_lost: 1.0 - returned,
            back: energy::several(Rgb::splat(1.0 - tables.through()), returned).0.x,
        };
        let returned = tables.mean_returned(alpha);
        let reflected = several.normal * returned.all + (1.0 - several.normal) * returned.part;
        let mean = 1.0 - reflected - several.back * several.mean_lost;
        self.base.inside = 1.0 - mean / sqr(self.eta);
        self.several = Some(several);
        self
    }

    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: false, transmits: false, anisotropic: self.facets.is_anisotropic() }
    }

    /// See [`super::Bsdf::scatters_everywhere`].
    pub(super) fn scatters_everywhere(&self) -> bool {
        self.facets.scatters_everywhere(self.base.reflectance.0.min_element() > 0.0)
    }

    /// Overrides one parameter; whether there is such a one. The roughness is not: the table depends on it.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::DiffuseReflectance => self.base.reflectance = not_negative(value),
            Parameter::SpecularReflectance => self.reflectance = not_negative(value),
            _ => return false,
        }
        true
    }

    /// The coat's transmittance for light from outside under the cosine `cos`.
    #[inline]
    fn through(&self, cos: f32) -> f32 {
        if let Some(several) = &self.several {
            let [once, often] = several.albedos(cos);
            return max(1.0 - once - often, 0.0);
        }
        let x = min(cos, 1.0) * (ANGLES - 1) as f32;
        let i = (x as usize).min(ANGLES - 2);
        let t = x - i as f32;
        (1.0 - t) * self.transmittance[i] + t * self.transmittance[i + 1]
    }

    /// See [`super::Bsdf::about_albedo`].
    pub(super) fn about_albedo(&self, wo: Vec3) -> f32 {
        let through = self.through(wo.z);
        self.reflectance.mean() * (1.0 - through) + self.base.reflectance.mean() * through
    }

    /// See [`super::Bsdf::gloss`].
    pub(super) fn gloss(&self, wo: Vec3) -> Option<Gloss> {
        let share = self.coat_probability(self.through(wo.z))?;
        Some(Gloss { alpha_squared: self.facets.alpha_squared(), share })
    }

    /// How likely it is that the coat's reflection is sampled; `None` if nothing comes back.
    #[inline]
    fn coat_probability(&self, through: f32) -> Option<f32> {
        coat_probability(self.reflectance, self.base.reflectance, 1.0 - through, through)
    }

    /// See [`super::Bsdf::look_from`]. `None` if nothing comes from there.
    #[inline]
    pub(super) fn look_from(&self, wo: Vec3) -> Option<SeenRoughPlastic> {
        if !(wo.z > 0.0) {
            return None;
        }
        let through = self.through(wo.z);
        Some(SeenRoughPlastic {
            through,
            coat: self.coat_probability(through)?,
            albedo: self.base.albedo(),
            mirrored: self.facets.mirrored(wo),
            often: self.several.as_ref().map_or(0.0, |several| several.often(wo.z)),
        })
    }

    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if !(wi.z > 0.0) {
            return NOTHING;
        }
        self.look_from(wo).map_or(NOTHING, |seen| self.towards(&seen, wo, wi))
    }

    /// Value and density of a direction.
    #[inline]
    pub(super) fn towards(&self, seen: &SeenRoughPlastic, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        let &SeenRoughPlastic { through, coat, albedo, mirrored: view, often } = seen;
        if !(wi.z > 0.0) {
            return NOTHING;
        }
        let cosine = warp::square_to_cosine_hemisphere_pdf(wi);
        let diffuse = albedo * (through * self.through(wi.z) / sqr(self.eta) * cosine.0);
        let Some(m) = (wo + wi).try_normalize() else { return NOTHING };
        let d = 0.25 * self.facets.d(m);
        let (mut value, mut density) = (0.0, 0.0);
        // Most directions are far from the peak of a narrow lobe.
        if d > 0.0 {
            let reflectance = fresnel::dielectric(min(wo.dot(m), 1.0), self.eta).reflectance;
            (value, density) = (reflectance * (d * view.masking * self.facets.g1(wi, m)), d * view.density);
        }
        if let Some(several) = &self.several {
            let (more, spread) = several.eval_pdf(wo, wi);
            value += more;
            density = (1.0 - often) * density + often * spread;
        }
        let pdf = coat * density + (1.0 - coat) * cosine.0;
        (diffuse + self.reflectance * value, SolidAnglePdf(pdf))
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        if !(wo.z > 0.0) {
            return None;
        }
        let coat = self.coat_probability(self.through(wo.z))?;
        let wi = if let Some(several) = &self.several
            && u.lobe() < coat * several.often(wo.z)
        {
            Spread::new(several.alpha).sample(u.direction())
        } else if u.lobe() < coat {
            self.facets.sample_mirrored(wo, u.direction())
        } else {
            u.hemisphere()
        };
        let (value, pdf) = self.eval_pdf(wo, wi);
        (pdf.0 > 0.0).then(|| BsdfSample { wi, weight: value / pdf.0, pdf: Some(pdf), eta: 1.0 })
    }
}

/// Instead of a cosine of 0, whose directions lie in the surface; as in Mitsuba.
const SMALLEST_COSINE: f32 = 1e-6;

/// The directions of view that the coat's transmittance is tabulated for, in the plane of z and x.
fn tabulated() -> impl Iterator<Item = Vec3> {
    (0..ANGLES).map(|i| {
        let cos = max(i as f32 / (ANGLES - 1) as f32, SMALLEST_COSINE);
        Vec3::new(safe_sqrt((1.0 - cos) * (1.0 + cos)), 0.0, cos)
    })
}

/// A rule for integrals over the microfacets that are seen, with as many nodes along each side of the unit square as Mitsuba's.
struct Rule<'a> {
    facets: &'a Microfacets,
    /// Numbers along the plane of view, and their weights.
    along: Vec<(f64, f64)>,
    /// What lies across that plane, on one side, ...
    across: Vec<f32>,
    /// ... and its weights.
    weights: Vec<f64>,
}

impl<'a> Rule<'a> {
    /// For what an interface of index `eta` does: where that can reflect everything, integrands have a kink.
    fn new(facets: &'a Microfacets, eta: f32) -> Self {
        const SMOOTH: usize = 32;
        const WITH_KINK: usize = 128;
        let along = gauss_legendre(if eta > 1.0 { SMOOTH } else { WITH_KINK });
        let half = &along[..along.len() / 2];
        let (across, weights) = half.iter().map(|&(y, w)| (facets.across(y as f32), w)).unzip();
        Self { facets, along, across, weights }
    }

    /// The mean of `f` over the microfacets that are seen from `wo`, in the plane of z and x.
    fn mean(&self, wo: Vec3, f: impl Fn(&Microfacets, Vec3) -> f32) -> f64 {
        // Which it is the compiler must know, so that it can take several nodes at a time.
        match self.facets.distribution() {
            Distribution::Beckmann => self.mean_over(&self.facets.of_shape(Distribution::Beckmann), wo, f),
            Distribution::Ggx => self.mean_over(&self.facets.of_shape(Distribution::Ggx), wo, f),
        }
    }

    /// The same over these microfacets.
    #[inline(always)]
    fn mean_over(&self, facets: &Microfacets, wo: Vec3, f: impl Fn(&Microfacets, Vec3) -> f32) -> f64 {
        let mut values = vec![0.0; self.across.len()];
        let mut mean = 0.0;
        for &(x, weight) in &self.along {
            let normal = facets.visible_line(wo, x as f32);
            for (value, y) in values.iter_mut().zip(&self.across) {
                *value = f(facets, normal(*y));
            }
            let sum: f64 = values.iter().zip(&self.weights).map(|(value, weight)| weight * f64::from(*value)).sum();
            // Either side of that plane has as much.
            mean += 2.0 * weight * sum;
        }
        mean
    }
}

/// Which part of the light that meets the microfacets `m` from `wo` leaves them below.
#[inline(always)]
fn refracted(facets: &Microfacets, wo: Vec3, eta: f32, m: Vec3) -> f32 {
    let cos_o = min(wo.dot(m), 1.0);
    let interface = fresnel::dielectric(cos_o, eta);
    let wi = (cos_o / eta - interface.cos_t) * m - wo / eta;
    if wi.z < 0.0 { interface.transmittance * facets.g1(wi, m) } else { 0.0 }
}

/// Which part of the light that meets the microfacets `m` from `wo` leaves them above.
#[inline(always)]
fn reflected(facets: &Microfacets, wo: Vec3, eta: f32, m: Vec3) -> f32 {
    let cos_o = min(wo.dot(m), 1.0);
    let wi = 2.0 * cos_o * m - wo;
    if wi.z > 0.0 { fresnel::dielectric(cos_o, eta).reflectance * facets.g1(wi, m) } else { 0.0 }
}
