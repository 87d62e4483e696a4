//! The bytes of picture files, decoded: the one place that knows the formats that are read.

use super::guarded::guarded;
use super::raster::{Raster, Samples};
use crate::error::{Error, Result};
use crate::files::{Files, Memory};
use exr::meta::BlockDescription;
use exr::prelude::{AnyChannels, FlatSamples, Layer, ReadChannels, ReadLayers, Vec2};
use half::f16;
use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::io::Cursor;
use std::path::Path;

/// Most pixels to read. Reason: as many as can be rendered; a header that claims more must not ask for the memory.
const MAX_PIXELS: u64 = 1 << 28;

/// Largest file in bytes: more than [`MAX_PIXELS`] of four float channels; protects against reading a device.
pub const MAX_PICTURE_BYTES: u64 = 8 << 30;

/// What is read besides floating point.
const OTHERS: [ImageFormat; 4] = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Bmp, ImageFormat::Tga];

/// A picture, and where it lies.
pub(super) struct Decoded {
    pub(super) raster: Raster,
    /// Column and row of its first pixel in the whole picture, of which it may be a part.
    pub(super) offset: (i32, i32),
}

/// The picture in a file.
///
/// Fails where the file cannot be read or [`decode`] fails.
pub(super) fn read(path: &Path) -> Result<Decoded> {
    let fail = |m: String| Error::file(path, format!("cannot read the picture: {m}"));
    let bytes = Files::default().read(path, MAX_PICTURE_BYTES).map_err(fail)?;
    decode(&bytes, ImageFormat::from_path(path).ok(), false, &Memory::default()).map_err(fail)
}

/// The picture that the bytes of a file are. EXR: the first layer with channels R, G and B, or Y, of half, float or integer
/// type, and A. Radiance HDR: its values as they are. Others: colours decoded by the sRGB transfer function unless `raw`.
/// `named` is the format that the file's name says, which counts only for files that do not say theirs (TGA).
///
/// Fails, with the reason, where they are of no such format or have no such channels, or `memory` does not suffice.
pub(super) fn decode(
    bytes: &[u8],
    named: Option<ImageFormat>,
    raw: bool,
    memory: &Memory,
) -> std::result::Result<Decoded, String> {
    guarded(|| decode_any(bytes, named, raw, memory))
}

/// The same, but for panics.
fn decode_any(
    bytes: &[u8],
    named: Option<ImageFormat>,
    raw: bool,
    memory: &Memory,
) -> std::result::Result<Decoded, String> {
    /// The first bytes of an OpenEXR file.
    const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
    if bytes.starts_with(&EXR_MAGIC) {
        return decode_exr(bytes, memory);
    }
    // What follows is the name of a program.
    if bytes.starts_with(b"#?") {
        return HdrDecoder::new_nonstrict(bytes).map_err(|e| e.to_string()).and_then(|d| decode_with(d, raw, memory));
    }
    let format = image::guess_format(bytes).ok().or(named).filter(|format| OTHERS.contains(format));
    let format = format.ok_or("it is none of OpenEXR, Radiance HDR, PNG, JPEG, BMP and TGA")?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    // The size is checked below, before there is memory for the pixels.
    reader.no_limits();
    let decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    check_bytes(format, decoder.dimensions(), bytes.len())?;
    decode_with(decoder, raw, memory)
}

/// An error where so few bytes cannot be a whole picture of this size: in JPEG every block of 8×8 pixels has a code of its own, of one bit
/// at least, and two bytes of a BMP are no more than 255 pixels, but for those that it skips. Without this a header of some bytes costs
/// the time of the millions of pixels that it claims.
fn check_bytes(format: ImageFormat, (width, height): (u32, u32), bytes: usize) -> std::result::Result<(), String> {
    const EDGE: u32 = 8;
    const PIXELS_A_BYTE: u64 = 128;
    let (units, most_a_byte) = match format {
        ImageFormat::Jpeg => (u64::from(width.div_ceil(EDGE)) * u64::from(height.div_ceil(EDGE)), u64::from(u8::BITS)),
        ImageFormat::Bmp => (u64::from(width) * u64::from(height), PIXELS_A_BYTE),
        _ => return Ok(()),
    };
    if units > most_a_byte * bytes as u64 {
        return Err(format!("it is cut off: {width}x{height} pixels are more than {bytes} bytes can hold"));
    }
    Ok(())
}

/// Width and height as numbers of 32 bits, unless there are too many pixels.
pub(super) fn check_size(width: usize, height: usize) -> std::result::Result<(u32, u32), String> {
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(w), Ok(h)) if w > 0 && h > 0 && u64::from(w) * u64::from(h) <= MAX_PIXELS => Ok((w, h)),
        _ => Err(format!("{width}x{height} pixels are too many; at most {MAX_PIXELS} can be read")),
    }
}

/// An error where the samples of a picture do not fit into the memory.
fn check_memory(memory: &Memory, (width, height): (u32, u32), bytes: u64) -> std::result::Result<(), String> {
    memory.check(bytes).map_err(|m| format!("{width}x{height} pixels: that {m}"))
}

fn decode_with(decoder: impl ImageDecoder, raw: bool, memory: &Memory) -> std::result::Result<Decoded, String> {
    let (width, height) = decoder.dimensions();
    let size = check_size(width as usize, height as usize)?;
    check_memory(memory, size, decoder.total_bytes())?;
    let image = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?;
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
    Ok(Decoded { raster: Raster::new(size, channels, samples, raw), offset: (0, 0) })
}

/// Bytes of a block that may be larger than the picture. Reason: tiles have a size of their own, of usually 64 to 256 pixels along each side, and
/// lines are packed by up to 256; but as many bytes as a block may have are made ready for what is read of it.
const MOST_BLOCK_BYTES: u64 = 1 << 26;

/// The first layer that has known channels, at full resolution.
fn decode_exr(bytes: &[u8], memory: &Memory) -> std::result::Result<Decoded, String> {
    let pedantic = false;
    let meta = exr::meta::MetaData::read_from_buffered(bytes, pedantic).map_err(|e| e.to_string())?;
    let mut total = 0;
    for header in &meta.headers {
        let (width, height) = check_size(header.layer_size.width(), header.layer_size.height())?;
        let pixel: u64 = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u64).sum();
        total += u64::from(width) * u64::from(height) * pixel;
        if total > MAX_PICTURE_BYTES {
            return Err(format!("its layers have more than {MAX_PICTURE_BYTES} bytes of pixels"));
        }
        check_memory(memory, (width, height), total)?;
        let block = match header.blocks {
            BlockDescription::Tiles(tiles) => {
                let Vec2(tile_width, tile_height) = tiles.tile_size;
                (tile_width as u64).saturating_mul(tile_height as u64).saturating_mul(pixel)
            }
            BlockDescription::ScanLines => header.max_block_byte_size() as u64,
        };
        if block > total.max(MOST_BLOCK_BYTES) {
            return Err(format!("its blocks of {block} bytes are far larger than the picture"));
        }
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    let layers = &image.layer_data;
    layers
        .iter()
        .find_map(of_layer)
        .ok_or_else(|| format!("it has neither channels R, G, B nor Y, but {}", channel_names(layers)))
}

fn channel_names(layers: &[Layer<AnyChannels<FlatSamples>>]) -> String {
    let names = layers.iter().flat_map(|l| l.channel_data.list.iter().map(|c| c.name.to_string()));
    names.collect::<Vec<_>>().join(", ")
}

/// From the channels R, G, B or Y, and A, of a layer that has them.
fn of_layer(layer: &Layer<AnyChannels<FlatSamples>>) -> Option<Decoded> {
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
            let places = floats.iter_mut().skip(c).step_by(channels.len());
            places.zip(channel.values_as_f32()).for_each(|(f, v)| *f = v);
        }
        Samples::Float(floats)
    };
    let position = layer.attributes.layer_position;
    let raster = Raster::new((width, height), channels.len() as u32, samples, true);
    Some(Decoded { raster, offset: (position.x(), position.y()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_known_picture_is_an_error_that_says_so() {
        let error = |bytes: &[u8]| decode(bytes, None, true, &Memory::default()).err().unwrap();
        let unknown = "it is none of OpenEXR, Radiance HDR, PNG, JPEG, BMP and TGA";
        assert_eq!([error(b"words"), error(b"GIF89a")], [unknown, unknown]);
        // A header without the rest.
        assert!(!error(b"\x89PNG\r\n\x1a\n").is_empty());
        assert!(!error(b"\x76\x2f\x31\x01").is_empty());
        // Found by fuzzing: files of a page that would have had a gigabyte made ready for a block.
        for file in ["blocks-of-a-gigabyte", "blocks-of-800-megabytes"] {
            let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/found/exr");
            let error = error(&std::fs::read(folder.join(file)).unwrap());
            assert!(
                error.starts_with("its blocks of ") && error.ends_with(" are far larger than the picture"),
                "{error}"
            );
        }
    }
}
