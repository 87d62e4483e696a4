//! How different two pictures are: errors, perceived differences, statistical tests.
//!
//! The second picture is the reference. Pixels that are not finite in either are left out of every figure, and counted.

mod convolution;
mod flip;
mod significance;

pub use flip::{Flip, HdrFlip, flip, hdr_flip};
pub use significance::{Family, Significance, significance};

use super::Picture;
use super::png_file::srgb;
use crate::spectrum::Rgb;

/// Figures about all finite pixels and channels of two pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Pixels with a channel that is NaN or infinite, in either picture.
    pub non_finite_pixels: u64,
    /// Mean of the picture.
    pub mean: f64,
    /// Mean of the reference.
    pub reference_mean: f64,
    /// Mean of (x − r)².
    pub mse: f64,
    /// Mean of (x − r)² / (r² + 0.01).
    pub rel_mse: f64,
    /// Peak signal-to-noise ratio in decibels of what a display shows: clamped to [0, 1] and sRGB-encoded, with peak 1.
    /// Infinite where nothing differs.
    pub psnr: f64,
    /// Largest |x − r|.
    pub max: f64,
    /// Column and row of that.
    pub max_at: (u32, u32),
}

/// What is added to r² in the relative error, so that black pixels count, but not without bound. The number is that of
/// the literature on rendering (for example Rousselle et al. 2011, section 6).
const REL_MSE_FLOOR: f64 = 0.01;

/// The figures for two pictures of the same size.
pub fn errors(picture: &Picture, reference: &Picture) -> Errors {
    let mut sums = [0.0; 5];
    let (mut count, mut non_finite_pixels, mut max, mut max_at) = (0_u64, 0, 0.0, (0, 0));
    for (i, (&a, &b)) in (0u32..).zip(picture.pixels().iter().zip(reference.pixels())) {
        if !(a.is_finite() && b.is_finite()) {
            non_finite_pixels += 1;
            continue;
        }
        for (x, r) in a.to_array().into_iter().zip(b.to_array()) {
            let (shown, shown_r) = (f64::from(srgb(x)), f64::from(srgb(r)));
            let (x, r) = (f64::from(x), f64::from(r));
            let squared = (x - r) * (x - r);
            let all = [x, r, squared, squared / (r * r + REL_MSE_FLOOR), (shown - shown_r) * (shown - shown_r)];
            sums.iter_mut().zip(all).for_each(|(s, v)| *s += v);
            if (x - r).abs() > max {
                (max, max_at) = ((x - r).abs(), (i % picture.width(), i / picture.width()));
            }
            count += 1;
        }
    }
    let [mean, reference_mean, mse, rel_mse, shown] = sums.map(|s| s / count.max(1) as f64);
    Errors { non_finite_pixels, mean, reference_mean, mse, rel_mse, psnr: -10.0 * libm::log10(shown), max, max_at }
}

/// Both pictures with every pixel black that is not finite in either.
pub fn without_non_finite(a: &Picture, b: &Picture) -> (Picture, Picture) {
    let (mut a, mut b) = (a.clone(), b.clone());
    for (x, y) in a.pixels.iter_mut().zip(&mut b.pixels) {
        if !(x.is_finite() && y.is_finite()) {
            (*x, *y) = (Rgb::BLACK, Rgb::BLACK);
        }
    }
    (a, b)
}

/// The picture minus the reference.
pub fn difference(picture: &Picture, reference: &Picture) -> Picture {
    let mut difference = picture.clone();
    for (d, r) in difference.pixels.iter_mut().zip(&reference.pixels) {
        *d = Rgb(d.0 - r.0);
    }
    difference
}

/// Values in [0, 1] as colours from black over violet, red and orange to white, bright in proportion to the eye.
pub fn heat(width: u32, height: u32, values: &[f32]) -> Picture {
    /// sRGB-encoded colours at equal steps.
    const RAMP: [[f64; 3]; 6] =
        [[0.0, 0.0, 0.02], [0.27, 0.06, 0.43], [0.64, 0.17, 0.42], [0.92, 0.39, 0.25], [0.99, 0.72, 0.30], [1.0; 3]];
    let mut picture = Picture::new(width, height);
    for (pixel, &v) in picture.pixels.iter_mut().zip(values) {
        let at = f64::from(v.clamp(0.0, 1.0)) * (RAMP.len() - 1) as f64;
        let step = (at as usize).min(RAMP.len() - 2);
        let t = at - step as f64;
        let channel =
            |c: usize| crate::spectrum::srgb_to_linear(RAMP[step][c] * (1.0 - t) + RAMP[step + 1][c] * t) as f32;
        *pixel = Rgb::new(channel(0), channel(1), channel(2));
    }
    picture
}

#[cfg(test)]
mod tests;
