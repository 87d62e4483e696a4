//! How heavy the tail of positive numbers is: Hill's estimate of its index (Hill 1975, *A Simple General Approach to Inference
//! About the Tail of a Distribution*).

/// The part of the numbers that counts as their tail, and the least number of those.
const TAIL: usize = 200;
const FEWEST: usize = 10;

/// The index α for which P(X > x) falls as x^−α in the largest two-hundredth part of them; infinite where there are too few, or no tail.
///
/// Below 1 such numbers have no mean, below 2 no variance.
pub(super) fn tail_index(mut values: Vec<f64>) -> f64 {
    let count = (values.len() / TAIL).max(FEWEST);
    if values.len() <= 2 * count {
        return f64::INFINITY;
    }
    values.select_nth_unstable_by(count, |a, b| b.total_cmp(a));
    let threshold = values[count];
    if !(threshold > 0.0) {
        return f64::INFINITY;
    }
    let logs: f64 = values[..count].iter().map(|v| libm::log(v / threshold)).sum();
    count as f64 / logs
}
