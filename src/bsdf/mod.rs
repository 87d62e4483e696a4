//! Scattering at a point of a surface: value, density and sampling of every bsdf.
//!
//! Directions are unit vectors in the local shading frame (normal +z) and point *away* from the surface. A bsdf sees no
//! texture, no world space and no random generator: its numbers are arguments.

mod beckmann;
mod conductor;
mod dielectric;
mod diffuse;
mod disney;
mod energy;
mod fresnel;
mod gltf;
mod gltf_layers;
mod gtr1;
mod microfacet;
mod null;
mod oren_nayar;
mod parameter;
mod plastic;
mod principled;
mod principled_thin;
mod rough_conductor;
mod rough_dielectric;
mod rough_pane;
mod rough_plastic;
mod sheen;
mod thin_dielectric;
mod thin_film;

pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use disney::Disney;
pub use gltf::{Gltf, GltfParameters};
pub use microfacet::{Distribution, Microfacets};
pub use null::Null;
pub use oren_nayar::OrenNayar;
pub use parameter::Parameter;
pub use plastic::Plastic;
pub use principled::{Principled, SeenPrincipled};
pub use principled_thin::PrincipledThin;
pub use rough_conductor::RoughConductor;
pub use rough_dielectric::RoughDielectric;
pub use rough_pane::RoughPane;
pub use rough_plastic::{RoughPlastic, SeenRoughPlastic};
pub use thin_dielectric::ThinDielectric;

use crate::facts::{Feature, has};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;
use std::f32::consts::PI;

/// A bsdf: a closed set, each in its own file with the same methods.
#[derive(Clone, Debug, PartialEq)]
pub enum Bsdf {
    /// Lambertian reflection.
    Diffuse(Diffuse),
    /// A mirror of metal.
    Conductor(Conductor),
    /// Microfacets of metal.
    RoughConductor(RoughConductor),
    /// A smooth interface.
    Dielectric(Dielectric),
    /// Microfacets of an interface.
    RoughDielectric(RoughDielectric),
    /// A pane.
    ThinDielectric(ThinDielectric),
    /// A pane with rough surfaces, which no file has.
    RoughPane(RoughPane),
    /// A diffuse base under a smooth coat.
    Plastic(Plastic),
    /// A diffuse base under a rough coat.
    RoughPlastic(RoughPlastic),
    /// Burley's blend of all of them.
    Principled(Principled),
    /// The same with some of it worked out already.
    SeenPrincipled(SeenPrincipled),
    /// Burley's blend for a sheet.
    PrincipledThin(PrincipledThin),
    /// Rough diffuse reflection.
    OrenNayar(OrenNayar),
    /// The material of glTF.
    Gltf(Gltf),
    /// A surface that is not there.
    Null(Null),
}

/// Value and density of a direction that a bsdf cannot scatter to.
const NOTHING: (Rgb, SolidAnglePdf) = (Rgb::BLACK, SolidAnglePdf(0.0));

/// A direction sampled from a bsdf.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Where the path goes on.
    pub wi: Vec3,
    /// f(wo, wi)·|cos θi| / pdf; for a delta lobe its reflectance over the probability of choosing it. For transmission
    /// it includes the 1/η² by which radiance changes across the interface.
    pub weight: Rgb,
    /// Density of `wi`; `None` for a delta lobe, which has none.
    pub pdf: Option<SolidAnglePdf>,
    /// Index of refraction on the side of `wi` relative to that of `wo`; 1 for reflection.
    pub eta: f32,
}

/// What an integrator may know of a bsdf before asking.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lobes {
    /// It has a part with a density; without one, sampling lights is useless.
    pub smooth: bool,
    /// It has delta lobes.
    pub delta: bool,
    /// Light passes through.
    pub transmits: bool,
    /// It matters where the tangents point, not only the normal.
    pub anisotropic: bool,
}

/// The lobe around the mirror image of a viewer's direction, roughly: for choosing among lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// α² of its microfacets, positive; of uneven ones the product.
    pub alpha_squared: f32,
    /// About which part of the light that is scattered is in it, in [0, 1].
    pub share: f32,
}

/// How light passes what lets it through in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Clearness {
    /// Not at all.
    Opaque,
    /// Straight on, or nearly so.
    Straight,
    /// By refraction.
    Bent,
}

/// What a bsdf knows of one viewer.
#[derive(Clone, Copy, Debug)]
pub enum Seen {
    /// Nothing that would spare work.
    Any,
    /// That nothing is scattered there.
    Nothing,
    /// What all directions have in common.
    RoughPlastic(SeenRoughPlastic),
    /// The same.
    Principled(SeenPrincipled),
}

macro_rules! each {
    ($self:ident, $b:ident => $e:expr) => {
        match $self {
            Bsdf::Diffuse($b) => $e,
            Bsdf::Conductor($b) => $e,
            Bsdf::RoughConductor($b) => $e,
            Bsdf::Dielectric($b) => $e,
            Bsdf::RoughDielectric($b) => $e,
            Bsdf::ThinDielectric($b) => $e,
            Bsdf::RoughPane($b) => $e,
            Bsdf::Plastic($b) => $e,
            Bsdf::RoughPlastic($b) => $e,
            Bsdf::Principled($b) => $e,
            Bsdf::SeenPrincipled($b) => $e,
            Bsdf::PrincipledThin($b) => $e,
            Bsdf::OrenNayar($b) => $e,
            Bsdf::Gltf($b) => $e,
            Bsdf::Null($b) => $e,
        }
    };
}

use each;

/// A material asks only for parameters that its bsdf has.
#[inline]
fn assert_known(known: bool) {
    debug_assert!(known, "a bsdf has no such parameter");
}

impl Bsdf {
    /// Whether it lets light through, whatever its parameters are.
    #[inline(always)]
    fn always_transmits(&self) -> bool {
        matches!(self, Self::Dielectric(_) | Self::RoughDielectric(_) | Self::ThinDielectric(_) | Self::Null(_))
    }

    /// f(wo, wi)·|cos θi|, in sr⁻¹ (times the cosine), and the density with which [`Self::sample`] finds `wi`; delta lobes
    /// count as zero in both. One call, because the two share most of their work.
    #[inline(always)]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        match self {
            Self::Diffuse(b) => b.eval_pdf(wo, wi),
            other => other.eval_pdf_apart(&wo, &wi),
        }
    }

    /// What [`Self::eval_pdf_seen`] needs to know of a viewer in the direction `wo`, for asking several times.
    #[inline(never)]
    pub fn look_from(&self, &wo: &Vec3) -> Seen {
        match self {
            Self::RoughPlastic(b) => b.look_from(wo).map_or(Seen::Nothing, Seen::RoughPlastic),
            Self::Principled(b) => Seen::Principled(b.look_from(wo)),
            _ => Seen::Any,
        }
    }

    /// The same as [`Self::eval_pdf`] for that `wo`, which [`Self::look_from`] has been told.
    #[inline]
    pub fn eval_pdf_seen(&self, seen: &Seen, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        match (self, seen) {
            (_, Seen::Nothing) => NOTHING,
            (Self::RoughPlastic(b), Seen::RoughPlastic(seen)) => b.towards(seen, wo, wi),
            (_, Seen::Principled(b)) => b.eval_pdf(wo, wi),
            _ => self.eval_pdf(wo, wi),
        }
    }

    /// What is not worth a place in the loop over paths. By reference: a vector that is copied just after it was made
    /// keeps the processor waiting.
    #[inline(never)]
    fn eval_pdf_apart(&self, &wo: &Vec3, &wi: &Vec3) -> (Rgb, SolidAnglePdf) {
        has(Feature::Transmission, self.always_transmits());
        each!(self, b => b.eval_pdf(wo, wi))
    }

    /// A direction; `None` means that this sample carries no energy and the path ends.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        match self {
            Self::Diffuse(b) => b.sample(wo, u),
            other => other.sample_apart(&wo, &u),
        }
    }

    /// See [`Self::eval_pdf_apart`].
    #[inline(never)]
    fn sample_apart(&self, &wo: &Vec3, &u: &BsdfUniforms) -> Option<BsdfSample> {
        has(Feature::Transmission, self.always_transmits());
        each!(self, b => b.sample(wo, u))
    }

    /// Hands on the same with other numbers for some parameters ([`Self::set`]). What depends on nothing but the viewer's direction is
    /// worked out ahead, if that pays: answers stay the same, but those for this `wo` take less time.
    ///
    /// It hands on instead of returning so that what is small, and often wanted, can be put to its place without copying as many bytes
    /// as the largest has.
    #[inline(always)]
    pub fn varied<R>(
        &self,
        numbers: impl Iterator<Item = (Parameter, Rgb)>,
        wo: Vec3,
        put: impl FnOnce(Self) -> R,
    ) -> R {
        match self {
            Self::Diffuse(b) => {
                let mut b = *b;
                numbers.for_each(|(parameter, value)| assert_known(b.set(parameter, value)));
                put(Self::Diffuse(b))
            }
            Self::Principled(b) => {
                let mut b = *b;
                numbers.for_each(|(parameter, value)| assert_known(b.set(parameter, value)));
                put(Self::SeenPrincipled(b.look_from(wo)))
            }
            other => {
                let mut b = other.clone();
                numbers.for_each(|(parameter, value)| b.set(parameter, value));
                put(b)
            }
        }
    }

    /// The same with what its microfacets scatter several times, which must be isotropic and of roughness α up to 1. Changes
    /// only rough metal, rough dielectrics and rough plastic.
    #[must_use]
    pub fn with_multiple_scattering(self) -> Self {
        match self {
            Self::RoughConductor(b) => Self::RoughConductor(b.with_multiple_scattering()),
            Self::RoughDielectric(b) => Self::RoughDielectric(b.with_multiple_scattering()),
            Self::RoughPlastic(b) => Self::RoughPlastic(b.with_multiple_scattering()),
            other => other,
        }
    }

    /// The rougher twin that a path meets once it has been scattered by something that is no mirror: biased, but what it reflects
    /// or refracts light can be sampled for ([`Microfacets`] have the rule, that of pbrt-v4's `BxDF::Regularize`). Mirrors, smooth
    /// glass and panes have a rough twin, too, smooth coats become rough ones; where there is nothing narrow, or light
    /// passes straight on, it is the same. Takes the same parameters as the original.
    #[must_use]
    pub fn regularized(self) -> Self {
        match self {
            Self::Conductor(b) => Self::RoughConductor(b.regularized()),
            Self::RoughConductor(b) => Self::RoughConductor(b.regularized()),
            Self::Dielectric(b) => b.regularized(),
            Self::RoughDielectric(b) => Self::RoughDielectric(b.regularized()),
            Self::ThinDielectric(b) => Self::RoughPane(b.regularized()),
            Self::Plastic(b) => Self::RoughPlastic(b.regularized()),
            Self::RoughPlastic(b) => Self::RoughPlastic(b.regularized()),
            Self::Principled(b) => Self::Principled(b.regularized()),
            Self::SeenPrincipled(b) => Self::SeenPrincipled(b.regularized()),
            Self::PrincipledThin(b) => Self::PrincipledThin(b.regularized()),
            Self::Gltf(b) => Self::Gltf(b.regularized()),
            Self::Diffuse(_) | Self::OrenNayar(_) | Self::RoughPane(_) | Self::Null(_) => self,
        }
    }

    /// Diffuse reflectance as Mitsuba has it: what a diffuse surface that looked like this one along the normal, seen from
    /// `wo`, would reflect.
    pub fn diffuse_reflectance(&self, wo: Vec3) -> Rgb {
        match self {
            Self::Diffuse(diffuse) => diffuse.reflectance,
            other => other.eval_pdf(wo, Vec3::Z).0 * PI,
        }
    }

    /// About which part of the light it sends on that is seen from `wo`, at least 0.05 where it is any: for choosing
    /// among bsdfs. What transmits as well as reflects counts as 1, as most of it is clear.
    pub fn about_albedo(&self, wo: Vec3) -> f32 {
        if !(wo.z > 0.0 || self.lobes().transmits) {
            return 0.0;
        }
        let albedo = match self {
            Self::Diffuse(b) => b.reflectance.mean(),
            Self::OrenNayar(b) => b.reflectance.mean(),
            Self::Conductor(b) => b.about_albedo(wo),
            Self::RoughConductor(b) => b.about_albedo(wo),
            Self::Plastic(b) => b.about_albedo(wo),
            Self::RoughPlastic(b) => b.about_albedo(wo),
            Self::Principled(b) => b.about_albedo(wo),
            Self::SeenPrincipled(b) => b.about_albedo(wo),
            Self::PrincipledThin(b) => b.about_albedo(wo),
            Self::Dielectric(_)
            | Self::RoughDielectric(_)
            | Self::ThinDielectric(_)
            | Self::RoughPane(_)
            | Self::Gltf(_)
            | Self::Null(_) => 1.0,
        };
        disney::share(true, albedo)
    }

    /// The lobe of what is reflected to a viewer above, if there is one that has a width.
    #[inline(never)]
    pub fn gloss(&self, &wo: &Vec3) -> Option<Gloss> {
        if !(wo.z > 0.0) {
            return None;
        }
        match self {
            Self::RoughConductor(b) => Some(b.gloss()),
            Self::RoughPlastic(b) => b.gloss(wo),
            Self::Principled(b) => b.gloss(wo),
            Self::SeenPrincipled(b) => b.gloss(wo),
            Self::Gltf(b) => b.gloss(wo),
            Self::Diffuse(_)
            | Self::Conductor(_)
            | Self::Dielectric(_)
            | Self::RoughDielectric(_)
            | Self::ThinDielectric(_)
            | Self::RoughPane(_)
            | Self::Plastic(_)
            | Self::PrincipledThin(_)
            | Self::OrenNayar(_)
            | Self::Null(_) => None,
        }
    }

    /// The reflectance of the delta lobe in the direction of `wo`'s mirror image, on the same side of the surface, if there is one beside
    /// other lobes; `None` for a viewer inside of glass, or in the surface.
    pub fn mirror(&self, wo: Vec3) -> Option<Rgb> {
        match self {
            Self::Plastic(b) => b.mirror(wo),
            Self::Dielectric(b) => b.mirror(wo),
            Self::ThinDielectric(b) => b.mirror(wo),
            Self::Diffuse(_)
            | Self::Conductor(_)
            | Self::RoughConductor(_)
            | Self::RoughDielectric(_)
            | Self::RoughPane(_)
            | Self::RoughPlastic(_)
            | Self::Principled(_)
            | Self::SeenPrincipled(_)
            | Self::PrincipledThin(_)
            | Self::OrenNayar(_)
            | Self::Gltf(_)
            | Self::Null(_) => None,
        }
    }

    /// The direction beyond the surface from which a delta lobe brings light to `wo`, and which part of the radiance passes: the mean of
    /// what samples of that lobe weigh, the others counting 0. `None` where nothing passes so.
    pub fn through(&self, wo: Vec3) -> Option<(Vec3, Rgb)> {
        match self {
            Self::Dielectric(b) => b.through(wo),
            Self::ThinDielectric(b) => Some(b.through(wo)),
            Self::Null(_) => Some((-wo, Rgb::WHITE)),
            // What passes the windows of glTF is a matter of coats and sheens as well.
            Self::Gltf(_)
            | Self::Diffuse(_)
            | Self::Conductor(_)
            | Self::Plastic(_)
            | Self::RoughConductor(_)
            | Self::RoughDielectric(_)
            | Self::RoughPane(_)
            | Self::RoughPlastic(_)
            | Self::Principled(_)
            | Self::SeenPrincipled(_)
            | Self::PrincipledThin(_)
            | Self::OrenNayar(_) => None,
        }
    }

    /// How what passes by a delta lobe does.
    pub fn clearness(&self) -> Clearness {
        match self {
            Self::Null(_) | Self::ThinDielectric(_) => Clearness::Straight,
            Self::Dielectric(b) if b.hardly_bends() => Clearness::Straight,
            Self::Dielectric(_) => Clearness::Bent,
            _ => Clearness::Opaque,
        }
    }

    /// Whether it reflects only, and where a channel of f is zero for one viewer above it, it is for all: so that what one sees
    /// another could see, if with lobes ever so narrow. For the sharing of paths.
    pub fn scatters_everywhere(&self) -> bool {
        match self {
            // The coat of smooth plastic is no part of f.
            Self::Diffuse(_) | Self::OrenNayar(_) | Self::Plastic(_) => true,
            Self::RoughConductor(b) => b.scatters_everywhere(),
            Self::RoughPlastic(b) => b.scatters_everywhere(),
            Self::Principled(b) => b.scatters_everywhere(),
            Self::SeenPrincipled(b) => b.scatters_everywhere(),
            Self::Gltf(b) => b.scatters_everywhere(),
            Self::Conductor(_)
            | Self::Dielectric(_)
            | Self::RoughDielectric(_)
            | Self::ThinDielectric(_)
            | Self::RoughPane(_)
            | Self::PrincipledThin(_)
            | Self::Null(_) => false,
        }
    }

    /// Its lobes.
    #[inline(always)]
    pub fn lobes(&self) -> Lobes {
        match self {
            Self::Diffuse(b) => b.lobes(),
            other => other.lobes_apart(),
        }
    }

    /// See [`Self::eval_pdf_apart`].
    #[inline]
    fn lobes_apart(&self) -> Lobes {
        each!(self, b => b.lobes())
    }
}

#[cfg(test)]
mod tests;
