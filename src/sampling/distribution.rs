//! Discrete distributions by inversion of the cumulative sum.

use crate::math::float::{ONE_MINUS_EPSILON, min};

/// Up to so many ends of intervals are compared one and all, without a branch that chance decides; more are bisected.
const COUNTED: usize = 16;

/// Picks an index with probability proportional to its weight.
#[derive(Clone, Debug)]
pub struct Discrete {
    /// `cumulative[i]` is the probability of an index below `i`; one entry more than there are weights.
    cumulative: Vec<f64>,
}

impl Discrete {
    /// From weights that are finite and not negative, with a positive sum; `None` otherwise.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut cumulative = vec![0.0];
        let mut sum = 0.0;
        for w in weights {
            if !(w >= 0.0 && w.is_finite()) {
                return None;
            }
            sum += w;
            cumulative.push(sum);
        }
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        for c in &mut cumulative {
            *c /= sum;
        }
        Some(Self { cumulative })
    }

    /// An index for the uniform number `u` in [0, 1), and `u` stretched to a new uniform number within that index.
    /// Never an index of weight zero.
    #[inline(always)]
    pub fn sample(&self, u: f32) -> (usize, f32) {
        let u = f64::from(u);
        // The last index whose lower end is at most u: skips empty intervals, whose two ends coincide.
        let below = if self.cumulative.len() <= COUNTED {
            self.cumulative.iter().map(|&c| usize::from(c <= u)).sum()
        } else {
            self.cumulative.partition_point(|&c| c <= u)
        };
        let index = below.clamp(1, self.cumulative.len() - 1) - 1;
        let (low, high) = (self.cumulative[index], self.cumulative[index + 1]);
        (index, min(((u - low) / (high - low)) as f32, ONE_MINUS_EPSILON))
    }

    /// The probability of `index`.
    #[inline]
    pub fn pmf(&self, index: usize) -> f32 {
        (self.cumulative[index + 1] - self.cumulative[index]) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn discrete_picks_in_proportion_and_never_an_empty_index() {
        let weights = [0.0, 1.0, 0.0, 3.0, 0.0];
        let d = Discrete::new(weights).unwrap();
        let n = 1 << 12;
        let mut counts = [0; 5];
        for i in 0..n {
            let (k, v) = d.sample((i as f32 + 0.5) / n as f32);
            assert!((0.0..1.0).contains(&v), "remapped {v}");
            counts[k] += 1;
        }
        assert_eq!(counts, [0, n / 4, 0, 3 * n / 4, 0]);
        assert_eq!(d.sample(0.0).0, 1);
        assert_eq!(d.sample(ONE_MINUS_EPSILON).0, 3);
        assert_eq!((d.pmf(0), d.pmf(1), d.pmf(3)), (0.0, 0.25, 0.75));
    }

    #[test]
    fn discrete_refuses_what_is_no_distribution() {
        assert!(Discrete::new([]).is_none());
        assert!(Discrete::new([0.0]).is_none());
        assert!(Discrete::new([1.0, f64::NAN]).is_none());
        assert!(Discrete::new([1.0, -1.0]).is_none());
        assert!(Discrete::new([f64::INFINITY]).is_none());
    }
}
