//! 8-bit PNG, sRGB-encoded.

use super::Picture;
use image::{ExtendedColorType, ImageEncoder, ImageResult, codecs::png::PngEncoder};
use std::io::{BufWriter, Write};

/// Writes `picture`, each value multiplied by 2^exposure, clamped to [0, 1] and sRGB-encoded.
pub(super) fn write(to: &mut impl Write, picture: &Picture, exposure: f32) -> ImageResult<()> {
    let scale = libm::exp2f(exposure);
    let bytes: Vec<u8> = picture.pixels().iter().flat_map(|p| (*p * scale).to_array().map(encode)).collect();
    let mut out = BufWriter::new(to);
    PngEncoder::new(&mut out).write_image(&bytes, picture.width(), picture.height(), ExtendedColorType::Rgb8)?;
    out.flush()?;
    Ok(())
}

/// The sRGB transfer function (IEC 61966-2-1) to 8 bits.
fn encode(linear: f32) -> u8 {
    (srgb(linear) * 255.0 + 0.5) as u8
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
