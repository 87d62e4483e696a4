//! Cells of a grid, picked by inversion: a row by the rows' cumulative sum, a cell by that of its row. So both uniform
//! numbers keep their stratification, and each is searched for in a table of one dimension only.

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
}

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
        Some((Self { width, rows, cells }, total))
    }

    /// Column and row of a cell for a uniform point of the unit square, and the point stretched to a new uniform one within
    /// that cell. Never a cell of weight zero.
    #[inline]
    pub fn sample(&self, u: Vec2) -> ([usize; 2], Vec2) {
        let (y, v) = find(&self.rows, u.y);
        let start = y * (self.width + 1);
        let (x, w) = find(&self.cells[start..=start + self.width], u.x);
        ([x, y], Vec2::new(w, v))
    }
}

/// The interval between two of the `ends` that `u` in [0, 1) lies in, and where in it.
#[inline]
fn find(ends: &[f32], u: f32) -> (usize, f32) {
    // The last interval that begins at u or before: skips empty ones, whose two ends coincide.
    let index = ends.partition_point(|&end| end <= u).clamp(1, ends.len() - 1) - 1;
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

    #[test]
    fn weights_that_are_no_distribution_are_refused() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Cells::new(2, 2, |x, y| if x == y { bad } else { 0.0 }).is_none(), "{bad}");
        }
        assert!(Cells::new(0, 0, |_, _| 1.0).is_none());
    }
}
