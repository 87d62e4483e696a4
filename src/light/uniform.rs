//! Chooses a light: each as likely as the other.

use crate::math::float::min;

/// Each of `count` lights with the same probability.
#[derive(Clone, Copy, Debug)]
pub struct UniformLightSampler {
    count: u32,
}

impl UniformLightSampler {
    /// For this many lights.
    pub fn new(count: usize) -> Self {
        Self { count: u32::try_from(count).unwrap_or(u32::MAX) }
    }

    /// A light and the probability of choosing it, for the uniform number that `u` gives, which is not asked for where
    /// there is no choice; `None` where there is no light.
    #[inline]
    pub fn sample(&self, u: impl FnOnce() -> f32) -> Option<(usize, f32)> {
        match self.count {
            0 => None,
            1 => Some((0, 1.0)),
            n => Some((min(u() * n as f32, (n - 1) as f32) as usize, self.pmf())),
        }
    }

    /// Probability of choosing any one light.
    #[inline]
    pub fn pmf(&self) -> f32 {
        1.0 / self.count as f32
    }
}
