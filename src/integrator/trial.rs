//! Which ways pay in a scene: found out by walking a few paths in each of them.
//!
//! Where most noise is that of direct light, or of light that nobody can share, sharing costs more than it gains; and only where
//! it is that of direct light, more light samples do. So blocks of pixels over the whole film are sampled in either way: the
//! standard deviation of a pixel's samples, relative to the block's mean, its sum's square times the rays that were traced, is what is
//! compared. (Of variances the few strongest paths would decide, and a vote of the blocks fails where noise is rare and strong, as
//! most have not seen it yet.) The numbers are the trial's own, always the same, so that the answer depends on the scene and
//! on the limits of paths alone: not on seed, crop or number of samples, and not on the machine.

use super::path_state::PathState;
use super::reuse::BLOCK;
use super::{Estimator, Integrator, PathReuse, RayCounts};
use crate::image::{Area, Crop};
use crate::light::Light;
use crate::sampler::{Sampler, SamplerKind};
use crate::scene::Scene;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Blocks across and down, of whole groups: some 13,000 paths each way. Many, as what is rare in a picture is in few places.
const BLOCKS: u32 = 10;

/// Samples of each pixel: the fewest that have a variance.
const SAMPLES: u32 = 2;

/// Most segments of a path: a trial cannot be interrupted, and without roulette there are paths that never end.
const DEEPEST: u32 = 32;

/// Seed of the trial's numbers.
const SEED: u64 = 0x7472_6961_6c73;

/// What is added to squares of means, relative to that of all blocks: black pixels have no relative error. Of a picture whose mean
/// is a third of white, relMSE's 0.01 is about that.
const DARKEST: f64 = 0.1;

/// What sharing among eight must gain in efficiency by rays: those are not all that it costs, and plates of lights for which the trial
/// says 1.25 are none the better for it.
const LEAST_GAIN_OF_EIGHTS: f64 = 1.3;

/// What sharing among whole blocks must gain over that. Less than 1: of the numbers of a render, which are spread more evenly than
/// the trial's, what nobody shares has less noise than here, and what is shared counts for more. The Cornell box, for which the trial
/// says 0.8, gains 1.8.
const LEAST_GAIN_OF_BLOCKS: f64 = 0.7;

/// What light samples must gain: for the spheres of veach-mis, of which the trial says 1.2, they are worth 2.1.
const LEAST_GAIN_OF_LIGHT_SAMPLES: f64 = 1.1;

/// The same where a sky is all there is, over which the numbers of a render are spread more evenly than the trial's: where it says
/// 1.02 to 1.13 more samples are worth 0.7 to 0.8.
const LEAST_GAIN_UNDER_SKIES: f64 = 1.3;

/// Light samples of the first vertex that are tried.
const TRIED_LIGHT_SAMPLES: u32 = 4;

/// What a light sample costs that takes no ray, in rays with all that hangs on them: measured on a sky and on spheres, 0.2 to
/// 0.3.
const LIGHT_SAMPLE_COST: f64 = 0.25;

/// What of an integrator is to be found out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Undecided {
    /// [`Integrator::reuse`].
    pub reuse: bool,
    /// [`Integrator::light_samples`].
    pub light_samples: bool,
}

/// x².
fn sqr(x: f64) -> f64 {
    x * x
}

/// What the samples of a block were like.
#[derive(Clone, Copy, Debug)]
struct Noise {
    /// Mean luminance.
    mean: f64,
    /// Mean variance of a pixel's samples.
    variance: f64,
    /// Rays traced, and what else there was in rays.
    cost: f64,
}

/// The best way so far, and what it was like if anything was tried.
struct Best {
    way: Integrator,
    noise: Option<Vec<Noise>>,
}

impl Integrator {
    /// The same with what is `undecided` as it serves `scene` best; asked on the threads of the current pool.
    #[must_use]
    pub fn with_what_pays(self, scene: &Scene, undecided: Undecided) -> Self {
        let plain = Self {
            reuse: if undecided.reuse { PathReuse::Off } else { self.reuse },
            light_samples: if undecided.light_samples { 1 } else { self.light_samples },
            ..self
        };
        let mut best = Best { way: plain, noise: None };
        // Of the only light, if it is a point, all samples are the same.
        let choice = scene.lights.len() > 1 || scene.lights.iter().any(|light| light.can_be_met());
        if undecided.light_samples && choice && self.estimator == Estimator::Path && self.max_depth > 1 {
            let skies = scene.lights.iter().all(Light::is_sky);
            let least = if skies { LEAST_GAIN_UNDER_SKIES } else { LEAST_GAIN_OF_LIGHT_SAMPLES };
            best.or(Self { light_samples: TRIED_LIGHT_SAMPLES, ..plain }, least, scene);
        }
        let eights = Self { reuse: PathReuse::Eights, ..best.way };
        if undecided.reuse && eights.shares(scene) {
            best.or(eights, LEAST_GAIN_OF_EIGHTS, scene);
            // Where a few gain nothing, many do not.
            if best.way == eights {
                best.or(Self { reuse: PathReuse::Blocks, ..eights }, LEAST_GAIN_OF_BLOCKS, scene);
            }
        }
        best.way
    }

    /// What samples of `scene` are like, block by block.
    fn noise(&self, scene: &Scene) -> Vec<Noise> {
        let (width, height) = scene.film.size;
        let whole = Area::from(Crop { x: 0, y: 0, width, height });
        let size = BLOCK.cast_unsigned();
        let place = |i: u32, length: u32| (((2 * i + 1) * length / (2 * BLOCKS)) / size * size).cast_signed();
        let blocks: Vec<_> = (0..BLOCKS * BLOCKS)
            .map(|i| Area { x: place(i % BLOCKS, width), y: place(i / BLOCKS, height), width: size, height: size })
            .map(|block| block.intersection(whole))
            .collect();
        // Edges of what shines itself are noise that numbers which are spread evenly lose soon.
        let max_depth = self.max_depth.min(DEEPEST);
        let blind = Self { max_depth, hide_emitters: true, hide_environment: true, ..*self };
        blocks.par_iter().map(|&block| blind.noise_of(scene, block)).collect()
    }

    fn noise_of(&self, scene: &Scene, block: Area) -> Noise {
        let sampler = Sampler { kind: SamplerKind::Independent, seed: SEED };
        let mut sums = BTreeMap::<(i32, i32), [f64; 2]>::new();
        let mut counts = RayCounts::default();
        let ids = self.sample_ids(scene, block, 0..SAMPLES);
        self.walk(scene, &sampler, ids, &mut (), &mut counts, &mut |path: &PathState| {
            let value = f64::from(path.radiance.luminance());
            let sum = sums.entry((path.id.x, path.id.y)).or_default();
            sum[0] += value;
            sum[1] += value * value;
        });
        let (n, pixels) = (f64::from(SAMPLES), sums.len() as f64);
        let mean = sums.values().map(|[sum, _]| sum / n).sum::<f64>() / pixels;
        let variance = sums.values().map(|[sum, squares]| (squares / n - sqr(sum / n)).max(0.0)).sum::<f64>() / pixels;
        let more_light_samples = f64::from(self.light_samples - 1) * counts.camera as f64;
        Noise { mean, variance, cost: counts.total() as f64 + LIGHT_SAMPLE_COST * more_light_samples }
    }
}

impl Best {
    /// Takes the other way if that gains so much.
    fn or(&mut self, way: Integrator, least_gain: f64, scene: &Scene) {
        let known = self.noise.take().unwrap_or_else(|| self.way.noise(scene));
        let other = way.noise(scene);
        let pays = gain(&known, &other) > least_gain;
        self.noise = Some(if pays { other } else { known });
        self.way = if pays { way } else { self.way };
    }
}

/// How many times as efficient the second way is; NaN where neither has noise.
fn gain(first: &[Noise], second: &[Noise]) -> f64 {
    // Relative to the same for both: a mean of few samples grows with the rare strong one, and would hide it.
    let means: Vec<f64> = first.iter().zip(second).map(|(a, b)| (a.mean + b.mean) / 2.0).collect();
    let darkest = DARKEST * sqr(means.iter().sum::<f64>() / means.len() as f64);
    let [first, second] = [first, second].map(|noise| {
        let relative = noise.iter().zip(&means).map(|(block, mean)| (block.variance / (sqr(*mean) + darkest)).sqrt());
        let error: f64 = relative.filter(|error| error.is_finite()).sum();
        sqr(error) * noise.iter().map(|block| block.cost).sum::<f64>()
    });
    first / second
}
