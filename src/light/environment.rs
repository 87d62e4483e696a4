//! A map of radiance around the scene, from infinitely far away, as Mitsuba 3 places its pixels: latitude and longitude
//! around the y axis of the map's own frame, its first row at +y, its middle at +z, its left and right edges at −z.
//!
//! With the polar angle θ from +y and the azimuth φ = atan2(x, −z), a map of w × h pixels is a grid of nodes: that of column
//! i and row j is at φ = 2π(i + ½)/w and θ = πj/(h − 1). Between them radiance is bilinear in φ, which wraps around, and θ.
//!
//! Directions are sampled in proportion to the luminance of that interpolation, not only of its pixels. In the plane of φ and θ
//! their density is bilinear, too, between luminance · sin θ at the nodes: so a cell between four nodes is picked by their mean,
//! a point of it by two linear densities, and per solid angle it is that over sin θ. The rows at the poles, where sin θ is 0,
//! count [`POLE_SINE`] of that of their neighbours, so that the density is positive wherever radiance is.
//!
//! # MIS compensation
//!
//! Karlík, Šik, Vévoda, Skřivan and Křivánek 2019, *MIS Compensation: Optimizing Sampling Techniques in Multiple Importance
//! Sampling*: where other techniques find what is dim, lights can leave that to them. Of the luminance of every node its mean
//! over the sphere is subtracted (section 6.1), and what is below it is not sampled at all: right only in combination.

use super::LightSample;
use crate::image::Picture;
use crate::math::float::{ONE_MINUS_EPSILON, min};
use crate::sampling::cells::Cells;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp::{sin_cos, unit_to_linear};
use crate::shape::Hit;
use crate::spectrum::Rgb;
use glam::{DMat3, Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

/// Least part of the mean luminance that the darkest pixel must be below it for MIS compensation: otherwise what is left of a
/// map would be its noise. Mitsuba's number.
const COMPENSATED_CONTRAST: f64 = 0.01;

/// sin θ of the rows at the poles, over that of the next rows. Of a bright row at a pole the cells send L·sin θ₁/6 and are picked
/// by this times L·sin θ₁/2, so that 1/3 would be right for it alone; for others less is better.
const POLE_SINE: f64 = 0.25;

/// Largest density, in sr⁻¹: at a pole itself it would be infinite, within 10⁻³⁰ of it larger than this.
const MOST_DENSITY: f64 = 1e30;

/// A sky with a picture on it.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    /// At least two columns and three rows of values that are not negative.
    map: Arc<Picture>,
    /// Factor from its values to radiance in W·sr⁻¹·m⁻².
    scale: f32,
    /// From the map's frame to the scene's: columns of unit length at right angles.
    to_world: DMat3,
    /// What sin θ counts in each row.
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
    /// Factor from what is left of them, times sin θ at the nodes and over it at the point, to a density in sr⁻¹.
    density: f64,
}

/// Where between four nodes a direction is.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Between the columns, from 0 to 1.
    x: f32,
    /// Between the rows, from that nearer to a pole.
    y: f32,
    /// sin θ.
    sine: f32,
}

/// What is at the nodes around a place, by row and column.
#[derive(Clone, Copy, Debug)]
struct Nodes {
    radiance: [[Rgb; 2]; 2],
    /// Luminances, as far as they count, times sin θ.
    weights: [[f64; 2]; 2],
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
        let sine = |steps: u32| libm::sin(std::f64::consts::PI * f64::from(steps) / f64::from(last));
        let pole = POLE_SINE * sine(1);
        let counted = |steps: u32| if steps == 0 { pole } else { sine(steps) };
        let sines: Vec<f32> = (0..=last).map(|row| counted(row.min(last - row)) as f32).collect();
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
        let columns = [column as u32, self.next_column(column as u32)];
        let nodes = self.nodes(columns, rows.map(|r| r as u32), sampling);
        let [near, far] = nodes.weights;
        // Rows are counted downwards.
        let v = if below { min(1.0 - rest.y, ONE_MINUS_EPSILON) } else { rest.y };
        let y = unit_to_linear(v, near[0] + near[1], far[0] + far[1]);
        let between = |i: usize| near[i] + (far[i] - near[i]) * f64::from(y);
        let x = unit_to_linear(rest.x, between(0), between(1));
        let (sine, cos) = sin_cos((step as f32 + y) / last as f32 * PI);
        let (sin_phi, cos_phi) = sin_cos((column as f32 + x + 0.5) / self.map.width() as f32 * TAU);
        let local = Vec3::new(sin_phi * sine, if below { -cos } else { cos }, -cos_phi * sine);
        let wi = (self.to_world * local.as_dvec3()).as_vec3();
        let (radiance, pdf) = self.at(&nodes, &Place { x, y, sine }, sampling);
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
        let floor = x.floor();
        // φ is between −π and π, and the quotient within half a turn and half a pixel of 0.
        let turns = if floor < 0.0 { self.map.width().cast_signed() } else { 0 };
        let column = (floor as i32 + turns).cast_unsigned();
        let sampling = self.sampling(combined);
        let nodes = self.nodes([column, self.next_column(column)], rows.map(|r| r as u32), sampling);
        self.at(&nodes, &Place { x: x - floor, y, sine: sin }, sampling)
    }

    #[inline]
    fn sampling(&self, combined: bool) -> &Sampling {
        self.combined.as_ref().filter(|_| combined).unwrap_or(&self.sampling)
    }

    #[inline(always)]
    fn next_column(&self, column: u32) -> u32 {
        if column + 1 < self.map.width() { column + 1 } else { 0 }
    }

    /// The nodes in two columns of two rows.
    #[inline(always)]
    fn nodes(&self, columns: [u32; 2], rows: [u32; 2], sampling: &Sampling) -> Nodes {
        let mut nodes = Nodes { radiance: [[Rgb::BLACK; 2]; 2], weights: [[0.0; 2]; 2] };
        for (j, row) in rows.into_iter().enumerate() {
            let sine = f64::from(self.sines[row as usize]);
            for (i, column) in columns.into_iter().enumerate() {
                let radiance = self.map.get(column, row);
                nodes.radiance[j][i] = radiance;
                nodes.weights[j][i] = sampling.importance(radiance) * sine;
            }
        }
        nodes
    }

    #[inline(always)]
    fn at(&self, nodes: &Nodes, place: &Place, sampling: &Sampling) -> (Rgb, SolidAnglePdf) {
        let (mut radiance, mut weight) = (Rgb::BLACK, 0.0);
        for (j, v) in [1.0 - place.y, place.y].into_iter().enumerate() {
            for (i, u) in [1.0 - place.x, place.x].into_iter().enumerate() {
                radiance += nodes.radiance[j][i] * (u * v);
                weight += nodes.weights[j][i] * f64::from(u * v);
            }
        }
        // Not NaN at a pole where nothing counts.
        let pdf =
            if weight > 0.0 { (weight * sampling.density / f64::from(place.sine)).min(MOST_DENSITY) } else { 0.0 };
        (radiance * self.scale, SolidAnglePdf(pdf as f32))
    }
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
        // The weights of a row's nodes, the first again after the last.
        let weights = |row: u32| -> Vec<f64> {
            let sine = f64::from(sines[row as usize]);
            (0..=width).map(|x| (luminance(map.get(x % width, row)) - offset).max(0.0) * sine).collect()
        };
        let (mut above, mut below) = (Vec::new(), weights(0));
        let cell = |x: usize, y: usize| {
            if x == 0 {
                above = std::mem::replace(&mut below, weights(y as u32 + 1));
            }
            0.25 * (above[x] + above[x + 1] + below[x] + below[x + 1])
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
