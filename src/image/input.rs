//! Reads pictures: OpenEXR, Radiance HDR, PNG, JPEG and BMP to linear sRGB.

use super::Picture;
use crate::error::{Error, Result};
use crate::spectrum::{Rgb, srgb_to_linear};
use exr::prelude::{AnyChannels, FlatSamples, Layer, ReadChannels, ReadLayers};
use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::path::Path;

/// Most pixels to read. Reason: as many as can be rendered; a header that claims more must not ask for the memory.
const MAX_PIXELS: u64 = 1 << 28;

/// Largest file in bytes: more than [`MAX_PIXELS`] of four float channels; protects against reading a device.
const MAX_BYTES: u64 = 8 << 30;

/// The layers of an OpenEXR file.
pub(super) type Layers = exr::prelude::SmallVec<[Layer<AnyChannels<FlatSamples>>; 2]>;

/// A picture from a file.
#[derive(Clone, Debug)]
pub struct PictureFile {
    /// Its pixels in linear sRGB; those of a file with luminance only are grey.
    pub picture: Picture,
    /// Column and row of its first pixel in the whole picture, of which it may be a part.
    pub offset: (i32, i32),
}

/// Reads a picture.
///
/// Fails where the file cannot be read or [`decode`] fails.
pub fn read(path: &Path) -> Result<PictureFile> {
    let about = std::fs::metadata(path).map_err(|e| Error::file(path, format!("cannot read the picture: {e}")))?;
    if !about.is_file() || about.len() > MAX_BYTES {
        return Err(Error::file(path, "cannot read the picture: this is not a regular file of at most 8 GiB"));
    }
    let bytes = std::fs::read(path).map_err(|e| Error::file(path, format!("cannot read the picture: {e}")))?;
    decode(&bytes, false).map_err(|e| Error::file(path, format!("cannot read the picture: {e}")))
}

/// The picture that the bytes of a file are. EXR: the first layer with channels R, G and B, or Y, of half, float or integer
/// type. Radiance HDR: its values as they are. Others: decoded by the sRGB transfer function unless `raw`; alpha is left out.
///
/// Fails, with the reason, where they are of no such format or have no such channels.
pub fn decode(bytes: &[u8], raw: bool) -> std::result::Result<PictureFile, String> {
    /// The first bytes of an OpenEXR file.
    const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
    if bytes.starts_with(&EXR_MAGIC) {
        return read_exr(bytes);
    }
    // What follows is the name of a program.
    if bytes.starts_with(b"#?") {
        return HdrDecoder::new_nonstrict(bytes).map_err(|e| e.to_string()).and_then(|d| read_with(d, raw));
    }
    let format = image::guess_format(bytes).ok().filter(|format| OTHERS.contains(format));
    let format = format.ok_or("it is none of OpenEXR, Radiance HDR, PNG, JPEG and BMP")?;
    let mut reader = ImageReader::with_format(std::io::Cursor::new(bytes), format);
    // The size is checked below, before there is memory for the pixels.
    reader.no_limits();
    reader.into_decoder().map_err(|e| e.to_string()).and_then(|d| read_with(d, raw))
}

/// What is read besides floating point.
const OTHERS: [ImageFormat; 3] = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Bmp];

/// Width and height as numbers of 32 bits, unless there are too many pixels.
pub(super) fn check_size(width: usize, height: usize) -> std::result::Result<(u32, u32), String> {
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(w), Ok(h)) if w > 0 && h > 0 && u64::from(w) * u64::from(h) <= MAX_PIXELS => Ok((w, h)),
        _ => Err(format!("{width}x{height} pixels are too many; at most {MAX_PIXELS} can be read")),
    }
}

fn read_exr(bytes: &[u8]) -> std::result::Result<PictureFile, String> {
    let layers = read_exr_layers(bytes)?;
    layers
        .iter()
        .find_map(picture_of)
        .ok_or_else(|| format!("it has neither channels R, G, B nor Y, but {}", channel_names(&layers)))
}

/// All layers of an OpenEXR file that is not too large, at full resolution.
pub(super) fn read_exr_layers(bytes: &[u8]) -> std::result::Result<Layers, String> {
    let pedantic = false;
    let meta = exr::meta::MetaData::read_from_buffered(bytes, pedantic).map_err(|e| e.to_string())?;
    for header in &meta.headers {
        check_size(header.layer_size.width(), header.layer_size.height())?;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(std::io::Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    Ok(image.layer_data)
}

fn channel_names(layers: &[Layer<AnyChannels<FlatSamples>>]) -> String {
    let names = layers.iter().flat_map(|l| l.channel_data.list.iter().map(|c| c.name.to_string()));
    names.collect::<Vec<_>>().join(", ")
}

/// The picture of a layer, if it has the channels.
fn picture_of(layer: &Layer<AnyChannels<FlatSamples>>) -> Option<PictureFile> {
    let (width, height) = check_size(layer.size.width(), layer.size.height()).ok()?;
    let pixels = width as usize * height as usize;
    let channel = |name: &str| {
        let found = layer.channel_data.list.iter().find(|c| c.name.eq_case_insensitive(name))?;
        // Not one of fewer samples than pixels.
        (found.sample_data.len() == pixels).then_some(&found.sample_data)
    };
    let (r, g, b) = match (channel("R"), channel("G"), channel("B")) {
        (Some(r), Some(g), Some(b)) => (r, g, b),
        _ => channel("Y").map(|y| (y, y, y))?,
    };
    let mut picture = Picture::new(width, height);
    let values = r.values_as_f32().zip(g.values_as_f32()).zip(b.values_as_f32());
    for (i, ((r, g), b)) in (0u32..).zip(values) {
        picture.set(i % width, i / width, Rgb::new(r, g, b));
    }
    let position = layer.attributes.layer_position;
    Some(PictureFile { picture, offset: (position.x(), position.y()) })
}

fn read_with(decoder: impl ImageDecoder, raw: bool) -> std::result::Result<PictureFile, String> {
    let (width, height) = decoder.dimensions();
    let (width, height) = check_size(width as usize, height as usize)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?;
    let pixels: Vec<Rgb> = match decoded {
        DynamicImage::ImageRgb32F(linear) => linear.pixels().map(|p| Rgb::new(p.0[0], p.0[1], p.0[2])).collect(),
        deep @ (DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_)) => {
            let linear = decoding_table(u16::MAX, raw);
            let at = |v: u16| linear[usize::from(v)];
            deep.into_rgb16().pixels().map(|p| Rgb::new(at(p.0[0]), at(p.0[1]), at(p.0[2]))).collect()
        }
        shallow => {
            let linear = decoding_table(u8::MAX.into(), raw);
            let at = |v: u8| linear[usize::from(v)];
            shallow.into_rgb8().pixels().map(|p| Rgb::new(at(p.0[0]), at(p.0[1]), at(p.0[2]))).collect()
        }
    };
    let mut picture = Picture::new(width, height);
    for (i, pixel) in (0u32..).zip(pixels) {
        picture.set(i % width, i / width, pixel);
    }
    Ok(PictureFile { picture, offset: (0, 0) })
}

/// The linear values of the integers from 0 to `most`, which stands for 1.
fn decoding_table(most: u16, raw: bool) -> Vec<f32> {
    let linear = |v: f64| if raw { v } else { srgb_to_linear(v) };
    (0..=most).map(|v| linear(f64::from(v) / f64::from(most)) as f32).collect()
}
