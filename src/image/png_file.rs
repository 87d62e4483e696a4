//! 8-bit PNG, sRGB-encoded.

use super::{Layers, Picture};
use crate::spectrum::{Rgb, rgb_to_xyz};
use image::{ExtendedColorType, ImageEncoder, ImageResult, codecs::png::PngEncoder};
use std::io::{BufWriter, Write};

/// Writes a picture, grey if its format is, each value multiplied by 2^exposure, clamped to [0, 1] and sRGB-encoded. Where
/// there is alpha, colours are divided by it, as PNG has them; alpha itself is linear.
pub(super) fn write(to: &mut impl Write, layers: &Layers<'_>, exposure: f32) -> ImageResult<()> {
    let scale = libm::exp2f(exposure);
    let picture = layers.picture;
    let (grey, alpha) = (layers.format.is_grey(), layers.alpha);
    let channels = if grey { 1 } else { 3 } + usize::from(alpha.is_some());
    let mut bytes = Vec::with_capacity(picture.pixels().len() * channels);
    for (i, &pixel) in picture.pixels().iter().enumerate() {
        let cover = alpha.map(|a| a[i]);
        let colour = straight(pixel, cover) * scale;
        if grey {
            bytes.push(encode(rgb_to_xyz(colour)[1]));
        } else {
            bytes.extend(colour.to_array().map(encode));
        }
        bytes.extend(cover.map(to_byte));
    }
    let kind = match (grey, alpha.is_some()) {
        (true, false) => ExtendedColorType::L8,
        (true, true) => ExtendedColorType::La8,
        (false, false) => ExtendedColorType::Rgb8,
        (false, true) => ExtendedColorType::Rgba8,
    };
    let mut out = BufWriter::new(to);
    PngEncoder::new(&mut out).write_image(&bytes, picture.width(), picture.height(), kind)?;
    out.flush()?;
    Ok(())
}

/// A picture in colour as the bytes of a file: see [`write()`].
pub fn to_png(picture: &Picture, exposure: f32) -> Vec<u8> {
    let mut bytes = Vec::new();
    // Writing to memory cannot fail, and every picture of at least one pixel can be encoded.
    let _ = write(&mut bytes, &picture.into(), exposure);
    bytes
}

/// A colour that was multiplied by alpha, without; black where nothing covers the pixel.
fn straight(colour: Rgb, alpha: Option<f32>) -> Rgb {
    match alpha {
        None => colour,
        Some(a) if a > 0.0 => colour / a,
        Some(_) => Rgb::BLACK,
    }
}

/// A value of [0, 1] to 8 bits.
fn to_byte(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// The sRGB transfer function (IEC 61966-2-1) to 8 bits.
fn encode(linear: f32) -> u8 {
    to_byte(srgb(linear))
}

/// The sRGB transfer function (IEC 61966-2-1) of a value clamped to [0, 1].
pub(super) fn srgb(linear: f32) -> f32 {
    /// Below this the function is linear.
    const TOE: f32 = 0.003_130_8;
    let v = linear.clamp(0.0, 1.0);
    if v <= TOE { 12.92 * v } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_encoding_at_its_landmarks() {
        assert_eq!([-1.0, 0.0, 0.003_130_8, 0.214_041_14, 1.0, 7.0].map(encode), [0, 0, 10, 128, 255, 255]);
    }
}
