//! Bytes: of buffers, of their views, and behind URIs. Nothing is read outside of what is there.

use super::model::Model;
use crate::error::{Error, Result};
use crate::loader::source::MAX_DATA_BYTES;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

/// A part of a buffer.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) bytes: &'a [u8],
    /// Bytes from one element to the next, where they are not one behind the other.
    pub(super) stride: Option<usize>,
}

/// As data URIs have it: padding may be left out.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

impl Model {
    /// The part of a buffer that `bufferViews[index]` is.
    pub(super) fn view(&self, index: usize, place: &str) -> Result<View<'_>> {
        let view = self.get(&self.root.buffer_views, index, "bufferViews", place)?;
        let place = format!("bufferViews[{index}]");
        let buffer = self.buffer(view.buffer.value(), &place)?;
        let (offset, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let bytes = part(buffer, offset, length).ok_or_else(|| {
            let (has, number) = (buffer.len(), view.buffer.value());
            self.error(
                &place,
                format!("{length} bytes from {offset} are outside of buffers[{number}], which has {has}"),
            )
        })?;
        Ok(View { bytes, stride: view.byte_stride.map(|s| s.0) })
    }

    fn buffer(&self, index: usize, place: &str) -> Result<&[u8]> {
        let buffer = self.get(&self.root.buffers, index, "buffers", place)?;
        let place = format!("buffers[{index}]");
        let bytes = match (&buffer.uri, &self.blob) {
            (None, Some(blob)) if index == 0 => blob,
            (None, _) => return Err(self.error(&place, "it has no uri, and is not the buffer of a binary glTF")),
            (Some(uri), _) => match self.buffers[index].get() {
                Some(bytes) => bytes,
                None => {
                    let bytes = self.behind(uri, &place)?;
                    self.buffers[index].get_or_init(|| bytes)
                }
            },
        };
        let length = buffer.byte_length.0;
        part(bytes, 0, length)
            .ok_or_else(|| self.error(&place, format!("it has {} bytes, but byteLength says {length}", bytes.len())))
    }

    /// What is behind a URI: a file beside this one, or bytes in the URI itself. It counts as kept: a file may name it again and
    /// again.
    pub(super) fn behind(&self, uri: &str, place: &str) -> Result<Vec<u8>> {
        let bytes = self.fetch(uri, place)?;
        self.files.memory().keep(bytes.len() as u64).map_err(|m| self.error(place, format!("it {m}")))?;
        Ok(bytes)
    }

    fn fetch(&self, uri: &str, place: &str) -> Result<Vec<u8>> {
        if let Some(data) = uri.strip_prefix("data:") {
            let Some((_, text)) = data.split_once(";base64,") else {
                return Err(self.error(place, "expected base64 in its data: URI"));
            };
            return BASE64.decode(text).map_err(|e| self.error(place, format!("its base64 is wrong: {e}")));
        }
        let scheme = uri.split_once(':').map(|(scheme, _)| scheme);
        // A letter is a drive of Windows.
        if scheme.is_some_and(|s| s.len() > 1 && s.bytes().all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b))) {
            return Err(self.error(place, format!("expected a data: URI or the name of a file, not '{uri}'")));
        }
        let name = unescape(uri).ok_or_else(|| self.error(place, format!("'{uri}' is not a URI")))?;
        let path = self.folder.join(name);
        self.files
            .read(&path, MAX_DATA_BYTES)
            .map_err(|e| Error::scene(&self.at, format!("{place}: {}: {e}", path.display())))
    }
}

/// `length` bytes from `offset`, if they are there.
pub(super) fn part(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let start = usize::try_from(offset).ok()?;
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    bytes.get(start..end)
}

/// With `%41` replaced by the byte that it stands for.
fn unescape(uri: &str) -> Option<String> {
    let (mut name, mut rest) = (Vec::new(), uri.as_bytes());
    while let [first, tail @ ..] = rest {
        rest = tail;
        if *first != b'%' {
            name.push(*first);
            continue;
        }
        let digits = std::str::from_utf8(tail.get(..2)?).ok()?;
        name.push(u8::from_str_radix(digits, 16).ok()?);
        rest = &tail[2..];
    }
    String::from_utf8(name).ok()
}
