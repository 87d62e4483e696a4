//! Lights at their edges: areas and solid angles from 10⁻²⁰ on, radiance up to 10³⁰, one pixel of a sky 10⁸ times the others,
//! black ones, a million of them.

use super::random::Rng;
use super::rooms;
use super::scenes::compiled;
use crate::accel::Accelerator;
use crate::description::{self, Geometry, LightKind, SceneDescription};
use crate::image::Picture;
use crate::light::{AreaLight, EnvironmentLight, Light, LightSample, LightSampler, PointLight, Receiver};
use crate::sampler::{Sampler, SamplerKind};
use crate::sampling::chi_square::{on_sphere, sidak};
use crate::shape::cylinder::Cylinder;
use crate::shape::disk::Disk;
use crate::shape::sphere::Sphere;
use crate::shape::{Shape, TriangleMesh};
use crate::spectrum::Rgb;
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;

/// What is asked of lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Area lights of all sizes from all distances: samples are finite, say what the density says, and the mean of one over
    /// their density is the solid angle.
    Areas,
    /// Skies: samples follow their density (χ²).
    Skies,
    /// What is black is no light.
    Black,
    /// Many points: what is chosen is chosen with the probability that is stated, and the estimate of their sum is right.
    Many,
}

impl Part {
    /// All there are.
    pub const ALL: [Self; 4] = [Self::Areas, Self::Skies, Self::Black, Self::Many];

    /// One word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Areas => "areas",
            Self::Skies => "skies",
            Self::Black => "black",
            Self::Many => "many",
        }
    }
}

/// What came of a part.
#[derive(Clone, Debug, Default)]
pub struct Verdicts {
    /// Lights times places from which they were asked.
    pub tests: usize,
    /// Samples in all.
    pub samples: u64,
    /// Each one that is wrong: its number, and how.
    pub broken: Vec<(usize, String)>,
}

/// Family-wise false-alarm rate of the χ² tests.
pub const FALSE_ALARMS: f64 = 0.01;

/// Samples of a light from a place.
const SAMPLES: u32 = 2000;

/// The same of a χ² test.
const CHI_SAMPLES: u32 = 40_000;

/// Standard errors that a mean may be off by, in one case of 10⁸ (for a normal distribution).
const MOST: f64 = 5.7;

/// Of one over a density as it is computed in f32; products of some ten rounded factors.
const ROUNDING: f64 = 64.0 * f32::EPSILON as f64;

/// What a sample says of its density may differ from what is said of its point: a grazing cosine is all rounding.
const AGREEMENT: f64 = 1e-3;

/// Decades of sizes, and of distances in sizes.
const SIZES: [f64; 2] = [-10.0, 0.0];
const DISTANCES: [f64; 2] = [-3.0, 7.0];

/// The radiance of lights: the largest that is asked for, and a usual one.
const RADIANCES: [f32; 2] = [1e30, 1.0];

/// A radiance that is next to nothing beside 10⁸.
const FAINT: f32 = 1e-30;

/// Places from which a light is chosen among many.
const PLACES: u32 = 4;

/// Points that are many, and very many.
const MANY: [usize; 2] = [30_000, 1_000_000];

fn uniform(seed: u64, i: u32) -> Vec2 {
    Sampler { kind: SamplerKind::Independent, seed }.stream(0, 0, i).light(0).point()
}

/// Asks a part of all that it is for, or of the one with this number. `long`: ten times as many.
pub fn run(part: Part, seed: u64, long: bool, only: Option<usize>) -> Verdicts {
    let all = match part {
        Part::Areas => {
            if long {
                20_000
            } else {
                2000
            }
        }
        Part::Skies => skies().len() * normals().len(),
        Part::Black => black().len(),
        Part::Many => 1 + usize::from(long),
    };
    let (per_test, level) = match part {
        Part::Areas => (SAMPLES, 0.0),
        Part::Skies => (CHI_SAMPLES, sidak(FALSE_ALARMS, all)),
        Part::Black => (0, 0.0),
        Part::Many => (PLACES * CHI_SAMPLES, 0.0),
    };
    let asked = |number: &usize| only.is_none_or(|only| only == *number);
    let numbers: Vec<usize> = (0..all).filter(asked).collect();
    let verdict = |&number: &usize| {
        let verdict = match part {
            Part::Areas => area(seed, number),
            Part::Skies => sky(number, level),
            Part::Black => black()[number].clone(),
            Part::Many => many(seed, MANY[number]),
        };
        verdict.err().map(|failure| (number, failure))
    };
    Verdicts {
        tests: numbers.len(),
        samples: numbers.len() as u64 * u64::from(per_test),
        broken: numbers.par_iter().filter_map(verdict).collect(),
    }
}

/// A light of random size and kind, asked from a random place in front of it.
fn area(seed: u64, number: usize) -> Result<(), String> {
    let rng = &mut Rng::of(seed, &[number as u64]);
    let mut decade = |[low, high]: [f64; 2]| libm::exp10(low + (high - low) * f64::from(rng.unit()));
    let (size, distance) = (decade(SIZES), decade(DISTANCES));
    // Within the scene.
    let distance = (distance * size).min(1.0);
    let d = Rng::of(seed, &[number as u64, 1]).direction().as_dvec3().normalize();
    let at = distance * (if d.z < 0.0 { -d } else { d });
    let radiance = RADIANCES[number % 2];
    let (name, surface, solid_angle) = surface(number / 2 % 5, size, at);
    let Some(light) = AreaLight::new(0, &surface, Rgb::splat(radiance)) else {
        return Err(format!("{name} of size {size:e}: no light"));
    };
    let what = format!("{name} of size {size:e} from {at:?}");
    let shapes = [surface];
    let lit = Light::Area(light.clone());
    let mut inverse = Vec::new();
    for i in 0..SAMPLES {
        let Some(s) = lit.sample(&shapes, at, Vec3::ZERO, uniform(seed ^ 29, i), false) else {
            inverse.push(0.0);
            continue;
        };
        inverse.push(1.0 / check_sample(&s, &what, radiance)?);
        let (Some(pdf), Some(end)) = (s.pdf, s.end) else { return Err(format!("{what}: {s:?}")) };
        let asked = light.pdf(&shapes[0], at, Vec3::ZERO, &end.seen_from(at, s.wi)).0;
        if !((f64::from(asked) / f64::from(pdf.0) - 1.0).abs() < AGREEMENT) {
            return Err(format!("{what}: sampled with density {}, which is {asked}", pdf.0));
        }
    }
    let Some(expected) = solid_angle else { return Ok(()) };
    let (mean, error) = statistics(&inverse);
    let off = (mean - expected).abs();
    if off <= MOST * error + ROUNDING * expected {
        Ok(())
    } else {
        Err(format!("{what}: solid angle {mean:e} ± {error:e}, but {expected:e}"))
    }
}

/// Its density, if it is a sample.
fn check_sample(s: &LightSample, what: &str, radiance: f32) -> Result<f64, String> {
    let pdf = s.pdf.map_or(1.0, |pdf| pdf.0);
    let unit = (s.wi.length() - 1.0).abs() < 8.0 * f32::EPSILON;
    let good = unit && pdf > 0.0 && pdf.is_finite() && s.radiance == Rgb::splat(radiance);
    if good { Ok(f64::from(pdf)) } else { Err(format!("{what}: {s:?}")) }
}

/// Mean and its standard error.
fn statistics(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, (squares / (n - 1.0) / n).sqrt())
}

/// A surface around the origin whose front looks along +z or outwards, and the solid angle that it fills as seen from `p`, if
/// that is known.
#[allow(clippy::expect_used, reason = "none of them is too thin")]
fn surface(kind: usize, size: f64, p: DVec3) -> (&'static str, Shape, Option<f64>) {
    let corner = |x: f64, y: f64| DVec3::new(x * size, y * size, 0.0).as_vec3();
    let mesh = |positions: Vec<Vec3>, faces: Vec<[u32; 3]>| {
        Shape::Mesh(TriangleMesh { positions, faces, ..TriangleMesh::default() })
    };
    match kind {
        0 => {
            let radius = size as f32;
            let r = f64::from(radius);
            let angle = if p.length() > r * 1.001 { Some(cap(r, p.length())) } else { None };
            ("sphere", Shape::Sphere(Sphere { centre: Vec3::ZERO, radius, flip: false }), angle)
        }
        1 => {
            let disk = Disk::new(DVec3::ZERO, size * DVec3::X, size * DVec3::Y, DVec3::Z);
            ("disk", Shape::Disk(disk.expect("a disk")), None)
        }
        2 => {
            let v = [corner(-1.0, -0.5), corner(1.0, -0.5), corner(0.3, 1.0)];
            ("triangle", mesh(v.to_vec(), vec![[0, 1, 2]]), Some(triangle_angle(v, p)))
        }
        3 => {
            let v = [corner(-1.0, -0.5), corner(1.0, -0.5), corner(1.0, 0.5), corner(-1.0, 0.5)];
            let angle = triangle_angle([v[0], v[1], v[2]], p) + triangle_angle([v[0], v[2], v[3]], p);
            ("rectangle", mesh(v.to_vec(), vec![[0, 1, 2], [0, 2, 3]]), Some(angle))
        }
        _ => {
            let axes = [size * DVec3::X, size * DVec3::Y, size * DVec3::Z];
            ("cylinder", Shape::Cylinder(Cylinder::new(-0.5 * axes[2], axes, false).expect("a cylinder")), None)
        }
    }
}

/// The solid angle of a sphere, without cancellation: 2π·(1 − cos θ), sin θ = r/d.
fn cap(r: f64, d: f64) -> f64 {
    let sin2 = (r / d) * (r / d);
    2.0 * PI * sin2 / (1.0 + (1.0 - sin2).sqrt())
}

/// Van Oosterom and Strackee 1983, *The Solid Angle of a Plane Triangle*.
fn triangle_angle(v: [Vec3; 3], p: DVec3) -> f64 {
    let [a, b, c] = v.map(|v| v.as_dvec3() - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    // As a product of edges: of vectors that are nearly parallel the triple product would cancel.
    let volume = a.dot((b - a).cross(c - a)).abs();
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * libm::atan2(volume, denominator)
}

/// Skies with a pixel that is brighter than all others together, in the middle, at a pole, and next to a dark half.
fn skies() -> Vec<(&'static str, EnvironmentLight)> {
    let map = |width: u32, height: u32, value: &dyn Fn(u32, u32) -> f32| {
        let mut map = Picture::new(width, height);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            map.set(x, y, Rgb::splat(value(x, y)));
        }
        Arc::new(map)
    };
    let axis = DVec3::new(0.48, -0.6, 0.64);
    let turn = |angle: f64| DMat3::from_axis_angle(axis, angle);
    let all = [
        ("one pixel of 1e8", map(64, 32, &|x, y| if (x, y) == (40, 9) { 1e8 } else { 1.0 }), turn(1.0)),
        ("a pole of 1e8", map(16, 9, &|_, y| if y == 0 { 1e8 } else { 0.5 }), turn(2.0)),
        ("one pixel of 1e8 in the dark", map(33, 17, &|x, y| if (x, y) == (0, 8) { 1e8 } else { 0.0 }), turn(3.0)),
        ("1e8 among the faint", map(20, 10, &|x, y| if (x, y) == (19, 5) { 1e8 } else { FAINT }), turn(4.0)),
    ];
    all.into_iter()
        .filter_map(|(name, map, turn)| Some((name, EnvironmentLight::new(&map, 1.0, turn, true)?)))
        .collect()
}

fn normals() -> Vec<(Vec3, bool)> {
    let n = [Vec3::ZERO, Vec3::Y, Vec3::new(-0.3, 0.2, -0.9).normalize()];
    n.into_iter().flat_map(|n| [(n, false), (n, true)]).collect()
}

fn sky(number: usize, level: f64) -> Result<(), String> {
    /// Error of the quadrature of the density at the edges of a map's cells, as in the tests of skies.
    const INTEGRAL: f64 = 1e-2;
    let skies = skies();
    let ((name, light), (n, combined)) = (&skies[number % skies.len()], normals()[number / skies.len()]);
    let lit = Light::Environment(light.clone());
    let sample = |i| lit.sample(&[], DVec3::ZERO, n, uniform(31, i), combined);
    for s in (0..SAMPLES).filter_map(sample) {
        let pdf = s.pdf.map_or(0.0, |pdf| pdf.0);
        if !(pdf > 0.0 && pdf.is_finite() && s.radiance.is_finite() && s.radiance.0.min_element() >= 0.0) {
            return Err(format!("{name}, normal {n}: {s:?}"));
        }
    }
    let o = on_sphere(CHI_SAMPLES, |i| sample(i).map(|s| s.wi), |w| light.seen(&w, n, combined).1.0.into());
    let right = o.p_value > level && (o.integral + o.lost - 1.0).abs() < INTEGRAL;
    if right { Ok(()) } else { Err(format!("{name}, normal {n}, combined {combined}: {o:?}, level {level:e}")) }
}

/// Everything that is black, and what becomes of it: a scene with it alone has no light.
fn black() -> Vec<Result<(), String>> {
    let dark = |name: &str, shapes: Vec<description::Shape>, lights: Vec<description::Light>| {
        let scene = SceneDescription { shapes, lights, ..rooms::enclosure(0.5, 0.0) };
        match compiled(&scene, Accelerator::Native) {
            Ok(scene) if scene.lights.is_empty() => Ok(()),
            Ok(scene) => Err(format!("{name}: {} lights", scene.lights.len())),
            Err(error) => Err(format!("{name}: {error}")),
        }
    };
    let ball = || Geometry::Sphere { centre: DVec3::ZERO, radius: 1.0, frame: DMat3::IDENTITY };
    let emitting = |geometry| vec![rooms::shape(geometry, DAffine3::IDENTITY, 0, Some(0.0))];
    let alone = |kind| (vec![rooms::shape(ball(), DAffine3::IDENTITY, 0, None)], vec![rooms::light(kind)]);
    let cylinder = Geometry::Cylinder { p0: DVec3::ZERO, p1: DVec3::Z, radius: 1.0 };
    let surfaces =
        [("sphere", ball()), ("disk", Geometry::Disk), ("rectangle", Geometry::Rectangle), ("cylinder", cylinder)];
    let mut all: Vec<_> = surfaces.into_iter().map(|(name, geometry)| dark(name, emitting(geometry), vec![])).collect();
    let map = Arc::new(Picture::new(4, 4));
    for (name, kind) in [
        ("point", LightKind::Point { position: DVec3::Z, intensity: Rgb::BLACK }),
        ("directional", LightKind::Directional { direction: DVec3::Z, irradiance: Rgb::BLACK }),
        ("constant", LightKind::Constant { radiance: Rgb::BLACK }),
        ("map", LightKind::Environment { map, scale: 1.0, to_world: DMat3::IDENTITY, mis_compensation: true }),
    ] {
        let (shapes, lights) = alone(kind);
        all.push(dark(name, shapes, lights));
    }
    let chosen = LightSampler::new(&[], &[]).sample(|| Receiver::new(Vec3::ZERO, Vec3::Z), || 0.5);
    all.push(if chosen.is_none() { Ok(()) } else { Err("of no lights one is chosen".into()) });
    all
}

/// So many points with intensities over many decades: what is chosen comes with its probability, and Σ I/d² is estimated right.
fn many(seed: u64, count: usize) -> Result<(), String> {
    let rng = &mut Rng::of(seed, &[count as u64]);
    let lights: Vec<Light> = (0..count)
        .map(|_| {
            let intensity = Rgb::splat(rng.power(-20.0, 0.0) as f32);
            Light::Point(PointLight { position: rng.in_cube().as_dvec3(), intensity, clearance: 0.0, touching: vec![] })
        })
        .collect();
    let sampler = LightSampler::new(&lights, &[]);
    for place in 0..PLACES {
        let receiver = Receiver::new(0.9 * rng.in_cube(), Vec3::ZERO);
        let value = |light: &Light| match light {
            Light::Point(light) => {
                f64::from(light.intensity.0.x) / (light.position - receiver.p.as_dvec3()).length_squared()
            }
            _ => 0.0,
        };
        let expected: f64 = lights.iter().map(value).sum();
        let at = sampler.at(|| receiver);
        let mut values = Vec::new();
        for _ in 0..CHI_SAMPLES {
            let u = f64::from(rng.unit());
            let Some((index, pmf)) = at.sample(|| u) else { return Err("nothing was chosen".into()) };
            let said = sampler.pmf(index, || receiver);
            if !(pmf > 0.0 && (f64::from(said) / f64::from(pmf) - 1.0).abs() < AGREEMENT) {
                return Err(format!("{count} points: {index} is chosen with {pmf}, but its probability is {said}"));
            }
            values.push(value(&lights[index]) / f64::from(pmf));
        }
        let (mean, error) = statistics(&values);
        if !((mean - expected).abs() <= MOST * error) {
            return Err(format!("{count} points from place {place}: {mean} ± {error}, but {expected}"));
        }
    }
    Ok(())
}
