//! Cells of a grid, picked by inversion: a row by the rows' cumulative sum, a cell by that of its row. So both uniform
//! numbers keep their stratification, and each is searched for in a table of one dimension only.
//!
//! Where to search is looked up in a guide (Chen and Asau 1974, *On Generating Random Variates from an Empirical
//! Distribution*), so that it takes a few steps however long a row is; unlike an alias table (Walker 1977), which takes as
//! few, this keeps neighbouring numbers in neighbouring cells.

use crate::math::float::{ONE_MINUS_EPSILON, min};
use glam::Vec2;

/// Picks a cell with probability proportional to its weight.
///
/// Sums are kept in f32, whose resolution just below one is that of the uniform numbers.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Cells in a row.
    width: usize,
    /// The probability of the rows before each row, and 1.
    rows: Vec<f32>,
    /// For each row the probability, within it, of the cells before each cell, and 1 (or all zero in a row of no weight).
    cells: Vec<f32>,
    /// Where to search `rows`.
    row_guide: Vec<u32>,
    /// Where to search each row of `cells`.
    cell_guides: Vec<u32>,
}

/// Cells for each step of a guide, about: a guide as fine as the cells would be as large as their sums, and not faster.
const CELLS_PER_STEP: usize = 4;

impl Cells {
    /// For `width` × `height` cells of these weights (asked for in order, by column and row), and the sum of the weights;
    /// `None` unless they are finite and not negative, with a positive sum.
    pub fn new(width: usize, height: usize, mut weight: impl FnMut(usize, usize) -> f64) -> Option<(Self, f64)> {
        let mut cells = Vec::with_capacity((width + 1) * height);
        let mut sums = Vec::with_capacity(height);
        let mut row = vec![0.0; width + 1];
        for y in 0..height {
            for x in 0..width {
                let w = weight(x, y);
                if !(w >= 0.0 && w.is_finite()) {
                    return None;
                }
                row[x + 1] = row[x] + w;
            }
            sums.push(row[width]);
            // A sum of zero makes all of them zero, whatever it is divided by.
            let sum = if row[width] > 0.0 { row[width] } else { 1.0 };
            cells.extend(row.iter().map(|c| (c / sum) as f32));
        }
        let total: f64 = sums.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut before = 0.0;
        let mut rows: Vec<f32> = sums
            .iter()
            .map(|sum| {
                let start = before;
                before += sum;
                (start / total) as f32
            })
            .collect();
        rows.push((before / total) as f32);
        let row_guide: Vec<u32> = guide(&rows).collect();
        let cell_guides = cells.chunks_exact(width + 1).flat_map(guide).collect();
        Some((Self { width, rows, cells, row_guide, cell_guides }, total))
    }

    /// Column and row of a cell for a uniform point of the unit square, and the point stretched to a new uniform one within
    /// that cell. Never a cell of weight zero.
    #[inline]
    pub fn sample(&self, u: Vec2) -> ([usize; 2], Vec2) {
        let (y, v) = find(&self.rows, &self.row_guide, u.y);
        let (start, steps) = (y * (self.width + 1), steps(self.width) + 1);
        let guide = &self.cell_guides[y * steps..(y + 1) * steps];
        let (x, w) = find(&self.cells[start..=start + self.width], guide, u.x);
        ([x, y], Vec2::new(w, v))
    }
}

/// Steps of a guide to so many intervals.
fn steps(intervals: usize) -> usize {
    intervals.div_ceil(CELLS_PER_STEP)
}

/// Ends of intervals that are counted rather than searched.
const FEW: usize = 16;

/// How many of the `ends` are at most i/n, for i from 0 to the number n of steps.
fn guide(ends: &[f32]) -> impl Iterator<Item = u32> {
    let steps = steps(ends.len() - 1);
    // Both sides are exact: 24 bits and those of a small integer fit into an f64.
    (0..=steps).map(move |i| ends.partition_point(|&end| f64::from(end) * steps as f64 <= i as f64) as u32)
}

/// The interval between two of the `ends` that `u` in [0, 1) lies in, and where in it.
#[inline]
fn find(ends: &[f32], guide: &[u32], u: f32) -> (usize, f32) {
    let step = (f64::from(u) * (guide.len() - 1) as f64) as usize;
    let (from, to) = (guide[step] as usize, guide[step + 1] as usize);
    // The last interval that begins at u or before: skips empty ones, whose two ends coincide.
    let ends_here = &ends[from..to];
    let before = match ends_here.len() {
        // Counting them all takes no guess of the processor's.
        0..=FEW => ends_here.iter().map(|&end| usize::from(end <= u)).sum(),
        _ => ends_here.partition_point(|&end| end <= u),
    };
    let below = from + before;
    let index = below.clamp(1, ends.len() - 1) - 1;
    let (low, high) = (f64::from(ends[index]), f64::from(ends[index + 1]));
    (index, min(((f64::from(u) - low) / (high - low)) as f32, ONE_MINUS_EPSILON))
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
            counts[y][x] += 1;
        }
        for (counts, weights) in counts.iter().flatten().zip(weights.iter().flatten()) {
            assert_eq!(f64::from(*counts), f64::from(n * n) * weights / sum);
        }
        for u in [0.0, ONE_MINUS_EPSILON] {
            assert!(weights[cells.sample(Vec2::splat(u)).0[1]].iter().any(|w| *w > 0.0));
        }
    }

    /// With a guide or without, the same interval is found.
    #[test]
    fn guides_change_nothing() {
        let weight = |x: usize| [0.0, 1e-9, 1.0, 0.0, 3.0, 1e4, 0.0, 0.02][x * 5 % 8] * (1 + x % 3) as f64;
        for width in [1, 2, 3, 4, 5, 17, 64, 1000] {
            let mut sum = 0.1;
            let ends: Vec<f64> = std::iter::once(0.0).chain((0..width).map(|x| (sum += weight(x), sum).1)).collect();
            let ends: Vec<f32> = ends.iter().map(|end| (end / sum) as f32).collect();
            let guide: Vec<u32> = guide(&ends).collect();
            let near = ends.iter().flat_map(|&end| [end.next_down(), end, end.next_up()]);
            for u in near.chain((0..999u16).map(|i| f32::from(i) / 999.0)).filter(|u| (0.0..1.0).contains(u)) {
                let expected = ends.partition_point(|&end| end <= u).clamp(1, ends.len() - 1) - 1;
                assert_eq!(find(&ends, &guide, u).0, expected, "{width}: {u}");
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
