//! A point that shines through a picture, as a slide projector does: the reciprocal of a pinhole camera, as Mitsuba 3 has it.
//!
//! A surface that faces the projector at distance 1 along its axis receives π times the picture as irradiance (that π is
//! Mitsuba's), and any surface parallel to it the same over the square of its distance: E⊥ = π·v/(z²·cos θ) for a point at
//! depth z in a direction θ from the axis, where the picture has the value v. The picture is the unit square of a texture.

use super::{LightSample, PointLight, Slide};
use crate::spectrum::Rgb;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// A light without size: only sampling it finds it.
#[derive(Clone, Debug)]
pub struct ProjectorLight {
    /// A point light that is nowhere dimmer.
    pub point: PointLight,
    /// What it shows, not black.
    slide: Slide,
    /// Factor from π times its values to irradiance at depth 1.
    scale: f64,
    /// Unit vectors to the left of the picture, to its top, and along the axis, at right angles.
    axes: [DVec3; 3],
    /// Half the picture's width and height at depth 1.
    half: DVec2,
}

impl ProjectorLight {
    /// `scale` is the file's times the square of [`crate::scene::Scene::unit`]; `point` has any intensity.
    pub fn new(point: PointLight, slide: Slide, scale: f64, axes: [DVec3; 3], half_width: f64) -> Self {
        let half = half_width * DVec2::new(1.0, 1.0 / slide.aspect());
        // I = E⊥·d² = π·v/cos³ θ is largest in a corner.
        let tan_squared = half.length_squared();
        let most = PI * scale * (1.0 + tan_squared) * (1.0 + tan_squared).sqrt() * f64::from(slide.largest());
        let point = PointLight { intensity: Rgb::splat(most as f32), ..point };
        Self { point, slide, scale, axes, half }
    }

    #[inline(never)]
    pub(super) fn sample(&self, p: &DVec3) -> Option<LightSample> {
        let away = *p - self.point.position;
        let [left, up, depth] = self.axes.map(|axis| axis.dot(away));
        if !(depth > 0.0) {
            return None;
        }
        let place = 0.5 - 0.5 * DVec2::new(left, up) / (depth * self.half);
        if !(place.cmpge(DVec2::ZERO).all() && place.cmple(DVec2::ONE).all()) {
            return None;
        }
        let factor = PI * self.scale * away.length() / (depth * depth * depth);
        let radiance = self.slide.colour(place.as_vec2()).map(|v| (f64::from(v) * factor) as f32);
        let sample = self.point.sample(p)?;
        (!radiance.is_black()).then_some(LightSample { radiance, ..sample })
    }

    /// The axis, the angle from it of the picture's corners, and the picture's area at depth 1.
    pub(super) fn cone(&self) -> (DVec3, f64, f64) {
        (self.axes[2], libm::atan(self.half.length()), 4.0 * self.half.x * self.half.y)
    }

    /// Radiant flux per channel: E integrated over the picture at depth 1.
    pub(super) fn power(&self) -> [f64; 3] {
        let area = 4.0 * self.half.x * self.half.y;
        self.slide.mean().map(|mean| PI * self.scale * area * mean)
    }
}
