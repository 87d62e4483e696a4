//! A point that shines through a picture, as a slide projector does: the reciprocal of a pinhole camera, as Mitsuba 3 has it.
//!
//! A surface that faces the projector at distance 1 along its axis receives π times the picture as irradiance (that π is
//! Mitsuba's), and any surface parallel to it the same over the square of its distance: E⊥ = π·v/(z²·cos θ) for a point at
//! depth z in a direction θ from the axis, where the picture has the value v. Pixels are interpolated bilinearly; half a pixel
//! from an edge with the opposite edge.

use super::{LightSample, PointLight};
use crate::image::Picture;
use crate::spectrum::Rgb;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// A light without size: only sampling it finds it.
#[derive(Clone, Debug)]
pub struct ProjectorLight {
    /// A point light that is nowhere dimmer.
    pub point: PointLight,
    /// What it shows, not black.
    map: Arc<Picture>,
    /// Factor from π times its values to irradiance at depth 1.
    scale: f64,
    /// Unit vectors to the left of the picture, to its top, and along the axis, at right angles.
    axes: [DVec3; 3],
    /// Half the picture's width and height at depth 1.
    half: DVec2,
}

impl ProjectorLight {
    /// `scale` is the file's times the square of [`crate::scene::Scene::unit`]; `point` has any intensity.
    pub fn new(point: PointLight, map: Arc<Picture>, scale: f64, axes: [DVec3; 3], half_width: f64) -> Self {
        let half = half_width * DVec2::new(1.0, f64::from(map.height()) / f64::from(map.width()));
        let brightest = map.pixels().iter().map(|p| p.max_component()).fold(0.0, f32::max);
        // I = E⊥·d² = π·v/cos³ θ is largest in a corner.
        let tan_squared = half.length_squared();
        let most = PI * scale * (1.0 + tan_squared) * (1.0 + tan_squared).sqrt() * f64::from(brightest);
        let point = PointLight { intensity: Rgb::splat(most as f32), ..point };
        Self { point, map, scale, axes, half }
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
        let radiance = self.value(place).map(|v| (f64::from(v) * factor) as f32);
        let sample = self.point.sample(p)?;
        (!radiance.is_black()).then_some(LightSample { radiance, ..sample })
    }

    /// Radiant flux per channel: E integrated over the picture at depth 1, of which the mean of its pixels is the mean.
    pub(super) fn power(&self) -> [f64; 3] {
        let sums = self.map.pixels().iter().fold([0.0; 3], |sums: [f64; 3], p| {
            let [r, g, b] = p.to_array().map(f64::from);
            [sums[0] + r, sums[1] + g, sums[2] + b]
        });
        let area = 4.0 * self.half.x * self.half.y;
        sums.map(|sum| PI * self.scale * area * sum / self.map.pixels().len() as f64)
    }

    /// The picture at a place from (0, 0) at its upper left to (1, 1).
    fn value(&self, place: DVec2) -> Rgb {
        let size = [self.map.width(), self.map.height()];
        let at = place * DVec2::from(size.map(f64::from)) - 0.5;
        let first = at.floor();
        let weight = (at - first).as_vec2();
        let wrapped = |i: f64, size: u32| (i as i64).rem_euclid(i64::from(size)) as u32;
        let [x0, x1] = [0.0, 1.0].map(|d| wrapped(first.x + d, size[0]));
        let [y0, y1] = [0.0, 1.0].map(|d| wrapped(first.y + d, size[1]));
        let row = |y| self.map.get(x0, y) * (1.0 - weight.x) + self.map.get(x1, y) * weight.x;
        row(y0) * (1.0 - weight.y) + row(y1) * weight.y
    }
}
