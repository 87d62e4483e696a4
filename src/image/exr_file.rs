//! OpenEXR: linear radiance with alpha and whatever else goes beside it, with data window and metadata.

use super::layers::{ALPHA, Layers, PlaneValues};
use super::output::WriteOptions;
use super::{ComponentFormat, Crop};
use exr::compression::Compression;
use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, IntegerBounds, Layer, LayerAttributes,
    SmallVec, Text, Vec2, WritableImage, f16,
};
use std::fs::File;
use std::io::BufWriter;

/// How files are packed. Deflating a render, whose last digits are noise, makes it 3 % smaller than this and takes as long as
/// some samples of every pixel.
const ENCODING: Encoding = Encoding { compression: Compression::RLE, ..Encoding::SMALL_LOSSLESS };

/// How many times as long as a file what is unpacked from it can be: a run of 128 bytes takes two, and there is more in a
/// file than its pixels.
pub(super) const MAX_EXPANSION: u64 = 64;

/// What a file says of the render that made it. Every entry becomes an attribute of the EXR.
#[derive(Clone, Debug, Default)]
pub struct Metadata {
    /// Numbers, for example `("snell.samples", 64.0)`.
    pub numbers: Vec<(&'static str, f64)>,
    /// Texts.
    pub texts: Vec<(String, String)>,
}

/// The picture and what the file says of it.
pub(super) struct ExrOptions<'a> {
    layers: Layers<'a>,
    full_size: (u32, u32),
    crop: Crop,
    format: ComponentFormat,
    metadata: &'a Metadata,
}

impl<'a> ExrOptions<'a> {
    pub(super) fn new(layers: Layers<'a>, o: &'a WriteOptions) -> Self {
        Self { layers, full_size: o.full_size, crop: o.crop, format: o.component_format, metadata: &o.metadata }
    }

    /// The channels of colour, alpha, and the planes beside. Adds to `clamped` how many values overflowed half precision.
    fn channels(&self, clamped: &mut u64) -> SmallVec<[AnyChannel<FlatSamples>; 4]> {
        let Layers { picture, format, alpha, planes } = self.layers;
        let mut channels = SmallVec::new();
        let mut coloured = |name: &str, values: &mut dyn Iterator<Item = f32>| {
            let samples = match self.format {
                ComponentFormat::Float => FlatSamples::F32(values.collect()),
                ComponentFormat::Half => FlatSamples::F16(values.map(|v| to_half(v, clamped)).collect()),
            };
            channels.push(AnyChannel::new(name, samples));
        };
        for (name, value) in format.channels() {
            coloured(name, &mut picture.pixels().iter().map(|&p| value(p)));
        }
        if let Some(alpha) = alpha {
            coloured(ALPHA, &mut alpha.iter().copied());
        }
        for plane in planes {
            if let PlaneValues::Colour(values) = &plane.values {
                coloured(&plane.name, &mut values.iter().copied());
            }
        }
        for plane in planes {
            let samples = match &plane.values {
                PlaneValues::Colour(_) => continue,
                PlaneValues::Float(values) => FlatSamples::F32(values.clone()),
                PlaneValues::Whole(values) => FlatSamples::U32(values.clone()),
            };
            channels.push(AnyChannel::new(plane.name.as_str(), samples));
        }
        channels
    }
}

/// Writes the picture. Returns how many values overflowed half precision and were clamped.
pub(super) fn write(to: &mut File, o: &ExrOptions<'_>) -> exr::error::Result<u64> {
    let mut clamped = 0;
    let channels = o.channels(&mut clamped);
    let mut attributes = LayerAttributes {
        layer_position: Vec2(as_i32(o.crop.x), as_i32(o.crop.y)),
        software_name: Some(Text::from(concat!("snell ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    let own = o.metadata.numbers.iter().map(|&(name, v)| (Text::from(name), AttributeValue::F64(v)));
    let own = own.chain(o.metadata.texts.iter().filter_map(|(name, v)| {
        // A text that is no Latin-1 cannot be an attribute; the picture matters more.
        Some((Text::new_or_none(name)?, AttributeValue::Text(Text::new_or_none(v)?)))
    }));
    attributes.other.extend(own);
    let picture = o.layers.picture;
    let size = Vec2(picture.width() as usize, picture.height() as usize);
    let layer = Layer::new(size, attributes, ENCODING, AnyChannels::sort(channels));
    let mut image = Image::from_layer(layer);
    image.attributes.display_window =
        IntegerBounds::new(Vec2(0, 0), Vec2(o.full_size.0 as usize, o.full_size.1 as usize));
    image.attributes.chromaticities = Some(BT709);
    image.write().non_parallel().to_buffered(BufWriter::new(to))?;
    Ok(clamped)
}

/// The primaries and white point of ITU-R BT.709, which sRGB shares.
const BT709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Film sizes are limited when the scene is read, far below this.
fn as_i32(v: u32) -> i32 {
    i32::try_from(v).unwrap_or(i32::MAX)
}

fn to_half(v: f32, clamped: &mut u64) -> f16 {
    let c = v.clamp(-ComponentFormat::MAX_HALF, ComponentFormat::MAX_HALF);
    *clamped += u64::from(c != v);
    f16::from_f32(c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_floats_are_clamped_and_counted() {
        assert_eq!(f16::MAX.to_f32(), ComponentFormat::MAX_HALF);
        let mut clamped = 0;
        let half = [0.0, 1.0, 65504.0, -65504.0, 65505.0, 1e30, -1e9].map(|v| to_half(v, &mut clamped).to_f32());
        assert_eq!(half, [0.0, 1.0, 65504.0, -65504.0, 65504.0, 65504.0, -65504.0]);
        assert_eq!(clamped, 3);
    }
}
