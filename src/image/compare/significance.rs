//! Whether the noise of two pictures explains their difference: z-tests of pixels, tiles and the whole.
//!
//! Hypothesis: the expectation of every pixel is the same. Each value's difference is divided by its standard error, from
//! the variances of both pictures. The variances must be those of independent pixels: with a reconstruction filter other
//! than the box neighbouring pixels share samples, and tiles and the whole would seem to differ more than they do.

use super::Picture;

/// Edge of a tile in pixels.
pub(super) const TILE: u32 = 8;

/// The result of one family of tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Family {
    /// Largest |z|.
    pub worst_z: f64,
    /// Number of tests: values that have a variance.
    pub tests: u64,
    /// Probability that noise alone makes the largest |z| of all tests as large, were it Gaussian (Šidák's correction
    /// for independent tests).
    pub p: f64,
}

/// What the tests say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Significance {
    /// Of every pixel and channel. The noise of rendered pixels has heavier tails than the Gaussian that is assumed, so a
    /// small p means little by itself.
    pub pixels: Family,
    /// Of every tile's mean, by channel.
    pub tiles: Family,
    /// Of the whole picture's mean, by channel.
    pub whole: Family,
    /// Values that differ where neither picture has a variance: what a few samples never saw.
    pub without_variance: u64,
}

impl Significance {
    /// Of all tests together, corrected for there being three families.
    pub fn p(&self) -> f64 {
        sidak(self.pixels.p.min(self.tiles.p).min(self.whole.p), 3)
    }
}

/// Differences and variances that are summed up over a region.
#[derive(Clone, Copy, Default)]
struct Sum {
    difference: f64,
    variance: f64,
}

impl Sum {
    fn add(&mut self, other: Self) {
        self.difference += other.difference;
        self.variance += other.variance;
    }

    /// z of the region's mean; `None` where it has no variance.
    fn z(&self) -> Option<f64> {
        (self.variance > 0.0).then(|| self.difference / self.variance.sqrt())
    }
}

/// Tests two pictures with the variances of their pixels (squares of their standard errors); all have the same size.
/// Pixels that are not finite are left out.
pub fn significance(picture: [&Picture; 2], variance: [Option<&Picture>; 2]) -> Significance {
    let (width, height) = (picture[0].width(), picture[0].height());
    let across = width.div_ceil(TILE);
    let mut tiles = vec![[Sum::default(); 3]; (across * height.div_ceil(TILE)) as usize];
    let mut pixels = Tests::default();
    let mut without_variance = 0;
    for i in 0..width * height {
        let sums = sums_of(i as usize, picture, variance);
        if !sums.iter().all(|s| s.difference.is_finite() && s.variance.is_finite()) {
            continue;
        }
        let tile = &mut tiles[(i % width / TILE + i / width / TILE * across) as usize];
        for (sum, tile) in sums.into_iter().zip(tile) {
            tile.add(sum);
            match sum.z() {
                Some(z) => pixels.add(z),
                None => without_variance += u64::from(sum.difference != 0.0),
            }
        }
    }
    let (mut tile_tests, mut whole_tests, mut whole) = (Tests::default(), Tests::default(), [Sum::default(); 3]);
    for tile in &tiles {
        tile.iter().filter_map(Sum::z).for_each(|z| tile_tests.add(z));
        whole.iter_mut().zip(tile).for_each(|(w, t)| w.add(*t));
    }
    whole.iter().filter_map(Sum::z).for_each(|z| whole_tests.add(z));
    Significance { pixels: pixels.finish(), tiles: tile_tests.finish(), whole: whole_tests.finish(), without_variance }
}

/// Difference and variance of a pixel, by channel.
fn sums_of(pixel: usize, picture: [&Picture; 2], variance: [Option<&Picture>; 2]) -> [Sum; 3] {
    let value = |p: &Picture| p.pixels()[pixel].0.as_dvec3();
    let difference = value(picture[0]) - value(picture[1]);
    let variance: glam::DVec3 = variance.into_iter().flatten().map(value).sum();
    [0, 1, 2].map(|c| Sum { difference: difference[c], variance: variance[c] })
}

#[derive(Default)]
struct Tests {
    worst_z: f64,
    tests: u64,
}

impl Tests {
    fn add(&mut self, z: f64) {
        self.worst_z = self.worst_z.max(z.abs());
        self.tests += 1;
    }

    fn finish(self) -> Family {
        let two_sided = libm::erfc(self.worst_z * std::f64::consts::FRAC_1_SQRT_2);
        Family { worst_z: self.worst_z, tests: self.tests, p: sidak(two_sided, self.tests) }
    }
}

/// 1 − (1 − p)ⁿ, the chance that the smallest of n independent p-values is at most p; without cancellation.
fn sidak(p: f64, n: u64) -> f64 {
    if p >= 1.0 { 1.0 } else { -libm::expm1(n as f64 * libm::log1p(-p)) }
}
