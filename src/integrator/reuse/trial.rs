//! Whether sharing pays: found out by walking a few paths both ways.
//!
//! Where most noise is that of direct light, or of surfaces that nobody can share, sharing costs more than it gains. So blocks
//! of pixels over the whole film are sampled with it and without, by the same numbers: the variance of a pixel's samples,
//! relative to the square of the block's mean, times the rays that were traced, is what is compared. (A vote of the blocks' medians
//! fails where noise is rare and strong, as most blocks have not seen it yet; a path that carries much has the same share in
//! both sums.) The numbers are the trial's own, always the same, so that the answer depends on the scene and on the limits of
//! paths alone: not on seed, crop or number of samples, and not on the machine.

use super::group;
use crate::film::SampleId;
use crate::image::{Area, Crop};
use crate::integrator::{Integrator, RayCounts};
use crate::sampler::{Sampler, SamplerKind};
use crate::scene::Scene;
use crate::spectrum::Rgb;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Pixels of a block along an edge: groups are whole.
const BLOCK: u32 = group::BLOCK.cast_unsigned();

/// Blocks across and down: some 13,000 paths, both ways.
const BLOCKS: u32 = 5;

/// Samples of each pixel.
const SAMPLES: u32 = 8;

/// Most segments of a path: a trial cannot be interrupted, and without roulette there are paths that never end.
const DEEPEST: u32 = 32;

/// Seed of the trial's numbers.
const SEED: u64 = 0x7472_6961_6c73;

/// What is added to squares of means, relative to that of all blocks: black pixels have no relative error.
const DARKEST: f64 = 0.01;

/// What must be gained in efficiency by rays: the rays of sharing are not all that it costs.
const LEAST_GAIN: f64 = 1.15;

/// x².
fn sqr(x: f64) -> f64 {
    x * x
}

/// What the samples of a block were like.
struct Noise {
    /// Mean luminance.
    mean: f64,
    /// Mean variance of a pixel's samples.
    variance: f64,
    /// Rays traced.
    rays: f64,
}

impl Integrator {
    /// Whether sharing what paths find pays in `scene`; asked on the threads of the current pool.
    pub(in crate::integrator) fn sharing_pays(&self, scene: &Scene) -> bool {
        let (width, height) = scene.film.size;
        let whole = Area::from(Crop { x: 0, y: 0, width, height });
        let place = |i: u32, size: u32| ((2 * i + 1) * size / (2 * BLOCKS)) / BLOCK * BLOCK;
        let corners = (0..BLOCKS).flat_map(|y| (0..BLOCKS).map(move |x| (place(x, width), place(y, height))));
        let blocks: Vec<_> = corners
            .map(|(x, y)| Area { x: x.cast_signed(), y: y.cast_signed(), width: BLOCK, height: BLOCK })
            .map(|block| block.intersection(whole))
            .collect();
        // Edges of what shines itself are noise that numbers which are spread evenly lose soon.
        let max_depth = self.max_depth.min(DEEPEST);
        let blind = |reuse| Self { reuse, max_depth, hide_emitters: true, hide_environment: true, ..*self };
        let of_block = |&block: &Area| [false, true].map(|reuse| blind(reuse).noise(scene, block));
        let noise: Vec<[Noise; 2]> = blocks.par_iter().map(of_block).collect();
        // Relative to the same for both: a mean of few samples grows with the rare strong one, and would hide it.
        let means: Vec<f64> = noise.iter().map(|[alone, shared]| (alone.mean + shared.mean) / 2.0).collect();
        let darkest = DARKEST * sqr(means.iter().sum::<f64>() / means.len() as f64);
        let [alone, shared] = [0, 1].map(|way| {
            let relative = noise.iter().zip(&means).map(|(both, mean)| both[way].variance / (sqr(*mean) + darkest));
            let error: f64 = relative.filter(|error| error.is_finite()).sum();
            error * noise.iter().map(|both| both[way].rays).sum::<f64>()
        });
        alone > LEAST_GAIN * shared
    }

    fn noise(&self, scene: &Scene, block: Area) -> Noise {
        let sampler = Sampler { kind: SamplerKind::Independent, seed: SEED };
        let mut sums = BTreeMap::<(i32, i32), [f64; 2]>::new();
        let mut counts = RayCounts::default();
        let ids = self.sample_ids(scene, block, 0..SAMPLES);
        self.walk(scene, &sampler, ids, &mut (), &mut counts, &mut |id: SampleId, radiance: Rgb| {
            let value = f64::from(radiance.luminance());
            let sum = sums.entry((id.x, id.y)).or_default();
            sum[0] += value;
            sum[1] += value * value;
        });
        let (n, pixels) = (f64::from(SAMPLES), sums.len() as f64);
        let mean = sums.values().map(|[sum, _]| sum / n).sum::<f64>() / pixels;
        let variance = sums.values().map(|[sum, squares]| (squares / n - sqr(sum / n)).max(0.0)).sum::<f64>() / pixels;
        Noise { mean, variance, rays: counts.total() as f64 }
    }
}
