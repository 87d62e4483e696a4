//! Where light comes from: radiance, sampling of directions towards a light, and the density of that sampling.
//!
//! Lights ask no rays: whether a sampled point is visible is the integrator's business.

mod area;
mod beams;
mod blocks;
mod cap;
mod circle;
mod constant;
mod directional;
mod environment;

mod point;
mod projector;
mod quad;
mod reach;
mod sampler;
mod slide;
mod spot;
mod tree;
mod triangles;
mod varying;
mod weights;

pub use area::AreaLight;
pub use constant::ConstantLight;
pub use directional::DirectionalLight;
pub use environment::{EnvironmentLight, FoundSky};
pub use point::PointLight;
pub use projector::ProjectorLight;
pub use quad::{FoundOnQuad, Quad, Receivers};
pub use reach::{Beam, Lobe, Reach, Receiver};
pub use sampler::{LightSampler, LightsAt};
pub use slide::Slide;
pub use spot::{SpotLight, SpotSlide};
pub use tree::LightTree;
pub use varying::{Coat, VaryingLight};

use crate::facts::{Feature, has};
use crate::sampling::pdf::SolidAnglePdf;
use crate::shape::offset::SurfacePoint;
use crate::shape::sphere::Sphere;
use crate::shape::{Hit, Shape};
use crate::spectrum::Rgb;
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// A light.
#[derive(Clone, Debug)]
pub enum Light {
    /// A surface that emits.
    Area(AreaLight),
    /// A surface that emits more here than there, or from both sides.
    Varying(Box<VaryingLight>),
    /// A sky of one colour.
    Constant(ConstantLight),
    /// A sky with a picture on it.
    Environment(EnvironmentLight),
    /// Parallel light.
    Directional(DirectionalLight),
    /// A point.
    Point(PointLight),
    /// A point that shines into a cone.
    Spot(SpotLight),
    /// A point that shines through a picture.
    Projector(ProjectorLight),
}

/// A direction towards a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub wi: Vec3,
    /// Radiance that arrives from there if nothing is in the way, in W·sr⁻¹·m⁻²; not black. Of a light without size the
    /// irradiance of a surface that faces it, in W·m⁻².
    pub radiance: Rgb,
    /// Density of `wi`, positive and finite; `None` of a light without size, which has no other direction.
    pub pdf: Option<SolidAnglePdf>,
    /// Where it ends on the light; `None` at infinity.
    pub end: Option<End>,
    /// What it is a point of; [`Hit::NONE`] at infinity and in free space.
    pub on: Hit,
}

/// Where a direction towards a light ends on it.
#[derive(Clone, Copy, Debug)]
pub enum End {
    /// At this point.
    Point(SurfacePoint),
    /// Where it first meets this sphere: few who ask for a direction need the point.
    Sphere(Sphere),
}

impl End {
    /// The point, of the direction `wi` from `p`.
    #[inline]
    pub fn seen_from(&self, p: DVec3, wi: Vec3) -> SurfacePoint {
        match self {
            Self::Point(end) => *end,
            Self::Sphere(sphere) => cap::nearest(sphere, p, wi),
        }
    }
}

impl Light {
    /// A direction from `p` towards the light; `None` where this sample would bring nothing. `n` is the normal on whose side
    /// what arrives is scattered, or zero where that is both sides. `combined`: bsdf sampling finds what this leaves out, so
    /// that directions of little light may be.
    #[inline(always)]
    pub fn sample(&self, shapes: &[Shape], p: DVec3, n: Vec3, u: Vec2, combined: bool) -> Option<LightSample> {
        has(Feature::Textures, matches!(self, Self::Varying(_)));
        has(Feature::Environment, self.is_sky());
        has(Feature::Mis, self.can_be_met());
        match self {
            Self::Area(light) => light.sample(&shapes[light.shape as usize], p, n, u),
            Self::Varying(light) => light.sample(&shapes[light.shape() as usize], &p, u),
            Self::Constant(light) => light.sample(n, u, combined),
            Self::Environment(light) => light.sample(n, u, combined),
            Self::Directional(light) => Some(light.sample()),
            Self::Point(light) => light.sample(&p),
            Self::Spot(light) => light.sample(&p),
            Self::Projector(light) => light.sample(&p),
        }
    }

    /// Whether rays that meet nothing else meet it.
    #[inline(always)]
    pub fn is_sky(&self) -> bool {
        matches!(self, Self::Constant(_) | Self::Environment(_))
    }

    /// Whether a path can run into it: whether it is no light without size.
    #[inline]
    pub fn can_be_met(&self) -> bool {
        match self {
            Self::Area(_) | Self::Varying(_) | Self::Constant(_) | Self::Environment(_) => true,
            Self::Directional(_) | Self::Point(_) | Self::Spot(_) | Self::Projector(_) => false,
        }
    }

    /// Where it is and what it hangs on, if it is a point.
    pub fn as_point_mut(&mut self) -> Option<&mut PointLight> {
        match self {
            Self::Point(light) => Some(light),
            Self::Spot(light) => Some(&mut light.point),
            Self::Projector(light) => Some(&mut light.point),
            Self::Area(_) | Self::Varying(_) | Self::Constant(_) | Self::Environment(_) | Self::Directional(_) => None,
        }
    }

    /// The largest radiance that it emits, in its largest channel; of a light without size, one of the order that it makes
    /// ([`PointLight::scale`]; the irradiance of a directional one).
    pub fn brightest(&self) -> f32 {
        match self {
            Self::Area(light) => light.radiance.max_component(),
            Self::Varying(light) => light.brightest(),
            Self::Constant(light) => light.radiance.max_component(),
            Self::Environment(light) => light.brightest(),
            Self::Directional(light) => light.irradiance.max_component(),
            Self::Point(light) => light.scale(),
            Self::Spot(light) => light.brightest(),
            Self::Projector(light) => light.point.scale(),
        }
    }

    /// Radiant flux that leaves the light, per channel, in W where the compiled scene's unit of length stands for the
    /// metre: π·A·L of a surface (of one with a texture, at some thousand points of it), 4π·I of a point, less of a spot or a
    /// projector; `None` at infinity, where it is not finite.
    pub fn power(&self, shapes: &[Shape]) -> Option<[f64; 3]> {
        let (factor, colour) = match self {
            Self::Area(light) => (PI * shapes[light.shape as usize].area(), light.radiance),
            Self::Varying(light) => {
                let area = shapes[light.shape() as usize].area();
                return Some(light.mean_radiance().map(|c| PI * area * c));
            }
            Self::Constant(_) | Self::Environment(_) | Self::Directional(_) => return None,
            Self::Point(light) => (4.0 * PI, light.intensity),
            Self::Spot(light) => return Some(light.power()),
            Self::Projector(light) => return Some(light.power()),
        };
        Some(colour.to_array().map(|c| f64::from(c) * factor))
    }
}

#[cfg(test)]
mod tests;
