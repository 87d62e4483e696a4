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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_light_is_chosen_with_the_probability_that_is_asked_for() {
        for count in [1, 2, 3, 7, 100] {
            let sampler = UniformLightSampler::new(count);
            let n = 1 << 16;
            let mut chosen = vec![0u32; count];
            for i in 0..n {
                let (index, p) = sampler.sample(|| (i as f32 + 0.5) / n as f32).unwrap();
                assert_eq!(p, sampler.pmf());
                chosen[index] += 1;
            }
            // Evenly spaced numbers: every light gets its share but for one number at either end.
            for c in chosen {
                assert!((f64::from(c) - f64::from(n) / count as f64).abs() <= 1.0, "{c} of {n} among {count}");
            }
            assert!((sampler.pmf() * count as f32 - 1.0).abs() <= f32::EPSILON);
        }
        assert!(UniformLightSampler::new(0).sample(|| 0.5).is_none());
        assert_eq!(UniformLightSampler::new(3).sample(|| crate::math::float::ONE_MINUS_EPSILON).unwrap().0, 2);
    }
}
