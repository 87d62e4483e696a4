//! A converged picture, in two independent halves, so that its own error is known.

use super::Result;
use rayon::ThreadPool;
use snell::image::Picture;
use snell::render::{Progress, RenderSettings, render};
use snell::scene::Scene;
use snell::spectrum::Rgb;
use std::path::Path;

/// Samples of each half, over all pixels: 4096 of each of 64×64.
const SAMPLES: u32 = 1 << 24;

/// Seeds that no measured render has.
const SEEDS: [u64; 2] = [1 << 40, 1 << 41];

/// What the weight of the error adds, in squares of the mean.
const DARK: f64 = 0.01;

/// Edge of the tiles of the test for bias, in pixels.
const TILE: usize = 8;

pub(super) struct Reference {
    size: u32,
    halves: [Vec<Rgb>; 2],
}

impl Reference {
    /// From a file of f32 numbers, or rendered and kept there.
    pub(super) fn load_or_render(
        path: &Path,
        (scene, settings, pool): (&Scene, &RenderSettings, &ThreadPool),
    ) -> Result<Self> {
        let size = scene.film.size.0;
        let count = 3 * (size * size) as usize;
        let numbers: Vec<f32> = match std::fs::read(path) {
            Ok(bytes) => bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect(),
            Err(_) => {
                let mut numbers = Vec::new();
                for seed in SEEDS {
                    let mut settings = RenderSettings { samples: SAMPLES / (size * size), ..*settings };
                    settings.sampler.seed = seed;
                    let picture = render(scene, &settings, pool, &Progress::default()).film.develop();
                    numbers.extend(picture.pixels().iter().flat_map(|p| p.to_array()));
                }
                let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
                let unfinished = path.with_extension("part");
                std::fs::write(&unfinished, bytes)?;
                std::fs::rename(&unfinished, path)?;
                numbers
            }
        };
        if numbers.len() != 2 * count {
            return Err(format!("{}: expected {} numbers", path.display(), 2 * count).into());
        }
        let half = |n: &[f32]| n.chunks_exact(3).map(|c| Rgb::new(c[0], c[1], c[2])).collect();
        Ok(Self { size, halves: [half(&numbers[..count]), half(&numbers[count..])] })
    }

    pub(super) fn size(&self) -> u32 {
        self.size
    }

    fn values(&self) -> impl Iterator<Item = ([f64; 3], [f64; 3])> {
        let wide = |c: &Rgb| c.to_array().map(f64::from);
        self.halves[0].iter().zip(&self.halves[1]).map(move |(a, b)| (wide(a), wide(b)))
    }

    fn darkness(&self) -> f64 {
        let sum: f64 = self.values().flat_map(|(a, b)| [0, 1, 2].map(|c| f64::midpoint(a[c], b[c]))).sum();
        let mean = sum / (3 * self.halves[0].len()) as f64;
        DARK * mean * mean
    }

    /// The relative error of a picture; the reference's own is taken out, which is independent of it.
    pub(super) fn error_of(&self, picture: &Picture) -> f64 {
        let darkness = self.darkness();
        let (mut sum, mut own) = (0.0, 0.0);
        for ((a, b), pixel) in self.values().zip(picture.pixels()) {
            for (c, value) in pixel.to_array().into_iter().enumerate() {
                let (r, d) = (f64::midpoint(a[c], b[c]), (a[c] - b[c]) / 2.0);
                let weight = 1.0 / (r * r + darkness);
                sum += (f64::from(value) - r).powi(2) * weight;
                own += d * d * weight;
            }
        }
        ((sum - own).max(0.0) / (3 * self.halves[0].len()) as f64).sqrt()
    }

    /// Its own relative error.
    pub(super) fn own_error(&self) -> f64 {
        let darkness = self.darkness();
        let mut own = 0.0;
        for (a, b) in self.values() {
            for c in 0..3 {
                let (r, d) = (f64::midpoint(a[c], b[c]), (a[c] - b[c]) / 2.0);
                own += d * d / (r * r + darkness);
            }
        }
        (own / (3 * self.halves[0].len()) as f64).sqrt()
    }

    /// The mean luminance of the whole picture, and of each of its tiles.
    pub(super) fn tile_means(&self, pixels: &[Rgb]) -> Vec<f64> {
        let size = self.size as usize;
        let across = size.div_ceil(TILE);
        let mut sums = vec![[0.0; 2]; 1 + across * across];
        for (i, pixel) in pixels.iter().enumerate() {
            for which in [0, 1 + i / size / TILE * across + i % size / TILE] {
                sums[which][0] += f64::from(pixel.luminance());
                sums[which][1] += 1.0;
            }
        }
        sums.into_iter().map(|[sum, count]| sum / count).collect()
    }

    /// Its own means, from two pictures. By how much these differ in one number says next to nothing of its error, but in those of all
    /// tiles, which are independent, it says what that of the whole is.
    pub(super) fn means(&self) -> Means {
        let mut means = Means::of(self.halves.iter().map(|half| self.tile_means(half)));
        if let [whole, tiles @ ..] = &mut means.0[..] {
            let count = tiles.len() as f64;
            whole[1] = tiles.iter().map(|tile| tile[1]).sum::<f64>() / (count * count);
        }
        means
    }
}

/// Means over pictures of their whole and their tiles, with squared standard errors.
pub(super) struct Means(Vec<[f64; 2]>);

impl Means {
    /// Of at least two pictures.
    pub(super) fn of(pictures: impl Iterator<Item = Vec<f64>>) -> Self {
        let mut sums: Vec<[f64; 2]> = Vec::new();
        let mut count = 0.0;
        for picture in pictures {
            sums.resize(picture.len(), [0.0; 2]);
            count += 1.0;
            for (sum, value) in sums.iter_mut().zip(picture) {
                sum[0] += value;
                sum[1] += value * value;
            }
        }
        let of = |[sum, squares]: [f64; 2]| {
            let mean = sum / count;
            [mean, (squares / count - mean * mean).max(0.0) / (count - 1.0)]
        };
        Self(sums.into_iter().map(of).collect())
    }

    /// How many standard errors these are from others.
    pub(super) fn against(&self, other: &Self) -> String {
        let z = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]) / (a[1] + b[1]).sqrt().max(f64::MIN_POSITIVE);
        let all: Vec<f64> = self.0.iter().zip(&other.0).map(z).collect();
        let [whole, tiles @ ..] = &all[..] else { return String::new() };
        let worst = tiles.iter().map(|z| z.abs()).fold(0.0, f64::max);
        let mean_square = tiles.iter().map(|z| z * z).sum::<f64>() / tiles.len() as f64;
        format!(
            "the whole {whole:+.2} standard errors ({:+.4} %), {} tiles: worst {worst:.2}, root of the mean square {:.2}",
            100.0 * (self.0[0][0] / other.0[0][0] - 1.0),
            tiles.len(),
            mean_square.sqrt()
        )
    }
}
