//! The values of a PLY file.

use super::attributes::{self, Columns};
use super::header::{Element, Format, Header, Property, Scalar};
use super::{Fault, Parsed, Wanted};
use crate::description::{Attribute, Mesh};
use crate::error::Position;
use glam::{DVec2, DVec3};

/// Names of the list of a face's vertices.
const INDEX_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Names of properties of vertices that are no attributes.
const VERTEX_NAMES: [&str; 10] = ["x", "y", "z", "nx", "ny", "nz", "u", "v", "s", "t"];

/// Fewest bytes of a number of an ascii file: a digit and a space.
const ASCII_NUMBER_BYTES: usize = 2;

/// Reads the mesh that follows the header.
pub(super) fn parse(bytes: &[u8], header: &Header, wanted: Wanted) -> Parsed<Mesh> {
    let mut cursor = Cursor { bytes, at: header.body, line: header.body_line, format: header.format };
    let mut mesh = Mesh::default();
    // Faces may come before the vertices that they name.
    let total = header.elements.iter().find(|e| e.name == "vertex").map_or(0, |e| e.count);
    for element in &header.elements {
        cursor.check_room(element)?;
        match element.name.as_str() {
            "vertex" => vertices(&mut cursor, element, &mut mesh, wanted)?,
            "face" => faces(&mut cursor, element, total, &mut mesh, wanted)?,
            _ => {
                for _ in 0..element.count {
                    skip(&mut cursor, &element.properties)?;
                }
            }
        }
    }
    if mesh.faces.is_empty() {
        return Err((Position::Whole, "the mesh has no faces".into()));
    }
    Ok(mesh)
}

fn vertices(cursor: &mut Cursor<'_>, element: &Element, mesh: &mut Mesh, wanted: Wanted) -> Parsed<()> {
    let column = |name: &str| element.properties.iter().position(|p| p.name == name && p.length.is_none());
    let columns = |names: [&str; 3]| Some([column(names[0])?, column(names[1])?, column(names[2])?]);
    let Some(position) = columns(["x", "y", "z"]) else {
        return Err((Position::Whole, "the vertices have no x, y and z".into()));
    };
    let normal = columns(["nx", "ny", "nz"]);
    // The names that Mitsuba knows.
    let uv =
        [["u", "v"], ["s", "t"]].into_iter().find_map(|[u, v]| Some([column(u)?, column(v)?])).filter(|_| wanted.uvs);
    if u32::try_from(element.count).is_err() {
        return Err((Position::Whole, "the mesh has too many vertices".into()));
    }
    mesh.positions.reserve_exact(element.count);
    mesh.normals.reserve_exact(if normal.is_some() { element.count } else { 0 });
    mesh.uvs.reserve_exact(if uv.is_some() { element.count } else { 0 });
    let mut columns = Attributes::of(element, &VERTEX_NAMES, wanted);
    let mut row = vec![0.0; element.properties.len()];
    for _ in 0..element.count {
        for (i, property) in element.properties.iter().enumerate() {
            if property.length.is_some() {
                skip(cursor, std::slice::from_ref(property))?;
                continue;
            }
            let place = cursor.at;
            row[i] = cursor.scalar(property.scalar)?;
            let matters =
                position.contains(&i) || normal.is_some_and(|n| n.contains(&i)) || uv.is_some_and(|uv| uv.contains(&i));
            if matters && !row[i].is_finite() {
                return Err(cursor.fault(place, format!("'{}' is not a finite number", cursor.word(place, row[i]))));
            }
        }
        mesh.positions.push(DVec3::from(position.map(|i| row[i])));
        if let Some(normal) = normal {
            mesh.normals.push(DVec3::from(normal.map(|i| row[i])));
        }
        if let Some(uv) = uv {
            mesh.uvs.push(DVec2::from(uv.map(|i| row[i])));
        }
        columns.push(&row);
    }
    mesh.attributes.append(&mut columns.made);
    Ok(())
}

/// Attributes while an element is read.
struct Attributes {
    columns: Vec<Columns>,
    made: Vec<Attribute>,
}

impl Attributes {
    fn of(element: &Element, known: &[&str], wanted: Wanted) -> Self {
        let columns =
            if wanted.attributes { attributes::of(&element.name, &element.properties, known) } else { Vec::new() };
        let of_faces = element.name == "face";
        let made = columns
            .iter()
            .map(|c| Attribute { name: c.name.clone(), of_faces, width: c.columns.len(), values: Vec::new() })
            .collect();
        Self { columns, made }
    }

    /// Adds the values of an entry. One that is no finite number becomes 0.
    fn push(&mut self, row: &[f64]) {
        for (columns, attribute) in self.columns.iter().zip(&mut self.made) {
            let value = |&i: &usize| if (row[i] as f32).is_finite() { row[i] as f32 } else { 0.0 };
            attribute.values.extend(columns.columns.iter().map(value));
        }
    }
}

/// Faces of a mesh of `total` vertices, fans of triangles.
fn faces(cursor: &mut Cursor<'_>, element: &Element, total: usize, mesh: &mut Mesh, wanted: Wanted) -> Parsed<()> {
    let is_indices = |p: &Property| p.length.is_some() && INDEX_NAMES.contains(&p.name.as_str());
    let Some(indices) = element.properties.iter().position(is_indices) else {
        return Err((Position::Whole, "the faces have no list 'vertex_indices'".into()));
    };
    let (before, rest) = element.properties.split_at(indices);
    let (property, after) = (&rest[0], &rest[1..]);
    let mut columns = Attributes::of(element, &[], wanted);
    let mut row = vec![0.0; element.properties.len()];
    mesh.faces.reserve_exact(element.count);
    for _ in 0..element.count {
        let of_face = mesh.faces.len();
        read_row(cursor, before, &mut row)?;
        let length = cursor.length(property)?;
        if length < 3 {
            return Err(cursor.fault(cursor.at, format!("a face needs at least three vertices, not {length}")));
        }
        let first = index(cursor, property.scalar, total)?;
        let mut second = index(cursor, property.scalar, total)?;
        for _ in 2..length {
            let third = index(cursor, property.scalar, total)?;
            mesh.faces.push([first, second, third]);
            second = third;
        }
        read_row(cursor, after, &mut row[indices + 1..])?;
        // Every triangle of a fan has the values of its face.
        for _ in of_face..mesh.faces.len() {
            columns.push(&row);
        }
    }
    mesh.attributes.append(&mut columns.made);
    Ok(())
}

/// Reads single values into `row`, and skips lists.
fn read_row(cursor: &mut Cursor<'_>, properties: &[Property], row: &mut [f64]) -> Parsed<()> {
    for (property, value) in properties.iter().zip(row) {
        match property.length {
            Some(_) => skip(cursor, std::slice::from_ref(property))?,
            None => *value = cursor.scalar(property.scalar)?,
        }
    }
    Ok(())
}

fn index(cursor: &mut Cursor<'_>, scalar: Scalar, total: usize) -> Parsed<u32> {
    let place = cursor.at;
    let value = cursor.scalar(scalar)?;
    // Written so that NaN is out of range.
    if !(value >= 0.0 && value < total as f64) {
        return Err(cursor.fault(place, format!("the vertex index {value} is out of range; the file has {total}")));
    }
    if value.fract() != 0.0 {
        return Err(cursor.fault(place, format!("'{value}' is not a vertex index")));
    }
    Ok(value as u32)
}

fn skip(cursor: &mut Cursor<'_>, properties: &[Property]) -> Parsed<()> {
    for property in properties {
        let count = if property.length.is_some() { cursor.length(property)? } else { 1 };
        for _ in 0..count {
            cursor.scalar(property.scalar)?;
        }
    }
    Ok(())
}

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The line of `at`, for ascii.
    line: u32,
    format: Format,
}

impl Cursor<'_> {
    /// An error unless the rest of the file can hold the element with all lists empty.
    fn check_room(&self, element: &Element) -> Parsed<()> {
        let size = |p: &Property| match self.format {
            Format::Ascii => ASCII_NUMBER_BYTES,
            _ => p.length.unwrap_or(p.scalar).size(),
        };
        let least = element.properties.iter().map(size).sum::<usize>().max(1);
        // The last number of an ascii file needs no space after it.
        let room = self.bytes.len() - self.at.min(self.bytes.len()) + 1;
        if element.count.checked_mul(least).is_some_and(|needed| needed <= room) {
            return Ok(());
        }
        Err((Position::Whole, format!("the file is too short for {} of the element '{}'", element.count, element.name)))
    }

    fn length(&mut self, property: &Property) -> Parsed<usize> {
        let place = self.at;
        let value = self.scalar(property.length.unwrap_or(property.scalar))?;
        let room = (self.bytes.len() - self.at.min(self.bytes.len())) as f64;
        if value >= 0.0 && value <= room && value.fract() == 0.0 {
            Ok(value as usize)
        } else {
            Err(self.fault(place, format!("'{value}' is not the length of a list")))
        }
    }

    /// The next number; every type fits into an f64.
    fn scalar(&mut self, scalar: Scalar) -> Parsed<f64> {
        if self.format == Format::Ascii {
            return self.ascii();
        }
        let size = scalar.size();
        let Some(bytes) = self.bytes.get(self.at..).and_then(|rest| rest.get(..size)) else {
            return Err(self.fault(self.at, "the file ends too early".into()));
        };
        self.at += size;
        let mut wide = [0; 8];
        wide[..size].copy_from_slice(bytes);
        if self.format == Format::BigEndian {
            wide[..size].reverse();
        }
        let [b0, b1, b2, b3, ..] = wide;
        Ok(match scalar {
            Scalar::I8 => f64::from(b0 as i8),
            Scalar::U8 => f64::from(b0),
            Scalar::I16 => f64::from(i16::from_le_bytes([b0, b1])),
            Scalar::U16 => f64::from(u16::from_le_bytes([b0, b1])),
            Scalar::I32 => f64::from(i32::from_le_bytes([b0, b1, b2, b3])),
            Scalar::U32 => f64::from(u32::from_le_bytes([b0, b1, b2, b3])),
            Scalar::F32 => f64::from(f32::from_le_bytes([b0, b1, b2, b3])),
            Scalar::F64 => f64::from_le_bytes(wide),
        })
    }

    fn ascii(&mut self) -> Parsed<f64> {
        while let Some(byte) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            self.line += u32::from(*byte == b'\n');
            self.at += 1;
        }
        let rest = self.bytes.get(self.at..).unwrap_or(&[]);
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.fault(self.at, "the file ends too early".into()));
        }
        let word = std::str::from_utf8(&rest[..length]).unwrap_or("");
        let Ok(value) = word.parse() else {
            let word = String::from_utf8_lossy(&rest[..length]);
            return Err(self.fault(self.at, format!("'{word}' is not a number")));
        };
        self.at += length;
        Ok(value)
    }

    /// How the file writes the number that was just read from `place`.
    fn word(&self, place: usize, value: f64) -> String {
        match self.format {
            Format::Ascii => String::from_utf8_lossy(&self.bytes[place..self.at]).trim().into(),
            _ => value.to_string(),
        }
    }

    fn fault(&self, place: usize, message: String) -> Fault {
        let position =
            if self.format == Format::Ascii { Position::Line(self.line) } else { Position::Byte(place as u64) };
        (position, message)
    }
}
