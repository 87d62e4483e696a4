//! Pictures as textures use them: kept in the bits of their file, decoded texel by texel.

use super::{Picture, decode};
use crate::error::Result;
use crate::spectrum::{Rgb, srgb_to_linear};
use half::f16;
use image::ImageFormat;
use std::fmt;
use std::path::Path;

/// A picture of one to four channels (grey, grey and alpha, red green blue, and alpha), row by row from the top.
pub struct Raster {
    width: u32,
    height: u32,
    channels: u32,
    samples: Samples,
    /// What each integer sample of a colour stands for; empty for floating-point samples.
    colour_of: Vec<f32>,
    /// What it is called, if it was told.
    name: String,
}

/// Samples in the type of the file.
#[derive(Clone)]
pub(super) enum Samples {
    U8(Vec<u8>),
    U16(Vec<u16>),
    Half(Vec<f16>),
    Float(Vec<f32>),
}

impl Samples {
    /// What each integer stands for.
    fn decoding_table(&self, raw: bool) -> Vec<f32> {
        let most = match self {
            Self::U8(_) => u16::from(u8::MAX),
            Self::U16(_) => u16::MAX,
            Self::Half(_) | Self::Float(_) => return Vec::new(),
        };
        let decode = |v: f64| if raw { v } else { srgb_to_linear(v) };
        (0..=most).map(|v| decode(f64::from(v) / f64::from(most)) as f32).collect()
    }
}

impl fmt::Debug for Raster {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Raster({}x{}, {} channels)", self.width, self.height, self.channels)
    }
}

impl Raster {
    /// What stands for a picture that is not decoded yet: one black pixel.
    pub fn pending() -> Self {
        Self::new((1, 1), 1, Samples::U8(vec![0]), true)
    }

    /// Reads PNG, JPEG, TGA, BMP, Radiance HDR or OpenEXR. Integer colours are decoded by the transfer function of sRGB
    /// unless the file's numbers are wanted `raw`; alpha and floating-point samples are linear as they are.
    ///
    /// Fails where the file cannot be read, is none of these, or has no known channels.
    pub fn read(path: &Path, raw: bool) -> Result<Self> {
        Ok(decode::read(path, raw)?.raster)
    }

    /// Decodes the bytes of a file; `named` is the format that its name says, which counts only for files that do not
    /// say theirs (TGA).
    pub fn decode(bytes: &[u8], named: Option<ImageFormat>, raw: bool) -> std::result::Result<Self, String> {
        Ok(decode::decode(bytes, named, raw)?.raster)
    }

    pub(super) fn new((width, height): (u32, u32), channels: u32, samples: Samples, raw: bool) -> Self {
        let colour_of = samples.decoding_table(raw);
        Self { width, height, channels, samples, colour_of, name: String::new() }
    }

    /// The same picture under a name: that of its file.
    pub fn called(self, name: String) -> Self {
        Self { name, ..self }
    }

    /// What it is called; empty if it was not told.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The same samples, with or without the transfer function of sRGB.
    pub fn decoded_as(&self, raw: bool) -> Self {
        let (samples, name) = (self.samples.clone(), self.name.clone());
        let colour_of = samples.decoding_table(raw);
        Self { samples, colour_of, name, ..*self }
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

    /// Type of its samples, for people: `8-bit`, `float`.
    pub fn sample_type(&self) -> &'static str {
        match &self.samples {
            Samples::U8(_) => "8-bit",
            Samples::U16(_) => "16-bit",
            Samples::Half(_) => "half",
            Samples::Float(_) => "float",
        }
    }

    /// Its channels, for people: `RGB`.
    pub fn channels(&self) -> &'static str {
        match self.channels {
            1 => "Y",
            2 => "YA",
            3 => "RGB",
            _ => "RGBA",
        }
    }

    /// The smallest and the largest linear value of any colour; `None` where one is not finite.
    pub fn range(&self) -> Option<[f32; 2]> {
        let (channels, colours) = (self.channels as usize, if self.is_grey() { 1 } else { 3 });
        let pixels = self.width as usize * self.height as usize;
        let values = (0..pixels).flat_map(|pixel| (0..colours).map(move |c| self.linear(pixel * channels + c)));
        values.into_iter().try_fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| {
            v.is_finite().then(|| [low.min(v), high.max(v)])
        })
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

impl From<&Picture> for Raster {
    fn from(picture: &Picture) -> Self {
        let samples = picture.pixels().iter().flat_map(|p| p.to_array()).collect();
        Self::new((picture.width(), picture.height()), 3, Samples::Float(samples), true)
    }
}
