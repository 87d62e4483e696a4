//! A point that shines into a cone: with its full radiant intensity up to an angle from the axis, the beam's width, from there
//! falling linearly with the angle to nothing at the cutoff, as Mitsuba 3 has it.

use super::{LightSample, PointLight};
use glam::DVec3;
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
        (!sample.radiance.is_black()).then_some(sample)
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
