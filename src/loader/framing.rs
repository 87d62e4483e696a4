//! A camera and light for what comes without: it is looked at a little from the right and from above, its front being +z
//! and +y up, as large as the frame allows. Lengths are multiples of its size, so that the picture is the same whatever the
//! unit.

use crate::description::{
    Camera, ComponentFormat, Crop, FieldOfView, Film, Filter, FovAxis, LightKind, Picture, PixelFormat, Projection,
    Sampler,
};
use crate::error::Span;
use crate::spectrum::Rgb;
use glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Where the camera stands, seen from what it looks at.
const VIEW: DVec3 = DVec3::new(0.5, 0.42, 1.0);
/// Field of view in degrees along the shorter side.
const FOV: f64 = 30.0;
/// Part of the frame that may be filled.
const FILL: f64 = 0.88;
/// Pixels across and down.
pub(crate) const SIZE: (u32, u32) = (768, 576);
/// Samples per pixel, and a seed.
pub(crate) const SAMPLER: Sampler = Sampler { sample_count: 64, seed: 0 };
/// Nearest and farthest visible distance, in distances of the camera.
const CLIP: (f64, f64) = (1e-3, 1e3);
/// Where the brightest light comes from.
pub(crate) const LAMP: DVec3 = DVec3::new(-0.9, 1.3, 0.8);

/// How something is looked at.
pub(crate) struct View {
    /// Middle of its bounding box, ...
    pub(crate) centre: DVec3,
    /// ... and the distance of the farthest point from it.
    pub(crate) radius: f64,
    /// Height of its lowest point.
    pub(crate) floor: f64,
    /// The camera's axes: left, up, forward.
    axes: DMat3,
    distance: f64,
}

impl View {
    /// Of something with these points; `None` where they are all the same.
    pub(crate) fn of(points: impl Iterator<Item = DVec3> + Clone) -> Option<Self> {
        let (low, high) =
            points.clone().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let centre = low * 0.5 + high * 0.5;
        let forward = -VIEW.normalize();
        let left = DVec3::Y.cross(forward).normalize();
        let axes = DMat3::from_cols(left, forward.cross(left), forward);
        // The nearest place from which every point is inside the frame, whichever its longer side.
        let reach = libm::tan(0.5 * FOV.to_radians()) * FILL;
        let (mut radius, mut distance) = (0.0_f64, 0.0_f64);
        for p in points {
            let seen = axes.transpose() * (p - centre);
            radius = radius.max(seen.length());
            distance = distance.max(seen.x.abs().max(seen.y.abs()) / reach - seen.z);
        }
        (radius > 0.0 && radius.is_finite()).then_some(Self { centre, radius, floor: low.y, axes, distance })
    }

    pub(crate) fn camera(&self, at: &Span) -> Camera {
        Camera {
            at: at.clone(),
            to_world: DAffine3::from_mat3_translation(self.axes, self.centre - self.axes.z_axis * self.distance),
            projection: Projection::Perspective {
                fov: FieldOfView { degrees: FOV, axis: FovAxis::Smaller },
                principal_point_offset: (0.0, 0.0),
            },
            near_clip: CLIP.0 * self.distance,
            far_clip: CLIP.1 * self.distance,
            film: film(at, SIZE),
            sampler: SAMPLER,
        }
    }
}

/// A film of this size, all else by default.
pub(crate) fn film(at: &Span, (width, height): (u32, u32)) -> Film {
    Film {
        at: at.clone(),
        width,
        height,
        crop: Crop { x: 0, y: 0, width, height },
        filter: Filter::DEFAULT,
        sample_border: false,
        component_format: ComponentFormat::Half,
        pixel_format: PixelFormat::Rgb,
    }
}

/// Columns and rows of the surroundings.
const SKY_SIZE: (u32, u32) = (256, 129);
/// Radiance at the zenith, just above the horizon, just below it, and straight down.
const SKY: [Rgb; 4] =
    [Rgb::new(0.38, 0.46, 0.58), Rgb::new(0.72, 0.74, 0.76), Rgb::new(0.2, 0.19, 0.18), Rgb::new(0.12, 0.115, 0.11)];
/// Radiance of the brightest direction beside the sky's, and how fast it falls off: κ of exp(κ(cos θ − 1)), which makes a
/// spot about as wide as a window.
const SUN: (Rgb, f64) = (Rgb::new(15.0, 14.2, 13.1), 60.0);

/// Surroundings for what comes without light: a sky with a bright spot at the upper left, and a dark ground whose horizon
/// mirrors show. They are infinitely far away, so that they stand before no camera that a file has.
pub(crate) fn surroundings() -> LightKind {
    let (width, height) = SKY_SIZE;
    let lamp = LAMP.normalize();
    let mut map = Picture::new(width, height);
    for y in 0..height {
        let theta = PI * f64::from(y) / f64::from(height - 1);
        let (sin, cos) = (libm::sin(theta), libm::cos(theta));
        let [from, to] = if cos >= 0.0 { [SKY[1], SKY[0]] } else { [SKY[2], SKY[3]] };
        let up = cos.abs() as f32;
        let sky = from * (1.0 - up) + to * up;
        for x in 0..width {
            let phi = TAU * (f64::from(x) + 0.5) / f64::from(width);
            let direction = DVec3::new(sin * libm::sin(phi), cos, -sin * libm::cos(phi));
            let spot = libm::exp(SUN.1 * (direction.dot(lamp) - 1.0)) as f32;
            map.set(x, y, sky + SUN.0 * spot);
        }
    }
    LightKind::Environment { map: Arc::new(map), scale: 1.0, to_world: DMat3::IDENTITY, mis_compensation: true }
}
