//! All that a picture's file may hold: its pixels in one of several formats, alpha, and named planes of anything else.

use super::Picture;
use crate::spectrum::{Rgb, rgb_to_xyz};
use serde::{Deserialize, Serialize};

/// What the channels of a file's pixels are, as Mitsuba names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PixelFormat {
    /// Y: relative luminance.
    Luminance,
    /// Y and alpha.
    LuminanceAlpha,
    /// R, G and B: linear sRGB.
    Rgb,
    /// These and alpha.
    Rgba,
    /// X, Y and Z: CIE 1931.
    Xyz,
    /// These and alpha.
    Xyza,
}

/// A channel of colour: its name, and what it says of a colour.
type ColourChannel = (&'static str, fn(Rgb) -> f32);

impl PixelFormat {
    /// Whether there is alpha.
    pub fn has_alpha(self) -> bool {
        matches!(self, Self::LuminanceAlpha | Self::Rgba | Self::Xyza)
    }

    /// The same with alpha.
    #[must_use]
    pub fn with_alpha(self) -> Self {
        match self {
            Self::Luminance | Self::LuminanceAlpha => Self::LuminanceAlpha,
            Self::Rgb | Self::Rgba => Self::Rgba,
            Self::Xyz | Self::Xyza => Self::Xyza,
        }
    }

    /// The same without alpha.
    #[must_use]
    pub fn without_alpha(self) -> Self {
        match self {
            Self::Luminance | Self::LuminanceAlpha => Self::Luminance,
            Self::Rgb | Self::Rgba => Self::Rgb,
            Self::Xyz | Self::Xyza => Self::Xyz,
        }
    }

    /// Whether all that is told of a colour is its luminance.
    pub(super) fn is_grey(self) -> bool {
        matches!(self, Self::Luminance | Self::LuminanceAlpha)
    }

    /// The channels of colour.
    pub fn channels(self) -> &'static [ColourChannel] {
        match self {
            Self::Luminance | Self::LuminanceAlpha => &[("Y", |c| rgb_to_xyz(c)[1])],
            Self::Rgb | Self::Rgba => &[("R", |c| c.0.x), ("G", |c| c.0.y), ("B", |c| c.0.z)],
            Self::Xyz | Self::Xyza => {
                &[("X", |c| rgb_to_xyz(c)[0]), ("Y", |c| rgb_to_xyz(c)[1]), ("Z", |c| rgb_to_xyz(c)[2])]
            }
        }
    }
}

/// The channel of alpha.
pub(super) const ALPHA: &str = "A";

/// One channel beside those of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Its name in the file: LAYER.CHANNEL or just a channel.
    pub name: String,
    /// Its pixels, row by row from the top.
    pub values: PlaneValues,
}

/// The values of a plane, and what type a file stores.
#[derive(Clone, Debug, PartialEq)]
pub enum PlaneValues {
    /// Something like a colour, in the type of the picture's pixels.
    Colour(Vec<f32>),
    /// Lengths and the like, which half floats are too coarse for.
    Float(Vec<f32>),
    /// Whole numbers.
    Whole(Vec<u32>),
}

impl PlaneValues {
    /// The values if they are whole numbers.
    pub fn whole(&self) -> Option<&[u32]> {
        if let Self::Whole(values) = self { Some(values) } else { None }
    }
}

/// A picture with all that goes into the same file.
#[derive(Clone, Copy, Debug)]
pub struct Layers<'a> {
    /// Its colours, multiplied by alpha if there is any.
    pub picture: &'a Picture,
    /// How they are stored. Only with alpha if there is one here.
    pub format: PixelFormat,
    /// How much of each pixel is covered, row by row.
    pub alpha: Option<&'a [f32]>,
    /// Whatever else, for files that can hold it.
    pub planes: &'a [Plane],
}

impl<'a> From<&'a Picture> for Layers<'a> {
    fn from(picture: &'a Picture) -> Self {
        Self { picture, format: PixelFormat::Rgb, alpha: None, planes: &[] }
    }
}
