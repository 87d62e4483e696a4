//! Sums in files: OpenEXR pictures that have, beside their pixels, planes of whole numbers and a record of how those came
//! about, with a hash over both.

use super::decode::{MAX_PICTURE_BYTES, check_size};
use super::exr_file::MAX_EXPANSION;
use super::guarded::guarded;
use super::{Metadata, Plane};
use crate::error::{Error, Result};
use crate::files::Files;
use exr::prelude::{AttributeValue, FlatSamples, ReadChannels, ReadLayers, Text};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// Attribute of the record.
const RECORD: &str = "snell.record";

/// Attribute of the hash of record and planes.
const HASH: &str = "snell.hash";

/// Planes of whole numbers, and what they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Sums {
    /// Text that the writer gave along.
    pub record: String,
    /// Columns and rows.
    pub size: (u32, u32),
    /// Row by row, by name.
    planes: BTreeMap<String, Vec<u32>>,
}

impl Sums {
    /// Those that a file of so many pixels would hold.
    pub fn new(record: String, size: (u32, u32), planes: impl IntoIterator<Item = (String, Vec<u32>)>) -> Self {
        Self { record, size, planes: planes.into_iter().collect() }
    }

    /// How many planes there are.
    pub fn plane_count(&self) -> usize {
        self.planes.len()
    }

    /// The values of the plane of that name.
    pub fn plane(&self, name: &str) -> Option<&[u32]> {
        self.planes.get(name).map(Vec::as_slice)
    }
}

/// Adds to the metadata what makes a file with these planes one that [`read`] reads: the record, any text, and the hash.
pub fn seal(metadata: &mut Metadata, record: &str, planes: &[Plane]) {
    let whole = planes.iter().filter_map(|plane| Some((plane.name.as_str(), plane.values.whole()?)));
    metadata.texts.push((HASH.into(), hash(record, whole.collect())));
    metadata.texts.push((RECORD.into(), ascii(record)));
}

/// A text of JSON in ASCII, which all that attributes can hold: the same text to whoever reads JSON.
fn ascii(json: &str) -> String {
    let mut units = [0; 2];
    json.chars().fold(String::with_capacity(json.len()), |mut text, c| {
        if c.is_ascii() {
            text.push(c);
        } else {
            text.extend(c.encode_utf16(&mut units).iter().map(|unit| format!("\\u{unit:04x}")));
        }
        text
    })
}

/// The hash of all that must not change.
fn hash(record: &str, mut planes: Vec<(&str, &[u32])>) -> String {
    planes.sort_unstable();
    let mut hasher = blake3::Hasher::new();
    // Every part behind its length, so that no two lists of parts are the same bytes.
    let mut part = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    part(ascii(record).as_bytes());
    for (name, values) in planes {
        part(name.as_bytes());
        part(&values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());
    }
    hasher.finalize().to_hex().to_string()
}

/// Reads a file's sums and record.
///
/// Fails where the file cannot be read, is not one with sums, or is not as it was written.
pub fn read(path: &Path) -> Result<Sums> {
    let fail = |e: &dyn std::fmt::Display| Error::file(path, format!("cannot read the sums of a render: {e}"));
    let bytes = Files::default().read(path, MAX_PICTURE_BYTES).map_err(|e| fail(&e))?;
    decode(&bytes).map_err(|e| fail(&e))
}

/// The same for the bytes of a file.
///
/// Fails, with the reason, where [`read`] does.
pub fn decode(bytes: &[u8]) -> std::result::Result<Sums, String> {
    guarded(|| decode_any(bytes))
}

/// The same, but for panics.
fn decode_any(bytes: &[u8]) -> std::result::Result<Sums, String> {
    const NONE: &str = "this is not a file that a render left with --checkpoint or --shard";
    const DAMAGED: &str = "the file is damaged";
    let meta = exr::meta::MetaData::read_from_buffered(bytes, true).map_err(|_| NONE)?;
    let [header] = meta.headers.as_slice() else { return Err(NONE.into()) };
    let size = check_size(header.layer_size.width(), header.layer_size.height())?;
    let text = |name: &str| match header.own_attributes.other.get(&Text::from(name)) {
        Some(AttributeValue::Text(text)) => Ok(text.to_string()),
        _ => Err(NONE),
    };
    let (record, expected) = (text(RECORD)?, text(HASH)?);
    // Also because the crate divides by them.
    if header.channels.list.iter().any(|channel| channel.sampling != exr::math::Vec2(1, 1)) {
        return Err(DAMAGED.into());
    }
    if header.total_pixel_bytes() as u64 > MAX_EXPANSION * bytes.len() as u64 {
        return Err(DAMAGED.into());
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| format!("{DAMAGED}: {e}"))?;
    let planes: BTreeMap<String, Vec<u32>> = image
        .layer_data
        .channel_data
        .list
        .into_iter()
        .filter_map(|channel| match channel.sample_data {
            FlatSamples::U32(values) => Some((channel.name.to_string(), values)),
            _ => None,
        })
        .collect();
    let found = hash(&record, planes.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect());
    if found != expected {
        return Err(DAMAGED.into());
    }
    Ok(Sums { record, size, planes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{ComponentFormat, Crop, Layers, OutputFile, Picture, PixelFormat, PlaneValues, WriteOptions};

    fn written() -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sums.exr");
        let picture = Picture::new(3, 2);
        let values = PlaneValues::Whole(vec![0, 1, u32::MAX, 7, 7, 7]);
        let planes = [Plane { name: "sum.R.0".into(), values }];
        let mut metadata = Metadata::default();
        seal(&mut metadata, r#"{"scene":"köln 🜂.xml"}"#, &planes);
        let options = WriteOptions {
            full_size: (3, 2),
            crop: Crop { x: 0, y: 0, width: 3, height: 2 },
            component_format: ComponentFormat::Half,
            exposure: 0.0,
            metadata,
        };
        let layers = Layers { picture: &picture, format: PixelFormat::Rgb, alpha: None, planes: &planes };
        OutputFile::reserve(&path).unwrap().write(layers, &options).unwrap();
        std::fs::read(path).unwrap()
    }

    #[test]
    fn what_was_written_is_read() {
        let sums = decode(&written()).unwrap();
        assert_eq!(sums.size, (3, 2));
        assert_eq!(sums.plane("sum.R.0"), Some(&[0, 1, u32::MAX, 7, 7, 7][..]));
        assert_eq!(sums.plane("R"), None);
        let record: serde_json::Value = serde_json::from_str(&sums.record).unwrap();
        assert_eq!(record["scene"], "köln 🜂.xml");
    }

    /// Whatever byte is changed, or wherever the file ends: refused, or the same sums.
    #[test]
    fn damage_is_noticed() {
        let (bytes, whole) = (written(), decode(&written()).unwrap());
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(decode(&damaged).is_err_and(|e| !e.is_empty()) || decode(&damaged).unwrap() == whole, "byte {at}");
            assert!(decode(&bytes[..at]).is_err(), "{at} bytes");
        }
    }

    #[test]
    fn other_files_are_refused() {
        for other in [&b""[..], b"words", b"\x76\x2f\x31\x01"] {
            assert!(decode(other).unwrap_err().contains("is not a file that a render left"));
        }
    }
}
