//! Serialized meshes: Mitsuba's own binary format, versions 3 and 4.
//!
//! A file is a chain of meshes. Each is an identifier and a version, 16 bits each, and a zlib stream: flags; in version 4
//! a name that ends with a zero; the numbers of vertices and triangles, 64 bits each; then all positions, all normals, all
//! texture coordinates, all colours (what the flags say is there), and all triangles. After the last mesh stand the
//! offsets of all meshes (32 bits each in version 3, 64 in version 4) and their number. Everything is little endian.
//!
//! Nothing is allocated for what a file only says that it holds: memory grows with what the stream has given.
//!
//! Source of the format: documentation of the plugin `serialized` of Mitsuba 3, and that of Mitsuba 0.6 for version 3.

use super::source::MAX_DATA_BYTES;
use crate::description::Mesh;
use crate::error::{Error, Position, Result, Span};
use crate::files::{Files, Memory};
use flate2::bufread::ZlibDecoder;
use glam::{DVec2, DVec3};
use std::io::Read;
use std::path::Path;

/// The first two bytes of a mesh.
const IDENTIFIER: u16 = 0x041C;

/// Bytes of identifier and version.
const HEADER_BYTES: usize = 4;

/// Bytes of the number of meshes at the end of a file.
const COUNT_BYTES: usize = 4;

/// Most bytes that one byte of a zlib stream can hold: a repetition of 258 bytes takes two bits at least
/// (RFC 1951, section 3.2.5).
const MOST_INFLATION: u64 = 258 * 8 / 2;

/// Longest name of a mesh in bytes. Reason: it is skipped; what is longer is no name.
const MAX_NAME_BYTES: usize = 1 << 16;

/// Values that are read at a time.
const CHUNK_VALUES: usize = 12 << 10;

/// What the flags of a mesh say.
mod flags {
    pub(super) const NORMALS: u32 = 0x0001;
    pub(super) const UVS: u32 = 0x0002;
    pub(super) const COLOURS: u32 = 0x0008;
    pub(super) const SINGLE: u32 = 0x1000;
    pub(super) const DOUBLE: u32 = 0x2000;
}

/// Reads mesh `index`, counted from 0; its normals are as many as its positions, or none. So are its texture coordinates
/// if `uvs` asks for them.
pub(crate) fn read(files: &Files, path: &Path, index: u32, uvs: bool) -> Result<Mesh> {
    let bytes = files.read(path, MAX_DATA_BYTES).map_err(|e| Error::file(path, e))?;
    parse(&bytes, index, uvs, files.memory())
        .map_err(|(position, message)| Error::scene(&Span { file: path.into(), position }, message))
}

/// Where in the file, and what is wrong there.
type Fault = (Position, String);

fn parse(bytes: &[u8], index: u32, uvs: bool, memory: &Memory) -> std::result::Result<Mesh, Fault> {
    let version = version(bytes, 0)?;
    let start = if index == 0 { 0 } else { offset(bytes, version, index).map_err(|m| (Position::Whole, m))? };
    let at = Position::Byte(start as u64);
    let version = if index == 0 { version } else { self::version(bytes, start)? };
    mesh(&bytes[start + HEADER_BYTES..], version, uvs, memory).map_err(|message| (at, message))
}

/// The version of the mesh at an offset.
fn version(bytes: &[u8], start: usize) -> std::result::Result<u16, Fault> {
    let fault = |message: String| (Position::Byte(start as u64), message);
    let word = |at: usize| bytes.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    if word(start) != Some(IDENTIFIER) {
        return Err(fault("no serialized mesh begins here: it must begin with the bytes 1C 04".into()));
    }
    match word(start + 2) {
        Some(version @ (3 | 4)) => Ok(version),
        Some(other) => Err(fault(format!("the version {other} of the format is unknown; 3 and 4 are known"))),
        None => Err(fault("the file ends within the header of the mesh".into())),
    }
}

/// Where mesh `index` begins, by the table at the end.
fn offset(bytes: &[u8], version: u16, index: u32) -> std::result::Result<usize, String> {
    let end = bytes.len() - COUNT_BYTES;
    let count = u32::from_le_bytes(fixed(&bytes[end..]));
    if index >= count {
        return Err(format!("there is no mesh {index}: the file says that it has {count}, the first being 0"));
    }
    let size = if version == 3 { 4 } else { 8 };
    let from_end = u64::from(count - index) * size as u64;
    let entry = usize::try_from(from_end).ok().and_then(|n| end.checked_sub(n)).map(|at| &bytes[at..at + size]);
    let start = match entry {
        Some(entry) if size == 4 => Some(u64::from(u32::from_le_bytes(fixed(entry)))),
        Some(entry) => Some(u64::from_le_bytes(fixed(entry))),
        None => None,
    };
    let inside = |start: &usize| start.checked_add(HEADER_BYTES).is_some_and(|body| body <= end);
    start
        .and_then(|start| usize::try_from(start).ok())
        .filter(inside)
        .ok_or_else(|| format!("the table at the end says that mesh {index} lies outside the file"))
}

/// The first bytes of `bytes`, which are there.
fn fixed<const N: usize>(bytes: &[u8]) -> [u8; N] {
    std::array::from_fn(|i| bytes[i])
}

/// The mesh whose stream `packed` begins with.
fn mesh(packed: &[u8], version: u16, uvs: bool, memory: &Memory) -> std::result::Result<Mesh, String> {
    let mut stream = Stream { inflated: ZlibDecoder::new(packed), chunk: Vec::new() };
    let flags = u32::from_le_bytes(stream.bytes()?);
    let size = match (flags & flags::SINGLE != 0, flags & flags::DOUBLE != 0) {
        (true, false) => 4,
        (false, true) => 8,
        _ => return Err("the flags of the mesh must say either single or double precision".into()),
    };
    if version >= 4 {
        stream.skip_name()?;
    }
    let (vertices, faces) = (u64::from_le_bytes(stream.bytes()?), u64::from_le_bytes(stream.bytes()?));
    let has = |flag: u32| flags & flag != 0;
    let per_vertex =
        3 + 3 * u64::from(has(flags::NORMALS)) + 2 * u64::from(has(flags::UVS)) + 3 * u64::from(has(flags::COLOURS));
    let needed = u128::from(vertices) * u128::from(per_vertex * size as u64) + 12 * u128::from(faces);
    if needed > u128::from(packed.len() as u64) * u128::from(MOST_INFLATION) {
        return Err(format!("the file is too short for {vertices} vertices and {faces} triangles"));
    }
    // In double precision, and vectors that grow hold twice what is in them at times.
    let held = 2 * (u128::from(vertices) * u128::from(8 * per_vertex) + 12 * u128::from(faces));
    memory.check(u64::try_from(held).unwrap_or(u64::MAX)).map_err(|m| format!("the mesh {m}"))?;
    let Ok(total) = u32::try_from(vertices) else {
        return Err("the mesh has too many vertices".into());
    };
    if faces == 0 {
        return Err("the mesh has no faces".into());
    }
    let mut mesh = Mesh::default();
    stream.numbers(size, 3, vertices, |v| mesh.positions.push(DVec3::from_slice(v)), "position")?;
    if has(flags::NORMALS) {
        stream.numbers(size, 3, vertices, |v| mesh.normals.push(DVec3::from_slice(v)), "normal")?;
    }
    if has(flags::UVS) && uvs {
        stream.numbers(size, 2, vertices, |v| mesh.uvs.push(DVec2::from_slice(v)), "texture coordinate")?;
    } else if has(flags::UVS) {
        stream.skip(vertices * 2 * size as u64)?;
    }
    if has(flags::COLOURS) {
        stream.skip(vertices * 3 * size as u64)?;
    }
    stream.faces(faces, total, &mut mesh.faces)?;
    Ok(mesh)
}

/// An inflated stream.
struct Stream<'a> {
    inflated: ZlibDecoder<&'a [u8]>,
    chunk: Vec<u8>,
}

impl Stream<'_> {
    fn bytes<const N: usize>(&mut self) -> std::result::Result<[u8; N], String> {
        let mut bytes = [0; N];
        self.inflated.read_exact(&mut bytes).map_err(broken)?;
        Ok(bytes)
    }

    fn skip_name(&mut self) -> std::result::Result<(), String> {
        for _ in 0..MAX_NAME_BYTES {
            if self.bytes::<1>()? == [0] {
                return Ok(());
            }
        }
        Err("the name of the mesh has no end".into())
    }

    fn skip(&mut self, count: u64) -> std::result::Result<(), String> {
        let skipped = std::io::copy(&mut (&mut self.inflated).take(count), &mut std::io::sink()).map_err(broken)?;
        if skipped == count { Ok(()) } else { Err(broken(std::io::ErrorKind::UnexpectedEof.into())) }
    }

    /// Fills `chunk` with the next `count` bytes.
    fn fill(&mut self, count: usize) -> std::result::Result<(), String> {
        self.chunk.resize(count, 0);
        self.inflated.read_exact(&mut self.chunk).map_err(broken)
    }

    /// Hands `count` tuples of `width` numbers of `size` bytes to `take`; all must be finite.
    fn numbers(
        &mut self,
        size: usize,
        width: usize,
        count: u64,
        mut take: impl FnMut(&[f64]),
        what: &str,
    ) -> std::result::Result<(), String> {
        let mut left = count;
        let mut tuple = [0.0; 3];
        while left > 0 {
            let now = left.min((CHUNK_VALUES / width) as u64);
            self.fill(now as usize * width * size)?;
            for bytes in self.chunk.chunks_exact(width * size) {
                for (number, bytes) in tuple.iter_mut().zip(bytes.chunks_exact(size)) {
                    *number = match size {
                        4 => f64::from(f32::from_le_bytes(fixed(bytes))),
                        _ => f64::from_le_bytes(fixed(bytes)),
                    };
                }
                if let Some(bad) = tuple[..width].iter().find(|number| !number.is_finite()) {
                    return Err(format!("a {what} of the mesh is not finite, but {bad}"));
                }
                take(&tuple[..width]);
            }
            left -= now;
        }
        Ok(())
    }

    /// Reads triangles of a mesh of `total` vertices.
    fn faces(&mut self, count: u64, total: u32, into: &mut Vec<[u32; 3]>) -> std::result::Result<(), String> {
        let mut left = count;
        while left > 0 {
            let now = left.min((CHUNK_VALUES / 3) as u64);
            self.fill(now as usize * 12)?;
            for bytes in self.chunk.chunks_exact(12) {
                let face: [u32; 3] = std::array::from_fn(|i| u32::from_le_bytes(fixed(&bytes[4 * i..])));
                if let Some(bad) = face.into_iter().find(|&index| index >= total) {
                    return Err(format!("the vertex index {bad} is out of range; the mesh has {total}"));
                }
                into.push(face);
            }
            left -= now;
        }
        Ok(())
    }
}

/// What to say of a stream that cannot be read on.
#[allow(clippy::needless_pass_by_value, reason = "for map_err")]
fn broken(error: std::io::Error) -> String {
    if error.kind() == std::io::ErrorKind::UnexpectedEof {
        return "the data of the mesh end too early".into();
    }
    format!("the data of the mesh cannot be inflated: {error}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::ZlibEncoder;
    use std::io::Write;

    const SINGLE: u32 = flags::SINGLE;
    const DOUBLE: u32 = flags::DOUBLE;
    const ALL: u32 = flags::NORMALS | flags::UVS | flags::COLOURS;

    fn parse(bytes: &[u8], index: u32, uvs: bool) -> std::result::Result<Mesh, Fault> {
        super::parse(bytes, index, uvs, &Memory::default())
    }

    /// A square of two triangles at height z, before it is deflated.
    fn content(version: u16, flags: u32, z: f64) -> Vec<u8> {
        let mut out = flags.to_le_bytes().to_vec();
        if version == 4 {
            out.extend(b"square\0");
        }
        out.extend(4_u64.to_le_bytes());
        out.extend(2_u64.to_le_bytes());
        let mut put = |numbers: &[f64]| {
            for &number in numbers {
                match flags & SINGLE {
                    0 => out.extend(number.to_le_bytes()),
                    _ => out.extend((number as f32).to_le_bytes()),
                }
            }
        };
        put(&[0.0, 0.0, z, 1.0, 0.0, z, 1.0, 1.0, z, 0.0, 1.0, z]);
        if flags & flags::NORMALS != 0 {
            put(&[0.0, 0.0, 1.0].repeat(4));
        }
        if flags & flags::UVS != 0 {
            put(&[0.0, 0.0, 1.0, 0.0, 1.0, 0.25, 0.0, 0.25]);
        }
        if flags & flags::COLOURS != 0 {
            put(&[0.5; 12]);
        }
        for index in [0_u32, 1, 2, 0, 2, 3] {
            out.extend(index.to_le_bytes());
        }
        out
    }

    fn deflated(version: u16, content: &[u8]) -> Vec<u8> {
        let mut out = IDENTIFIER.to_le_bytes().to_vec();
        out.extend(version.to_le_bytes());
        let mut encoder = ZlibEncoder::new(out, Compression::fast());
        encoder.write_all(content).unwrap();
        encoder.finish().unwrap()
    }

    /// A file of these meshes, with the table at its end.
    fn file(version: u16, contents: &[Vec<u8>]) -> Vec<u8> {
        let (mut out, mut table) = (Vec::new(), Vec::new());
        for content in contents {
            match version {
                3 => table.extend((out.len() as u32).to_le_bytes()),
                _ => table.extend((out.len() as u64).to_le_bytes()),
            }
            out.extend(deflated(version, content));
        }
        out.extend(table);
        out.extend((contents.len() as u32).to_le_bytes());
        out
    }

    fn message(bytes: &[u8], index: u32) -> String {
        parse(bytes, index, true).unwrap_err().1
    }

    #[test]
    fn every_version_precision_and_index() {
        for version in [3, 4] {
            for flags in [SINGLE, DOUBLE, SINGLE | ALL, DOUBLE | ALL, DOUBLE | flags::UVS] {
                let contents: Vec<_> = [0.0, 1.0, 2.0].map(|z| content(version, flags, z)).into();
                let bytes = file(version, &contents);
                for (index, z) in [(0, 0.0), (1, 1.0), (2, 2.0)] {
                    let mesh = parse(&bytes, index, true).unwrap();
                    assert_eq!(mesh.positions[2], DVec3::new(1.0, 1.0, z));
                    assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3]]);
                    assert_eq!(mesh.normals, if flags & flags::NORMALS != 0 { vec![DVec3::Z; 4] } else { vec![] });
                    assert_eq!(mesh.uvs.len(), if flags & flags::UVS != 0 { 4 } else { 0 });
                    assert!(mesh.uvs.is_empty() || mesh.uvs[2] == DVec2::new(1.0, 0.25));
                    let without = parse(&bytes, index, false).unwrap();
                    assert_eq!(without, Mesh { uvs: vec![], ..mesh });
                }
                assert!(message(&bytes, 3).contains("there is no mesh 3: the file says that it has 3"));
            }
        }
    }

    #[test]
    fn truncated_files_are_errors_wherever_they_end() {
        for version in [3, 4] {
            let whole = file(version, &[content(version, SINGLE | ALL, 0.0), content(version, DOUBLE, 1.0)]);
            let first = deflated(version, &content(version, SINGLE | ALL, 0.0)).len();
            for end in 0..whole.len() {
                assert!(parse(&whole[..end], 1, true).is_err(), "{end} of {}", whole.len());
                // The end of the last block and the check of the sum are not needed.
                assert!(end >= first - 8 || parse(&whole[..end], 0, true).is_err(), "{end} of {}", whole.len());
            }
        }
    }

    /// Every byte of a file changed in several ways: an error or a mesh, never a panic.
    #[test]
    fn broken_files_do_not_panic() {
        let whole = file(4, &[content(4, SINGLE | ALL, 0.0), content(4, DOUBLE, 1.0)]);
        for at in 0..whole.len() {
            for change in [1, 0x80, 0xFF] {
                let mut broken = whole.clone();
                broken[at] ^= change;
                let _ = (parse(&broken, 0, true), parse(&broken, 1, true));
            }
        }
    }

    #[test]
    fn faults_are_named() {
        assert!(message(b"", 0).contains("no serialized mesh begins here"));
        assert!(message(b"ply\n", 7).contains("must begin with the bytes 1C 04"));
        assert!(message(&deflated(5, &[]), 0).contains("the version 5 of the format is unknown"));
        assert!(message(&[0x1C, 4, 4], 0).contains("the file ends within the header"));
        assert!(message(&deflated(4, &[0; 9]), 0).contains("must say either single or double precision"));
        assert!(message(&[0x1C, 4, 4, 0, 9, 9, 9, 9], 0).contains("the data of the mesh cannot be inflated"));
        assert!(message(&deflated(4, &SINGLE.to_le_bytes()), 0).contains("the data of the mesh end too early"));
        let endless = [&SINGLE.to_le_bytes()[..], &[b'a'; MAX_NAME_BYTES + 1]].concat();
        assert!(message(&deflated(4, &endless), 0).contains("the name of the mesh has no end"));
        let counts = |vertices: u64, faces: u64, padding: usize| {
            let head = [&SINGLE.to_le_bytes()[..], &vertices.to_le_bytes(), &faces.to_le_bytes()].concat();
            deflated(3, &[&head[..], &vec![0; padding]].concat())
        };
        assert!(message(&counts(u64::MAX, 1, 0), 0).contains("the file is too short for 18446744073709551615"));
        assert!(message(&counts(3, u64::MAX, 0), 0).contains("the file is too short for 3 vertices and 184467"));
        assert!(message(&counts(3, 0, 36), 0).contains("the mesh has no faces"));
        assert!(message(&counts(2, 1, 35), 0).contains("end too early"));
        let with = |flags: u32, at: usize, bytes: &[u8]| {
            let mut content = content(3, flags, 0.0);
            let at = if at == usize::MAX { content.len() - bytes.len() } else { at };
            content[at..at + bytes.len()].copy_from_slice(bytes);
            message(&deflated(3, &content), 0)
        };
        assert!(with(SINGLE, 20, &f32::NAN.to_le_bytes()).contains("a position of the mesh is not finite, but NaN"));
        assert!(
            with(DOUBLE, 20, &f64::INFINITY.to_le_bytes()).contains("a position of the mesh is not finite, but inf")
        );
        assert!(with(SINGLE | ALL, 20 + 48, &f32::NAN.to_le_bytes()).contains("a normal of the mesh is not finite"));
        assert!(
            with(SINGLE | ALL, 20 + 96, &f32::NAN.to_le_bytes()).contains("a texture coordinate of the mesh is not")
        );
        assert!(with(SINGLE, usize::MAX, &4_u32.to_le_bytes()).contains("index 4 is out of range; the mesh has 4"));
        let mut bytes = file(4, &[content(4, SINGLE, 0.0), content(4, SINGLE, 1.0)]);
        let table = bytes.len() - 12;
        bytes[table..table + 8].copy_from_slice(&u64::MAX.to_le_bytes());
        assert!(message(&bytes, 1).contains("the table at the end says that mesh 1 lies outside the file"));
        bytes[table..table + 8].copy_from_slice(&1_u64.to_le_bytes());
        assert!(message(&bytes, 1).contains("no serialized mesh begins here"));
    }
}
