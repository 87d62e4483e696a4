//! The numbers of a whole wave at once, sixteen streams at a time.

use super::sobol::{Index, SobolSet};
use super::zsobol::ZSobolSet;
use super::{
    BSDF_NUMBERS, BsdfUniforms, FILM_AND_LENS_NUMBERS, FILM_NUMBERS, LIGHT_NUMBERS, LightUniforms, SET_FILM,
    SamplerKind, Set, Stream, bsdf_set, independent, light_set, stratified, to_unit,
};
use crate::sampling::warp::square_to_cosine_hemisphere;
use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, u32x16};
use glam::{Vec2, Vec3};

/// Streams at a time.
const LANES: usize = 16;

/// One set's numbers for many streams: the same bits that each [`Stream`] gives by itself.
#[derive(Debug)]
pub struct Batch {
    level: Level,
    sets: Vec<[[f32; LANES]; 4]>,
    /// Of numbers for bsdfs: [`BsdfUniforms::hemisphere`].
    hemispheres: Vec<[[f32; LANES]; 3]>,
}

impl Default for Batch {
    fn default() -> Self {
        Self { level: crate::math::simd::level(), sets: Vec::new(), hemispheres: Vec::new() }
    }
}

impl Batch {
    /// The positions within the pixel of all streams, and those on the `lens` if there is one.
    pub fn fill_film(&mut self, lens: bool, streams: impl ExactSizeIterator<Item = Stream>) {
        self.fill(SET_FILM, if lens { FILM_AND_LENS_NUMBERS } else { FILM_NUMBERS }, streams);
    }

    /// The numbers for the bsdf of all streams at path vertex `vertex`, counted from 0.
    pub fn fill_bsdf(&mut self, vertex: u32, streams: impl ExactSizeIterator<Item = Stream>) {
        self.fill(bsdf_set(vertex), BSDF_NUMBERS, streams);
        let Self { level, sets, hemispheres } = self;
        hemispheres.resize(sets.len(), [[0.0; LANES]; 3]);
        for (numbers, directions) in sets.iter().zip(hemispheres) {
            dispatch!(*level, simd => lift(simd, numbers, directions));
        }
    }

    /// The numbers for the light of all streams at path vertex `vertex`, counted from 0; with a `choice` among lights or
    /// without.
    pub fn fill_light(&mut self, vertex: u32, choice: bool, streams: impl ExactSizeIterator<Item = Stream>) {
        self.fill(light_set(vertex), if choice { LIGHT_NUMBERS } else { 2 }, streams);
    }

    /// The same for every one of the `parts` parts of all streams, one stream's after the other's.
    pub fn fill_light_parts(
        &mut self,
        vertex: u32,
        choice: bool,
        (kind, parts): (SamplerKind, u32),
        stream: impl Fn(usize) -> Stream,
        streams: usize,
    ) {
        let part = |i: usize| stream(i / parts as usize).part(kind, i as u32 % parts, parts);
        self.fill_light(vertex, choice, (0..streams * parts as usize).map(part));
    }

    /// Stream `i`'s position within the pixel, after [`Self::fill_film`].
    #[inline]
    pub fn film(&self, i: usize) -> Vec2 {
        self.get(i).pair()
    }

    /// Stream `i`'s position on the lens, after [`Self::fill_film`]; 0 without one.
    #[inline]
    pub fn lens(&self, i: usize) -> Vec2 {
        self.get(i).second_pair()
    }

    /// Stream `i`'s numbers, after [`Self::fill_bsdf`].
    #[inline]
    pub fn bsdf(&self, i: usize) -> BsdfUniforms {
        let [x, y, z] = &self.hemispheres[i / LANES];
        let lane = i % LANES;
        BsdfUniforms { set: self.get(i), hemisphere: Vec3::new(x[lane], y[lane], z[lane]) }
    }

    /// Stream `i`'s numbers, after [`Self::fill_light`].
    #[inline]
    pub fn light(&self, i: usize) -> LightUniforms {
        LightUniforms(self.get(i))
    }

    #[inline]
    fn get(&self, i: usize) -> Set {
        let block = &self.sets[i / LANES];
        let lane = i % LANES;
        Set([block[0][lane], block[1][lane], block[2][lane], block[3][lane]])
    }

    fn fill(&mut self, set: u32, wanted: usize, mut streams: impl ExactSizeIterator<Item = Stream>) {
        self.sets.resize(streams.len().div_ceil(LANES), [[0.0; LANES]; 4]);
        for block in &mut self.sets {
            let mut keys = [[0; LANES]; 2];
            let mut indices = [0; LANES];
            let mut kind = SamplerKind::Sobol;
            for (lane, stream) in streams.by_ref().take(LANES).enumerate() {
                kind = stream.kind;
                [keys[0][lane], keys[1][lane]] = stream.key;
                indices[lane] = stream.index;
            }
            dispatch!(self.level, simd => compute(simd, kind, &keys, &indices, set, wanted, block));
        }
    }
}

/// The directions for the first two numbers, in a loop that becomes vectors of what `simd` says the processor has.
#[inline(always)]
fn lift<S: Simd>(_: S, [x, y, ..]: &[[f32; LANES]; 4], out: &mut [[f32; LANES]; 3]) {
    for i in 0..LANES {
        let w = square_to_cosine_hemisphere(Vec2::new(x[i], y[i]));
        (out[0][i], out[1][i], out[2][i]) = (w.x, w.y, w.z);
    }
}

#[inline(always)]
fn compute<S: Simd>(
    simd: S,
    kind: SamplerKind,
    keys: &[[u32; LANES]; 2],
    indices: &[u32; LANES],
    set: u32,
    wanted: usize,
    out: &mut [[f32; LANES]; 4],
) {
    for unwanted in &mut out[wanted..] {
        *unwanted = [0.0; LANES];
    }
    let key = [u32x16::from_slice(simd, &keys[0]), u32x16::from_slice(simd, &keys[1])];
    let index = u32x16::from_slice(simd, indices);
    match kind {
        SamplerKind::Sobol => {
            let mut below = 0;
            for &i in indices {
                below |= i;
            }
            let set = SobolSet::new(key, Index::new(index, below.saturating_add(1)), set);
            for (d, out) in out.iter_mut().enumerate().take(wanted) {
                store(set.bits(d), out);
            }
        }
        SamplerKind::ZSobol { log_samples } => {
            let set = ZSobolSet::new(key, index, log_samples, set);
            for (d, out) in out.iter_mut().enumerate().take(wanted) {
                store(set.bits(d), out);
            }
        }
        SamplerKind::Stratified { samples } => stratified_pairs(samples, keys, indices, set, wanted, out),
        SamplerKind::Independent => {
            for (d, out) in out.iter_mut().enumerate().take(wanted) {
                store(independent::bits(key, index, set, d), out);
            }
        }
    }
}

/// One after the other: their permutations end at different times.
#[inline(never)]
fn stratified_pairs(
    samples: u32,
    keys: &[[u32; LANES]; 2],
    indices: &[u32; LANES],
    set: u32,
    wanted: usize,
    out: &mut [[f32; LANES]; 4],
) {
    for lane in 0..LANES {
        for d in (0..wanted).step_by(2) {
            let bits = stratified::pair([keys[0][lane], keys[1][lane]], indices[lane], samples, set, (d / 2) as u32);
            out[d][lane] = to_unit(bits[0]);
            out[d + 1][lane] = if d + 1 < wanted { to_unit(bits[1]) } else { 0.0 };
        }
    }
}

#[inline(always)]
fn store<S: Simd>(bits: u32x16<S>, out: &mut [f32; LANES]) {
    let mut words = [0; LANES];
    bits.store_slice(&mut words);
    for (out, &word) in out.iter_mut().zip(&words) {
        *out = to_unit(word);
    }
}
