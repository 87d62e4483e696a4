//! What independent pictures say of the picture they all estimate, and the z-test of two such estimates.

use super::picture;
use snell::image::Picture;
use snell::render::RenderSettings;
use snell::scene::Scene;
use snell::spectrum::Rgb;

/// Pixels along the edge of a tile.
const TILE: u32 = 8;

/// The first of the seeds that pictures are rendered with.
const FIRST_SEED: u64 = 1000;

/// A reference is a mean of f32 values that Mitsuba summed in f32, 64 samples at a time: equal values, of no variance, may
/// come out wrong by the rounding of 64 additions.
const REFERENCE_ROUNDING: f64 = 64.0 * (f32::EPSILON / 2.0) as f64;

/// An estimate of a number, with the variance of the estimate.
#[derive(Clone, Copy, Debug)]
pub struct Value {
    pub mean: f64,
    pub variance: f64,
}

impl Value {
    /// Their difference in standard errors, signed.
    fn z_against(self, other: Self) -> f64 {
        let d = self.mean - other.mean;
        if d == 0.0 { 0.0 } else { d / (self.variance + other.variance).sqrt() }
    }
}

/// The mean over all pixels and channels, the means over 8×8 pixels, and the channels of all pixels.
pub struct Estimate {
    pub whole: Vec<Value>,
    pub tiles: Vec<Value>,
    pub pixels: Vec<Value>,
}

/// The largest |z| of each.
#[derive(Clone, Copy, Debug)]
pub struct Worst {
    pub whole: f64,
    pub tile: f64,
    pub pixel: f64,
}

impl Worst {
    /// Whether no bound is exceeded.
    pub fn within(&self, bounds: &Self) -> bool {
        self.whole < bounds.whole && self.tile < bounds.tile && self.pixel < bounds.pixel
    }
}

impl Estimate {
    /// From `seeds` renders, and the scatter among them.
    pub fn of(scene: &Scene, settings: &RenderSettings, seeds: u64) -> Self {
        Self::of_shifted(scene, settings, seeds, 0)
    }

    /// The same with seeds that start later.
    pub fn of_shifted(scene: &Scene, settings: &RenderSettings, seeds: u64, shift: u64) -> Self {
        let pictures = (0..seeds).map(|seed| {
            let mut s = *settings;
            s.sampler.seed = FIRST_SEED + shift + seed;
            picture(scene, &s)
        });
        let values: Vec<[Vec<f64>; 3]> = pictures.map(|p| levels(&p)).collect();
        let [whole, tiles, pixels] = [0, 1, 2].map(|level| {
            let count = values[0][level].len();
            (0..count).map(|i| scatter(values.iter().map(|v| v[level][i]))).collect()
        });
        Self { whole, tiles, pixels }
    }

    /// From a picture and the variance of its pixels, which are independent of each other.
    pub fn of_reference(mean: &Picture, variance: &Picture) -> Self {
        let [whole, tiles, pixels] = levels(mean);
        let value = |(mean, variance): (f64, f64)| {
            let rounding = mean * REFERENCE_ROUNDING;
            Value { mean, variance: variance + rounding * rounding }
        };
        let pixel_variances = variance.pixels().iter().flat_map(|p| p.to_array()).map(f64::from);
        // The channels of a pixel share their paths. At worst they vary as one: then deviations add, not variances.
        let mut grey = Picture::new(variance.width(), variance.height());
        for y in 0..variance.height() {
            for x in 0..variance.width() {
                let deviation = variance.get(x, y).to_array().into_iter().map(f32::sqrt).sum::<f32>() / 3.0;
                grey.set(x, y, Rgb::splat(deviation * deviation));
            }
        }
        let [whole_variance, tile_variances, _] = levels(&grey);
        let per = |variances: Vec<f64>, pixels: u32| variances.into_iter().map(move |v| v / f64::from(pixels));
        Self {
            whole: whole.into_iter().zip(per(whole_variance, mean.width() * mean.height())).map(value).collect(),
            tiles: tiles.into_iter().zip(per(tile_variances, TILE * TILE)).map(value).collect(),
            pixels: pixels.into_iter().zip(pixel_variances).map(value).collect(),
        }
    }

    /// From one picture, with `ratio` times the variance of `other`.
    pub fn with_variance_of(picture: &Picture, other: &Self, ratio: u32) -> Self {
        let [whole, tiles, pixels] = levels(picture);
        let value = |(mean, v): (f64, &Value)| Value { mean, variance: v.variance * f64::from(ratio) };
        Self {
            whole: whole.into_iter().zip(&other.whole).map(value).collect(),
            tiles: tiles.into_iter().zip(&other.tiles).map(value).collect(),
            pixels: pixels.into_iter().zip(&other.pixels).map(value).collect(),
        }
    }

    /// The same for pictures that are `factor` times as bright.
    pub fn scaled(&self, factor: f64) -> Self {
        let scale = |v: &Value| Value { mean: v.mean * factor, variance: v.variance * factor * factor };
        let [whole, tiles, pixels] = [&self.whole, &self.tiles, &self.pixels].map(|v| v.iter().map(scale).collect());
        Self { whole, tiles, pixels }
    }

    /// The same where no pixel's variance is less than `ratio` times that of `other`.
    pub fn no_surer_than(mut self, other: &Self, ratio: f64) -> Self {
        for (v, o) in self.pixels.iter_mut().zip(&other.pixels) {
            v.variance = v.variance.max(ratio * o.variance);
        }
        self
    }

    /// How far the two are apart.
    pub fn worst_z_against(&self, other: &Self) -> Worst {
        let worst = |a: &[Value], b: &[Value]| {
            assert_eq!(a.len(), b.len(), "pictures of one size");
            a.iter().zip(b).map(|(a, b)| a.z_against(*b).abs()).fold(0.0, f64::max)
        };
        Worst {
            whole: worst(&self.whole, &other.whole),
            tile: worst(&self.tiles, &other.tiles),
            pixel: worst(&self.pixels, &other.pixels),
        }
    }
}

/// Mean, and variance of the mean, of independent values.
fn scatter(values: impl Iterator<Item = f64> + Clone) -> Value {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let squares: f64 = values.map(|v| (v - mean) * (v - mean)).sum();
    Value { mean, variance: squares / (n - 1.0) / n }
}

/// The mean of a picture, the means of its tiles, and its pixels' channels.
fn levels(picture: &Picture) -> [Vec<f64>; 3] {
    let (across, down) = (picture.width() / TILE, picture.height() / TILE);
    let tile = |i: u32| {
        let (x0, y0) = (i % across * TILE, i / across * TILE);
        let pixels = (0..TILE * TILE).map(|k| picture.get(x0 + k % TILE, y0 + k / TILE));
        pixels.flat_map(|p| p.to_array()).map(f64::from).sum::<f64>() / f64::from(3 * TILE * TILE)
    };
    let pixels = picture.pixels().iter().flat_map(|p| p.to_array()).map(f64::from).collect();
    [vec![super::mean(picture)], (0..across * down).map(tile).collect(), pixels]
}
