//! How far a picture's pixels are from the truth, as far as its own samples tell.
//!
//! The samples of a pixel are two halves of one sequence, each of which is as evenly spread as the whole. If h is the mean
//! of the later half, which has the part w of the weight, and g that of the earlier one, the mean m = w·h + (1 − w)·g of
//! independent halves of equal variance per sample has the standard error √(w·(1 − w))·|h − g| in the mean square. Halves of
//! a sequence err less together than independent ones would, so that the estimate is rather too large than too small. A
//! single pixel's |h − g| may be small by chance: it is pooled over the pixels around.

use crate::film::Film;
use crate::image::Picture;
use crate::math::float::saturate_to_f32;

/// How far around a pixel its estimate is pooled, in pixels.
const POOL: usize = 1;

/// Estimates the standard error of each pixel's colour.
///
/// `later` is the film's index of the first of three means of the later half's radiance; the next is that half's part.
pub(super) fn planes(film: &Film, picture: &Picture, later: usize) -> [Vec<f32>; 3] {
    let part = film.means(later + 3);
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    [0, 1, 2].map(|channel| {
        let sums = film.means(later + channel);
        let mean = |i: usize| f64::from(picture.pixels()[i].0[channel]);
        let squares: Vec<f64> = (0..width * height).map(|i| squared_error(mean(i), sums[i], part[i])).collect();
        let around = |at: usize, end: usize| at.saturating_sub(POOL)..(at + POOL + 1).min(end);
        (0..width * height)
            .map(|i| {
                let (rows, columns) = (around(i / width, height), around(i % width, width));
                let (mut sum, mut count) = (0.0, 0.0);
                for y in rows {
                    for square in &squares[y * width..][columns.clone()] {
                        (sum, count) = (sum + square, count + 1.0);
                    }
                }
                saturate_to_f32((sum / count).sqrt())
            })
            .collect()
    })
}

/// The estimated square of a mean's error, of whose weighted sum `later` is that of the later half with the part `w` of the
/// weight. With one half only, nothing is known: as large as the mean itself.
fn squared_error(mean: f64, later: f64, w: f64) -> f64 {
    let both = w * (1.0 - w);
    if !(both > 0.0) {
        return mean * mean;
    }
    let difference = later / w - (mean - later) / (1.0 - w);
    both * difference * difference
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_tell_the_error() {
        // Means 3 and 1 of equal halves: 2 ± 1.
        assert_eq!(squared_error(2.0, 1.5, 0.5), 1.0);
        assert_eq!(squared_error(2.0, 1.0, 0.5), 0.0);
        // One sample, or a weight that negative lobes of a filter have spoilt.
        assert_eq!(squared_error(2.0, 0.0, 0.0), 4.0);
        assert_eq!(squared_error(2.0, 1.0, 1.5), 4.0);
    }
}
