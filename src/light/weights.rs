//! One of a few, in proportion to their weights.
//!
//! In f64, as the uniform number is: beside a great weight a small one would vanish, or get more than its share.

/// Up to `N` weights, none negative, and their sums from the first to each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights<const N: usize> {
    weights: [f32; N],
    sums: [f64; N],
}

/// The part of a choice that does not depend on lobes. Reason: what hides the light in a lobe nobody knows, and a lobe is a guess; so no
/// light is chosen much more seldom than if there were none.
const BY_COSINE: f64 = 0.2;

/// Weights in proportion to `seen`, but a part of them in proportion to `sent`; the sum is that of `seen`, and what has a weight in one has
/// one.
#[inline(always)]
pub(super) fn mixed<const N: usize>([sent, mut seen]: [[f32; N]; 2]) -> [f32; N] {
    let (mut all_sent, mut all_seen) = (0.0, 0.0);
    for i in 0..N {
        all_sent += f64::from(sent[i]);
        all_seen += f64::from(seen[i]);
    }
    if all_sent > 0.0 {
        let per = BY_COSINE * (all_seen / all_sent);
        for i in 0..N {
            seen[i] = ((1.0 - BY_COSINE) * f64::from(seen[i]) + per * f64::from(sent[i])) as f32;
        }
    }
    seen
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

    /// By hand: 0.8·90 + 0.2·91·½ and 0.8·1 + 0.2·91·½; and a light that the lobe leaves out keeps a fifth of its chance.
    #[test]
    fn no_weight_is_much_less_than_without_a_lobe() {
        let near = |a: f32, b: f32| assert!((a - b).abs() <= 1e-5 * b, "{a} {b}");
        let [a, b, c] = mixed([[1.0, 1.0, 0.0], [90.0, 1.0, 0.0]]);
        near(a, 81.1);
        near(b, 9.9);
        assert_eq!(c, 0.0);
        let [a, b] = mixed([[1e-38, 1e-38], [1e30, 1e-30]]);
        near(b / a, 0.1 / 0.9);
        assert_eq!(mixed([[0.0; 2]; 2]), [0.0; 2]);
    }

    #[test]
    fn of_nothing_there_is_no_choice() {
        assert!(Weights::new([0.0; 4]).choose(0.5).is_none());
        assert_eq!(Weights::new([0.0; 4]).pmf(1), 0.0);
    }
}
