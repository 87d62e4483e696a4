//! Pictures as textures use them: kept in the bits of their file, decoded texel by texel.

use super::input::{check_size, read_exr_layers};
use crate::error::{Error, Result};
use crate::spectrum::{Rgb, srgb_to_linear};
use exr::prelude::{AnyChannels, FlatSamples, Layer};
use half::f16;
use image::{DynamicImage, ImageFormat, ImageReader};
use std::fmt;
use std::io::Cursor;
use std::path::Path;

/// Largest file in bytes: protects against reading a device.
const MAX_BYTES: u64 = 4 << 30;

/// A picture of one to four channels (grey, grey and alpha, red green blue, and alpha), row by row from the top.
pub struct Raster {
    width: u32,
    height: u32,
    channels: u32,
    samples: Samples,
    /// What each integer sample of a colour stands for; empty for floating-point samples.
    colour_of: Vec<f32>,
}

/// Samples in the type of the file.
enum Samples {
    U8(Vec<u8>),
    U16(Vec<u16>),
    Half(Vec<f16>),
    Float(Vec<f32>),
}

impl fmt::Debug for Raster {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Raster({}x{}, {} channels)", self.width, self.height, self.channels)
    }
}

impl Raster {
    /// Reads PNG, JPEG, TGA, BMP, Radiance HDR or OpenEXR. Integer colours are decoded by the transfer function of sRGB
    /// unless the file's numbers are wanted `raw`; alpha and floating-point samples are linear as they are.
    ///
    /// Fails where the file cannot be read, is none of these, or has no known channels.
    pub fn read(path: &Path, raw: bool) -> Result<Self> {
        let fail = |m: &dyn fmt::Display| Error::file(path, format!("cannot read the picture: {m}"));
        let about = std::fs::metadata(path).map_err(|e| fail(&e))?;
        if !about.is_file() || about.len() > MAX_BYTES {
            return Err(fail(&"this is not a regular file of at most 4 GiB"));
        }
        let bytes = std::fs::read(path).map_err(|e| fail(&e))?;
        Self::decode(&bytes, ImageFormat::from_path(path).ok(), raw).map_err(|e| fail(&e))
    }

    /// Decodes the bytes of a file; `named` is the format that its name says, which counts only for files that do not
    /// say theirs (TGA).
    pub fn decode(bytes: &[u8], named: Option<ImageFormat>, raw: bool) -> std::result::Result<Self, String> {
        let format = image::guess_format(bytes).ok().or(named).ok_or("its format is not known")?;
        match format {
            ImageFormat::OpenExr => read_exr_layers(bytes)?
                .iter()
                .find_map(Self::of_layer)
                .ok_or_else(|| "it has neither channels R, G, B nor Y".into()),
            ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Tga | ImageFormat::Bmp | ImageFormat::Hdr => {
                let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
                reader.limits(Self::limits());
                Self::of_image(reader.decode().map_err(|e| e.to_string())?, raw)
            }
            other => Err(format!("{other:?} is not supported (PNG, JPEG, TGA, BMP, HDR, OpenEXR)")),
        }
    }

    /// What a header may claim.
    fn limits() -> image::Limits {
        /// Columns and rows of the largest picture.
        const MAX_SIDE: u32 = 1 << 17;
        let mut limits = image::Limits::default();
        limits.max_image_width = Some(MAX_SIDE);
        limits.max_image_height = Some(MAX_SIDE);
        limits.max_alloc = Some(MAX_BYTES);
        limits
    }

    fn of_image(image: DynamicImage, raw: bool) -> std::result::Result<Self, String> {
        let (width, height) = check_size(image.width() as usize, image.height() as usize)?;
        let channels = u32::from(image.color().channel_count());
        let samples = match image {
            DynamicImage::ImageLuma8(i) => Samples::U8(i.into_raw()),
            DynamicImage::ImageLumaA8(i) => Samples::U8(i.into_raw()),
            DynamicImage::ImageRgb8(i) => Samples::U8(i.into_raw()),
            DynamicImage::ImageRgba8(i) => Samples::U8(i.into_raw()),
            DynamicImage::ImageLuma16(i) => Samples::U16(i.into_raw()),
            DynamicImage::ImageLumaA16(i) => Samples::U16(i.into_raw()),
            DynamicImage::ImageRgb16(i) => Samples::U16(i.into_raw()),
            DynamicImage::ImageRgba16(i) => Samples::U16(i.into_raw()),
            DynamicImage::ImageRgb32F(i) => Samples::Float(i.into_raw()),
            DynamicImage::ImageRgba32F(i) => Samples::Float(i.into_raw()),
            _ => return Err("the type of its samples is not known".into()),
        };
        Ok(Self::new((width, height), channels, samples, raw))
    }

    /// From the channels R, G, B or Y, and A, of a layer that has them.
    fn of_layer(layer: &Layer<AnyChannels<FlatSamples>>) -> Option<Self> {
        let (width, height) = check_size(layer.size.width(), layer.size.height()).ok()?;
        let pixels = width as usize * height as usize;
        let channel = |name: &str| {
            let found = layer.channel_data.list.iter().find(|c| c.name.eq_case_insensitive(name))?;
            // Not one of fewer samples than pixels.
            (found.sample_data.len() == pixels).then_some(&found.sample_data)
        };
        let mut channels = match (channel("R"), channel("G"), channel("B")) {
            (Some(r), Some(g), Some(b)) => vec![r, g, b],
            _ => vec![channel("Y")?],
        };
        channels.extend(channel("A"));
        let halves: Vec<&Vec<f16>> =
            channels.iter().filter_map(|c| if let FlatSamples::F16(half) = c { Some(half) } else { None }).collect();
        let samples = if halves.len() == channels.len() {
            Samples::Half((0..pixels).flat_map(|i| halves.iter().map(move |c| c[i])).collect())
        } else {
            let mut floats = vec![0.0; pixels * channels.len()];
            for (c, channel) in channels.iter().enumerate() {
                floats
                    .iter_mut()
                    .skip(c)
                    .step_by(channels.len())
                    .zip(channel.values_as_f32())
                    .for_each(|(f, v)| *f = v);
            }
            Samples::Float(floats)
        };
        Some(Self::new((width, height), channels.len() as u32, samples, true))
    }

    fn new((width, height): (u32, u32), channels: u32, samples: Samples, raw: bool) -> Self {
        let most = match samples {
            Samples::U8(_) => Some(u16::from(u8::MAX)),
            Samples::U16(_) => Some(u16::MAX),
            Samples::Half(_) | Samples::Float(_) => None,
        };
        let decode = |v: f64| if raw { v } else { srgb_to_linear(v) };
        let colour_of =
            most.map_or(Vec::new(), |most| (0..=most).map(|v| decode(f64::from(v) / f64::from(most)) as f32).collect());
        Self { width, height, channels, samples, colour_of }
    }

    /// Pixels across.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels down.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Whether it is a picture without colours.
    pub fn is_grey(&self) -> bool {
        self.channels <= 2
    }

    /// Whether it says what is transparent.
    pub fn has_alpha(&self) -> bool {
        self.channels.is_multiple_of(2)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        let samples = match &self.samples {
            Samples::U8(s) => s.len(),
            Samples::U16(s) => 2 * s.len(),
            Samples::Half(s) => 2 * s.len(),
            Samples::Float(s) => 4 * s.len(),
        };
        (samples + 4 * self.colour_of.len()) as u64
    }

    /// The linear colour of the pixel in column `x` of row `y`.
    #[inline]
    pub fn colour(&self, x: u32, y: u32) -> Rgb {
        let at = self.index(x, y);
        if self.is_grey() {
            return Rgb::splat(self.linear(at));
        }
        Rgb::new(self.linear(at), self.linear(at + 1), self.linear(at + 2))
    }

    /// Its opacity: 1 where the picture does not say.
    #[inline]
    pub fn alpha(&self, x: u32, y: u32) -> f32 {
        if !self.has_alpha() {
            return 1.0;
        }
        let at = self.index(x, y) + self.channels as usize - 1;
        match &self.samples {
            Samples::U8(s) => f32::from(s[at]) / f32::from(u8::MAX),
            Samples::U16(s) => f32::from(s[at]) / f32::from(u16::MAX),
            Samples::Half(s) => s[at].to_f32(),
            Samples::Float(s) => s[at],
        }
    }

    #[inline]
    fn index(&self, x: u32, y: u32) -> usize {
        (y as usize * self.width as usize + x as usize) * self.channels as usize
    }

    #[inline]
    fn linear(&self, at: usize) -> f32 {
        match &self.samples {
            Samples::U8(s) => self.colour_of[s[at] as usize],
            Samples::U16(s) => self.colour_of[s[at] as usize],
            Samples::Half(s) => s[at].to_f32(),
            Samples::Float(s) => s[at],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn what_is_no_known_picture_is_an_error_that_says_so() {
        let error = |bytes: &[u8]| Raster::decode(bytes, None, true).unwrap_err();
        assert_eq!(error(b"words"), "its format is not known");
        assert_eq!(error(b"GIF89a"), "Gif is not supported (PNG, JPEG, TGA, BMP, HDR, OpenEXR)");
        // A header without the rest.
        assert!(!error(b"\x89PNG\r\n\x1a\n").is_empty());
        assert!(!error(b"\x76\x2f\x31\x01").is_empty());
    }
}
