//! Random numbers of the checks: one small state that a seed and a few indices start.

use crate::sampler::mix64;
use glam::Vec3;

/// Shorter vectors are not brought to unit length: so few bits are no good direction.
const SHORTEST_SQUARED: f32 = 1e-4;

/// SplitMix64 (Steele, Lea and Flood 2014).
#[derive(Clone, Debug)]
pub struct Rng(pub u64);

impl Rng {
    /// A stream for a thing that is named by `seed` and these indices.
    pub fn of(seed: u64, indices: &[u64]) -> Self {
        Self(indices.iter().fold(mix64(seed), |state, &index| mix64(state ^ mix64(index))))
    }

    /// 64 random bits.
    #[allow(clippy::should_implement_trait, reason = "no iterator: it has no end")]
    pub fn next(&mut self) -> u64 {
        let bits = mix64(self.0);
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        bits
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// In [a, b), but for rounding.
    pub fn between(&mut self, a: f32, b: f32) -> f32 {
        a + (b - a) * self.unit()
    }

    /// Less than `n`, which is not 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// A power of two with an exponent, not an integer, in [low, high).
    pub fn power(&mut self, low: f32, high: f32) -> f64 {
        libm::exp2(f64::from(self.between(low, high)))
    }

    /// 1 or −1.
    pub fn sign(&mut self) -> f32 {
        if self.next() & 1 == 0 { 1.0 } else { -1.0 }
    }

    /// In the cube [−1, 1)³.
    pub fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// A unit vector.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.in_cube();
            if v.length_squared() > SHORTEST_SQUARED && v.length_squared() <= 1.0 {
                return v.normalize();
            }
        }
    }
}
