//! Which paths carry the error: a picture taken apart into classes of light, and the variance of each.
//!
//! A picture is the sum of its classes' pictures, P = ΣPᶜ. With the weights w of [`super::estimate`] the error of a class is
//! mean(w·Var Pᶜ), its variance being estimated from pictures of different seeds. The classes' errors and their covariances,
//! which are what remains, add up to mean(w·Var P).
//!
//! Every sample counts in its own pixel, whatever the film's reconstruction filter: the split is that of the box filter.

use super::estimate::{Reference, weights};
use super::run::{Interrupted, Stage};
use crate::accel::Hit;
use crate::bsdf::Bsdf;
use crate::film::{SampleId, TILE_SIZE};
use crate::image::{Area, Crop};
use crate::integrator::record::{Event, Record};
use crate::material::Material;
use crate::math::ray::Ray;
use crate::render::RenderSettings;
use crate::scene::Scene;
use crate::spectrum::Rgb;
use rayon::prelude::*;
use serde::Serialize;

/// The longest paths that are a class of their own; all longer ones are one more.
const LONGEST: usize = 8;

/// How light was found.
const TECHNIQUES: [&str; 4] =
    ["seen by the camera", "a light sampled", "a light hit after a smooth lobe", "a light hit after a delta lobe"];

/// What the first surface did. Light that is seen directly was scattered by none.
const LOBES: [&str; 7] = [
    "no surface",
    "diffuse reflection",
    "glossy reflection",
    "mirror reflection",
    "diffuse transmission",
    "glossy transmission",
    "delta transmission",
];

/// Where the planes of each way to split begin, and where the last ends.
const STARTS: [usize; 4] = [0, LONGEST + 1, LONGEST + 1 + TECHNIQUES.len(), PLANES];
/// Pictures that are kept.
const PLANES: usize = LONGEST + 1 + TECHNIQUES.len() + LOBES.len();

/// A way to take the error apart.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Partition {
    /// What the classes differ in.
    pub by: &'static str,
    /// Those that have light, or a part of the error.
    pub classes: Vec<Class>,
    /// The error of the whole less that of all classes: what they have in common, or take from each other.
    pub covariance: f64,
}

/// Least part of the light or of the error that a class is shown for: the surfaces' shading normals, and rounding, put a few
/// paths into classes that a scene does not really have.
const SHOWN: f64 = 5e-4;

impl Partition {
    /// The classes that are worth showing.
    pub fn shown(&self) -> impl Iterator<Item = &Class> {
        let all: f64 = self.classes.iter().map(|c| c.error).sum();
        self.classes.iter().filter(move |c| c.light >= SHOWN || c.error >= SHOWN * all)
    }
}

/// A part of the light.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Class {
    /// What it is.
    pub name: String,
    /// Its part of the picture's mean.
    pub light: f64,
    /// Its error: the mean of w times its variance.
    pub error: f64,
}

/// The error of a picture taken apart.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Split {
    /// Samples of each pixel.
    pub samples: u32,
    /// The error of the whole: the mean of w times the variance of a picture.
    pub error: f64,
    /// In each of these ways.
    pub partitions: Vec<Partition>,
}

/// Sums of a pixel over seeds, by plane.
#[derive(Clone)]
struct Pixel {
    sums: [[f64; 3]; PLANES],
    squares: [[f64; 3]; PLANES],
    /// The same of the whole picture.
    sum: [f64; 3],
    square: [f64; 3],
}

const EMPTY: Pixel = Pixel { sums: [[0.0; 3]; PLANES], squares: [[0.0; 3]; PLANES], sum: [0.0; 3], square: [0.0; 3] };

/// A tile of [`Pixel`]s.
struct Tile {
    bounds: Area,
    pixels: Vec<Pixel>,
}

/// Renders once for each of `seeds`, at least two, and takes the error apart.
pub fn split(
    stage: &Stage<'_>,
    scene: &Scene,
    settings: &RenderSettings,
    seeds: &[u64],
    reference: &Reference,
) -> Result<Split, Interrupted> {
    let mut tiles = tiles(scene.film.crop);
    stage.pool.install(|| {
        tiles.par_iter_mut().try_for_each(|tile| {
            for &seed in seeds {
                if stage.progress.is_cancelled() {
                    return Err(Interrupted);
                }
                let mut settings = *settings;
                settings.sampler.seed = seed;
                add_seed(tile, scene, &settings);
            }
            Ok(())
        })
    })?;
    Ok(evaluate(&tiles, scene.film.crop, seeds.len(), settings.samples, reference))
}

fn tiles(crop: Crop) -> Vec<Tile> {
    let (across, down) = (crop.width.div_ceil(TILE_SIZE), crop.height.div_ceil(TILE_SIZE));
    let size = |start: u32, whole: u32| TILE_SIZE.min(whole - start);
    let tile = |column: u32, row: u32| {
        let (x, y) = (column * TILE_SIZE, row * TILE_SIZE);
        let bounds = Area {
            x: (crop.x + x).cast_signed(),
            y: (crop.y + y).cast_signed(),
            width: size(x, crop.width),
            height: size(y, crop.height),
        };
        Tile { bounds, pixels: vec![EMPTY; bounds.pixels() as usize] }
    };
    (0..down).flat_map(|row| (0..across).map(move |column| (column, row))).map(|(c, r)| tile(c, r)).collect()
}

/// Renders the tile and adds what its pixels are.
fn add_seed(tile: &mut Tile, scene: &Scene, settings: &RenderSettings) {
    let pixels = tile.pixels.len();
    let mut listener = Listener {
        scene,
        bounds: tile.bounds,
        samples: settings.samples,
        paths: vec![PathSoFar::START; pixels * settings.samples.min(MOST_TOGETHER) as usize],
        first: 0,
        now: (0, 0),
        planes: vec![[[0.0; 3]; PLANES]; pixels],
    };
    while listener.first < settings.samples {
        let last = listener.first.saturating_add(MOST_TOGETHER).min(settings.samples);
        listener.paths.fill(PathSoFar::START);
        let samples = listener.first..last;
        settings.integrator.record(scene, &settings.sampler, tile.bounds, samples, &mut listener);
        listener.first = last;
    }
    for (pixel, planes) in tile.pixels.iter_mut().zip(&listener.planes) {
        for (plane, value) in planes.iter().enumerate() {
            for (c, value) in value.iter().enumerate() {
                let value = value / f64::from(settings.samples);
                pixel.sums[plane][c] += value;
                pixel.squares[plane][c] += value * value;
            }
        }
        for c in 0..3 {
            // Any way to split has all of the light.
            let whole: f64 = planes[..STARTS[1]].iter().map(|p| p[c]).sum::<f64>() / f64::from(settings.samples);
            pixel.sum[c] += whole;
            pixel.square[c] += whole * whole;
        }
    }
}

/// Samples of each pixel whose paths are remembered at a time.
const MOST_TOGETHER: u32 = 16;

/// What has happened to a path.
#[derive(Clone, Copy)]
struct PathSoFar {
    vertices: u32,
    /// Whether the last lobe was a delta lobe.
    delta: bool,
    /// Index into [`LOBES`] of what the first surface did.
    lobe: u8,
    /// The segment from the camera and what it met.
    first: Option<(Ray, Hit)>,
}

impl PathSoFar {
    const START: Self = Self { vertices: 0, delta: false, lobe: 0, first: None };
}

/// Adds up what paths find, by class.
struct Listener<'a> {
    scene: &'a Scene,
    bounds: Area,
    /// Samples of each pixel, in all.
    samples: u32,
    /// Of each pixel, its samples from `first` on.
    paths: Vec<PathSoFar>,
    first: u32,
    /// The pixel and the path that are spoken of.
    now: (usize, usize),
    planes: Vec<[[f64; 3]; PLANES]>,
}

impl Listener<'_> {
    /// Counts light that came over `length` segments.
    fn add(&mut self, radiance: Rgb, length: u32, technique: usize, lobe: u8) {
        if !radiance.is_finite() {
            return;
        }
        let by_length = (length as usize - 1).min(LONGEST);
        let planes = &mut self.planes[self.now.0];
        for plane in [STARTS[0] + by_length, STARTS[1] + technique, STARTS[2] + usize::from(lobe)] {
            planes[plane].iter_mut().zip(radiance.to_array()).for_each(|(sum, v)| *sum += f64::from(v));
        }
    }

    /// What the first surface does to light that goes from the camera's segment into `next`.
    fn lobe(&self, (ray, hit): (Ray, Hit), next: &Ray, delta: bool) -> u8 {
        let normal = self.scene.shapes[hit.shape as usize].meet(&ray, hit.primitive).point.n;
        let goes_through = (ray.d.dot(normal) < 0.0) == (next.d.dot(normal) < 0.0);
        let sharpness = if delta {
            2
        } else {
            let is_diffuse = |bsdf: &Bsdf| matches!(bsdf, Bsdf::Diffuse(_) | Bsdf::OrenNayar(_));
            let material = &self.scene.materials[self.scene.appearances[hit.shape as usize].material as usize];
            let all_diffuse = match material {
                Material::Plain(sides) => is_diffuse(&sides.front) && sides.back.as_ref().is_none_or(is_diffuse),
                Material::Varying(graph) => graph.bsdfs().all(is_diffuse),
            };
            u8::from(!all_diffuse)
        };
        1 + sharpness + if goes_through { 3 } else { 0 }
    }

    fn traced(&mut self, vertex: u32, ray: Ray, hit: Hit) {
        let mut path = self.paths[self.now.1];
        path.vertices = vertex;
        match (vertex, path.first) {
            (1, _) => path.first = hit.is_some().then_some((ray, hit)),
            (2, Some(first)) => path.lobe = self.lobe(first, &ray, path.delta),
            _ => {}
        }
        self.paths[self.now.1] = path;
    }
}

impl Record for Listener<'_> {
    fn at(&mut self, id: impl FnOnce() -> SampleId) {
        let id = id();
        let pixel = self.bounds.index(id.x, id.y);
        let together = self.samples.min(MOST_TOGETHER);
        self.now = (pixel, pixel * together as usize + (id.index - self.first) as usize);
    }

    fn event(&mut self, event: Event) {
        let path = self.paths[self.now.1];
        match event {
            Event::Traced { vertex, ray, hit } => self.traced(vertex, ray, hit),
            Event::Found { radiance, .. } => {
                let technique = if path.vertices == 1 { 0 } else { 2 + usize::from(path.delta) };
                self.add(radiance, path.vertices, technique, path.lobe);
            }
            Event::Shadow { ray, radiance, delta, occluded } if !occluded => {
                let lobe = match path.first {
                    Some(first) if path.vertices == 1 => self.lobe(first, &ray, delta),
                    _ => path.lobe,
                };
                self.add(radiance, path.vertices + 1, 1, lobe);
            }
            Event::Scattered { delta, .. } => self.paths[self.now.1].delta = delta,
            _ => {}
        }
    }
}

/// Variances over `seeds` pictures, weighted.
fn evaluate(tiles: &[Tile], crop: Crop, seeds: usize, samples: u32, reference: &Reference) -> Split {
    let n = seeds as f64;
    let variance = |sum: f64, square: f64| ((square - sum * sum / n) / (n - 1.0)).max(0.0);
    let (mut light, mut errors, mut whole, mut all_light) = ([0.0; PLANES], [0.0; PLANES], 0.0, 0.0);
    for tile in tiles {
        for (i, pixel) in tile.pixels.iter().enumerate() {
            let (column, row) = (i as u32 % tile.bounds.width, i as u32 / tile.bounds.width);
            let (x, y) =
                (tile.bounds.x.cast_unsigned() - crop.x + column, tile.bounds.y.cast_unsigned() - crop.y + row);
            let w = weights(reference.picture().get(x, y));
            for (c, w) in w.into_iter().enumerate() {
                for plane in 0..PLANES {
                    light[plane] += pixel.sums[plane][c];
                    errors[plane] += w * variance(pixel.sums[plane][c], pixel.squares[plane][c]);
                }
                all_light += pixel.sum[c];
                whole += w * variance(pixel.sum[c], pixel.square[c]);
            }
        }
    }
    let values = 3.0 * Area::from(crop).pixels() as f64;
    let error = whole / values;
    let partition = |which: usize, by: &'static str, name: &dyn Fn(usize) -> String| {
        let planes = STARTS[which]..STARTS[which + 1];
        let class = |plane: usize| Class {
            name: name(plane - STARTS[which]),
            light: if all_light > 0.0 { light[plane] / all_light } else { 0.0 },
            error: errors[plane] / values,
        };
        let classes: Vec<Class> = planes.map(class).filter(|c| c.light > 0.0 || c.error > 0.0).collect();
        let covariance = error - classes.iter().map(|c| c.error).sum::<f64>();
        Partition { by, classes, covariance }
    };
    let length = |i: usize| if i < LONGEST { format!("{}", i + 1) } else { format!("{} and more", i + 1) };
    let partitions = vec![
        partition(0, "segments of the path", &length),
        partition(1, "how the light was found", &|i| TECHNIQUES[i].into()),
        partition(2, "what the first surface did", &|i| LOBES[i].into()),
    ];
    Split { samples, error, partitions }
}
