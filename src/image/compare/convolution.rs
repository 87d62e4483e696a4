//! Separable convolution of planes of numbers.

use rayon::prelude::*;

/// A plane of numbers, row by row.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) values: Vec<f32>,
}

/// One factor of a separable kernel: its values from −radius to +radius.
pub(super) type Kernel = Vec<f64>;

impl Plane {
    pub(super) fn height(&self) -> usize {
        self.values.len() / self.width.max(1)
    }

    /// Convolved with a kernel along each axis; beyond its edges the plane goes on with the values at its edges.
    pub(super) fn convolved(&self, along_x: &Kernel, along_y: &Kernel) -> Self {
        let (width, height) = (self.width, self.height());
        let mut rows = vec![0.0_f32; self.values.len()];
        rows.par_chunks_mut(width).zip(self.values.par_chunks(width)).for_each(|(out, row)| {
            for (x, o) in out.iter_mut().enumerate() {
                *o = tap(along_x, x, width, |i| row[i]);
            }
        });
        let mut values = vec![0.0_f32; self.values.len()];
        values.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            for (x, o) in out.iter_mut().enumerate() {
                *o = tap(along_y, y, height, |i| rows[i * width + x]);
            }
        });
        Self { width, values }
    }

    /// `f` of the values of two planes.
    pub(super) fn zipped(&self, other: &Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let values = self.values.iter().zip(&other.values).map(|(&a, &b)| f(a, b)).collect();
        Self { width: self.width, values }
    }
}

/// The kernel's sum over a line of `length` values around `at`.
fn tap(kernel: &Kernel, at: usize, length: usize, value: impl Fn(usize) -> f32) -> f32 {
    let radius = kernel.len() / 2;
    let sum: f64 = kernel
        .iter()
        .enumerate()
        // The kernel is mirrored, as convolution says; those here are even or odd, where that is a sign at most.
        .map(|(k, w)| w * f64::from(value((at + k).saturating_sub(radius).min(length - 1))))
        .sum();
    sum as f32
}
