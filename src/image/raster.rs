//! Pictures as textures use them: kept in the bits of their file, decoded texel by texel.

use super::blocks::Blocks;
use super::{Picture, decode};
use crate::files::Memory;
use crate::spectrum::{Rgb, srgb_to_linear};
use glam::Vec3;
use half::f16;
use image::ImageFormat;
use std::fmt;
use std::sync::OnceLock;

/// A picture of one to four channels (grey, grey and alpha, red green blue, and alpha), row by row from the top.
pub struct Raster {
    width: u32,
    height: u32,
    channels: u32,
    samples: Samples,
    /// What each integer sample of a colour stands for; zeros for floating-point samples.
    colour_of: Table,
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
    /// 8-bit colours in another order.
    Blocks(Blocks),
}

/// What integers stand for: the same numbers for all pictures, so that they stay in the first cache.
#[derive(Clone, Copy)]
struct Table {
    of_8_bits: &'static [f32; TABLE_8],
    of_16_bits: &'static [f32],
}

/// How many integers of 8 bits there are.
const TABLE_8: usize = 1 << u8::BITS;

impl Table {
    /// For colours, of the transfer function of sRGB or `raw`; the one of 16 bits only where it is `long`.
    fn new(raw: bool, long: bool) -> Self {
        static SHORT: [OnceLock<[f32; TABLE_8]>; 2] = [const { OnceLock::new() }; 2];
        static LONG: [OnceLock<Vec<f32>>; 2] = [const { OnceLock::new() }; 2];
        let decode = |v: usize, most: u16| {
            let v = v as f64 / f64::from(most);
            (if raw { v } else { srgb_to_linear(v) }) as f32
        };
        let of_8_bits = || std::array::from_fn(|v| decode(v, u16::from(u8::MAX)));
        let of_16_bits = || (0..=usize::from(u16::MAX)).map(|v| decode(v, u16::MAX)).collect();
        Self {
            of_8_bits: SHORT[usize::from(raw)].get_or_init(of_8_bits),
            of_16_bits: if long { LONG[usize::from(raw)].get_or_init(of_16_bits) } else { &[] },
        }
    }

    /// For samples of a type.
    fn of(samples: &Samples, raw: bool) -> Self {
        Self::new(raw, matches!(samples, Samples::U16(_)))
    }

    #[inline(always)]
    fn colour(self, [r, g, b, _]: [u8; 4]) -> Vec3 {
        let value = |v: u8| self.of_8_bits[v as usize];
        Vec3::new(value(r), value(g), value(b))
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

    /// Decodes the bytes of a file: PNG, JPEG, TGA, BMP, Radiance HDR or OpenEXR. Integer colours are decoded by the transfer
    /// function of sRGB unless the file's numbers are wanted `raw`; alpha and floating-point samples are linear as they are.
    /// `named` is the format that the file's name says, which counts only for files that do not say theirs (TGA).
    ///
    /// Fails, with the reason, where they are none of these or have no known channels, or take more than `memory` has.
    pub fn decode(
        bytes: &[u8],
        named: Option<ImageFormat>,
        raw: bool,
        memory: &Memory,
    ) -> std::result::Result<Self, String> {
        Ok(decode::decode(bytes, named, raw, memory)?.raster)
    }

    pub(super) fn new((width, height): (u32, u32), channels: u32, samples: Samples, raw: bool) -> Self {
        let colour_of = Table::of(&samples, raw);
        let samples = match samples {
            Samples::U8(samples) if channels >= 3 => Samples::Blocks(Blocks::new(width, channels, &samples)),
            others => others,
        };
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
        let colour_of = Table::of(&samples, raw);
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
            Samples::U8(_) | Samples::Blocks(_) => "8-bit",
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
        let pixels = (0..self.height).flat_map(|y| (0..self.width).map(move |x| self.colour(x, y).0));
        pixels.into_iter().try_fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| {
            v.is_finite().then(|| [low.min(v.min_element()), high.max(v.max_element())])
        })
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        let samples = match &self.samples {
            Samples::U8(s) => s.len(),
            Samples::U16(s) => 2 * s.len(),
            Samples::Half(s) => 2 * s.len(),
            Samples::Float(s) => 4 * s.len(),
            Samples::Blocks(blocks) => blocks.memory_bytes(),
        };
        samples as u64
    }

    /// The linear colour of the pixel in column `x` of row `y`.
    #[inline]
    pub fn colour(&self, x: u32, y: u32) -> Rgb {
        if let Samples::Blocks(blocks) = &self.samples {
            return Rgb(self.colour_of.colour(blocks.pixel(x, y)));
        }
        let at = self.index(x, y);
        if self.is_grey() {
            return Rgb::splat(self.linear(at));
        }
        Rgb::new(self.linear(at), self.linear(at + 1), self.linear(at + 2))
    }

    /// The linear colours of the pixels in the columns `x` of the row `y[0]`, and of those in the row `y[1]`.
    #[inline]
    pub fn four(&self, x: [u32; 2], y: [u32; 2]) -> [[Rgb; 2]; 2] {
        if let Some(pixels) = self.four_coded(x, y) {
            return self.decode_four(pixels);
        }
        [[self.colour(x[0], y[0]), self.colour(x[1], y[0])], [self.colour(x[0], y[1]), self.colour(x[1], y[1])]]
    }

    /// The same before they are decoded, of pictures that lie in blocks: all pixels before any colour, as they may be far away.
    #[inline]
    pub fn four_coded(&self, x: [u32; 2], y: [u32; 2]) -> Option<[[[u8; 4]; 2]; 2]> {
        if let Samples::Blocks(blocks) = &self.samples { Some(blocks.four(x, y)) } else { None }
    }

    /// What [`Self::four`] makes of [`Self::four_coded`].
    #[inline]
    pub fn decode_four(&self, [[a, b], [c, d]]: [[[u8; 4]; 2]; 2]) -> [[Rgb; 2]; 2] {
        let colour = |pixel| Rgb(self.colour_of.colour(pixel));
        [[colour(a), colour(b)], [colour(c), colour(d)]]
    }

    /// Its opacity: 1 where the picture does not say.
    #[inline]
    pub fn alpha(&self, x: u32, y: u32) -> f32 {
        if !self.has_alpha() {
            return 1.0;
        }
        let at = || self.index(x, y) + self.channels as usize - 1;
        match &self.samples {
            Samples::U8(s) => f32::from(s[at()]) / f32::from(u8::MAX),
            Samples::Blocks(blocks) => f32::from(blocks.pixel(x, y)[3]) / f32::from(u8::MAX),
            Samples::U16(s) => f32::from(s[at()]) / f32::from(u16::MAX),
            Samples::Half(s) => s[at()].to_f32(),
            Samples::Float(s) => s[at()],
        }
    }

    /// Some bits of the memory that the pixel in column `x` of row `y` is in.
    #[inline]
    pub fn touch(&self, x: u32, y: u32) -> u32 {
        match &self.samples {
            Samples::Blocks(blocks) => u32::from(blocks.pixel(x, y)[0]),
            Samples::U8(s) => u32::from(s[self.index(x, y)]),
            Samples::U16(s) => u32::from(s[self.index(x, y)]),
            Samples::Half(s) => u32::from(s[self.index(x, y)].to_bits()),
            Samples::Float(s) => s[self.index(x, y)].to_bits(),
        }
    }

    #[inline]
    fn index(&self, x: u32, y: u32) -> usize {
        (y as usize * self.width as usize + x as usize) * self.channels as usize
    }

    /// Of what does not lie in blocks.
    #[inline]
    fn linear(&self, at: usize) -> f32 {
        match &self.samples {
            Samples::U8(s) => self.colour_of.of_8_bits[s[at] as usize],
            Samples::U16(s) => self.colour_of.of_16_bits[s[at] as usize],
            Samples::Half(s) => s[at].to_f32(),
            Samples::Float(s) => s[at],
            Samples::Blocks(_) => 0.0,
        }
    }
}

impl From<&Picture> for Raster {
    fn from(picture: &Picture) -> Self {
        let samples = picture.pixels().iter().flat_map(|p| p.to_array()).collect();
        Self::new((picture.width(), picture.height()), 3, Samples::Float(samples), true)
    }
}
