//! FLIP: how different two pictures look when one flips between them.
//!
//! P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström and M. D. Fairchild, FLIP: A Difference Evaluator
//! for Alternating Images, High Performance Graphics 2020; sections and equations below are its. Colours are filtered by
//! what the eye resolves (section 4.1.1), compared in a Hunt-adjusted L*a*b* by the HyAB distance (4.1.2, 4.1.3) and
//! mapped to [0, 1]; differences of edges and points (4.2) amplify that (4.3).
//!
//! For pictures of high dynamic range: P. Andersson, J. Nilsson, P. Shirley and T. Akenine-Möller, Visualizing Errors in
//! Rendered High Dynamic Range Images, Eurographics 2021 (short papers): FLIP at a range of exposures, and of these the
//! largest value in each pixel.

use super::convolution::{Kernel, Plane};
use crate::image::Picture;
use crate::spectrum::Rgb;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// Pixels per degree of visual angle: a 0.7 m wide display of 3840 pixels, seen from 0.7 m (section 5).
const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Amplitudes and scales (in degrees²) of the Gaussians that model contrast sensitivity (table 1): of the achromatic, the
/// red-green, and the two of the blue-yellow channel.
const ACHROMATIC: &[(f64, f64)] = &[(1.0, 0.0047)];
const RED_GREEN: &[(f64, f64)] = &[(1.0, 0.0053)];
const BLUE_YELLOW: &[(f64, f64)] = &[(34.1, 0.04), (13.5, 0.025)];

/// Largest of these scales, which determines how far the filters reach.
const LARGEST_SCALE: f64 = 0.04;

/// Exponent of colour differences (q_c), and the part of the largest one (p_c) that is mapped to `COLOUR_SPLIT` (p_t).
const COLOUR_EXPONENT: f64 = 0.7;
/// See [`COLOUR_EXPONENT`].
const COLOUR_KNEE: f64 = 0.4;
/// See [`COLOUR_EXPONENT`].
const COLOUR_SPLIT: f64 = 0.95;

/// Width of the feature detectors in degrees (w), and the exponent of feature differences (q_f).
const FEATURE_WIDTH: f64 = 0.082;
/// See [`FEATURE_WIDTH`].
const FEATURE_EXPONENT: f64 = 0.5;

/// Standard deviations at which filters are cut off.
const CUT: f64 = 3.0;

/// Linear sRGB to CIE XYZ by columns, from the primaries and white point of ITU-R BT.709-6.
const XYZ_OF_RGB: DMat3 = DMat3::from_cols(
    DVec3::new(10_135_552.0 / 24_577_794.0, 2_613_072.0 / 12_288_897.0, 1_425_312.0 / 73_733_382.0),
    DVec3::new(8_788_810.0 / 24_577_794.0, 8_788_810.0 / 12_288_897.0, 8_788_810.0 / 73_733_382.0),
    DVec3::new(4_435_075.0 / 24_577_794.0, 887_015.0 / 12_288_897.0, 70_074_185.0 / 73_733_382.0),
);

/// A FLIP map and its mean.
#[derive(Clone, Debug)]
pub struct Flip {
    /// Perceived difference of each pixel in [0, 1], row by row.
    pub map: Vec<f32>,
    /// Its mean.
    pub mean: f64,
}

impl Flip {
    fn of(map: Vec<f32>) -> Self {
        let mean = map.iter().map(|&v| f64::from(v)).sum::<f64>() / map.len().max(1) as f64;
        Self { map, mean }
    }
}

/// FLIP at a range of exposures.
#[derive(Clone, Debug)]
pub struct HdrFlip {
    /// The largest of all exposures in each pixel.
    pub flip: Flip,
    /// The first and the last exposure in stops, and how many there were.
    pub exposures: (f64, f64, u32),
}

/// FLIP of two pictures of the same size, as a display shows them: clamped to [0, 1].
pub fn flip(picture: &Picture, reference: &Picture) -> Flip {
    let observer = Observer::new();
    Flip::of(observer.compare(&observer.view(picture, f64::from), &observer.view(reference, f64::from)))
}

/// HDR-FLIP of two pictures of the same size, with the exposures that the reference asks for and the ACES tone mapping.
/// `None` where the reference is black: no exposure shows anything of it.
pub fn hdr_flip(picture: &Picture, reference: &Picture) -> Option<HdrFlip> {
    let (start, stop) = exposures(reference)?;
    // Section 2.3 of the HDR paper: a step of at most one stop, and at least two exposures.
    let count = (stop - start).ceil().max(2.0) as u32;
    let step = (stop - start) / f64::from(count - 1);
    let observer = Observer::new();
    let mut worst = vec![0.0_f32; picture.pixels().len()];
    for i in 0..count {
        let factor = libm::exp2(start + step * f64::from(i));
        let mapped = |v: f32| tone_mapped(f64::from(v).max(0.0) * factor);
        let map = observer.compare(&observer.view(picture, mapped), &observer.view(reference, mapped));
        worst.iter_mut().zip(map).for_each(|(w, v)| *w = w.max(v));
    }
    Some(HdrFlip { flip: Flip::of(worst), exposures: (start, stop, count) })
}

/// Coefficients of the fit to the ACES filmic curve (K. Narkowicz 2015), (a·x² + b·x) / (c·x² + d·x + e), with the factor
/// 0.6 in x that takes its exposure out again.
const ACES: [f64; 5] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];

fn tone_mapped(x: f64) -> f64 {
    let [a, b, c, d, e] = ACES;
    (a * x * x + b * x) / (c * x * x + d * x + e)
}

/// The exposures in stops at which the brightest pixel of the reference, and at which its median, is mapped to 0.85
/// (section 2.2 of the HDR paper).
fn exposures(reference: &Picture) -> Option<(f64, f64)> {
    /// Where the curve begins to flatten.
    const BRIGHT: f64 = 0.85;
    let [a, b, c, d, e] = ACES;
    // The positive root of (a − tc)·x² + (b − td)·x − te = 0.
    let half = 0.5 * (b - BRIGHT * d) / (a - BRIGHT * c);
    let x = -half + (half * half + BRIGHT * e / (a - BRIGHT * c)).sqrt();
    let mut luminances: Vec<f64> = reference.pixels().iter().map(|p| (XYZ_OF_RGB * p.0.as_dvec3()).y).collect();
    luminances.sort_unstable_by(f64::total_cmp);
    let largest = *luminances.last()?;
    let median = luminances[luminances.len() / 2];
    /// Least luminance that an exposure is made for: half of a picture may be black.
    const DARKEST: f64 = 1e-10;
    (largest > 0.0).then(|| (libm::log2(x / largest), libm::log2(x / median.max(DARKEST.min(largest)))))
}

/// The filters of an observer.
struct Observer {
    contrast: [Vec<Kernel>; 3],
    bell: Kernel,
    edge: Kernel,
    point: Kernel,
}

/// What an observer makes of a picture: filtered colours in Hunt-adjusted L*a*b*, and the strength of edges and points.
struct View {
    colours: Vec<DVec3>,
    edges: Plane,
    points: Plane,
}

impl Observer {
    fn new() -> Self {
        let radius = (CUT * (LARGEST_SCALE / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
        let contrast = [ACHROMATIC, RED_GREEN, BLUE_YELLOW].map(|gaussians| contrast(gaussians, radius));
        // Standard deviation of the detectors in pixels (equations 6 and 7).
        let sd = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        let radius = (CUT * sd).ceil() as i32;
        let gaussian = |x: f64| libm::exp(-x * x / (2.0 * sd * sd));
        let kernel = |f: &dyn Fn(f64) -> f64| (-radius..=radius).map(|x| f(f64::from(x))).collect::<Vec<f64>>();
        Self {
            contrast,
            bell: balanced(kernel(&gaussian)),
            edge: balanced(kernel(&|x| -x * gaussian(x))),
            point: balanced(kernel(&|x| (x * x / (sd * sd) - 1.0) * gaussian(x))),
        }
    }

    fn view(&self, picture: &Picture, map: impl Fn(f32) -> f64) -> View {
        let white = XYZ_OF_RGB * DVec3::ONE;
        let to_rgb = XYZ_OF_RGB.inverse();
        let opponent: Vec<DVec3> = picture.pixels().iter().map(|p| opponent(clamped(*p, &map), white)).collect();
        let width = picture.width() as usize;
        let plane = |c: usize| Plane { width, values: opponent.iter().map(|v| v[c] as f32).collect() };
        let filtered: Vec<Plane> = (0..3)
            .map(|c| {
                let sums = self.contrast[c].iter().map(|k| plane(c).convolved(k, k));
                sums.reduce(|a, b| a.zipped(&b, |a, b| a + b)).unwrap_or_else(|| plane(c))
            })
            .collect();
        let colours = (0..opponent.len())
            .map(|i| {
                let v = DVec3::from([0, 1, 2].map(|c| f64::from(filtered[c].values[i])));
                let rgb = (to_rgb * from_opponent(v, white)).clamp(DVec3::ZERO, DVec3::ONE);
                hunt(lab(XYZ_OF_RGB * rgb / white))
            })
            .collect();
        // The achromatic channel from 0 to 1.
        let grey = Plane { width, values: opponent.iter().map(|v| ((v.x + 16.0) / 116.0) as f32).collect() };
        let feature = |k: &Kernel| grey.convolved(k, &self.bell).zipped(&grey.convolved(&self.bell, k), f32::hypot);
        View { colours, edges: feature(&self.edge), points: feature(&self.point) }
    }

    fn compare(&self, a: &View, b: &View) -> Vec<f32> {
        // The largest colour difference is that of green and blue (section 4.1.3).
        let white = XYZ_OF_RGB * DVec3::ONE;
        let primary = |v: DVec3| hunt(lab(XYZ_OF_RGB * v / white));
        let largest = libm::pow(hyab(primary(DVec3::Y), primary(DVec3::Z)), COLOUR_EXPONENT);
        let knee = COLOUR_KNEE * largest;
        let features = a.edges.values.iter().zip(&b.edges.values).zip(a.points.values.iter().zip(&b.points.values));
        let pixels = a.colours.iter().zip(&b.colours).zip(features);
        pixels
            .map(|((&ca, &cb), ((ea, eb), (pa, pb)))| {
                let d = libm::pow(hyab(ca, cb), COLOUR_EXPONENT);
                let colour = if d < knee {
                    COLOUR_SPLIT / knee * d
                } else {
                    COLOUR_SPLIT + (d - knee) / (largest - knee) * (1.0 - COLOUR_SPLIT)
                };
                let feature = f64::from((ea - eb).abs().max((pa - pb).abs()));
                let feature = libm::pow(std::f64::consts::FRAC_1_SQRT_2 * feature, FEATURE_EXPONENT);
                libm::pow(colour, 1.0 - feature) as f32
            })
            .collect()
    }
}

/// One factor for each Gaussian of a contrast sensitivity, such that the kernel that they make together sums to one:
/// a·√(π/b)·exp(−π²(x² + y²)/b), with x and y in degrees (equation 5).
fn contrast(gaussians: &[(f64, f64)], radius: i32) -> Vec<Kernel> {
    let factors: Vec<Kernel> = gaussians
        .iter()
        .map(|&(a, b)| {
            let value = |x: i32| {
                let degrees = f64::from(x) / PIXELS_PER_DEGREE;
                (a * (PI / b).sqrt()).sqrt() * libm::exp(-PI * PI * degrees * degrees / b)
            };
            (-radius..=radius).map(value).collect()
        })
        .collect();
    let total: f64 = factors.iter().map(|k| k.iter().sum::<f64>()).map(|s| s * s).sum();
    factors.into_iter().map(|k| k.into_iter().map(|v| v / total.sqrt()).collect()).collect()
}

/// The kernel with its positive values scaled to a sum of 1, its negative ones to −1.
fn balanced(kernel: Kernel) -> Kernel {
    let sum = |sign: f64| kernel.iter().map(|v| (sign * v).max(0.0)).sum::<f64>();
    let (positive, negative) = (sum(1.0), sum(-1.0));
    kernel
        .iter()
        .map(|&v| {
            if v > 0.0 {
                v / positive
            } else if v < 0.0 {
                v / negative
            } else {
                0.0
            }
        })
        .collect()
}

fn clamped(p: Rgb, map: &impl Fn(f32) -> f64) -> DVec3 {
    DVec3::from(p.to_array().map(|v| map(v).clamp(0.0, 1.0)))
}

/// YCxCz, a linear relative of L*a*b* (equation 4).
fn opponent(rgb: DVec3, white: DVec3) -> DVec3 {
    let v = XYZ_OF_RGB * rgb / white;
    DVec3::new(116.0 * v.y - 16.0, 500.0 * (v.x - v.y), 200.0 * (v.y - v.z))
}

fn from_opponent(v: DVec3, white: DVec3) -> DVec3 {
    let y = (v.x + 16.0) / 116.0;
    DVec3::new(y + v.y / 500.0, y, y - v.z / 200.0) * white
}

/// CIE L*a*b* (CIE 15:2004, section 8.2.1) of XYZ relative to white.
fn lab(v: DVec3) -> DVec3 {
    const DELTA: f64 = 6.0 / 29.0;
    let f = |t: f64| {
        if t > DELTA * DELTA * DELTA { libm::cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let (x, y, z) = (f(v.x), f(v.y), f(v.z));
    DVec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

/// Colours are less colourful where it is darker (section 4.1.2).
fn hunt(v: DVec3) -> DVec3 {
    DVec3::new(v.x, 0.01 * v.x * v.y, 0.01 * v.x * v.z)
}

/// The distance for large differences: city-block in lightness, Euclidean in colour (section 4.1.3).
fn hyab(a: DVec3, b: DVec3) -> f64 {
    (a.x - b.x).abs() + (a.y - b.y).hypot(a.z - b.z)
}
