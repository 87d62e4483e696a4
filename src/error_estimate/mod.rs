//! How wrong a picture is, as far as its own samples tell: of each pixel, of areas, and of the whole with an interval.
//!
//! # What is estimated
//!
//! The *relative error* of this very picture: the root of the mean over pixels and channels of (m − r)²/(r² + 0.01·L²), where m
//! is the picture, r what it converges to and L the mean value of r, so that exposure does not matter.
//!
//! # From replicates
//!
//! Let x and y be the errors of two independent pictures of equal variance, of which the picture is the mean. With e = (x + y)/2 its
//! error and d = (x − y)/2 half of their difference, e² − d² = x·y, whose expected value is 0: d² is an unbiased estimate of e², for
//! points of any sequence, and by how much a sum of d² misses that of e² is the sum of x·y. How large that is, is known, too:
//!
//! - from the halves of each of the two: (x₀ − x₁)/2 is distributed about as x is, so that over blocks of pixels the sum of squares
//!   of Σ (x₀ − x₁)(y₀ − y₁)/4 estimates its variance, whatever correlations there are within a block (halves of one sequence differ
//!   by more than independent ones, since they are spread evenly together; the ratio of Σd² to what the halves say takes that out);
//! - from the squares of single pixels, which see rare large errors: the mean of (x·y)² is at most 4/3 of that of d⁴, with equality
//!   for normal errors.
//!
//! Both are added, though normal errors are then counted twice.
//!
//! The weight 1/(r² + 0.01·L²) is not known either. Taken at m it is too small where an error makes m too large, just where d² is
//! large. Taken at the mean of two of the four halves, and multiplied by the squared difference of the other two, it has nothing to do
//! with that, but is too large, since 1/r² is convex (a correction by its second derivative helps, and a limit: pixels that are black
//! in two halves of four have no better guess than that). The estimate is the geometric mean of the two, and half their ratio is part
//! of its uncertainty. Without the limit the second is much larger where pixels are made by rare samples; then the interval goes up to
//! that.
//!
//! # From halves
//!
//! Of one sequence, whose halves are each as evenly spread as the whole: with h the mean of the later half, which has the
//! part w of the weight, and g that of the earlier one, w·(1 − w)·(h − g)² is the squared error of the mean of independent halves of
//! equal variance per sample. If the variance of N samples falls as N^−s, its expected value is 2^s − 1 times the squared error:
//! 1 for independent samples, more for evenly spread ones. So it is rather too large; the interval's lower end is that for
//! [`MOST_SLOPE`], and its width that of pixels which all err alike within a block. The weight is between that at m and that at the
//! darker half, which is what is right where the brighter one has a rare bright sample.

mod interval;
mod tail;

pub use interval::{Interval, normal_quantile};

use crate::film::{Film, PartMean};
use crate::image::Area;
use crate::math::float::saturate_to_f32;
use tail::tail_index;

/// L² times this is added to r² where an error is divided by it: what is darker than a tenth of the mean counts as that.
const DARK: f64 = 0.01;

/// How far around a pixel its own estimate is pooled, in pixels.
const POOL: usize = 1;

/// Edge of the blocks within which errors may be alike: that of pixels which share what their paths find.
const BLOCK: usize = 8;

/// The largest s for which N^−s is how the variance of a whole picture falls. Measured: 1.0 to 1.5 (docs/benchmarks.md).
const MOST_SLOPE: f64 = 1.5;

/// No weight from half of the samples is more than so many times that from all: as much as it can be less, since the mean of all
/// is at least half of that of any half, where nothing is negative.
const MOST_WEIGHT: f64 = 4.0;

/// For normal x and y, the variance of x·y over the mean of ((x − y)/2)⁴.
const NORMAL_PRODUCT: f64 = 4.0 / 3.0;

/// Below this index of its tail, the sum of a picture's squared errors is that of a few pixels, and what has not been seen yet may
/// be as much again: such terms have no mean.
const TRUSTED_TAIL: f64 = 1.0;

/// Above these surprises pixels are made by rare samples. Measured with 64 samples (docs/error.md): of replicates, where estimates are
/// right, up to 1.3, where caustics make them a quarter too small, 2.4; of halves up to 3, in scenes of small lights 8, with
/// caustics 17 and more.
const MOST_SURPRISE_OF_REPLICATES: f64 = 2.0;
const MOST_SURPRISE_OF_HALVES: f64 = 10.0;

/// How the parts of a film came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parts {
    /// Two: the earlier and the later half of one sequence.
    Halves,
    /// Four: two halves of each of two independent sequences, all with the same weight.
    Replicates,
}

impl Parts {
    /// How many.
    pub fn count(self) -> usize {
        match self {
            Self::Halves => 2,
            Self::Replicates => 4,
        }
    }
}

/// What is known of one pixel, per channel: radiances in W·sr⁻¹·m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelEstimate {
    /// The mean.
    pub mean: [f32; 3],
    /// A number whose square is an estimate of the mean's squared error: of replicates, half of the difference of the two.
    pub difference: [f32; 3],
    /// Of replicates, half of the difference of each one's halves; else the same as the difference.
    pub halves: [[f32; 3]; 2],
}

impl PixelEstimate {
    /// From two halves; where there is but one, nothing is known, and the error counts as large as the mean.
    pub fn from_halves(parts: [PartMean; 2]) -> Self {
        let all = parts[0].weight + parts[1].weight;
        let w = if all > 0.0 { parts[1].weight / all } else { 0.0 };
        let both = w * (1.0 - w);
        Self::from_channels(|c| {
            let [g, h] = parts.map(|part| part.radiance[c]);
            let mean = g + w * (h - g);
            let difference = if both > 0.0 { both.sqrt() * (h - g) } else { mean };
            [mean, difference, difference, difference]
        })
    }

    /// From two halves of each of two replicates.
    pub fn from_replicates(parts: [PartMean; 4]) -> Self {
        Self::from_channels(|c| {
            let [x0, x1, y0, y1] = parts.map(|part| part.radiance[c]);
            let (x, y) = (f64::midpoint(x0, x1), f64::midpoint(y0, y1));
            [f64::midpoint(x, y), (x - y) / 2.0, (x0 - x1) / 2.0, (y0 - y1) / 2.0]
        })
    }

    fn from_channels(of: impl Fn(usize) -> [f64; 4]) -> Self {
        let channels = [0, 1, 2].map(of);
        let all = |which: usize| channels.map(|values| saturate_to_f32(values[which]));
        Self { mean: all(0), difference: all(1), halves: [all(2), all(3)] }
    }

    /// The sum over the channels of the squared errors, each divided by the squared radiance plus `darkness`.
    fn relative(&self, darkness: f64) -> f64 {
        let of = |c: usize| {
            let (mean, d) = (f64::from(self.mean[c]), f64::from(self.difference[c]));
            d * d * over(mean, darkness)
        };
        of(0) + of(1) + of(2)
    }

    /// The same with the radiance of the darker half, within limits and without.
    fn relative_to_darker(&self, darkness: f64) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for c in 0..3 {
            let (mean, d) = (f64::from(self.mean[c]), f64::from(self.difference[c]));
            let (own, darker) = (over(mean, darkness), over((mean.abs() - d.abs()).max(0.0), darkness));
            sums[0] += d * d * darker.min(MOST_WEIGHT * own);
            sums[1] += d * d * darker;
        }
        sums
    }

    /// The same sum for what else is known of it.
    fn beside(&self, darkness: f64) -> Beside {
        let mut sums = Beside::default();
        for c in 0..3 {
            let (mean, d) = (f64::from(self.mean[c]), f64::from(self.difference[c]));
            let [hx, hy] = self.halves.map(|half| f64::from(half[c]));
            let weight = over(mean, darkness);
            sums.product += hx * hy * weight;
            sums.halves += (hx * hx + hy * hy) / 4.0 * weight;
            let [x, y] = [[mean + d + hx, mean + d - hx], [mean - d + hy, mean - d - hy]];
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let square = (x[i] - y[j]) * (x[i] - y[j]);
                sums.own_weight += square * weight;
                let other = over_mean_of(x[1 - i], y[1 - j], darkness);
                sums.other_weight += square * other.min(MOST_WEIGHT * weight);
                sums.free_weight += square * other;
            }
        }
        sums
    }

    /// The sum over the channels of replicate `which`'s squared error, as its halves say, relative to its own radiance: nothing of
    /// the other comes into it.
    pub fn of_replicate(&self, which: usize, darkness: f64) -> f64 {
        let sign = if which == 0 { 1.0 } else { -1.0 };
        let of = |c: usize| {
            let (mean, half) = (f64::from(self.mean[c] + sign * self.difference[c]), f64::from(self.halves[which][c]));
            half * half * over(mean, darkness)
        };
        of(0) + of(1) + of(2)
    }
}

/// What squared errors are multiplied by; where all is black there is nothing to be wrong about.
fn over(mean: f64, darkness: f64) -> f64 {
    let square = mean * mean + darkness;
    if square > 0.0 { 1.0 / square } else { 0.0 }
}

/// The same for the mean of two values, from which is taken that the function is convex: by ½·f″ times its variance, which
/// their difference tells.
fn over_mean_of(a: f64, b: f64, darkness: f64) -> f64 {
    /// No more than doubles it.
    const LEAST: f64 = -0.5;
    let (mean, variance) = (f64::midpoint(a, b), (a - b) * (a - b) / 4.0);
    let over = over(mean, darkness);
    let bend = (3.0 * mean * mean - darkness) * over * over * variance;
    over / (1.0 + bend.max(LEAST))
}

/// Sums over channels and pixels, all relative to squared radiance.
#[derive(Clone, Copy, Debug, Default)]
struct Beside {
    /// Of products of the halves' differences, one of each replicate.
    product: f64,
    /// Of the squared error as halves say it.
    halves: f64,
    /// Of squared differences between halves of different replicates, with the weight at the mean of all.
    own_weight: f64,
    /// The same with the weight at the mean of the other halves, within limits.
    other_weight: f64,
    /// The same without.
    free_weight: f64,
}

impl std::ops::AddAssign for Beside {
    fn add_assign(&mut self, o: Self) {
        self.product += o.product;
        self.halves += o.halves;
        self.own_weight += o.own_weight;
        self.other_weight += o.other_weight;
        self.free_weight += o.free_weight;
    }
}

/// What is known of all pixels of a picture, row by row.
#[derive(Clone, Debug)]
pub struct Estimates {
    width: usize,
    pixels: Vec<PixelEstimate>,
    parts: Parts,
}

/// What is known of a whole picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureError {
    /// The estimated relative error.
    pub error: f64,
    /// Its interval.
    pub interval: Interval,
    /// Index of the tail of the pixels' squared errors; infinite where there is none.
    pub tail: f64,
    /// How many times as large the squared error would be if some of a pixel's samples said what it should be: half of them those that
    /// the other half is compared with, or the darker of two halves. Large where pixels are made by samples that most samples
    /// know nothing of.
    pub surprise: f64,
    /// Above which that makes the estimate doubtful.
    most_surprise: f64,
    /// Whether the picture is black all over.
    is_black: bool,
}

impl PictureError {
    /// Whether a few pixels make most of the error, so that its estimate cannot be trusted.
    pub fn is_heavy_tailed(&self) -> bool {
        self.tail < TRUSTED_TAIL || self.surprise > self.most_surprise
    }

    /// Whether all is black, so that nothing is known.
    pub fn is_of_black(&self) -> bool {
        self.is_black
    }
}

impl Estimates {
    /// Nothing yet, for a picture of this size.
    pub fn new(width: u32, height: u32, parts: Parts) -> Self {
        let pixels = vec![PixelEstimate::default(); width as usize * height as usize];
        Self { width: width as usize, pixels, parts }
    }

    /// What a film's two halves say.
    pub fn from_halves(film: &Film) -> Self {
        let area = film.area();
        let [first, second] = [0, 1].map(|part| film.part_means(part));
        let pixels = first.into_iter().zip(second).map(|(g, h)| PixelEstimate::from_halves([g, h])).collect();
        Self { width: area.width as usize, pixels, parts: Parts::Halves }
    }

    /// Row and column are those of the picture.
    pub fn set(&mut self, x: usize, y: usize, estimate: PixelEstimate) {
        self.pixels[y * self.width + x] = estimate;
    }

    fn height(&self) -> usize {
        self.pixels.len() / self.width.max(1)
    }

    /// What is added to squares of radiance before an error's square is divided by them.
    pub fn darkness(&self) -> f64 {
        let sum: f64 = self.pixels.iter().flat_map(|p| p.mean).map(f64::from).sum();
        let mean = sum / (3 * self.pixels.len()).max(1) as f64;
        DARK * mean * mean
    }

    /// The whole picture's error alone.
    pub fn error(&self) -> f64 {
        /// It has nothing to do with it.
        const ANY_CONFIDENCE: f64 = 0.5;
        self.whole(ANY_CONFIDENCE).error
    }

    /// The whole picture's error, with an interval in which it lies with this `confidence`, a probability.
    pub fn whole(&self, confidence: f64) -> PictureError {
        let darkness = self.darkness();
        let own = self.relative(darkness);
        let sum: f64 = own.iter().sum();
        let estimate = match self.parts {
            Parts::Replicates => self.of_replicates(&own, sum, darkness),
            Parts::Halves => self.of_halves(&own, sum, darkness),
        };
        let count = (3 * self.pixels.len()).max(1) as f64;
        let mut interval = Interval::around(estimate.sum / count, estimate.deviation, confidence);
        if self.parts == Parts::Halves {
            interval.low /= (libm::exp2(MOST_SLOPE) - 1.0).sqrt();
        }
        let most_surprise = match self.parts {
            Parts::Replicates => MOST_SURPRISE_OF_REPLICATES,
            Parts::Halves => MOST_SURPRISE_OF_HALVES,
        };
        let (error, surprise) = ((estimate.sum / count).sqrt(), estimate.surprise);
        if self.parts == Parts::Replicates {
            // Those may be right who expect something else.
            interval.high = interval.high.max(error * surprise.sqrt());
        }
        PictureError { error, interval, tail: tail_index(own), surprise, most_surprise, is_black: darkness == 0.0 }
    }

    /// See the module's head.
    fn of_replicates(&self, own: &[f64], sum: f64, darkness: f64) -> Sum {
        let (mut all, mut miss) = (Beside::default(), 0.0);
        for block in self.tiles(BLOCK) {
            let mut of_block = Beside::default();
            self.indices(block).for_each(|i| of_block += self.pixels[i].beside(darkness));
            miss += of_block.product * of_block.product;
            all += of_block;
        }
        if !(sum > 0.0 && all.own_weight > 0.0 && all.halves > 0.0) {
            return Sum { sum, deviation: 0.0, surprise: 1.0 };
        }
        let alike = (sum / all.halves).min(1.0);
        let rare: f64 = own.iter().map(|square| NORMAL_PRODUCT * square * square).sum();
        // On the scale of logarithms; what halves of replicates say can be off by little more than that where all is noise.
        let of_weight = libm::log(all.other_weight / all.own_weight) / 2.0;
        let squared = (miss * alike * alike + rare) / (sum * sum) + of_weight * of_weight;
        let surprise = all.free_weight / all.own_weight;
        Sum { sum: sum * libm::exp(of_weight), deviation: squared.sqrt(), surprise }
    }

    /// See the module's head. Squares of one normal number a block miss by √(4/3) times what their own squares add up to.
    fn of_halves(&self, own: &[f64], sum: f64, darkness: f64) -> Sum {
        let of_block = |block| self.indices(block).map(|i| own[i]).sum::<f64>();
        let squares: f64 = self.tiles(BLOCK).map(of_block).map(|sum| NORMAL_PRODUCT * sum * sum).sum();
        if !(sum > 0.0) {
            return Sum { sum, deviation: 0.0, surprise: 1.0 };
        }
        let (mut limited, mut free) = (0.0, 0.0);
        for [within, without] in self.pixels.iter().map(|pixel| pixel.relative_to_darker(darkness)) {
            (limited, free) = (limited + within, free + without);
        }
        let of_weight = libm::log(limited / sum) / 2.0;
        let squared = squares / (sum * sum) + of_weight * of_weight;
        Sum { sum: sum * libm::exp(of_weight), deviation: squared.sqrt(), surprise: free / sum }
    }

    /// Each pixel's squared error, relative to its radiance, over its channels.
    fn relative(&self, darkness: f64) -> Vec<f64> {
        self.pixels.iter().map(|pixel| pixel.relative(darkness)).collect()
    }

    /// The relative error of an area, in the picture's own rows and columns.
    pub fn of_area(&self, area: Area, darkness: f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for i in self.indices(area) {
            (sum, count) = (sum + self.pixels[i].relative(darkness), count + 3);
        }
        (sum / count.max(1) as f64).sqrt()
    }

    /// The mean squared error of half of an area's pixels, each relative to its own radiance: those of a chessboard's one colour, if
    /// there are any.
    pub fn of_colour(&self, area: Area, colour: usize, darkness: f64) -> Option<f64> {
        let is_meant = |i: &usize| (i % self.width + i / self.width) % 2 == colour;
        let (mut sum, mut count) = (0.0, 0usize);
        for i in self.indices(area).filter(is_meant) {
            (sum, count) = (sum + self.pixels[i].relative(darkness), count + 1);
        }
        (count > 0).then(|| sum / count as f64)
    }

    /// The mean over an area's pixels of [`PixelEstimate::of_replicate`].
    pub fn of_replicate(&self, area: Area, which: usize, darkness: f64) -> f64 {
        let sum: f64 = self.indices(area).map(|i| self.pixels[i].of_replicate(which, darkness)).sum();
        sum / area.pixels().max(1) as f64
    }

    /// The standard error of each pixel's channel, pooled over those around it; row by row.
    pub fn standard_errors(&self, channel: usize) -> Vec<f32> {
        let around = |at: usize, end: usize| at.saturating_sub(POOL)..(at + POOL + 1).min(end);
        let (width, height) = (self.width, self.height());
        (0..self.pixels.len())
            .map(|i| {
                let (rows, columns) = (around(i / width, height), around(i % width, width));
                let (mut sum, mut count) = (0.0, 0.0);
                for y in rows {
                    for pixel in &self.pixels[y * width..][columns.clone()] {
                        (sum, count) = (sum + f64::from(pixel.difference[channel]).powi(2), count + 1.0);
                    }
                }
                saturate_to_f32((sum / count).sqrt())
            })
            .collect()
    }

    /// The picture cut into squares with edges of so many pixels, in its own rows and columns.
    pub fn tiles(&self, edge: usize) -> impl Iterator<Item = Area> + use<> {
        let (width, height) = (self.width, self.height());
        (0..height).step_by(edge).flat_map(move |y| {
            (0..width).step_by(edge).map(move |x| Area {
                x: x as i32,
                y: y as i32,
                width: edge.min(width - x) as u32,
                height: edge.min(height - y) as u32,
            })
        })
    }

    /// Positions of the pixels of an area.
    fn indices(&self, area: Area) -> impl Iterator<Item = usize> {
        let columns = area.x as usize..area.x as usize + area.width as usize;
        let (width, rows) = (self.width, area.y as usize..area.y as usize + area.height as usize);
        rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
    }
}

/// A sum of squared errors, and by how much of itself it may be wrong: one standard deviation.
struct Sum {
    sum: f64,
    deviation: f64,
    surprise: f64,
}

#[cfg(test)]
mod tests;
