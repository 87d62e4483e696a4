//! PLY meshes: ascii, binary little and big endian.
//!
//! Our own reader: the PLY crates make a map from names to values of every element, which is ten times slower than the
//! disk, and none of them checks the counts of the header against the size of the file before it allocates.
//!
//! Source of the format: G. Turk, The PLY Polygon File Format, 1994.

mod attributes;
mod body;
mod header;

use super::source::MAX_DATA_BYTES;
use crate::description::Mesh;
use crate::error::{Error, Position, Result, Span};
use crate::files::{Files, Memory};
use std::path::Path;

/// Where in the file, and what is wrong there.
type Fault = (Position, String);
type Parsed<T> = std::result::Result<T, Fault>;

/// What to read beside positions, normals and faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Wanted {
    /// Texture coordinates.
    pub(crate) uvs: bool,
    /// Attributes.
    pub(crate) attributes: bool,
}

/// Reads a mesh; its normals are as many as its positions, or none. So are its texture coordinates if they are wanted.
pub(crate) fn read(files: &Files, path: &Path, wanted: Wanted) -> Result<Mesh> {
    let bytes = files.read(path, MAX_DATA_BYTES).map_err(|e| Error::file(path, e))?;
    parse(&bytes, wanted, files.memory())
        .map_err(|(position, message)| Error::scene(&Span { file: path.into(), position }, message))
}

fn parse(bytes: &[u8], wanted: Wanted, memory: &Memory) -> Parsed<Mesh> {
    let header = header::parse(bytes)?;
    memory.check(header.mesh_bytes()).map_err(|m| (Position::Whole, format!("the mesh {m}")))?;
    body::parse(bytes, &header, wanted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    const PLAIN: Wanted = Wanted { uvs: false, attributes: false };
    const UVS: Wanted = Wanted { uvs: true, ..PLAIN };

    fn parse(bytes: &[u8], wanted: Wanted) -> Parsed<Mesh> {
        super::parse(bytes, wanted, &Memory::default())
    }

    const HEADER: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty float z\nproperty uchar red\n\
        element tag 1\nproperty list uchar short data\nproperty int n\n\
        element face 2\nproperty uchar flag\nproperty list uchar int vertex_indices\nend_header\n";
    const BODY: &str = "0 0 0 1\n1 0 0 2\n1 1 0.5 3\n0 1e0 0 4\n2 7 -8 9\n0 3 0 1 2\n1 4 0 1 2 3\n";

    fn ascii(header: &str, body: &str) -> Vec<u8> {
        format!("ply\nformat ascii 1.0\ncomment x\n{header}{body}").into_bytes()
    }

    /// The same file in binary; `big` for big endian.
    fn binary(big: bool) -> Vec<u8> {
        let name = if big { "big" } else { "little" };
        let mut out =
            format!("ply\r\nformat binary_{name}_endian 1.0\r\n{}", HEADER.replace('\n', "\r\n")).into_bytes();
        let mut put = |mut bytes: Vec<u8>| {
            if big {
                bytes.reverse();
            }
            out.extend(bytes);
        };
        for (i, (x, y, z)) in [(0, 0, 0.0), (1, 0, 0.0), (1, 1, 0.5), (0, 1, 0.0)].into_iter().enumerate() {
            put((x as f32).to_le_bytes().into());
            put((y as f64).to_le_bytes().into());
            put((z as f32).to_le_bytes().into());
            put(vec![i as u8 + 1]);
        }
        put(vec![2]);
        put(7_i16.to_le_bytes().into());
        put((-8_i16).to_le_bytes().into());
        put(9_i32.to_le_bytes().into());
        for (flag, face) in [(0, &[0, 1, 2][..]), (1, &[0, 1, 2, 3])] {
            put(vec![flag]);
            put(vec![face.len() as u8]);
            for i in face {
                put(i32::to_le_bytes(*i).into());
            }
        }
        out
    }

    #[test]
    fn all_formats_are_one_mesh() {
        let mesh = parse(&ascii(HEADER, BODY), PLAIN).unwrap();
        assert_eq!(mesh.positions[2], DVec3::new(1.0, 1.0, 0.5));
        assert_eq!(mesh.faces, [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);
        assert!(mesh.normals.is_empty());
        assert_eq!(parse(&binary(false), PLAIN).unwrap(), mesh);
        assert_eq!(parse(&binary(true), PLAIN).unwrap(), mesh);
    }

    #[test]
    fn truncated_files_are_errors_wherever_they_end() {
        for whole in [ascii(HEADER, BODY), binary(false), binary(true)] {
            // The last bytes of an ascii file are its last number and a line end.
            for end in 0..whole.len() - 2 {
                assert!(parse(&whole[..end], PLAIN).is_err(), "{end} of {}", whole.len());
            }
        }
    }

    #[test]
    fn faces_may_stand_before_vertices() {
        let vertex = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
        let face = "element face 1\nproperty list uchar int vertex_indices\n";
        let (points, faces) = ("0 0 0\n1 0 0\n1 1 0\n0 1 0\n", "4 0 1 2 3\n");
        let usual = parse(&ascii(&format!("{vertex}{face}end_header\n"), &format!("{points}{faces}")), PLAIN).unwrap();
        let swapped =
            parse(&ascii(&format!("{face}{vertex}end_header\n"), &format!("{faces}{points}")), PLAIN).unwrap();
        assert_eq!(usual, swapped);
        let beyond = ascii(&format!("{face}{vertex}end_header\n"), &format!("4 0 1 2 4\n{points}"));
        assert!(parse(&beyond, PLAIN).unwrap_err().1.contains("out of range; the file has 4"));
        assert!(parse(&ascii(&format!("{face}end_header\n"), faces), PLAIN).unwrap_err().1.contains("the file has 0"));
    }

    #[test]
    fn texture_coordinates_are_read_when_asked_for() {
        let header = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float s\n\
            property float t\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let file = ascii(header, "0 0 0 0.5 1\n1 0 0 0 1\n1 1 0 0 0\n3 0 1 2\n");
        assert_eq!(parse(&file, UVS).unwrap().uvs[0], glam::DVec2::new(0.5, 1.0));
        assert!(parse(&file, PLAIN).unwrap().uvs.is_empty());
    }

    #[test]
    fn normals_are_read() {
        let header = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
            property float ny\nproperty float nz\nelement face 1\nproperty list uchar uint vertex_index\nend_header\n";
        let mesh = parse(&ascii(header, "0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n3 0 1 2\n"), PLAIN).unwrap();
        assert_eq!(mesh.normals, [DVec3::Z; 3]);
    }

    #[test]
    fn faults_name_their_place() {
        let lines = HEADER.lines().count() as u32 + 3;
        let of = |body: &str| parse(&ascii(HEADER, body), PLAIN).unwrap_err();
        let nan = of(&BODY.replace("1 1 0.5", "1 nan 0.5"));
        assert_eq!(nan, (Position::Line(lines + 3), "'nan' is not a finite number".into()));
        let range = of(&BODY.replace("4 0 1 2 3", "4 0 1 2 4"));
        assert_eq!(range, (Position::Line(lines + 7), "the vertex index 4 is out of range; the file has 4".into()));
        assert!(of(&BODY.replace("4 0 1 2 3", "2 0 1")).1.contains("at least three"));
        assert!(of(&BODY.replace("4 0 1 2 3", "4 0 1 2 -1")).1.contains("out of range"));
        assert!(of(&BODY.replace("4 0 1 2 3", "4 0 1.5 2 3")).1.contains("'1.5' is not a vertex index"));
        assert!(of(&BODY.replace("4 0 1 2 3", "3.7 0 1 2")).1.contains("'3.7' is not the length"));
        let huge = HEADER.replace("vertex 4", "vertex 4000000000");
        assert!(parse(&ascii(&huge, BODY), PLAIN).unwrap_err().1.contains("too short"));
        let bytes = binary(false);
        let mut broken = bytes.clone();
        broken[bytes.len() - 4..].copy_from_slice(&9_i32.to_le_bytes());
        let (at, message) = parse(&broken, PLAIN).unwrap_err();
        assert!(matches!(at, Position::Byte(_)) && message.contains("out of range"), "{message}");
    }

    #[test]
    fn broken_headers_are_errors() {
        for bad in [
            "",
            "plx\n",
            "ply\n",
            "ply\nformat ascii 1.0\n",
            "ply\nformat utf8 1.0\nend_header\n",
            "ply\nformat ascii 1.0\nend_header\n",
            "ply\nformat ascii 1.0\nproperty float x\nend_header\n",
            "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement vertex 1\nend_header\n",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n0",
        ] {
            assert!(parse(bad.as_bytes(), PLAIN).is_err(), "{bad}");
        }
    }
}
