//! Cells of a grid, picked by inversion: a row by the rows' cumulative sum, a cell by that of its row. So both uniform
//! numbers keep their stratification, and each is searched for in a table of one dimension only. Cells of no weight are not in
//! the tables.
//!
//! Where to search is looked up in a guide (Chen and Asau 1974, *On Generating Random Variates from an Empirical
//! Distribution*), so that it takes a few steps however long a row is; unlike an alias table (Walker 1977), which takes as
//! few, this keeps neighbouring numbers in neighbouring cells.

use crate::math::float::{ONE_MINUS_EPSILON, min};
use glam::{Vec2, Vec4};

/// Picks a cell with probability proportional to its weight.
///
/// Sums are kept in f32, whose resolution just below one is that of the uniform numbers.
#[derive(Clone, Debug)]
pub struct Cells {
    /// The rows that have any weight.
    rows: Line,
    /// The cells of each of these that have any.
    cells: Vec<Line>,
}

/// Intervals that divide [0, 1).
#[derive(Clone, Debug)]
struct Line {
    /// Where each begins, increasing from 0; then ones.
    ends: Vec<f32>,
    /// What each stands for.
    index: Vec<u32>,
    /// For every step of equal length the first of the `ends` behind its beginning.
    guide: Vec<u32>,
}

/// Intervals for each step of a guide, about.
const INTERVALS_PER_STEP: usize = 2;

/// Ends that are compared at once.
const LANES: usize = 4;

impl Cells {
    /// For `width` × `height` cells of these weights (asked for in order, by column and row), and the sum of the weights;
    /// `None` unless they are finite and not negative, with a positive sum.
    pub fn new(width: usize, height: usize, mut weight: impl FnMut(usize, usize) -> f64) -> Option<(Self, f64)> {
        let (mut lines, mut sums) = (Vec::new(), Vec::new());
        let mut row = vec![0.0; width];
        for y in 0..height {
            for (x, w) in row.iter_mut().enumerate() {
                *w = weight(x, y);
                if !(*w >= 0.0 && w.is_finite()) {
                    return None;
                }
            }
            let sum = row.iter().sum();
            sums.push(sum);
            lines.push(Line::new(&row, sum));
        }
        let total: f64 = sums.iter().sum();
        let rows = Line::new(&sums, total).filter(|_| total.is_finite())?;
        let cells = rows.index.iter().filter_map(|&y| lines[y as usize].take()).collect();
        Some((Self { rows, cells }, total))
    }

    /// Column and row of a cell for a uniform point of the unit square, and the point stretched to a new uniform one within
    /// that cell. Never a cell of weight zero.
    #[inline(always)]
    pub fn sample(&self, u: Vec2) -> ([u32; 2], Vec2) {
        self.in_row(self.row(u.y), u.x)
    }

    /// The first half of [`Self::sample`]: a row, and the number stretched to one within it.
    #[inline(always)]
    pub fn row(&self, u: f32) -> (usize, f32) {
        self.rows.find(u)
    }

    /// The second half: a cell of the row.
    #[inline(always)]
    pub fn in_row(&self, (row, v): (usize, f32), u: f32) -> ([u32; 2], Vec2) {
        let cells = &self.cells[row];
        let (cell, w) = cells.find(u);
        ([cells.index[cell], self.rows.index[row]], Vec2::new(w, v))
    }
}

impl Line {
    /// Of intervals whose lengths are as these weights, whose sum is `sum`; without those that are too short for any number.
    /// `None` unless the sum is positive.
    fn new(weights: &[f64], sum: f64) -> Option<Self> {
        if !(sum > 0.0) {
            return None;
        }
        let (mut ends, mut index) = (Vec::new(), Vec::new());
        let mut before = 0.0;
        for (i, w) in (0..).zip(weights) {
            let (start, end) = ((before / sum) as f32, ((before + w) / sum) as f32);
            // What rounding puts at the end is behind all numbers.
            if start < end && start < 1.0 {
                ends.push(start);
                index.push(i);
            }
            before += w;
        }
        let steps = ends.len().div_ceil(INTERVALS_PER_STEP);
        // Both sides are exact: 24 bits and those of a small integer fit into an f64.
        let first = |step: usize| ends.partition_point(|&end| f64::from(end) * steps as f64 <= step as f64) as u32;
        let guide = (0..steps).map(first).collect();
        ends.extend([1.0; LANES]);
        Some(Self { ends, index, guide })
    }

    /// The interval that `u` in [0, 1) lies in, and where in it.
    #[inline(always)]
    fn find(&self, u: f32) -> (usize, f32) {
        let step = (f64::from(u) * f64::from(self.guide.len() as u32)) as u32;
        let mut next = self.guide[step as usize] as usize;
        // As long as all are passed: of numbers that are uniform, that is rarely more than once.
        loop {
            let passed = Vec4::from_slice(&self.ends[next..next + LANES]).cmple(Vec4::splat(u)).bitmask().count_ones();
            next += passed as usize;
            if passed < LANES as u32 {
                break;
            }
        }
        let (low, high) = (self.ends[next - 1], self.ends[next]);
        (next - 1, min((u - low) / (high - low), ONE_MINUS_EPSILON))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_picked_in_proportion_and_never_an_empty_one() {
        let weights = [[0.0, 0.0, 0.0], [1.0, 0.0, 3.0], [0.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        let (cells, sum) = Cells::new(3, 4, |x, y| weights[y][x]).unwrap();
        assert_eq!(sum, 8.0);
        let n = 64;
        let mut counts = [[0; 3]; 4];
        for i in 0..n * n {
            let u = Vec2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
            let ([x, y], rest) = cells.sample(u);
            assert!(rest.cmpge(Vec2::ZERO).all() && rest.cmplt(Vec2::ONE).all(), "{rest}");
            counts[y as usize][x as usize] += 1;
        }
        for (counts, weights) in counts.iter().flatten().zip(weights.iter().flatten()) {
            assert_eq!(f64::from(*counts), f64::from(n * n) * weights / sum);
        }
        for u in [0.0, ONE_MINUS_EPSILON] {
            assert!(weights[cells.sample(Vec2::splat(u)).0[1] as usize].iter().any(|w| *w > 0.0));
        }
    }

    /// With a guide or without, the same interval is found, and what is not in the table is what no number lies in.
    #[test]
    fn guides_change_nothing() {
        let weight = |x: usize| [0.0, 1e-9, 1.0, 0.0, 3.0, 1e4, 0.0, 0.02][x * 5 % 8] * (1 + x % 3) as f64;
        for width in [2, 3, 4, 5, 17, 64, 1000] {
            let weights: Vec<f64> = (0..width).map(weight).collect();
            let sum = weights.iter().sum();
            let line = Line::new(&weights, sum).unwrap();
            let mut before = 0.0;
            let ends = std::iter::once(0.0).chain(weights.iter().map(|w| (before += w, before).1));
            let ends: Vec<f32> = ends.map(|end| (end / sum) as f32).collect();
            let near = ends.iter().flat_map(|&end| [end.next_down(), end, end.next_up()]);
            for u in near.chain((0..999u16).map(|i| f32::from(i) / 999.0)).filter(|u| (0.0..1.0).contains(u)) {
                let expected = ends.partition_point(|&end| end <= u).clamp(1, width) - 1;
                let (found, rest) = line.find(u);
                assert_eq!(line.index[found] as usize, expected, "{width}: {u}");
                assert!((0.0..1.0).contains(&rest), "{width}: {u}: {rest}");
            }
        }
    }

    #[test]
    fn weights_that_are_no_distribution_are_refused() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Cells::new(2, 2, |x, y| if x == y { bad } else { 0.0 }).is_none(), "{bad}");
        }
        assert!(Cells::new(0, 0, |_, _| 1.0).is_none());
    }
}
