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

    /// The light for the uniform number `u` and the probability of choosing it; `None` where there is no light.
    #[inline]
    pub fn sample(&self, u: f32) -> Option<(usize, f32)> {
        let last = self.count.checked_sub(1)?;
        let index = min(u * self.count as f32, last as f32) as usize;
        Some((index, self.pmf()))
    }

    /// Probability of choosing any one light.
    #[inline]
    pub fn pmf(&self) -> f32 {
        1.0 / self.count as f32
    }
}
