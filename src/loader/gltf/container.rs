//! The two containers of glTF: a text file, or a binary one with the text and a buffer in it.

use crate::error::{Error, Result, Span};
use crate::files::Files;
use crate::loader::source::MAX_DATA_BYTES;
use gltf::json::{Material, Root};
use std::ops::Range;
use std::path::Path;

/// What a file holds.
pub(super) struct Container {
    /// The objects.
    pub(super) root: Root,
    /// The buffer of a binary file, if it has one.
    pub(super) blob: Option<Vec<u8>>,
}

/// The first bytes of a binary file.
const MAGIC: &[u8; 4] = b"glTF";
/// Bytes of its header: magic, version, length.
const HEADER_BYTES: usize = 12;
/// Bytes before each chunk: length, type.
const CHUNK_HEADER_BYTES: usize = 8;

/// Most bytes that the form of an object takes in memory, were it `{}` in the file.
const LARGEST_OBJECT: usize = 1 << 10;

/// Reads a file of either kind, whatever it is called.
pub(super) fn read(files: &Files, path: &Path) -> Result<Container> {
    let mut bytes = files.read(path, MAX_DATA_BYTES).map_err(|e| Error::file(path, e))?;
    let at = Span::whole(path);
    if !bytes.starts_with(MAGIC) {
        return Ok(Container { root: parse(files, &at, &bytes, true)?, blob: None });
    }
    let (text, blob) = chunks(&bytes).map_err(|message| Error::scene(&at, message))?;
    let root = parse(files, &at, &bytes[text], false)?;
    let blob = blob.map(|range| {
        bytes.truncate(range.end);
        bytes.drain(..range.start);
        bytes
    });
    Ok(Container { root, blob })
}

fn parse(files: &Files, at: &Span, text: &[u8], is_file: bool) -> Result<Root> {
    const { assert!(size_of::<Material>() <= LARGEST_OBJECT) };
    let most = text.iter().filter(|&&byte| byte == b'{').count() * LARGEST_OBJECT + text.len();
    files.memory().check(most as u64).map_err(|m| Error::scene(at, format!("its JSON {m}")))?;
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    gltf::json::deserialize::from_slice(text).map_err(|e| {
        let message = e.to_string();
        let said = message.rsplit_once(" at line ").map_or(message.as_str(), |(said, _)| said);
        let place = (e.line().max(1) as u32, e.column().max(1) as u32);
        if is_file {
            Error::scene(&Span::text(at.file.clone(), place.0, place.1), format!("this is no glTF: {said}"))
        } else {
            Error::scene(at, format!("its JSON is no glTF: {said} (line {}, column {})", place.0, place.1))
        }
    })
}

/// Where in a binary file the text and the buffer are.
fn chunks(bytes: &[u8]) -> std::result::Result<(Range<usize>, Option<Range<usize>>), String> {
    let number = |at: usize| -> std::result::Result<u32, String> {
        let four = bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).ok_or("the file is cut short")?;
        Ok(u32::from_le_bytes(four))
    };
    let version = number(4)?;
    if version != 2 {
        return Err(format!("a binary glTF has version 2, not {version}"));
    }
    let length = number(8)? as usize;
    if length > bytes.len() {
        return Err(format!("the file is cut short: it has {} bytes of {length}", bytes.len()));
    }
    let chunk = |start: usize, kind: &[u8; 4]| -> std::result::Result<Option<Range<usize>>, String> {
        if start + CHUNK_HEADER_BYTES > length || bytes[start + 4..start + 8] != *kind {
            return Ok(None);
        }
        let size = number(start)? as usize;
        let begin = start + CHUNK_HEADER_BYTES;
        if size > length - begin {
            return Err(format!("a chunk of {size} bytes does not fit into the file"));
        }
        Ok(Some(begin..begin + size))
    };
    let text = chunk(HEADER_BYTES, b"JSON")?.ok_or("a binary glTF begins with a chunk of JSON")?;
    let blob = chunk(text.end.next_multiple_of(4), b"BIN\0")?;
    Ok((text, blob))
}
