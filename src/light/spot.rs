//! A point that shines into a cone: with its full radiant intensity up to an angle from the axis, the beam's width, from there
//! falling linearly with the angle to nothing at the cutoff, as Mitsuba 3 has it. A texture may lie over the square around the
//! cone.

use super::{LightSample, PointLight, Slide};
use crate::spectrum::Rgb;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A light without size: only sampling it finds it.
#[derive(Clone, Debug)]
pub struct SpotLight {
    /// The same light without the cone.
    pub point: PointLight,
    /// Unit vector along the axis, away from the light.
    pub axis: DVec3,
    /// Angle from the axis up to which intensity is full, in radians, from 0 to `cutoff`.
    pub beam: f64,
    /// Angle from which there is none, in radians, in (0, π].
    pub cutoff: f64,
    /// A factor on the intensity.
    pub slide: Option<SpotSlide>,
}

/// What a spot shines through.
#[derive(Clone, Debug)]
pub struct SpotSlide {
    /// The texture.
    pub slide: Slide,
    /// Unit vectors at right angles to the axis, along which its coordinates grow.
    pub across: [DVec3; 2],
}

impl SpotLight {
    #[inline(never)]
    pub(super) fn sample(&self, p: &DVec3) -> Option<LightSample> {
        let away = *p - self.point.position;
        // Not by the arc cosine, which has few digits near the axis.
        let angle = libm::atan2(self.axis.cross(away).length(), self.axis.dot(away));
        if !(angle < self.cutoff) {
            return None;
        }
        let mut sample = self.point.sample(p)?;
        if angle > self.beam {
            sample.radiance *= ((self.cutoff - angle) / (self.cutoff - self.beam)) as f32;
        }
        if let Some(slide) = &self.slide {
            sample.radiance *= self.shown(slide, away);
        }
        (!sample.radiance.is_black()).then_some(sample)
    }

    /// What the texture is in a direction from the light. At depth 1 its unit square is as wide as the cone; where the cone is
    /// wider than half of all directions, Mitsuba's formula goes on.
    fn shown(&self, SpotSlide { slide, across }: &SpotSlide, away: DVec3) -> Rgb {
        let half = self.axis.dot(away) * libm::tan(self.cutoff);
        let uv = 0.5 + 0.5 * DVec2::from(across.map(|axis| axis.dot(away))) / half;
        slide.colour(uv.as_vec2())
    }

    /// The scale of what it makes ([`PointLight::scale`]).
    pub(super) fn brightest(&self) -> f32 {
        self.point.scale() * self.slide.as_ref().map_or(1.0, |s| s.slide.largest())
    }

    /// Radiant flux per channel; through a texture by the midpoint rule.
    pub(super) fn power(&self) -> [f64; 3] {
        /// Steps along the angle from the axis and around it.
        const STEPS: u32 = 256;
        let intensity = self.point.intensity.to_array().map(f64::from);
        let Some(slide) = &self.slide else { return intensity.map(|i| i * self.effective_solid_angle()) };
        let middle = |i: u32, range: f64| (f64::from(i) + 0.5) / f64::from(STEPS) * range;
        let mut sum = [0.0; 3];
        for (i, j) in (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j))) {
            let (angle, around) = (middle(i, self.cutoff), middle(j, TAU));
            let [x, y] = [libm::cos(around), libm::sin(around)].map(|c| c * libm::sin(angle));
            let away = self.axis * libm::cos(angle) + slide.across[0] * x + slide.across[1] * y;
            let falloff = ((self.cutoff - angle) / (self.cutoff - self.beam)).min(1.0);
            let weight = libm::sin(angle) * falloff * self.cutoff * TAU / f64::from(STEPS).powi(2);
            let shown = self.shown(slide, away).to_array();
            sum = [0, 1, 2].map(|c| sum[c] + weight * f64::from(shown[c]));
        }
        [0, 1, 2].map(|c| sum[c] * intensity[c])
    }

    /// Solid angle of the cone, directions weighted with their intensity relative to the full one: with beam b and cutoff c,
    /// 2π(1 − cos b) + 2π∫(c − θ)/(c − b)·sin θ dθ from b to c = 2π(1 − (sin c − sin b)/(c − b)).
    pub(super) fn effective_solid_angle(&self) -> f64 {
        let (b, c) = (self.beam, self.cutoff);
        // The difference of sines as a product, which keeps its digits, and so does the sinc of half of a small c − b.
        let half = 0.5 * (c - b);
        let sinc = if half > 0.0 { libm::sin(half) / half } else { 1.0 };
        TAU * (1.0 - libm::cos(0.5 * (c + b)) * sinc)
    }
}
