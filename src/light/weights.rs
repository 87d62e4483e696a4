//! One of a few, in proportion to their weights.
//!
//! In f64, as the uniform number is: beside a great weight a small one would vanish, or get more than its share.

/// Up to `N` weights, none negative, and their sums from the first to each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights<const N: usize> {
    weights: [f32; N],
    sums: [f64; N],
}

/// The largest number below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

impl<const N: usize> Weights<N> {
    #[inline(always)]
    pub(super) fn new(weights: [f32; N]) -> Self {
        let (mut sums, mut sum) = ([0.0; N], 0.0);
        for (running, weight) in sums.iter_mut().zip(weights) {
            sum += f64::from(weight);
            *running = sum;
        }
        Self { weights, sums }
    }

    /// Of all.
    #[inline(always)]
    pub(super) fn sum(&self) -> f64 {
        self.sums[N - 1]
    }

    /// The probability of choosing one: nought if its weight is, even where all are.
    #[inline(always)]
    pub(super) fn pmf(&self, index: usize) -> f64 {
        let weight = f64::from(self.weights[index]);
        if weight > 0.0 { weight / self.sum() } else { 0.0 }
    }

    /// One, the probability of choosing it, and what is left of the uniform number in [0, 1): another. `None` where all
    /// weights are nought. Those that are nought have no interval of the sums, so that none is ever chosen.
    #[inline(always)]
    pub(super) fn choose(&self, u: f64) -> Option<(usize, f64, f64)> {
        let sum = self.sum();
        if !(sum > 0.0) {
            return None;
        }
        // The product may round to the sum, behind all: then it is the number before that.
        let x = (u * sum).min(f64::from_bits(sum.to_bits() - 1));
        // Counting them takes no branch that depends on the number.
        let mut index = 0;
        for running in self.sums {
            index += usize::from(running <= x);
        }
        let before = if index > 0 { self.sums[index - 1] } else { 0.0 };
        let weight = f64::from(self.weights[index]);
        // The sums are rounded, and the quotient may be: it is below 1 all the same.
        Some((index, weight / sum, ((x - before) / weight).min(BELOW_ONE)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_has_its_interval_and_what_is_left_runs_through_it() {
        let weights = Weights::new([0.0, 1.0, 0.0, 2.0, 1e-30, 5.0, 0.0, 0.0]);
        for (u, expected, rest) in [(0.0, 1, 0.0), (0.124, 1, 0.992), (0.125, 3, 0.0), (0.25, 3, 0.5), (0.6875, 5, 0.5)]
        {
            let (index, p, left) = weights.choose(u).unwrap();
            assert_eq!((index, p), (expected, weights.pmf(expected)), "{u}");
            assert!((left - rest).abs() < 1e-12, "{u}: {left}");
        }
    }

    #[test]
    fn the_largest_number_falls_on_the_last_that_has_a_weight() {
        for weights in [[0.1_f32, 0.2, 0.3, 0.0], [1e30, 1e-30, 0.0, 0.0], [f32::from_bits(1), 0.0, 0.0, 0.0]] {
            let (index, p, left) = Weights::new(weights).choose(BELOW_ONE).unwrap();
            assert!(weights[index] > 0.0 && p > 0.0 && left < 1.0, "{weights:?}: {index} {p} {left}");
        }
    }

    #[test]
    fn of_nothing_there_is_no_choice() {
        assert!(Weights::new([0.0; 4]).choose(0.5).is_none());
        assert_eq!(Weights::new([0.0; 4]).pmf(1), 0.0);
    }
}
