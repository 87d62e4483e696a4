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

    /// How many standard errors the mean of some renders is off, in the whole and in tiles; `sums` has the sum of each pixel's
    /// luminances and of their squares.
    pub(super) fn bias(&self, sums: &[[f64; 2]], renders: u64) -> String {
        let n = renders as f64;
        let luminance = |c: &Rgb| f64::from(c.luminance());
        let size = self.size as usize;
        let (mut whole, mut tiles): ([f64; 3], Vec<[f64; 3]>) = ([0.0; 3], vec![[0.0; 3]; size.div_ceil(TILE).pow(2)]);
        for (i, [sum, squares]) in sums.iter().enumerate() {
            let (a, b) = (luminance(&self.halves[0][i]), luminance(&self.halves[1][i]));
            let mean = sum / n;
            let variance = (squares / n - mean * mean).max(0.0) / (n - 1.0) + (a - b).powi(2) / 4.0;
            let tile = i / size / TILE * size.div_ceil(TILE) + i % size / TILE;
            for to in [&mut whole, &mut tiles[tile]] {
                to[0] += mean - f64::midpoint(a, b);
                to[1] += variance;
                to[2] += mean;
            }
        }
        let z = |[difference, variance, _]: [f64; 3]| difference / variance.sqrt().max(f64::MIN_POSITIVE);
        let worst = tiles.iter().map(|&tile| z(tile).abs()).fold(0.0, f64::max);
        let mean_square = tiles.iter().map(|&tile| z(tile).powi(2)).sum::<f64>() / tiles.len() as f64;
        format!(
            "whole picture {:+.2} standard errors ({:+.4} %); {} tiles: worst {worst:.2}, root of the mean square {:.2}",
            z(whole),
            100.0 * whole[0] / whole[2],
            tiles.len(),
            mean_square.sqrt()
        )
    }
}
