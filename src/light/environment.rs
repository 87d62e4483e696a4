//! A map of radiance around the scene, from infinitely far away, as Mitsuba 3 places its pixels: latitude and longitude
//! around the y axis of the map's own frame, its first row at +y, its middle at +z, its left and right edges at −z.
//!
//! With the polar angle θ from +y and the azimuth φ = atan2(x, −z), a map of w × h pixels is a grid of nodes: that of column
//! i and row j is at φ = 2π(i + ½)/w and θ = πj/(h − 1). Between them radiance is bilinear in φ, which wraps around, and θ.
//!
//! Directions are sampled in proportion to the luminance of that interpolation, not only of its pixels. In the plane of φ and θ
//! their density is bilinear, too, between luminance · sin θ at the nodes: so a cell between four nodes is picked by their mean,
//! a point of it by two linear densities, and per solid angle it is that over sin θ. What a surface does not see, or sees at a
//! low angle, is picked less often ([`Blocks`]). The rows at the poles, where sin θ is 0,
//! count [`POLE_SINE`] of that of their neighbours, so that the density is positive wherever radiance is.
//!
//! # MIS compensation
//!
//! Karlík, Šik, Vévoda, Skřivan and Křivánek 2019, *MIS Compensation: Optimizing Sampling Techniques in Multiple Importance
//! Sampling*: where other techniques find what is dim, lights can leave that to them. Of the luminance of every node its mean
//! over the sphere is subtracted (section 6.1), and what is below it is not sampled at all: right only in combination.

use super::LightSample;
use super::blocks::{Block, Blocks, Cell};
use crate::image::Picture;
use crate::math::float::{ONE_MINUS_EPSILON, min};
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp::{sin_cos_turns, turns, unit_to_linear};
use crate::shape::Hit;
use crate::spectrum::Rgb;
use glam::{DMat3, DVec3, Vec2, Vec3, Vec4};
use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};

/// Least part of the mean luminance that the darkest pixel must be below it for MIS compensation: otherwise what is left of a
/// map would be its noise. Mitsuba's number.
const COMPENSATED_CONTRAST: f64 = 0.01;

/// sin θ of the rows at the poles, over that of the next rows. Of a bright row at a pole the cells send L·sin θ₁/6 and are picked
/// by this times L·sin θ₁/2, so that 1/3 would be right for it alone; for others less is better.
const POLE_SINE: f64 = 0.25;

/// Largest density, in sr⁻¹: at a pole itself it would be infinite, within 10⁻³⁰ of it larger than this.
const MOST_DENSITY: f32 = 1e30;

/// A sky with a picture on it.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    /// Nodes to a row, at least two, and of rows, at least three.
    size: [u32; 2],
    /// Factor from the map's values to radiance in W·sr⁻¹·m⁻².
    scale: f32,
    /// The largest of the map's values.
    brightest: f32,
    /// From the map's frame to the scene's: columns of unit length at right angles.
    to_world: DMat3,
    /// Mean of the luminance over the sphere, in the map's values.
    mean: f64,
    /// The map, and how directions are sampled in combination with bsdf sampling.
    combined: Map,
    /// How they are alone, if otherwise: made when somebody asks, as most renders do not.
    alone: Option<Box<OnceLock<Map>>>,
}

/// Values at nodes, and a density of directions in proportion to them.
#[derive(Clone, Debug)]
struct Map {
    /// The value and the weight of every node, row by row, that of each row's first node once more at its end. A weight is
    /// the luminance, as far as it counts, over the mean, times sin θ.
    nodes: Vec<Vec4>,
    /// The cells between nodes.
    blocks: Blocks,
    /// Factor from a weight over sin θ at a point to a density in sr⁻¹.
    density: f32,
}

/// Directions that were sampled, by lane.
#[derive(Clone, Copy, Debug)]
pub struct FoundSky<const L: usize> {
    /// Unit vectors towards the sky, by coordinate.
    wi: [[f32; L]; 3],
    radiance: [Rgb; L],
    /// Densities in sr⁻¹.
    pdf: [f32; L],
}

impl<const L: usize> FoundSky<L> {
    /// To be overwritten.
    pub const NONE: Self = Self { wi: [[0.0; L]; 3], radiance: [Rgb::BLACK; L], pdf: [0.0; L] };

    /// What is in this lane.
    #[inline(always)]
    pub fn sample(&self, lane: usize) -> Option<LightSample> {
        let (radiance, pdf) = (self.radiance[lane], self.pdf[lane]);
        (pdf > 0.0 && pdf.is_finite() && !radiance.is_black()).then(|| LightSample {
            wi: Vec3::new(self.wi[0][lane], self.wi[1][lane], self.wi[2][lane]),
            radiance,
            pdf: Some(SolidAnglePdf(pdf)),
            end: None,
            on: Hit::NONE,
        })
    }
}

/// The nodes around cells, and the uniform numbers that pick points between them, by lane.
struct Corners<const L: usize> {
    /// Of the row nearer to a pole, and of the next.
    near: [[Vec4; 2]; L],
    far: [[Vec4; 2]; L],
    /// Their weights.
    weights: [[f32; L]; 4],
    column: [f32; L],
    /// Rows from that pole, and the sign of the pole's cosine.
    step: [f32; L],
    pole: [f32; L],
    u: [f32; L],
    v: [f32; L],
}

impl<const L: usize> Corners<L> {
    /// To be overwritten.
    const NONE: Self = Self {
        near: [[Vec4::ZERO; 2]; L],
        far: [[Vec4::ZERO; 2]; L],
        weights: [[0.0; L]; 4],
        column: [0.0; L],
        step: [0.0; L],
        pole: [0.0; L],
        u: [0.0; L],
        v: [0.0; L],
    };
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

impl EnvironmentLight {
    /// Least numbers of columns and rows of a map.
    pub const LEAST_SIZE: (u32, u32) = (2, 3);

    /// The values of `map` must be finite and not negative, it must have [`Self::LEAST_SIZE`], and the columns of `to_world`
    /// must be of unit length at right angles. `compensated`: sample only what is brighter than the mean where bsdf sampling
    /// finds the rest. `None` where the map is black.
    pub fn new(map: &Arc<Picture>, scale: f32, to_world: DMat3, compensated: bool) -> Option<Self> {
        if !(scale > 0.0) {
            return None;
        }
        let (mut sum, mut weights, mut least, mut brightest) = (0.0, 0.0, f64::INFINITY, 0.0);
        for (pixels, sine) in map.pixels().chunks(map.width() as usize).zip(sines(map.height())) {
            for pixel in pixels {
                let y = luminance(*pixel);
                sum += y * sine;
                weights += sine;
                least = least.min(y);
                brightest = f32::max(brightest, pixel.max_component());
            }
        }
        let mean = sum / weights;
        let size = [map.width(), map.height()];
        let of = |offset: f64| Map::new(map.pixels(), size, mean, offset, to_world);
        let contrasts = compensated && mean - least > COMPENSATED_CONTRAST * mean;
        let compensated = if contrasts { of(mean) } else { None };
        let alone = compensated.is_some().then(Box::default);
        let combined = match compensated {
            Some(compensated) => compensated,
            None => of(0.0)?,
        };
        Some(Self { size, scale, brightest, to_world, mean, combined, alone })
    }

    /// The largest radiance of any direction, in its largest channel.
    pub fn brightest(&self) -> f32 {
        self.brightest * self.scale
    }

    /// Mean luminance of the radiance over all directions.
    pub fn mean_luminance(&self) -> f32 {
        self.scale * self.mean as f32
    }

    /// Mean luminance of the irradiance over all directions that a surface may face: a quarter of the integral over the sphere.
    pub(super) fn mean_irradiance(&self) -> f64 {
        std::f64::consts::PI * f64::from(self.scale) * self.mean
    }

    /// A direction for a surface that scatters on the side of the unit normal `n`, or, where that is zero, on both sides.
    /// `combined`: what this misses is found by bsdf sampling.
    #[inline(always)]
    pub(super) fn sample(&self, n: Vec3, u: Vec2, combined: bool) -> Option<LightSample> {
        let mut found = FoundSky::<1>::NONE;
        self.sample_all(1, |_| Some((n, u)), combined, &mut found);
        found.sample(0)
    }

    /// [`Self::sample`] in each of so many lanes for a normal and a number, if there are some. The cells of all are found before anything is computed: finding
    /// one waits for memory at every step, and those of several can wait together; and what is computed then is computed in vectors, if
    /// there are enough ([`super::Quad`]).
    #[inline(always)]
    pub fn sample_all<const L: usize>(
        &self,
        count: usize,
        receiver: impl Fn(usize) -> Option<(Vec3, Vec2)>,
        combined: bool,
        found: &mut FoundSky<L>,
    ) {
        let map = self.map(combined);
        let mut blocks = [Block::default(); L];
        let mut factors = [0.0; L];
        let mut corners = Corners::<L>::NONE;
        for (i, block) in blocks.iter_mut().enumerate().take(count) {
            if let Some((n, u)) = receiver(i) {
                *block = map.blocks.pick(n, u);
            }
        }
        for (i, block) in blocks.iter().enumerate().take(count) {
            let cell = map.blocks.pick_in(block);
            factors[i] = cell.factor;
            self.put_nodes(map, &cell, &mut corners, i);
        }
        let [near0, near1, far0, far1] = &corners.weights;
        let (rows, columns) = ((2 * (self.size[1] - 1)) as f32, self.size[0] as f32);
        let (mut xs, mut ys, mut sines) = ([0.0f32; L], [0.0f32; L], [0.0f32; L]);
        let mut local = [[0.0f32; L]; 3];
        for i in 0..L {
            let y = unit_to_linear(corners.v[i], near0[i] + near1[i], far0[i] + far1[i]);
            let x = unit_to_linear(corners.u[i], between(y, near0[i], far0[i]), between(y, near1[i], far1[i]));
            let (sine, cos) = sin_cos_turns((corners.step[i] + y) / rows);
            let (sin_phi, cos_phi) = sin_cos_turns((corners.column[i] + x + 0.5) / columns);
            (xs[i], ys[i], sines[i]) = (x, y, sine);
            local[0][i] = sin_phi * sine;
            local[1][i] = cos * corners.pole[i];
            local[2][i] = -cos_phi * sine;
        }
        let [x, y, z] = [self.to_world.x_axis, self.to_world.y_axis, self.to_world.z_axis];
        for (axis, wi) in found.wi.iter_mut().enumerate() {
            for i in 0..L {
                let [a, b, c] = [f64::from(local[0][i]), f64::from(local[1][i]), f64::from(local[2][i])];
                wi[i] = (x[axis] * a + y[axis] * b + z[axis] * c) as f32;
            }
        }
        for i in 0..count {
            let place = Place { x: xs[i], y: ys[i], sine: sines[i] };
            let (radiance, pdf) = self.at(map, (corners.near[i], corners.far[i]), &place);
            found.radiance[i] = radiance;
            found.pdf[i] = (pdf * factors[i]).0;
        }
    }

    /// Puts into a lane what a cell that was found lies between, and where in it.
    #[inline(always)]
    fn put_nodes<const L: usize>(&self, map: &Map, cell: &Cell, corners: &mut Corners<L>, lane: usize) {
        let Cell { place: [column, row], u: rest, .. } = *cell;
        // From the pole that is nearer, where the digits of a polar angle count.
        let last = self.size[1] - 1;
        let below = 2 * row + 1 > last;
        let step = if below { last - 1 - row } else { row };
        let rows = if below { [row + 1, row] } else { [row, row + 1] };
        let (near, far) = (self.nodes(map, column, rows[0]), self.nodes(map, column, rows[1]));
        (corners.near[lane], corners.far[lane]) = (near, far);
        for (weights, node) in corners.weights.iter_mut().zip([near[0], near[1], far[0], far[1]]) {
            weights[lane] = node.w;
        }
        corners.column[lane] = column as f32;
        corners.step[lane] = step as f32;
        corners.pole[lane] = if below { -1.0 } else { 1.0 };
        corners.u[lane] = rest.x;
        // Rows are counted downwards.
        corners.v[lane] = if below { min(1.0 - rest.y, ONE_MINUS_EPSILON) } else { rest.y };
    }

    /// Radiance from the direction `w` of unit length, and the density with which [`Self::sample`] samples it for the normal `n`,
    /// in combination with bsdf sampling or not.
    #[inline(always)]
    pub fn seen(&self, w: &Vec3, n: Vec3, combined: bool) -> (Rgb, SolidAnglePdf) {
        let local = (self.to_world.transpose() * w.as_dvec3()).as_vec3();
        let [width, last] = [self.size[0], self.size[1] - 1];
        let sine = Vec2::new(local.x, local.z).length();
        let from_pole = 2.0 * turns(local.y.abs(), sine) * last as f32;
        let step = (from_pole as u32).min(last - 1);
        let y = min(from_pole - step as f32, 1.0);
        let rows = if local.y < 0.0 { [last - step, last - step - 1] } else { [step, step + 1] };
        let x = turns(-local.z, local.x) * width as f32 - 0.5;
        let floor = x.floor();
        // φ is between −π and π, and the quotient within half a turn and half a pixel of 0.
        let turns = if floor < 0.0 { width.cast_signed() } else { 0 };
        let column = (floor as i32 + turns).cast_unsigned();
        let map = self.map(combined);
        let nodes = (self.nodes(map, column, rows[0]), self.nodes(map, column, rows[1]));
        let (radiance, pdf) = self.at(map, nodes, &Place { x: x - floor, y, sine });
        let row = rows[0].min(rows[1]);
        (radiance, pdf * map.blocks.factor(n, [column, row]))
    }

    #[inline]
    fn map(&self, combined: bool) -> &Map {
        match &self.alone {
            Some(alone) if !combined => self.map_alone(alone),
            _ => &self.combined,
        }
    }

    #[cold]
    fn map_alone<'a>(&self, alone: &'a OnceLock<Map>) -> &'a Map {
        alone.get_or_init(|| {
            let stride = self.size[0] as usize + 1;
            let rows = self.combined.nodes.chunks(stride);
            let values: Vec<Rgb> = rows.flat_map(|row| &row[..stride - 1]).map(|node| Rgb(node.truncate())).collect();
            // What has weight above its mean has some.
            Map::new(&values, self.size, self.mean, 0.0, self.to_world).unwrap_or_else(|| self.combined.clone())
        })
    }

    /// The nodes of a row in a column and the next.
    #[inline(always)]
    fn nodes(&self, map: &Map, column: u32, row: u32) -> [Vec4; 2] {
        let first = row as usize * (self.size[0] as usize + 1) + column as usize;
        let nodes = &map.nodes[first..first + 2];
        [nodes[0], nodes[1]]
    }

    /// Radiance and density between the nodes of a row near a pole and the next.
    #[inline(always)]
    fn at(&self, map: &Map, (near, far): ([Vec4; 2], [Vec4; 2]), place: &Place) -> (Rgb, SolidAnglePdf) {
        let (x, y) = (place.x, place.y);
        let left = near[0] * (1.0 - y) + far[0] * y;
        let right = near[1] * (1.0 - y) + far[1] * y;
        let node = left * (1.0 - x) + right * x;
        // Not NaN at a pole where nothing counts.
        let pdf = if node.w > 0.0 { min(node.w * map.density / place.sine, MOST_DENSITY) } else { 0.0 };
        (Rgb(node.truncate()) * self.scale, SolidAnglePdf(pdf))
    }
}

#[inline(always)]
fn between(t: f32, a: f32, b: f32) -> f32 {
    (1.0 - t) * a + t * b
}

/// In f64, where the luminance of no colour vanishes.
#[inline]
fn luminance(colour: Rgb) -> f64 {
    Rgb::LUMINANCE.iter().zip(colour.to_array()).map(|(weight, c)| f64::from(*weight) * f64::from(c)).sum()
}

/// What sin θ counts in each of so many rows.
fn sines(rows: u32) -> impl Iterator<Item = f64> {
    let last = rows - 1;
    let sine = move |steps: u32| libm::sin(std::f64::consts::PI * f64::from(steps) / f64::from(last));
    (0..rows).map(move |row| match row.min(last - row) {
        0 => POLE_SINE * sine(1),
        steps => sine(steps),
    })
}

impl Map {
    /// With weights by luminances over their `mean`, less `offset`. `None` where nothing is left.
    fn new(values: &[Rgb], [width, height]: [u32; 2], mean: f64, offset: f64, to_world: DMat3) -> Option<Self> {
        let stride = width as usize + 1;
        let mut nodes = Vec::with_capacity(stride * height as usize);
        for (row, sine) in values.chunks(width as usize).zip(sines(height)) {
            let node = |value: &Rgb| {
                let weight = (luminance(*value) - offset).max(0.0) / mean * sine;
                value.0.extend(weight as f32)
            };
            nodes.extend(row.iter().chain(&row[..1]).map(node));
        }
        let weight = |x: usize, y: usize| {
            let corners =
                [y * stride + x, (y + 1) * stride + x].map(|i| f64::from(nodes[i].w) + f64::from(nodes[i + 1].w));
            0.25 * (corners[0] + corners[1])
        };
        let angles = |steps: u32, all: f64, offset: f64| (0..=steps).map(move |i| TAU * (f64::from(i) + offset) / all);
        let [across, down] = [angles(width, width.into(), 0.5), angles(height - 1, f64::from(2 * (height - 1)), 0.0)]
            .map(|angles| angles.map(|angle| (libm::sin(angle), libm::cos(angle))).collect::<Vec<_>>());
        let corner = |x: usize, y: usize| {
            let ((sin_phi, cos_phi), (sin, cos)) = (across[x], down[y]);
            to_world * DVec3::new(sin_phi * sin, cos, -cos_phi * sin)
        };
        let (blocks, sum) = Blocks::new([width as usize, height as usize - 1], weight, corner)?;
        // Cells to the radian in either direction.
        let per_radian = [f64::from(width) / TAU, f64::from(height - 1) / std::f64::consts::PI];
        Some(Self { nodes, blocks, density: (per_radian[0] * per_radian[1] / sum) as f32 })
    }
}
