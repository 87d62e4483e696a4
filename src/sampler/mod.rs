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
//! | 3 + 2v | at path vertex v: light u, light v, light choice, spare (opacity) |
//!
//! The first two numbers of a set are those with the best two-dimensional projection.

mod hash;
mod independent;
mod sobol;

use glam::Vec2;

/// Which numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol' points: see [`sobol`].
    Sobol,
    /// Independent uniform numbers: for statistics that need them.
    Independent,
}

/// A sampler for a whole render.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    /// Which numbers.
    pub kind: SamplerKind,
    /// Different seeds give independent pictures.
    pub seed: u64,
}

/// The uniform numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Stream {
    kind: SamplerKind,
    key: u64,
    index: u32,
}

/// Four uniform numbers in [0, 1), each computed when it is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Set(Numbers);

#[derive(Clone, Copy, Debug)]
enum Numbers {
    Sobol(sobol::SobolSet),
    Independent(independent::IndependentSet),
}

impl Set {
    /// Number `d`, 0 to 3.
    #[inline]
    pub fn get(&self, d: usize) -> f32 {
        match &self.0 {
            Numbers::Sobol(set) => set.get(d),
            Numbers::Independent(set) => set.get(d),
        }
    }

    /// The two numbers with the best projection.
    #[inline]
    pub fn pair(&self) -> Vec2 {
        Vec2::new(self.get(0), self.get(1))
    }
}

/// What a path vertex needs for its bsdf and for roulette.
#[derive(Clone, Copy, Debug)]
pub struct BsdfUniforms(Set);

impl BsdfUniforms {
    /// Direction.
    #[inline]
    pub fn direction(&self) -> Vec2 {
        self.0.pair()
    }

    /// Choice of lobe.
    #[inline]
    pub fn lobe(&self) -> f32 {
        self.0.get(2)
    }

    /// Russian roulette.
    #[inline]
    pub fn roulette(&self) -> f32 {
        self.0.get(3)
    }
}

/// What a path vertex needs to sample a light.
#[derive(Clone, Copy, Debug)]
pub struct LightUniforms(Set);

impl LightUniforms {
    /// Point on the light, or direction towards it.
    #[inline]
    pub fn point(&self) -> Vec2 {
        self.0.pair()
    }

    /// Choice of the light.
    #[inline]
    pub fn choice(&self) -> f32 {
        self.0.get(2)
    }
}

const SET_FILM: u32 = 0;
const SET_FIRST_VERTEX: u32 = 2;
const SETS_PER_VERTEX: u32 = 2;

impl Sampler {
    /// The numbers of sample `index` of a pixel, which is named by its column and row in the whole film (so that a crop
    /// shows the same numbers as the whole).
    #[inline]
    pub fn stream(&self, x: u32, y: u32, index: u32) -> Stream {
        let pixel = u64::from(y) << 32 | u64::from(x);
        Stream { kind: self.kind, key: hash::mix64(hash::mix64(self.seed) ^ pixel), index }
    }
}

impl Stream {
    #[inline]
    fn set(&self, set: u32) -> Set {
        Set(match self.kind {
            SamplerKind::Sobol => Numbers::Sobol(sobol::SobolSet::new(self.key, self.index, set)),
            SamplerKind::Independent => {
                Numbers::Independent(independent::IndependentSet::new(self.key, self.index, set))
            }
        })
    }

    /// Position within the pixel.
    #[inline]
    pub fn film(&self) -> Vec2 {
        self.set(SET_FILM).pair()
    }

    /// For the bsdf at path vertex `vertex`, counted from 0.
    #[inline]
    pub fn bsdf(&self, vertex: u32) -> BsdfUniforms {
        BsdfUniforms(self.set(SET_FIRST_VERTEX.wrapping_add(vertex.wrapping_mul(SETS_PER_VERTEX))))
    }

    /// For the light at path vertex `vertex`, counted from 0.
    #[inline]
    pub fn light(&self, vertex: u32) -> LightUniforms {
        LightUniforms(self.set(SET_FIRST_VERTEX.wrapping_add(vertex.wrapping_mul(SETS_PER_VERTEX)).wrapping_add(1)))
    }
}

/// The top 24 bits as a number in [0, 1 − 2⁻²⁴]: never one, and every value exact.
#[inline]
fn to_unit(bits: u32) -> f32 {
    const SCALE: f32 = 1.0 / (1u32 << 24) as f32;
    (bits >> 8) as f32 * SCALE
}

#[cfg(test)]
mod tests;
