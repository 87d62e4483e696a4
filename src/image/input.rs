//! Reads pictures: OpenEXR and PNG to linear sRGB.

use super::Picture;
use crate::error::{Error, Result};
use crate::spectrum::{Rgb, srgb_to_linear};
use exr::prelude::{AnyChannels, FlatSamples, Layer, ReadChannels, ReadLayers};
use image::ImageFormat;
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

/// Reads a picture. EXR: the first layer with channels R, G and B, or Y, of half, float or integer type. PNG: decoded by
/// the sRGB transfer function; alpha is left out.
///
/// Fails where the file cannot be read, is neither, or has no such channels.
pub fn read(path: &Path) -> Result<PictureFile> {
    let about = std::fs::metadata(path).map_err(|e| Error::file(path, format!("cannot read the picture: {e}")))?;
    if !about.is_file() || about.len() > MAX_BYTES {
        return Err(Error::file(path, "cannot read the picture: this is not a regular file of at most 8 GiB"));
    }
    let bytes = std::fs::read(path).map_err(|e| Error::file(path, format!("cannot read the picture: {e}")))?;
    /// The first bytes of an OpenEXR file.
    const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
    let read = if bytes.starts_with(&EXR_MAGIC) {
        read_exr(&bytes)
    } else if image::guess_format(&bytes).is_ok_and(|f| f == ImageFormat::Png) {
        read_png(&bytes)
    } else {
        Err("it is neither OpenEXR nor PNG".into())
    };
    read.map_err(|e| Error::file(path, format!("cannot read the picture: {e}")))
}

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

fn read_png(bytes: &[u8]) -> std::result::Result<PictureFile, String> {
    let decoded = image::load_from_memory_with_format(bytes, ImageFormat::Png).map_err(|e| e.to_string())?;
    // 16 bits hold 8 exactly: v · 257 / 65535 = v / 255.
    let decoded = decoded.into_rgb16();
    let (width, height) = check_size(decoded.width() as usize, decoded.height() as usize)?;
    let mut picture = Picture::new(width, height);
    let linear = |v: u16| srgb_to_linear(f64::from(v) / f64::from(u16::MAX)) as f32;
    for (x, y, p) in decoded.enumerate_pixels() {
        let [r, g, b] = p.0.map(linear);
        picture.set(x, y, Rgb::new(r, g, b));
    }
    Ok(PictureFile { picture, offset: (0, 0) })
}
