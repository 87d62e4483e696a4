//! Pictures inside of the page.

use crate::image::{Picture, compare, to_png};
use crate::spectrum::{Rgb, rgb_to_xyz};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::ops::RangeInclusive;

/// Largest width of a picture in the page; larger ones are reduced by a whole number, and those that are smaller are stretched.
const WIDTH: u32 = 288;

/// Where the brighter parts of a picture are to be in what is shown, and the range in which they may stay where they are.
const BRIGHT: f32 = 0.8;
const LEAVE_ALONE: RangeInclusive<f32> = 0.25..=1.6;
/// The brighter parts: so much of the picture is darker.
const BRIGHT_PART: f64 = 0.95;

/// A picture as the source of an image element.
fn source(picture: &Picture, exposure: f32) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(to_png(picture, exposure)))
}

/// The value below which `part` of all lies; 0 of none.
pub(super) fn quantile(mut values: Vec<f32>, part: f64) -> f32 {
    values.retain(|v| v.is_finite());
    values.sort_unstable_by(f32::total_cmp);
    let at = (part * values.len() as f64) as usize;
    values.get(at.min(values.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

/// Stops of exposure that a picture needs to be seen: none if it shows well as it is.
pub(super) fn exposure(picture: &Picture) -> f32 {
    let bright = quantile(picture.pixels().iter().map(|&p| rgb_to_xyz(p)[1]).collect(), BRIGHT_PART);
    if !(bright > 0.0) || LEAVE_ALONE.contains(&bright) {
        return 0.0;
    }
    // Half stops are as exact as anyone can see, and short to say.
    (2.0 * libm::log2f(BRIGHT / bright)).round() / 2.0
}

/// An image element.
pub(super) fn image(picture: &Picture, exposure: f32, alt: &str) -> String {
    element(&reduced(picture), exposure, alt)
}

fn element(picture: &Picture, exposure: f32, alt: &str) -> String {
    format!(r#"<img src="{}" alt="{alt}">"#, source(picture, exposure))
}

/// A map of values, of which `top` and what is above it is white.
pub(super) fn heat(size: (u32, u32), values: &[f32], top: f32, alt: &str) -> String {
    let mut grey = Picture::new(size.0, size.1);
    for (i, &v) in (0_u32..).zip(values) {
        grey.set(i % size.0, i / size.0, Rgb::splat(v / top.max(f32::MIN_POSITIVE)));
    }
    let grey = reduced(&grey);
    let values: Vec<f32> = grey.pixels().iter().map(|p| p.0.x).collect();
    element(&compare::heat(grey.width(), grey.height(), &values), 0.0, alt)
}

/// The colours of [`heat`], from 0 to its top.
pub(super) fn ramp() -> String {
    const STEPS: u32 = 110;
    let values: Vec<f32> = (0..STEPS).map(|i| i as f32 / (STEPS - 1) as f32).collect();
    format!(r#"<img src="{}" alt="colour scale">"#, source(&compare::heat(STEPS, 1, &values), 0.0))
}

/// The picture at most [`WIDTH`] pixels wide: means of squares of pixels.
fn reduced(picture: &Picture) -> Picture {
    let factor = picture.width().div_ceil(WIDTH);
    if factor <= 1 {
        return picture.clone();
    }
    let (width, height) = (picture.width() / factor, (picture.height() / factor).max(1));
    let mut smaller = Picture::new(width, height);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let rows = (y * factor..(y + 1) * factor).filter(|row| *row < picture.height());
        let pixels = rows.flat_map(|row| (x * factor..(x + 1) * factor).map(move |column| (column, row)));
        let (mut sum, mut count) = (Rgb::BLACK, 0.0);
        for (column, row) in pixels {
            sum += picture.get(column, row);
            count += 1.0;
        }
        smaller.set(x, y, sum / count);
    }
    smaller
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_pictures_are_reduced_by_means() {
        let mut picture = Picture::new(600, 4);
        (0..600).for_each(|x| (0..4).for_each(|y| picture.set(x, y, Rgb::splat((x % 3) as f32))));
        let small = reduced(&picture);
        assert_eq!((small.width(), small.height()), (200, 1));
        assert!(small.pixels().iter().all(|p| p.0.x == 1.0));
        assert_eq!(reduced(&small), small);
    }

    #[test]
    fn dark_pictures_are_made_brighter() {
        let mut picture = Picture::new(2, 2);
        assert_eq!(exposure(&picture), 0.0);
        picture.apply(|_| Rgb::splat(0.5));
        assert_eq!(exposure(&picture), 0.0);
        picture.apply(|_| Rgb::splat(0.05));
        assert_eq!(exposure(&picture), 4.0);
    }
}
