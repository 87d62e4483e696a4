//! The material of glTF 2.0: metal, dielectric and glass of one roughness under sheen and a coat.
//!
//! Khronos Group 2021, *glTF 2.0 Specification*, appendix B, and the extensions `KHR_materials_clearcoat`, `_ior`,
//! `_iridescence`, `_sheen`, `_specular`, `_transmission` and `_volume`. From the top:
//!
//! coat: w·(Fc·D·G / 4cos θo + what it scatters several times), over everything else times (1 − w·Ec(o))·(1 − w·Ec(i));
//! sheen, over the base times the smaller of 1 − max(c)·Es(o) and 1 − max(c)·Es(i), as its extension says;
//! base: metal·m + (1−m)·(F·D·G / 4cos θo + (1−t)·diffuse + t·transmitted).
//!
//! Metal reflects by Schlick's approximation, dielectrics by F = s·(F₀ + (1−F₀)·g), where g is Fresnel's own instead of
//! Schlick's (1−cos)⁵ ([`Contrast`]), so that an index of 1 is no interface and glass can be left the way it was entered.
//! All microfacets are GGX whose lost light comes back ([`super::energy`]).
//!
//! The specification leaves open how the base below a dielectric is weighted. Here it is (1−E(o))·(1−E(i)) / (1−Ē) with the
//! albedo E of the reflection above (Kelemen and Szirmay-Kalos 2001, *A Microfacet Based Coupled Specular-Matte BRDF Model*): white
//! returns everything, and the weight is the same in both directions. Under a thin film, whose albedo has no table, it is the
//! smaller of 1−E(o) and 1−E(i).
//!
//! The coat has the surface's own normal where a map gives the base another ([`Gltf::set_coat_normal`]). What it reflects below the
//! base's horizon is lost.
//!
//! Without volume the material is a sheet that looks the same from both sides if it transmits; what is transmitted leaves as if
//! reflected and mirrored at the sheet. With volume what is below the surface is glass of weight (1−m)·t.

use super::disney::share;
use super::energy::Spread;
use super::fresnel::{self, Contrast, Interface as Fresnel};
use super::gltf_layers::{Layers, Means, Seen};
use super::microfacet::{Distribution, Microfacets};
use super::parameter::{Parameter, not_negative, scalar, up_to};
use super::rough_dielectric::Crossing;
use super::sheen::Sheen;
use super::thin_film::Film;
use super::{BsdfSample, Gloss, Lobes, NOTHING};
use crate::math::float::{max, min, sqr};
use crate::math::frame::Frame;
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::spectrum::Rgb;
use glam::Vec3;
use std::f32::consts::TAU;

/// The parameters. Scalars in [0, 1] unless they say otherwise; roughness is the root of α.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GltfParameters {
    /// Colour of the base: albedo, or reflectance of the metal.
    pub base_color: Rgb,
    /// Share of metal.
    pub metallic: f32,
    /// Roughness of the base.
    pub roughness: f32,
    /// Index of refraction inside relative to outside, at least 1.
    pub ior: f32,
    /// Strength of the dielectric's reflection.
    pub specular: f32,
    /// Its colour at normal incidence, not negative.
    pub specular_color: Rgb,
    /// Share of what is not reflected by the dielectric that passes.
    pub transmission: f32,
    /// Whether there is an inside.
    pub solid: bool,
    /// Strength of the coat.
    pub clearcoat: f32,
    /// Its roughness.
    pub clearcoat_roughness: f32,
    /// Colour of the sheen.
    pub sheen_color: Rgb,
    /// Its roughness.
    pub sheen_roughness: f32,
    /// Strength of the thin film.
    pub iridescence: f32,
    /// Its index of refraction, at least 1.
    pub iridescence_ior: f32,
    /// Its thickness in nanometres, not negative.
    pub iridescence_thickness: f32,
}

impl Default for GltfParameters {
    fn default() -> Self {
        Self {
            base_color: Rgb::WHITE,
            metallic: 1.0,
            roughness: 1.0,
            ior: 1.5,
            specular: 1.0,
            specular_color: Rgb::WHITE,
            transmission: 0.0,
            solid: false,
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            sheen_color: Rgb::BLACK,
            sheen_roughness: 0.0,
            iridescence: 0.0,
            iridescence_ior: 1.3,
            iridescence_thickness: 400.0,
        }
    }
}

/// The material; the normal points to the outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gltf {
    pub(super) is: GltfParameters,
    /// Whether it transmits anywhere on the surface.
    transmits: bool,
    pub(super) tables: &'static super::energy::Interface,
    /// The coat's normal: the surface's own where the base has another.
    coat_normal: Vec3,
    /// Whether base and coat are rougher than the parameters say.
    pub(super) regularized: bool,
    /// What follows from the parameters.
    layers: Layers,
    means: Means,
}

/// How often each lobe is sampled; they add up to 1.
#[derive(Clone, Copy, Default)]
struct Shares {
    diffuse: f32,
    /// What facets scatter several times, to the viewer's side and to the other: as often as their albedos say, which are known.
    up: f32,
    down: f32,
    sheen: f32,
    coat: f32,
    facets: f32,
    /// Straight through.
    window: f32,
}

/// What a microfacet of the base does.
struct Facet {
    reflectance: Rgb,
    transmittance: Rgb,
    /// How likely it is that reflection is sampled of the two; NaN if neither carries anything.
    reflects: f32,
}

/// A direction of view, above, with what depends on it alone.
struct View {
    wo: Vec3,
    /// Whether that is outside.
    outside: bool,
    /// The coat's normal, on the viewer's side.
    coat: Vec3,
    seen: Seen,
    shares: Shares,
}

/// A sheet seen from above, mirrored at its plane.
const MIRROR: Vec3 = Vec3::new(1.0, 1.0, -1.0);

impl Gltf {
    /// The least |η − 1| of a solid that refracts: below, light goes straight on. Reason: see
    /// [`super::RoughDielectric`]'s, whose number it is, of a roughness of 1.
    pub(super) const LEAST_CONTRAST: f32 = super::RoughDielectric::NARROWEST_LOBE;

    /// From its parameters, of which those that vary are what they are elsewhere on the surface.
    pub fn new(is: GltfParameters) -> Self {
        let tables = super::energy::Interface::of(Distribution::Ggx, is.ior);
        if is.iridescence > 0.0 {
            Film::prepare();
        }
        if !is.sheen_color.is_black() {
            Sheen::prepare();
        }
        let (layers, means) = (Layers::default(), Means::default());
        let (transmits, coat_normal) = (is.transmission > 0.0, Vec3::Z);
        let mut this = Self { is, transmits, tables, coat_normal, regularized: false, layers, means };
        // Makes the other tables, too.
        this.follow();
        this
    }

    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: self.is_window(), transmits: self.transmits, anisotropic: false }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        let is = &mut self.is;
        let colour = |value: Rgb| not_negative(value).map(|c| min(c, 1.0));
        match parameter {
            Parameter::BaseColor => is.base_color = not_negative(value),
            Parameter::Metallic => is.metallic = up_to(1.0, value),
            Parameter::Roughness => is.roughness = up_to(1.0, value),
            Parameter::Specular => is.specular = up_to(1.0, value),
            Parameter::SpecularColor => is.specular_color = not_negative(value),
            Parameter::Transmission => is.transmission = if self.transmits { up_to(1.0, value) } else { 0.0 },
            Parameter::Clearcoat => is.clearcoat = up_to(1.0, value),
            Parameter::ClearcoatRoughness => is.clearcoat_roughness = up_to(1.0, value),
            Parameter::SheenColor => is.sheen_color = colour(value),
            Parameter::SheenRoughness => is.sheen_roughness = up_to(1.0, value),
            Parameter::Iridescence => is.iridescence = up_to(1.0, value),
            Parameter::IridescenceThickness => is.iridescence_thickness = max(scalar(value), 0.0),
            _ => return false,
        }
        self.follow();
        true
    }

    /// Gives the coat another normal than the base, of unit length and in the base's frame; one that looks into the base is
    /// ignored.
    pub fn set_coat_normal(&mut self, normal: Vec3) {
        if normal.z > 0.0 {
            self.coat_normal = normal;
        }
    }

    /// The coat's normal in the local frame.
    pub fn coat_normal(&self) -> Vec3 {
        self.coat_normal
    }

    /// Works out what follows from the parameters.
    pub(super) fn follow(&mut self) {
        self.layers = Layers::new(self);
        self.means = Means::new(self, &self.layers);
    }

    /// Whether light that enters the solid goes straight on.
    #[inline]
    pub(super) fn is_window(&self) -> bool {
        self.transmits && self.is.solid && (self.is.ior - 1.0).abs() < Self::LEAST_CONTRAST
    }

    /// Weight of what is transmitted.
    #[inline]
    pub(super) fn glass(&self) -> f32 {
        (1.0 - self.is.metallic) * self.is.transmission
    }

    /// Whether something is transmitted with refraction.
    #[inline]
    pub(super) fn refracts(&self) -> bool {
        self.is.solid && self.glass() > 0.0 && !self.is_window()
    }

    #[inline]
    fn facets(alpha: f32) -> Microfacets {
        Microfacets::new(Distribution::Ggx, alpha, alpha)
    }

    /// What facets of the base do that are met under the cosine `cos` from `outside` or inside, where a bare interface does
    /// as `interface` says.
    #[inline]
    fn facet(&self, outside: bool, cos: f32, interface: Fresnel) -> Facet {
        let is = &self.is;
        let total = !outside && interface.transmittance == 0.0;
        let cos = if outside { cos } else { interface.cos_t };
        let dielectric = match (self.is_window(), total) {
            (true, _) => Rgb::BLACK,
            (false, true) => Rgb::WHITE,
            (false, false) => self.dielectric(cos, interface.reflectance),
        };
        let through = max(1.0 - dielectric.max_component(), 0.0);
        let reflectance = if !outside {
            dielectric * self.glass()
        } else if is.metallic > 0.0 {
            self.metal(cos) * is.metallic + dielectric * (1.0 - is.metallic)
        } else {
            dielectric
        };
        let transmittance = if self.is_window() { Rgb::BLACK } else { is.base_color * (self.glass() * through) };
        let (r, t) = (reflectance.mean(), transmittance.mean());
        Facet { reflectance, transmittance, reflects: r / (r + t) }
    }

    /// The dielectric's reflectance under the cosine `cos` outside, where a bare interface's is `reflectance`.
    pub(super) fn dielectric(&self, cos: f32, reflectance: f32) -> Rgb {
        let is = &self.is;
        let normal = self.dielectric_normal();
        let g = Contrast::new(is.ior).part(reflectance);
        let bare = normal.map(|n| max(n + (1.0 - n) * g, 0.0));
        self.with_film(bare, cos, normal) * is.specular
    }

    /// The dielectric's reflectance at normal incidence, but for its strength and its film.
    #[inline]
    pub(super) fn dielectric_normal(&self) -> Rgb {
        let normal = Contrast::new(self.is.ior).normal;
        self.is.specular_color.map(|c| min(c * normal, 1.0))
    }

    /// The metal's reflectance under the cosine `cos`.
    #[inline]
    pub(super) fn metal(&self, cos: f32) -> Rgb {
        let g = super::disney::schlick_weight(cos);
        let normal = self.is.base_color;
        self.with_film(normal.map(|n| n + (1.0 - n) * g), cos, normal)
    }

    /// The metal's mean reflectance over the hemisphere; with a film by Schlick's approximation of what that reflects at normal
    /// incidence.
    pub(super) fn mean_metal(&self) -> Rgb {
        /// ∫ (1 − μ)⁵·2μ dμ.
        const SCHLICK: f32 = 1.0 / 21.0;
        let normal = self.is.base_color;
        self.with_film(normal, 1.0, normal).map(|n| n + (1.0 - n) * SCHLICK)
    }

    /// The reflectance `bare` with as much of the film's as there is.
    #[inline]
    fn with_film(&self, bare: Rgb, cos: f32, normal: Rgb) -> Rgb {
        let part = self.is.iridescence;
        if !(part > 0.0) {
            return bare;
        }
        bare * (1.0 - part) + self.film().reflectance(cos, normal) * part
    }

    #[inline]
    pub(super) fn film(&self) -> Film {
        Film { eta: self.is.iridescence_ior, thickness: self.is.iridescence_thickness }
    }

    /// What is seen from `wo`, mirrored so that it is above; `None` if nothing comes from there.
    fn view(&self, wo: Vec3) -> Option<View> {
        let from_below = wo.z < 0.0;
        if wo.z == 0.0 || from_below && !self.transmits {
            return None;
        }
        let outside = !(from_below && self.is.solid);
        let wo = if from_below { wo * MIRROR } else { wo };
        // Turned round, and mirrored.
        let turned = if from_below { Vec3::new(-1.0, -1.0, 1.0) } else { Vec3::ONE };
        let coat = self.coat_normal * turned;
        let seen = self.seen(outside, wo, coat);
        let shares = self.shares(outside, wo, coat, &seen)?;
        Some(View { wo, outside, coat, seen, shares })
    }

    /// What is seen from `w`, where the coat has the normal `coat`.
    #[inline]
    fn seen(&self, outside: bool, w: Vec3, coat: Vec3) -> Seen {
        let cosines = [w.z.abs(), w.dot(coat).copysign(w.dot(coat) * w.z)].map(|cos| min(max(cos, 0.0), 1.0));
        Seen::new(self, &self.layers, &self.means, outside, cosines)
    }

    /// How often each lobe is sampled; `None` if there is none.
    fn shares(&self, outside: bool, wo: Vec3, coat: Vec3, seen: &Seen) -> Option<Shares> {
        let (is, cos) = (&self.is, min(wo.z, 1.0));
        let eta = self.eta(outside);
        let facet = self.facet(outside, cos, fresnel::dielectric(cos, eta));
        let below = seen.coat * seen.sheen;
        let [diffuse, up, down] = self.means.even_albedos(self, outside, seen);
        let window = if self.is_window() { self.straight() * below } else { Rgb::BLACK };
        let mut shares = Shares {
            diffuse: share(!diffuse.is_black(), diffuse.mean()),
            up: up.mean(),
            down: down.mean(),
            sheen: share(outside && !is.sheen_color.is_black(), is.sheen_color.mean() * seen.sheen_albedo),
            coat: share(outside && is.clearcoat > 0.0 && wo.dot(coat) > 0.0, 1.0 - seen.coat),
            facets: share(facet.reflects >= 0.0, (facet.reflectance + facet.transmittance).mean() * below),
            window: share(!window.is_black(), window.mean()),
        };
        let Shares { diffuse, up, down, sheen, coat, facets, window } = &mut shares;
        let all = *diffuse + *up + *down + *sheen + *coat + *facets + *window;
        for part in [diffuse, up, down, sheen, coat, facets, window] {
            *part /= all;
        }
        (all > 0.0).then_some(shares)
    }

    /// Whether facets only reflect: what a sheet's transmit is reflected first, and mirrored.
    fn only_mirrors(&self) -> bool {
        !(self.is.solid && self.transmits)
    }

    /// Index beyond the interface relative to that on the viewer's side.
    #[inline]
    fn eta(&self, outside: bool) -> f32 {
        if outside { self.is.ior } else { 1.0 / self.is.ior }
    }

    /// What goes straight through a window, but for what is above it.
    #[inline]
    fn straight(&self) -> Rgb {
        self.is.base_color * self.glass()
    }

    /// See [`super::Bsdf::gloss`]; as if the coat were as rough as what is below.
    pub(super) fn gloss(&self, wo: Vec3) -> Option<Gloss> {
        let Shares { facets, coat, .. } = self.view(wo)?.shares;
        Some(Gloss { alpha_squared: sqr(self.layers.alpha), share: facets + coat })
    }

    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if wi.z == 0.0 {
            return NOTHING;
        }
        let Some(view) = self.view(wo) else { return NOTHING };
        self.scatter(&view, if wo.z < 0.0 { wi * MIRROR } else { wi })
    }

    /// Value and density of `wi` in the view's frame.
    fn scatter(&self, view: &View, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if wi.z > 0.0 {
            self.reflection(view, wi)
        } else if self.transmits && wi.z < 0.0 {
            self.transmission(view, wi)
        } else {
            NOTHING
        }
    }

    /// Value and density on the viewer's side.
    fn reflection(&self, view: &View, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        let View { wo, outside, ref seen, shares, .. } = *view;
        let (layers, means) = (&self.layers, &self.means);
        let Some(m) = (wo + wi).try_normalize() else { return NOTHING };
        let cos = min(wo.dot(m), 1.0);
        let back = self.seen(outside, wi, view.coat);
        let cosine = warp::square_to_cosine_hemisphere_pdf(wi).0;
        let mut value = means.even_up(self, outside, seen, &back) * cosine;
        let mut pdf = shares.diffuse * cosine + shares.up * Spread::new(layers.alpha).pdf(wi);
        if shares.facets > 0.0 {
            let facet = self.facet(outside, cos, fresnel::dielectric(cos, self.eta(outside)));
            if facet.reflects > 0.0 {
                let [p, density] = mirrored(&Self::facets(layers.alpha), wo, wi, m, self.only_mirrors());
                value += facet.reflectance * p;
                pdf += shares.facets * facet.reflects * density;
            }
        }
        if !outside {
            return (value, SolidAnglePdf(pdf));
        }
        value *= min(seen.sheen, back.sheen);
        if shares.sheen > 0.0 {
            value += self.is.sheen_color * layers.sheen.value(wo, wi);
            pdf += shares.sheen / TAU;
        }
        value *= seen.coat * back.coat;
        if shares.coat > 0.0 {
            let (one, density) = self.coat(view, &back, wi);
            value += Rgb::splat(self.is.clearcoat * one);
            pdf += shares.coat * density;
        }
        (value, SolidAnglePdf(pdf))
    }

    /// What a full coat reflects, times cos θi, and the density, in the coat's own frame.
    fn coat(&self, view: &View, back: &Seen, wi: Vec3) -> (f32, f32) {
        let (layers, means) = (&self.layers, &self.means);
        let [wo, wi] = [view.wo, wi].map(|w| in_frame_of(view.coat, w));
        let Some(m) = (wo + wi).try_normalize().filter(|_| wo.z > 0.0 && wi.z > 0.0) else { return (0.0, 0.0) };
        let [p, density] = mirrored(&Self::facets(layers.coat_alpha), wo, wi, m, true);
        let reflectance = fresnel::dielectric(min(wo.dot(m), 1.0), Layers::COAT_IOR).reflectance;
        let several = means.coat_several * view.seen.coat_missing(back, means);
        let value = reflectance * p + several * warp::square_to_cosine_hemisphere_pdf(wi).0;
        let spread = Spread::new(layers.coat_alpha).pdf(wi);
        (value, means.coat_once * density + (1.0 - means.coat_once) * spread)
    }

    /// Value and density on the other side.
    fn transmission(&self, view: &View, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        let View { outside, ref seen, shares, .. } = *view;
        let other = outside != self.is.solid;
        let beyond = self.seen(other, wi, view.coat);
        let above = wi * MIRROR;
        let cosine = warp::square_to_cosine_hemisphere_pdf(above).0;
        let eta = if self.is.solid { self.eta(outside) } else { 1.0 };
        let mut value = self.means.even_down(self, outside, seen, &beyond) * (cosine / sqr(eta));
        let mut pdf = shares.down * Spread::new(self.layers.alpha).pdf(above);
        if shares.facets > 0.0 && !self.is_window() {
            let (one, density) = if self.is.solid { self.refraction(view, wi, eta) } else { self.passage(view, above) };
            value += one;
            pdf += shares.facets * density;
        }
        // Coat and sheen are outside: of a sheet, on both sides.
        (value * (seen.coat * beyond.coat * min(seen.sheen, beyond.sheen)), SolidAnglePdf(pdf))
    }

    /// What facets of a sheet transmit, `above` being mirrored, and the density.
    fn passage(&self, view: &View, above: Vec3) -> (Rgb, f32) {
        let none = (Rgb::BLACK, 0.0);
        let Some(m) = (view.wo + above).try_normalize() else { return none };
        let cos = min(view.wo.dot(m), 1.0);
        let facet = self.facet(true, cos, fresnel::dielectric(cos, self.is.ior));
        if !(facet.reflects < 1.0) {
            return none;
        }
        let [p, density] = mirrored(&Self::facets(self.layers.alpha), view.wo, above, m, true);
        (facet.transmittance * p, (1.0 - facet.reflects) * density)
    }

    /// What facets refract to `wi`, and the density ([`super::rough_dielectric`]).
    fn refraction(&self, view: &View, wi: Vec3, eta: f32) -> (Rgb, f32) {
        let (none, wo) = ((Rgb::BLACK, 0.0), view.wo);
        let Some(m) = (wo + eta * wi).try_normalize() else { return none };
        let m = if m.z < 0.0 { -m } else { m };
        let (dot_o, dot_i) = (wo.dot(m), wi.dot(m));
        if !(dot_o > 0.0 && dot_i < 0.0) {
            return none;
        }
        let (cos_o, cos_i) = (min(dot_o, 1.0), min(-dot_i, 1.0));
        let facet = self.facet(view.outside, cos_o, fresnel::refraction(cos_o, cos_i, eta));
        if !(facet.reflects < 1.0) {
            return none;
        }
        let facets = Self::facets(self.layers.alpha);
        let one = facets.view(wo);
        let p = facets.d(m) * cos_o * Crossing { eta, cos_o, cos_i }.jacobian();
        let value = p * (one.masking / wo.z * facets.g1(wi, m));
        (facet.transmittance * value, (1.0 - facet.reflects) * p * (one.visible / wo.z) * sqr(eta))
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let view = self.view(wo)?;
        let wi = match self.direction(&view, u)? {
            Some(wi) => wi,
            None => {
                let weight = self.straight() * (view.seen.coat * view.seen.sheen / view.shares.window);
                // The same coat and sheen are passed whichever way one looks.
                return Some(BsdfSample { wi: -wo, weight, pdf: None, eta: 1.0 });
            }
        };
        let wi = wi.normalize();
        let (value, pdf) = self.scatter(&view, wi);
        let eta = if wi.z < 0.0 && self.is.solid { self.eta(view.outside) } else { 1.0 };
        let wi = if wo.z < 0.0 { wi * MIRROR } else { wi };
        (pdf.0 > 0.0).then(|| BsdfSample { wi, weight: value / pdf.0, pdf: Some(pdf), eta })
    }

    /// A direction in the view's frame by one of its lobes, `Some(None)` for straight on.
    fn direction(&self, view: &View, u: BsdfUniforms) -> Option<Option<Vec3>> {
        let (shares, wo) = (&view.shares, view.wo);
        let (lobe, hemisphere, u) = (u.lobe(), u.hemisphere(), u.direction());
        let mut rest = lobe - shares.diffuse;
        if rest < 0.0 {
            return Some(Some(hemisphere));
        }
        rest -= shares.up;
        if rest < 0.0 {
            return Some(Some(Spread::new(self.layers.alpha).sample(u)));
        }
        rest -= shares.down;
        if rest < 0.0 {
            return Some(Some(Spread::new(self.layers.alpha).sample(u) * MIRROR));
        }
        rest -= shares.sheen;
        if rest < 0.0 {
            return Some(Some(warp::square_to_uniform_hemisphere(u)));
        }
        rest -= shares.window;
        if rest < 0.0 {
            return Some(None);
        }
        if rest < shares.coat {
            let coat = Frame::from_normal(view.coat);
            let wo = in_frame_of(view.coat, wo);
            let wi = match rest < shares.coat * self.means.coat_once {
                true => Self::facets(self.layers.coat_alpha).sample_mirrored(wo, u),
                false => Spread::new(self.layers.coat_alpha).sample(u),
            };
            let above = wi.z > 0.0;
            return upwards(if view.coat == Vec3::Z { wi } else { coat.to_world(wi) }).filter(|_| above);
        }
        let facets = Self::facets(self.layers.alpha);
        let mirrored = self.only_mirrors().then(|| (facets.sample_mirrored(wo, u) + wo).normalize_or_zero());
        let m = mirrored.unwrap_or_else(|| facets.sample_visible(wo, u));
        let cos = min(wo.dot(m), 1.0);
        if !(cos > 0.0) {
            return None;
        }
        let eta = self.eta(view.outside);
        let interface = fresnel::dielectric(cos, eta);
        if (rest - shares.coat) / shares.facets < self.facet(view.outside, cos, interface).reflects {
            return upwards(2.0 * cos * m - wo);
        }
        if self.is.solid {
            let wi = (cos / eta - interface.cos_t) * m - wo / eta;
            return (wi.z < 0.0).then_some(Some(wi));
        }
        Some(upwards(2.0 * cos * m - wo)?.map(|wi| wi * MIRROR))
    }
}

/// `w` where `normal` is z.
#[inline]
fn in_frame_of(normal: Vec3, w: Vec3) -> Vec3 {
    if normal == Vec3::Z { w } else { Frame::from_normal(normal).to_local(w) }
}

/// A reflected direction if it is above.
#[inline]
fn upwards(wi: Vec3) -> Option<Option<Vec3>> {
    (wi.z > 0.0).then_some(Some(wi))
}

/// D·G / (4·cos θo) of facets that reflect everything, and the density of reflection: of `only_mirrors`, or by all normals that
/// are visible, which for GGX is its own masking.
#[inline]
fn mirrored(facets: &Microfacets, wo: Vec3, wi: Vec3, m: Vec3, only_mirrors: bool) -> [f32; 2] {
    let view = facets.mirrored(wo);
    let d = 0.25 * facets.d(m);
    [d * view.masking * facets.g1(wi, m), d * if only_mirrors { view.density } else { view.masking }]
}
