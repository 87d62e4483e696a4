//! Where uniform numbers come from: functions of (seed, pixel, sample, dimension) alone, never of thread or time.
//!
//! # Dimensions
//!
//! Numbers come in *sets* of four. Every use has its own place for good, because moving one would change every picture:
//!
//! | set | numbers |
//! |---|---|
//! | 0 | film x, film y, lens u, lens v |
//! | 1 | time; three spare |
//! | 2 + 2v | at path vertex v (the first hit is 0): bsdf u, bsdf v, bsdf lobe, roulette |
//! | 3 + 2v | at path vertex v: light u, light v, light choice, and more digits of that |
//!
//! Time is reserved: nothing uses it yet.
//!
//! The first two numbers of a set are those with the best two-dimensional projection.
//!
//! # Runs
//!
//! The upper two bits of a sample's index name one of four *runs* of 2³⁰ samples. Each has numbers of its own, independent of the
//! others' as if it had another seed: by how much their pictures differ one knows how wrong they are.

mod batch;
mod hash;
mod independent;
mod sobol;
mod stratified;
mod word;
mod zsobol;

pub use batch::Batch;
pub use hash::mix64;
pub use zsobol::MOST_LOG_SAMPLES;

use crate::sampling::warp::square_to_cosine_hemisphere;
use glam::{Vec2, Vec3};

/// Which numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol' points, for any count: see [`sobol`].
    Sobol,
    /// The same, dealt out to pixels so that their errors are blue noise: see [`zsobol`].
    ZSobol {
        /// Binary logarithm of the number of samples a pixel, at most [`MOST_LOG_SAMPLES`].
        log_samples: u32,
    },
    /// Correlated multi-jittered points: see [`stratified`].
    Stratified {
        /// Samples a pixel.
        samples: u32,
    },
    /// Independent uniform numbers: for statistics that need them.
    Independent,
}

impl SamplerKind {
    /// The same for `samples` a pixel; `None` if it cannot have that many.
    pub fn for_samples(self, samples: u32) -> Option<Self> {
        match self {
            Self::ZSobol { .. } => {
                let log_samples = samples.is_power_of_two().then(|| samples.ilog2())?;
                (log_samples <= MOST_LOG_SAMPLES).then_some(Self::ZSobol { log_samples })
            }
            Self::Stratified { .. } => Some(Self::Stratified { samples }),
            Self::Sobol | Self::Independent => Some(self),
        }
    }

    /// The same for points each of which is cut into `parts`, a power of two: see [`Stream::part`]. `None` if it cannot have that
    /// many.
    pub fn split(self, parts: u32) -> Option<Self> {
        match self {
            Self::ZSobol { log_samples } => {
                let log_samples = log_samples + parts.ilog2();
                (log_samples <= MOST_LOG_SAMPLES).then_some(Self::ZSobol { log_samples })
            }
            Self::Stratified { samples } => Some(Self::Stratified { samples: samples.checked_mul(parts)? }),
            Self::Sobol | Self::Independent => Some(self),
        }
    }
}

/// A sampler for a whole render.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    /// Which numbers.
    pub kind: SamplerKind,
    /// Different seeds give independent pictures.
    pub seed: u64,
}

/// Where the uniform numbers of one sample of one pixel come from.
#[derive(Clone, Copy, Debug)]
pub struct Stream {
    kind: SamplerKind,
    key: [u32; 2],
    index: u32,
}

/// Four uniform numbers in [0, 1). Those that nobody wants are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Set([f32; 4]);

impl Set {
    /// Number `d`, 0 to 3.
    #[inline]
    pub fn get(&self, d: usize) -> f32 {
        self.0[d]
    }

    /// The two numbers with the best projection.
    #[inline]
    pub fn pair(&self) -> Vec2 {
        Vec2::new(self.0[0], self.0[1])
    }

    /// The other two.
    #[inline]
    pub fn second_pair(&self) -> Vec2 {
        Vec2::new(self.0[2], self.0[3])
    }
}

/// What a path vertex needs for its bsdf and for roulette.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfUniforms {
    set: Set,
    hemisphere: Vec3,
}

impl BsdfUniforms {
    fn new(set: Set) -> Self {
        Self { set, hemisphere: square_to_cosine_hemisphere(set.pair()) }
    }

    /// What [`square_to_cosine_hemisphere`] makes of [`Self::direction`]: most bsdfs have a lobe that asks, and of many paths at once
    /// it takes a fraction of the time.
    #[inline]
    pub fn hemisphere(&self) -> Vec3 {
        self.hemisphere
    }

    /// The same with another number for the choice of the lobe.
    #[must_use]
    pub fn with_lobe(mut self, lobe: f32) -> Self {
        self.set.0[2] = lobe;
        self
    }

    /// Direction.
    #[inline]
    pub fn direction(&self) -> Vec2 {
        self.set.pair()
    }

    /// Choice of lobe.
    #[inline]
    pub fn lobe(&self) -> f32 {
        self.set.get(2)
    }

    /// Russian roulette.
    #[inline]
    pub fn roulette(&self) -> f32 {
        self.set.get(3)
    }
}

/// What a path vertex needs to sample a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightUniforms(Set);

impl LightUniforms {
    /// Point on the light, or direction towards it.
    #[inline]
    pub fn point(&self) -> Vec2 {
        self.0.pair()
    }

    /// Choice of the light, to 48 bits: of many lights some have a small probability.
    #[inline]
    pub fn choice(&self) -> f64 {
        f64::from(self.0.get(2)) + f64::from(self.0.get(3)) * (1.0 / (1u32 << 24) as f64)
    }
}

/// Bits of a sample's index within its run.
const RUN_BITS: u32 = 30;

/// How many runs there are.
pub const RUNS: u32 = 1 << (u32::BITS - RUN_BITS);

/// Most samples of a run.
pub const MOST_OF_RUN: u32 = 1 << RUN_BITS;

/// The index of the first sample of a run.
pub fn first_of_run(run: u32) -> u32 {
    run << RUN_BITS
}

const SET_FILM: u32 = 0;
const SET_FIRST_VERTEX: u32 = 2;
const SETS_PER_VERTEX: u32 = 2;

/// How many numbers of a set are in use; a light sample needs the last two only where there is a choice.
const FILM_NUMBERS: usize = 2;
const FILM_AND_LENS_NUMBERS: usize = 4;
const BSDF_NUMBERS: usize = 4;
const LIGHT_NUMBERS: usize = 4;

/// The set of the bsdf at path vertex `vertex`, counted from 0.
#[inline]
fn bsdf_set(vertex: u32) -> u32 {
    SET_FIRST_VERTEX.wrapping_add(vertex.wrapping_mul(SETS_PER_VERTEX))
}

/// The set of the light at path vertex `vertex`.
#[inline]
fn light_set(vertex: u32) -> u32 {
    bsdf_set(vertex).wrapping_add(1)
}

impl Sampler {
    /// The numbers of sample `index` of a pixel, which is named by its column and row in the whole film (so that a crop
    /// shows the same numbers as the whole).
    #[inline]
    pub fn stream(&self, x: u32, y: u32, index: u32) -> Stream {
        let (run, index) = (index >> RUN_BITS, index % MOST_OF_RUN);
        let ([x, y], index) = match self.kind {
            SamplerKind::ZSobol { log_samples } => (zsobol::block(x, y), zsobol::index(x, y, index, log_samples)),
            _ => ([x, y], index),
        };
        let place = u64::from(y) << 32 | u64::from(x);
        let key = hash::mix64(hash::mix64(self.seed) ^ place);
        let key = if run == 0 { key } else { hash::mix64(key.wrapping_add(u64::from(run))) };
        Stream { kind: self.kind, key: [key as u32, (key >> 32) as u32], index }
    }
}

impl Stream {
    /// The first `wanted` numbers of a set.
    fn set(&self, set: u32, wanted: usize) -> Set {
        let mut numbers = [0.0; 4];
        match self.kind {
            SamplerKind::Sobol => {
                let index = sobol::Index::new(self.index, self.index.saturating_add(1));
                let set = sobol::SobolSet::new(self.key, index, set);
                for (d, number) in numbers.iter_mut().enumerate().take(wanted) {
                    *number = to_unit(set.bits(d));
                }
            }
            SamplerKind::ZSobol { log_samples } => {
                let set = zsobol::ZSobolSet::new(self.key, self.index, log_samples, set);
                for (d, number) in numbers.iter_mut().enumerate().take(wanted) {
                    *number = to_unit(set.bits(d));
                }
            }
            SamplerKind::Stratified { samples } => {
                for (pair, numbers) in (0..).zip(numbers.chunks_exact_mut(2)).take(wanted.div_ceil(2)) {
                    let bits = stratified::pair(self.key, self.index, samples, set, pair);
                    numbers.copy_from_slice(&bits.map(to_unit));
                }
                numbers[wanted..].fill(0.0);
            }
            SamplerKind::Independent => {
                for (d, number) in numbers.iter_mut().enumerate().take(wanted) {
                    *number = to_unit(independent::bits(self.key, self.index, set, d));
                }
            }
        }
        Set(numbers)
    }

    /// Number `part` of the `parts` samples that take the place of this one among as many times the samples of `kind`, which
    /// [`SamplerKind::split`] gave: together they are as well spread as the samples themselves.
    #[inline(always)]
    pub fn part(self, kind: SamplerKind, part: u32, parts: u32) -> Self {
        Self { kind, index: self.index.wrapping_mul(parts).wrapping_add(part), ..self }
    }

    /// Position within the pixel.
    pub fn film(&self) -> Vec2 {
        self.set(SET_FILM, FILM_NUMBERS).pair()
    }

    /// Position on the lens.
    pub fn lens(&self) -> Vec2 {
        self.set(SET_FILM, FILM_AND_LENS_NUMBERS).second_pair()
    }

    /// For the bsdf at path vertex `vertex`, counted from 0.
    pub fn bsdf(&self, vertex: u32) -> BsdfUniforms {
        BsdfUniforms::new(self.set(bsdf_set(vertex), BSDF_NUMBERS))
    }

    /// For the light at path vertex `vertex`, counted from 0.
    pub fn light(&self, vertex: u32) -> LightUniforms {
        LightUniforms(self.set(light_set(vertex), LIGHT_NUMBERS))
    }
}

/// The top 24 bits as a number in [0, 1 − 2⁻²⁴]: never one, and every value exact.
#[inline(always)]
fn to_unit(bits: u32) -> f32 {
    const SCALE: f32 = 1.0 / (1u32 << 24) as f32;
    (bits >> 8) as f32 * SCALE
}

#[cfg(test)]
mod tests;
