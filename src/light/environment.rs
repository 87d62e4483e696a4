//! A map of radiance around the scene, from infinitely far away, as Mitsuba 3 places its pixels: latitude and longitude
//! around the y axis of the map's own frame, its first row at +y, its middle at +z, its left and right edges at −z.
//!
//! With the polar angle θ from +y and the azimuth φ = atan2(x, −z), a map of w × h pixels is a grid of nodes: that of column
//! i and row j is at φ = 2π(i + ½)/w and θ = πj/(h − 1). Between them radiance is bilinear in φ, which wraps around, and θ.
//!
//! Directions are sampled in proportion to the luminance of that interpolation, not only of its pixels: a cell between four
//! nodes by the integral over it, then a point of the cell. The factor sin θ of the solid angle is taken to be linear within
//! a cell, so that the integrals are closed; what that leaves out is part of the density, less than θ²/6 of it for cells of
//! height θ. So the density is positive wherever radiance is.
//!
//! # MIS compensation
//!
//! Karlík, Šik, Vévoda, Skřivan and Křivánek 2019, *MIS Compensation: Optimizing Sampling Techniques in Multiple Importance
//! Sampling*: where other techniques find what is dim, lights can leave that to them. Of the luminance of every node its mean
//! over the sphere is subtracted (section 6.1), and what is below it is not sampled at all: right only in combination.

use super::LightSample;
use crate::image::Picture;
use crate::math::float::min;
use crate::sampling::cells::Cells;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp::{sin_cos, unit_to_linear, unit_to_product};
use crate::shape::Hit;
use crate::spectrum::Rgb;
use glam::{DMat3, Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

/// Least part of the mean luminance that the darkest pixel must be below it for MIS compensation: otherwise what is left of a
/// map would be its noise. Mitsuba's number.
const COMPENSATED_CONTRAST: f64 = 0.01;

/// A sky with a picture on it.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    /// At least two columns and three rows of values that are not negative.
    map: Arc<Picture>,
    /// Factor from its values to radiance in W·sr⁻¹·m⁻².
    scale: f32,
    /// From the map's frame to the scene's: columns of unit length at right angles.
    to_world: DMat3,
    /// sin θ of each row.
    sines: Vec<f32>,
    /// How directions are sampled.
    sampling: Sampling,
    /// How they are in combination with bsdf sampling, if otherwise.
    combined: Option<Sampling>,
}

/// A density of directions.
#[derive(Clone, Debug)]
struct Sampling {
    /// The cells between nodes, row by row.
    cells: Cells,
    /// What is subtracted from luminances.
    offset: f64,
    /// Factor from what is left of them to a density in sr⁻¹, but for the ratio of the linear sin θ to the true one.
    density: f64,
}

/// Where in the map a direction is.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// The columns of the nodes around it.
    columns: [u32; 2],
    /// Their rows: first that nearer to a pole.
    rows: [u32; 2],
    /// Where between the columns, from 0 to 1.
    x: f32,
    /// Where between the rows.
    y: f32,
    /// What is linear within the cell, over sin θ.
    sine_ratio: f32,
}

impl EnvironmentLight {
    /// Least numbers of columns and rows of a map.
    pub const LEAST_SIZE: (u32, u32) = (2, 3);

    /// The values of `map` must be finite and not negative, it must have [`Self::LEAST_SIZE`], and the columns of `to_world`
    /// must be of unit length at right angles. `compensated`: sample only what is brighter than the mean where bsdf sampling
    /// finds the rest. `None` where the map is black.
    pub fn new(map: Arc<Picture>, scale: f32, to_world: DMat3, compensated: bool) -> Option<Self> {
        if !(scale > 0.0) {
            return None;
        }
        let last = map.height() - 1;
        let sines: Vec<f32> = (0..=last).map(|row| row_sine(row.min(last - row), last)).collect();
        let sampling = Sampling::new(&map, &sines, 0.0)?;
        let combined = compensated.then(|| Sampling::compensated(&map, &sines)).flatten();
        Some(Self { map, scale, to_world, sines, sampling, combined })
    }

    /// The largest radiance of any direction, in its largest channel.
    pub fn brightest(&self) -> f32 {
        self.map.pixels().iter().map(|p| p.max_component()).fold(0.0, f32::max) * self.scale
    }

    /// Mean luminance of the irradiance over all directions that a surface may face: a quarter of the integral over the sphere,
    /// which is that of the density over its factor.
    pub(super) fn mean_irradiance(&self) -> f64 {
        0.25 * f64::from(self.scale) / self.sampling.density
    }

    /// `combined`: what this misses is found by bsdf sampling.
    #[inline(never)]
    pub(super) fn sample(&self, u: Vec2, combined: bool) -> Option<LightSample> {
        let sampling = self.sampling(combined);
        let last = self.sines.len() - 1;
        let ([column, row], rest) = sampling.cells.sample(u);
        // From the pole that is nearer, where the digits of a polar angle count.
        let below = 2 * row + 1 > last;
        let step = if below { last - 1 - row } else { row };
        let rows = if below { [row + 1, row] } else { [row, row + 1] };
        let mut place = Place {
            columns: self.columns(column as i32),
            rows: rows.map(|r| r as u32),
            x: 0.0,
            y: 0.0,
            sine_ratio: 0.0,
        };
        let [near, far] = self.nodes(&place).map(|row| row.map(|p| sampling.importance(p)));
        let sines = [self.sines[step].into(), self.sines[step + 1].into()];
        place.y = unit_to_product(rest.y, [near[0] + near[1], far[0] + far[1]], sines);
        let between = |i: usize| near[i] + (far[i] - near[i]) * f64::from(place.y);
        place.x = unit_to_linear(rest.x, between(0), between(1));
        let (sin, cos) = sin_cos((step as f32 + place.y) / last as f32 * PI);
        place.sine_ratio = self.sine_ratio(step, place.y, sin);
        let phi = (column as f32 + place.x + 0.5) / self.map.width() as f32 * TAU;
        let (sin_phi, cos_phi) = sin_cos(phi);
        let local = Vec3::new(sin_phi * sin, if below { -cos } else { cos }, -cos_phi * sin);
        let wi = (self.to_world * local.as_dvec3()).as_vec3();
        let (radiance, pdf) = self.at(&place, sampling);
        (pdf.0 > 0.0 && pdf.0.is_finite() && !radiance.is_black()).then_some(LightSample {
            wi,
            radiance,
            pdf: Some(pdf),
            end: None,
            on: Hit::NONE,
        })
    }

    /// Radiance from the direction `w` of unit length, and the density with which it is sampled, in combination with bsdf
    /// sampling or not.
    #[inline(never)]
    pub fn seen(&self, &w: &Vec3, combined: bool) -> (Rgb, SolidAnglePdf) {
        let local = (self.to_world.transpose() * w.as_dvec3()).as_vec3();
        let last = self.sines.len() - 1;
        let sin = Vec2::new(local.x, local.z).length();
        let from_pole = libm::atan2f(sin, local.y.abs()) / PI * last as f32;
        let step = (from_pole as usize).min(last - 1);
        let y = min(from_pole - step as f32, 1.0);
        let rows = if local.y < 0.0 { [last - step, last - step - 1] } else { [step, step + 1] };
        let x = libm::atan2f(local.x, -local.z) / TAU * self.map.width() as f32 - 0.5;
        let column = x.floor();
        let place = Place {
            columns: self.columns(column as i32),
            rows: rows.map(|r| r as u32),
            x: x - column,
            y,
            sine_ratio: self.sine_ratio(step, y, sin),
        };
        self.at(&place, self.sampling(combined))
    }

    #[inline]
    fn sampling(&self, combined: bool) -> &Sampling {
        self.combined.as_ref().filter(|_| combined).unwrap_or(&self.sampling)
    }

    /// A column and the next.
    #[inline]
    fn columns(&self, column: i32) -> [u32; 2] {
        let width = self.map.width().cast_signed();
        [column, column + 1].map(|c| c.rem_euclid(width).cast_unsigned())
    }

    /// What sin θ is within a cell that begins `step` rows from a pole, over what it should be.
    #[inline]
    fn sine_ratio(&self, step: usize, y: f32, sin: f32) -> f32 {
        let (a, b) = (self.sines[step], self.sines[step + 1]);
        // At a pole itself the limit.
        if sin > 0.0 { (a + (b - a) * y) / sin } else { b * (self.sines.len() - 1) as f32 / PI }
    }

    /// The pixels around a place, by row and column.
    #[inline]
    fn nodes(&self, place: &Place) -> [[Rgb; 2]; 2] {
        place.rows.map(|row| place.columns.map(|column| self.map.get(column, row)))
    }

    #[inline]
    fn at(&self, place: &Place, sampling: &Sampling) -> (Rgb, SolidAnglePdf) {
        let nodes = self.nodes(place);
        let weights = [1.0 - place.y, place.y].map(|v| [(1.0 - place.x) * v, place.x * v]);
        let (mut radiance, mut importance) = (Rgb::BLACK, 0.0);
        for (node, weight) in nodes.iter().flatten().zip(weights.iter().flatten()) {
            radiance += *node * *weight;
            importance += sampling.importance(*node) * f64::from(*weight);
        }
        let pdf = importance * sampling.density * f64::from(place.sine_ratio);
        (radiance * self.scale, SolidAnglePdf(pdf as f32))
    }
}

/// sin θ of the row that is `steps` from a pole, of rows from 0 to `last`.
fn row_sine(steps: u32, last: u32) -> f32 {
    libm::sin(std::f64::consts::PI * f64::from(steps) / f64::from(last)) as f32
}

/// In f64, where the luminance of no colour vanishes.
#[inline]
fn luminance(colour: Rgb) -> f64 {
    Rgb::LUMINANCE.iter().zip(colour.to_array()).map(|(weight, c)| f64::from(*weight) * f64::from(c)).sum()
}

impl Sampling {
    /// What a node counts.
    #[inline]
    fn importance(&self, node: Rgb) -> f64 {
        (luminance(node) - self.offset).max(0.0)
    }

    /// `None` where nothing is left after `offset` is subtracted from the luminances.
    fn new(map: &Picture, sines: &[f32], offset: f64) -> Option<Self> {
        let (width, height) = (map.width(), map.height());
        // The importances of a row's nodes, the first again after the last.
        let importances = |row: u32| -> Vec<f64> {
            (0..=width).map(|x| (luminance(map.get(x % width, row)) - offset).max(0.0)).collect()
        };
        let (mut above, mut below) = (Vec::new(), importances(0));
        let cell = |x: usize, y: usize| {
            if x == 0 {
                above = std::mem::replace(&mut below, importances(y as u32 + 1));
            }
            // The integral of linear importance times linear sine, of the mean of two columns.
            let [a, b] = [&above, &below].map(|row| 0.5 * (row[x] + row[x + 1]));
            let [s, t] = [sines[y], sines[y + 1]].map(f64::from);
            (2.0 * (a * s + b * t) + a * t + b * s) / 6.0
        };
        let (cells, sum) = Cells::new(width as usize, height as usize - 1, cell)?;
        // Cells to the radian in either direction.
        let per_radian = [f64::from(width) / std::f64::consts::TAU, f64::from(height - 1) / std::f64::consts::PI];
        Some(Self { cells, offset, density: per_radian[0] * per_radian[1] / sum })
    }

    /// For use together with bsdf sampling; `None` where the map is nearly of one luminance.
    fn compensated(map: &Picture, sines: &[f32]) -> Option<Self> {
        let (mut sum, mut weights, mut least) = (0.0, 0.0, f64::INFINITY);
        for (pixels, sine) in map.pixels().chunks(map.width() as usize).zip(sines) {
            for y in pixels.iter().map(|p| luminance(*p)) {
                sum += y * f64::from(*sine);
                weights += f64::from(*sine);
                least = least.min(y);
            }
        }
        let mean = sum / weights;
        if mean - least > COMPENSATED_CONTRAST * mean { Self::new(map, sines, mean) } else { None }
    }
}
