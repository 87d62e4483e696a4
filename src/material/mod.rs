//! What a surface looks like: bsdfs, combined with each other and varied by textures.
//!
//! Most materials are a bsdf, or one for each side, ready before the render. All others are a [`Graph`], which is worked out
//! anew at each point of the surface: into [`Layer`]s, bsdfs with the parameters of that point, of which the material is
//! the weighted sum.

mod graph;
mod layer;

pub use graph::{Graph, Node, NormalSource, Number, Place, Terminator};
pub use layer::{Layer, Perturbation};

use crate::bsdf::{Bsdf, BsdfSample, Clearness, Gloss, Lobes, Seen};
use crate::facts::{Feature, has};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;

/// A surface's material.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "there are few, and they are read at every vertex")]
pub enum Material {
    /// The same everywhere.
    Plain(Sides),
    /// To be worked out at each point.
    Varying(Graph),
}

/// One-sided as the bsdf itself says, or a bsdf for each side.
#[derive(Clone, Debug, PartialEq)]
pub struct Sides {
    /// Seen from the front (both sides if `back` is `None`: the bsdf itself tells them apart).
    pub front: Bsdf,
    /// Seen from the back, in a frame mirrored at the surface so that it believes itself seen from the front.
    pub back: Option<Bsdf>,
}

impl Sides {
    /// The bsdf for a viewer on the side of `cos_wo`, the cosine between the shading normal and `wo`; and whether the
    /// shading normal is to be flipped for it.
    #[inline]
    pub fn seen_from(&self, cos_wo: f32) -> (&Bsdf, bool) {
        match &self.back {
            Some(back) if cos_wo < 0.0 => (back, true),
            _ => (&self.front, false),
        }
    }
}

impl Material {
    /// The same of rougher twins ([`Bsdf::regularized`]).
    #[must_use]
    pub fn regularized(&self) -> Self {
        match self {
            Self::Plain(Sides { front, back }) => {
                Self::Plain(Sides { front: front.clone().regularized(), back: back.clone().map(Bsdf::regularized) })
            }
            Self::Varying(graph) => Self::Varying(graph.regularized()),
        }
    }

    /// What of all bsdfs in it lets light through by a delta lobe: in no direction, straight on or nearly so, or by refraction, too.
    pub fn clearness(&self) -> Clearness {
        match self {
            Self::Plain(Sides { front, back }) => {
                back.iter().fold(front.clearness(), |all, back| all.max(back.clearness()))
            }
            Self::Varying(graph) => graph.bsdfs().map(Bsdf::clearness).max().unwrap_or(Clearness::Opaque),
        }
    }

    /// The lobes of all bsdfs in it.
    pub fn lobes(&self) -> Lobes {
        match self {
            Self::Plain(Sides { front, back }) => {
                back.iter().fold(front.lobes(), |lobes, back| union(lobes, back.lobes()))
            }
            Self::Varying(graph) => graph.bsdfs().map(Bsdf::lobes).fold(NO_LOBES, union),
        }
    }
}

/// None.
const NO_LOBES: Lobes = Lobes { smooth: false, delta: false, transmits: false, anisotropic: false };

fn union(a: Lobes, b: Lobes) -> Lobes {
    Lobes {
        smooth: a.smooth || b.smooth,
        delta: a.delta || b.delta,
        transmits: a.transmits || b.transmits,
        anisotropic: a.anisotropic || b.anisotropic,
    }
}

/// How a surface scatters at a point, in its shading frame.
#[derive(Clone, Copy, Debug)]
pub enum Scatter<'a> {
    /// By a bsdf.
    One(&'a Bsdf),
    /// By the weighted sum of several, or by one in a frame of its own.
    Layers(&'a [Layer]),
}

impl Scatter<'_> {
    #[inline(always)]
    fn is_worked_out(&self) -> bool {
        matches!(self, Self::Layers(_))
    }

    /// See [`Bsdf::eval_pdf`].
    #[inline(always)]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        has(Feature::Textures, self.is_worked_out());
        match self {
            Self::One(bsdf) => bsdf.eval_pdf(wo, wi),
            Self::Layers(layers) => layer::eval_pdf(layers, &wo, &wi),
        }
    }

    /// See [`Bsdf::look_from`].
    #[inline(always)]
    pub fn look_from(&self, wo: Vec3) -> Seen {
        match self {
            Self::One(bsdf) => bsdf.look_from(&wo),
            Self::Layers(_) => Seen::Any,
        }
    }

    /// See [`Bsdf::gloss`]; blends, masks and what has a normal of its own are not asked.
    #[inline(always)]
    pub fn gloss(&self, wo: Vec3) -> Option<Gloss> {
        match self {
            Self::One(bsdf) if !matches!(bsdf, Bsdf::Diffuse(_)) => bsdf.gloss(&wo),
            _ => None,
        }
    }

    /// Where what is seen from `wo` comes from through the surface, and which part of it, if there is one such direction and nothing else
    /// passes without a density: what [`Self::sample`] makes of it on average. Through what has a normal of its own nothing is told to.
    #[inline(never)]
    pub fn through(&self, wo: Vec3) -> Option<(Vec3, Rgb)> {
        match self {
            Self::One(bsdf) => bsdf.through(wo),
            Self::Layers(layers) => {
                let mut clear = layers.iter().filter(|layer| {
                    let lobes = layer.bsdf.lobes();
                    lobes.delta && lobes.transmits
                });
                let layer = clear.next().filter(|layer| layer.perturbation.is_none())?;
                let (wi, part) = layer.bsdf.through(wo)?;
                clear.next().is_none().then(|| (wi, part * layer.weight))
            }
        }
    }

    /// See [`Bsdf::eval_pdf_seen`].
    #[inline(always)]
    pub fn eval_pdf_seen(&self, seen: &Seen, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        match self {
            Self::One(bsdf) => bsdf.eval_pdf_seen(seen, wo, wi),
            Self::Layers(_) => self.eval_pdf(wo, wi),
        }
    }

    /// See [`Bsdf::sample`].
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        has(Feature::Textures, self.is_worked_out());
        match self {
            Self::One(bsdf) => bsdf.sample(wo, u),
            Self::Layers(layers) => layer::sample(layers, &wo, &u),
        }
    }

    /// See [`Bsdf::diffuse_reflectance`]; holes do not count.
    pub fn diffuse_reflectance(&self, wo: Vec3) -> Rgb {
        match self {
            Self::One(bsdf) => bsdf.diffuse_reflectance(wo),
            Self::Layers(layers) => {
                let solid = layers.iter().filter(|layer| !matches!(layer.bsdf, Bsdf::Null(_)));
                let (mut sum, mut weight) = (Rgb::BLACK, 0.0);
                for layer in solid {
                    sum += layer.bsdf.diffuse_reflectance(wo) * layer.weight;
                    weight += layer.weight;
                }
                if weight > 0.0 { sum / weight } else { Rgb::BLACK }
            }
        }
    }

    /// See [`Bsdf::scatters_everywhere`].
    pub fn scatters_everywhere(&self) -> bool {
        match self {
            Self::One(bsdf) => bsdf.scatters_everywhere(),
            Self::Layers(layers) => layers.iter().all(Layer::scatters_everywhere),
        }
    }

    /// Whether it is worked out alike, and scatters to the same directions, seen from `a` and from `b`, which are on the same side of
    /// the surface: normals of its own may be turned to the viewer.
    pub fn is_alike(&self, a: Vec3, b: Vec3) -> bool {
        match self {
            Self::One(_) => true,
            Self::Layers(layers) => layers.iter().all(|layer| layer.is_alike(a, b)),
        }
    }

    /// The lobes of all bsdfs in it.
    #[inline(always)]
    pub fn lobes(&self) -> Lobes {
        has(Feature::Textures, self.is_worked_out());
        match self {
            Self::One(bsdf) => bsdf.lobes(),
            Self::Layers(layers) => layers.iter().map(|layer| layer.bsdf.lobes()).fold(NO_LOBES, union),
        }
    }
}

#[cfg(test)]
mod tests;
