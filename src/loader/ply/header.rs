//! The header of a PLY file.

use super::{Fault, Parsed};
use crate::error::Position;
use crate::loader::suggest::suggestion;

/// How the values after the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// Bytes of a number in the binary formats.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

const SCALARS: &[(&str, Scalar)] = &[
    ("char", Scalar::I8),
    ("double", Scalar::F64),
    ("float", Scalar::F32),
    ("float32", Scalar::F32),
    ("float64", Scalar::F64),
    ("int", Scalar::I32),
    ("int16", Scalar::I16),
    ("int32", Scalar::I32),
    ("int8", Scalar::I8),
    ("short", Scalar::I16),
    ("uchar", Scalar::U8),
    ("uint", Scalar::U32),
    ("uint16", Scalar::U16),
    ("uint32", Scalar::U32),
    ("uint8", Scalar::U8),
    ("ushort", Scalar::U16),
];

/// One value, or one list, of each of an element's entries.
#[derive(Debug)]
pub(super) struct Property {
    pub(super) name: String,
    /// The type of a list's length; `None` for a single value.
    pub(super) length: Option<Scalar>,
    pub(super) scalar: Scalar,
}

/// A table of the file.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

/// What the header says.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) format: Format,
    pub(super) elements: Vec<Element>,
    /// Where the values begin.
    pub(super) body: usize,
    /// The number of the line of the body's first byte.
    pub(super) body_line: u32,
}

impl Header {
    /// Bytes of a mesh of triangles with as much of everything as is declared, at most.
    pub(super) fn mesh_bytes(&self) -> u64 {
        let of = |element: &Element| {
            let each = match element.name.as_str() {
                "vertex" => 8 * element.properties.len(),
                "face" => 12 + 4 * element.properties.len(),
                _ => 0,
            };
            (element.count as u64).saturating_mul(each as u64)
        };
        self.elements.iter().map(of).fold(0, u64::saturating_add)
    }
}

/// The elements of which a mesh has one.
const ONCE: [&str; 2] = ["vertex", "face"];

/// Reads the header.
pub(super) fn parse(bytes: &[u8]) -> Parsed<Header> {
    let (mut at, mut line) = (0, 0);
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        line += 1;
        let fault = |message: String| -> Fault { (Position::Line(line), message) };
        let Some(length) = bytes[at..].iter().position(|&b| b == b'\n') else {
            return Err(fault(if line == 1 {
                "this is not a PLY file".into()
            } else {
                "the header has no end".into()
            }));
        };
        let text = String::from_utf8_lossy(&bytes[at..at + length]);
        at += length + 1;
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        if (line == 1) != (words == ["ply"]) {
            return Err(fault("this is not a PLY file: it must begin with one line 'ply'".into()));
        }
        match words[..] {
            [] | ["ply"] | ["comment" | "obj_info", ..] => {}
            ["format", name, _version] => format = Some(parse_format(name).map_err(fault)?),
            ["element", name, count] => {
                let count = count.parse().map_err(|_| fault(format!("'{count}' is not a number of elements")))?;
                if ONCE.contains(&name) && elements.iter().any(|e| e.name == name) {
                    return Err(fault(format!("a second element '{name}'")));
                }
                elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            ["property", ref rest @ ..] => {
                let Some(element) = elements.last_mut() else {
                    return Err(fault("a property needs an element before it".into()));
                };
                element.properties.push(parse_property(rest).map_err(fault)?);
            }
            ["end_header"] => break,
            _ => return Err(fault(format!("'{}' is not a line of a PLY header", text.trim()))),
        }
    }
    let Some(format) = format else {
        return Err((Position::Line(line), "the header has no format".into()));
    };
    Ok(Header { format, elements, body: at, body_line: line + 1 })
}

fn parse_format(name: &str) -> Result<Format, String> {
    match name {
        "ascii" => Ok(Format::Ascii),
        "binary_little_endian" => Ok(Format::LittleEndian),
        "binary_big_endian" => Ok(Format::BigEndian),
        _ => Err(format!("'{name}' is not a PLY format")),
    }
}

fn parse_property(words: &[&str]) -> Result<Property, String> {
    match words {
        ["list", length, scalar, name] => {
            let length = Some(parse_scalar(length)?);
            Ok(Property { name: (*name).into(), length, scalar: parse_scalar(scalar)? })
        }
        [scalar, name] => Ok(Property { name: (*name).into(), length: None, scalar: parse_scalar(scalar)? }),
        _ => Err("expected 'property TYPE NAME' or 'property list TYPE TYPE NAME'".into()),
    }
}

fn parse_scalar(name: &str) -> Result<Scalar, String> {
    let found = SCALARS.iter().find(|row| row.0 == name).map(|row| row.1);
    found.ok_or_else(|| format!("'{name}' is not a PLY type{}", suggestion(name, SCALARS.iter().map(|row| row.0))))
}
