//! Wavefront OBJ meshes, parsed by `tobj`.
//!
//! tobj makes one mesh of each group and material, counts vertices apart in each, and tells no lines. So it is fed only
//! the statements that matter (`v`, `vn`, `vt`, `f`), which makes one mesh with a vertex for every combination of
//! position, texture coordinate and normal, as in Mitsuba; and where it fails, the file is read once more to find the
//! line.

use super::source::MAX_DATA_BYTES;
use crate::description::Mesh;
use crate::error::{Error, Position, Result, Span};
use crate::files::Files;
use glam::{DVec2, DVec3};
use std::path::Path;

/// Reads a mesh; its normals are as many as its positions, none, or, where only some vertices have one, fewer. So are its
/// texture coordinates if `uvs` asks for them; without, they are not even parsed.
pub(crate) fn read(files: &Files, path: &Path, uvs: bool) -> Result<Mesh> {
    read_with_materials(files, path, uvs).map(|(mesh, _)| mesh)
}

/// What a file says of the materials of its mesh.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Materials {
    /// The material libraries that it names.
    pub(crate) libraries: Vec<String>,
    /// The materials that it names, each with the number of its first triangle; each holds until the next.
    pub(crate) uses: Vec<(usize, String)>,
}

/// Reads a mesh and what it says of materials.
pub(crate) fn read_with_materials(files: &Files, path: &Path, uvs: bool) -> Result<(Mesh, Materials)> {
    let bytes = files.read(path, MAX_DATA_BYTES).map_err(|e| Error::file(path, e))?;
    parse(&bytes, uvs).map_err(|(line, message)| {
        let position = line.map_or(Position::Whole, |line| Position::Line(u32::try_from(line).unwrap_or(u32::MAX)));
        Error::scene(&Span { file: path.into(), position }, message)
    })
}

/// A 1-based line, where known, and what is wrong there.
type Fault = (Option<usize>, String);

const OPTIONS: tobj::LoadOptions = tobj::LoadOptions {
    single_index: true,
    triangulate: true,
    // Neither occurs after the filter.
    ignore_points: true,
    ignore_lines: true,
};

fn parse(bytes: &[u8], uvs: bool) -> std::result::Result<(Mesh, Materials), Fault> {
    let (filtered, materials) = filter(bytes, uvs)?;
    let no_materials = |_: &Path| Err(tobj::LoadError::GenericFailure);
    let loaded = tobj::load_obj_buf(&mut filtered.as_slice(), &OPTIONS, no_materials);
    let fault = |otherwise: String| find_fault(bytes, uvs).unwrap_or((None, otherwise));
    let (mut models, _) = loaded.map_err(|e| fault(e.to_string()))?;
    let Some(model) = models.pop().filter(|m| models.is_empty() && !m.mesh.indices.is_empty()) else {
        return Err((None, "the mesh has no faces".into()));
    };
    drop(filtered);
    let vectors = |flat: &[f64]| -> Vec<DVec3> { flat.chunks_exact(3).map(DVec3::from_slice).collect() };
    let mesh = Mesh {
        positions: vectors(&model.mesh.positions),
        normals: vectors(&model.mesh.normals),
        uvs: model.mesh.texcoords.chunks_exact(2).filter(|_| uvs).map(DVec2::from_slice).collect(),
        faces: model.mesh.indices.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect(),
        ..Mesh::default()
    };
    let finite = mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite());
    if finite && mesh.uvs.iter().all(|v| v.is_finite()) {
        Ok((mesh, materials))
    } else {
        Err(fault("a coordinate is not a finite number".into()))
    }
}

/// The statements that matter to the mesh, one a line, and what the others say of materials.
fn filter(bytes: &[u8], uvs: bool) -> std::result::Result<(Vec<u8>, Materials), Fault> {
    let mut out = Vec::with_capacity(bytes.len());
    let (mut materials, mut triangles, mut so_far) = (Materials::default(), 0, [0_i64; 3]);
    let mut lines = Lines::new(bytes);
    while let Some((line, statement)) = lines.next_statement() {
        let mut words = words(&statement);
        let (keyword, most) = match words.next() {
            // What follows the three coordinates (a weight, a colour) means nothing to us.
            Some(keyword @ (b"v" | b"vn")) => (keyword, 3),
            Some(keyword @ b"vt") if uvs => (keyword, 2),
            Some(b"vt") => {
                // Only their number is needed.
                so_far[TEXTURE_COORDINATE] += 1;
                out.extend_from_slice(b"vt 0 0\n");
                continue;
            }
            Some(keyword @ b"f") => (keyword, usize::MAX),
            Some(keyword @ (b"usemtl" | b"mtllib")) => {
                let name = String::from_utf8_lossy(&statement[keyword.len()..]).trim().to_owned();
                match keyword {
                    b"usemtl" => materials.uses.push((triangles, name)),
                    _ => materials.libraries.push(name),
                }
                continue;
            }
            _ => continue,
        };
        out.extend_from_slice(keyword);
        if keyword == b"f" {
            let mut corners = words.clone().take_while(|word| !word.starts_with(b"#"));
            let from_end = corners.find_map(|word| unbounded_fault(word, so_far));
            if let Some(message) = from_end {
                return Err(find_fault(bytes, uvs).unwrap_or((Some(line), message)));
            }
        } else if let Some(kind) = list_of(keyword) {
            so_far[kind] += 1;
        }
        let mut count = 0;
        for word in words.take(most).take_while(|word| !word.starts_with(b"#")) {
            out.push(b' ');
            out.extend_from_slice(word);
            count += 1;
        }
        out.push(b'\n');
        if count < most.min(3) {
            let what = match keyword {
                b"f" => "a face needs at least three vertices",
                b"vt" => "expected two numbers",
                _ => "expected three numbers",
            };
            return Err((Some(line), format!("{what}, not {count}")));
        }
        if keyword == b"f" {
            triangles += count - 2;
        }
    }
    Ok((out, materials))
}

/// The first line that is wrong.
fn find_fault(bytes: &[u8], uvs: bool) -> Option<Fault> {
    let mut totals = [0_i64; 3];
    let mut lines = Lines::new(bytes);
    while let Some((_, statement)) = lines.next_statement() {
        if let Some(kind) = words(&statement).next().and_then(list_of) {
            totals[kind] += 1;
        }
    }
    let mut so_far = [0_i64; 3];
    let mut lines = Lines::new(bytes);
    while let Some((line, statement)) = lines.next_statement() {
        let mut words = words(&statement).map(String::from_utf8_lossy);
        let keyword = words.next()?;
        let fault = match (list_of(keyword.as_bytes()), &*keyword) {
            (Some(kind), _) => {
                so_far[kind] += 1;
                let numbers = if kind != TEXTURE_COORDINATE { 3 } else { 2 * usize::from(uvs) };
                words.take(numbers).find_map(|word| number_fault(&word))
            }
            (None, "f") => words.find_map(|word| corner_fault(&word, so_far, totals)),
            _ => None,
        };
        if let Some(message) = fault {
            return Some((Some(line), message));
        }
    }
    None
}

/// Place of texture coordinates among the three indices of a corner.
const TEXTURE_COORDINATE: usize = 1;

/// Which of the three indices of a corner counts the statements of this keyword.
fn list_of(keyword: &[u8]) -> Option<usize> {
    [b"v".as_slice(), b"vt", b"vn"].iter().position(|k| *k == keyword)
}

fn number_fault(word: &str) -> Option<String> {
    match word.parse::<f64>() {
        Ok(value) if value.is_finite() => None,
        Ok(_) => Some(format!("'{word}' is not a finite number")),
        Err(_) => Some(format!("'{word}' is not a number")),
    }
}

fn corner_fault(word: &str, so_far: [i64; 3], totals: [i64; 3]) -> Option<String> {
    let parts: Vec<&str> = word.split('/').collect();
    if parts.len() > 3 || parts[0].is_empty() {
        return Some(format!("'{word}' is not of the form v, v/vt, v//vn or v/vt/vn"));
    }
    const NAMES: [&str; 3] = ["vertex", "texture coordinate", "normal"];
    for (kind, part) in parts.into_iter().enumerate().filter(|(_, part)| !part.is_empty()) {
        let Ok(index) = part.parse::<i64>() else {
            return Some(format!("'{part}' is not an index"));
        };
        let fits = if index < 0 { index >= -so_far[kind] } else { index >= 1 && index <= totals[kind] };
        if !fits {
            let (name, total) = (NAMES[kind], totals[kind]);
            return Some(format!("the {name} index {index} is out of range; the file has {total}"));
        }
    }
    None
}

/// What is wrong with a corner whose indices the parser would take modulo 2⁶⁴: those that count from the end, and very large ones; or
/// which it might see as several.
fn unbounded_fault(word: &[u8], so_far: [i64; 3]) -> Option<String> {
    /// Digits of an index that all lists together cannot reach.
    const MANY: usize = 11;
    let is_unbounded = |part: &[u8]| part.starts_with(b"-") || part.len() >= MANY;
    let has_some = !word.is_ascii() || word.split(|&c| c == b'/').any(is_unbounded);
    has_some.then(|| corner_fault(&String::from_utf8_lossy(word), so_far, [i64::from(u32::MAX); 3])).flatten()
}

/// The words of a statement, as the parser separates them, but for spaces that are not ASCII.
fn words(statement: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    const VERTICAL_TAB: u8 = 0x0b;
    statement.split(|byte| byte.is_ascii_whitespace() || *byte == VERTICAL_TAB).filter(|word| !word.is_empty())
}

/// The lines of a file; a backslash at the end of one joins the next to it.
struct Lines<'a> {
    rest: Option<&'a [u8]>,
    line: usize,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { rest: Some(bytes), line: 0 }
    }

    fn next_line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest.filter(|rest| !rest.is_empty())?;
        self.line += 1;
        let end = rest.iter().position(|&b| b == b'\n');
        self.rest = end.map(|end| &rest[end + 1..]);
        Some(rest[..end.unwrap_or(rest.len())].trim_ascii())
    }

    /// The next line that is not empty, and its number.
    fn next_statement(&mut self) -> Option<(usize, std::borrow::Cow<'a, [u8]>)> {
        loop {
            let first = self.next_line()?;
            let line = self.line;
            let Some(start) = first.strip_suffix(b"\\") else {
                if first.is_empty() {
                    continue;
                }
                return Some((line, first.into()));
            };
            let mut joined = start.to_vec();
            while let Some(next) = self.next_line() {
                joined.push(b' ');
                let more = next.strip_suffix(b"\\");
                joined.extend_from_slice(more.unwrap_or(next));
                if more.is_none() {
                    break;
                }
            }
            return Some((line, joined.into()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(text: &str) -> Fault {
        parse(text.as_bytes(), false).unwrap_err()
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn polygons_are_fans_and_groups_one_mesh() {
        let text = b"# \xe9\no a\nv 0 0 0\nv 1 0 0 1 0.5 0.5 0.5\nv 2 1 0\nv 1 2 0\nv 0 1 0\ng x\nf 1 2 3 4 \\\n 5\ng y\nf -5 -4 -3 # c\n";
        let mesh = parse(text, false).unwrap().0;
        assert_eq!(mesh.positions.len(), 5);
        assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 2]]);
        assert!(mesh.normals.is_empty());
    }

    #[test]
    fn a_vertex_is_a_combination_of_indices() {
        let text = format!("{SQUARE}vt 0 0\nvt 1 1\nvn 0 0 2\nf 1/1/1 2/1/1 3/1/1\nf 1/2/1 3/1/1 4/1/1\n");
        let mesh = parse(text.as_bytes(), false).unwrap().0;
        assert_eq!(mesh.positions.len(), 5);
        assert_eq!(mesh.normals, [DVec3::Z * 2.0; 5]);
    }

    #[test]
    fn texture_coordinates_are_read_when_asked_for() {
        let text = format!("{SQUARE}vt 0 0.5 7\nvt 1 1e-1\nf 1/1 2/2 3/1\nf 1/2 3/1 4/2\n");
        let mesh = parse(text.as_bytes(), true).unwrap().0;
        assert_eq!((mesh.positions.len(), mesh.uvs.len()), (5, 5));
        assert_eq!(mesh.uvs[1], DVec2::new(1.0, 0.1));
        assert!(parse(text.as_bytes(), false).unwrap().0.uvs.is_empty());
        let bad = text.replace("1e-1", "x");
        assert_eq!(parse(bad.as_bytes(), true).unwrap_err().0, Some(6));
        assert!(parse(bad.as_bytes(), false).is_ok(), "nobody asked");
        let short = text.replace(" 1e-1", "");
        assert_eq!(parse(short.as_bytes(), true).unwrap_err(), (Some(6), "expected two numbers, not 1".into()));
    }

    #[test]
    fn equal_positions_stay_apart() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0.3\nv 0 0 0\nv 1 1 0.3\nv 0 1 0\nf 1 2 3\nf 4 5 6\n";
        assert_eq!(parse(text.as_bytes(), false).unwrap().0.positions.len(), 6);
    }

    #[test]
    fn numbers_are_double_precision() {
        let mesh = parse(b"v 1000000.0001 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n", false).unwrap().0;
        assert_eq!(mesh.positions[0].x, 1000000.0001);
    }

    /// The parser takes them modulo 2⁶⁴: -6148914691236517205 would be the normal 1.
    #[test]
    fn indices_that_wrap_are_out_of_range() {
        for index in ["-6148914691236517205", "-2", "6148914691236517206", "-9223372036854775808"] {
            let (line, told) = fault(&format!("{SQUARE}vn 0 0 1\nf 1//1 2//1 3//{index} # of-a-very-long-word\n"));
            assert_eq!(line, Some(6), "{index}");
            assert_eq!(told, format!("the normal index {index} is out of range; the file has 1"));
        }
        let told = fault(&format!("{SQUARE}f -4 -3 -5\nv 0 0 1\n")).1;
        assert_eq!(told, "the vertex index -5 is out of range; the file has 5");
        assert!(parse(format!("{SQUARE}f -4 -3 00000000002 # of-a-very-long-word\n").as_bytes(), false).is_ok());
    }

    /// Else faces would belong to other materials.
    #[test]
    fn corners_are_counted_as_the_parser_does() {
        assert_eq!(
            fault(&format!("{SQUARE}f 1 2 \u{b}\n")),
            (Some(5), "a face needs at least three vertices, not 2".into())
        );
        assert_eq!(parse(format!("{SQUARE}f 1 2\u{b}3\n").as_bytes(), false).unwrap().0.faces, [[0, 1, 2]]);
        for space in ['\u{a0}', '\u{2003}'] {
            assert_eq!(fault(&format!("{SQUARE}f 1 2{space}4 3\n")).0, Some(5));
        }
    }

    #[test]
    fn materials_hold_until_the_next() {
        let text = format!("mtllib a b.mtl\n{SQUARE}f 1 2 3\nusemtl red\nf 1 2 3 4\ng x\nusemtl  blue \nf 1 3 4\n");
        let (mesh, materials) = parse(text.as_bytes(), false).unwrap();
        assert_eq!(mesh.faces.len(), 4);
        assert_eq!(materials.libraries, ["a b.mtl"]);
        assert_eq!(materials.uses, [(1, "red".to_owned()), (3, "blue".to_owned())]);
    }

    #[test]
    fn faults_name_their_line() {
        assert_eq!(fault("v 0 0 nan\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").0, Some(1));
        assert_eq!(fault("v 0 0 0\nv 1 0 1e999\nv 1 1 0\nf 1 2 3\n").0, Some(2));
        assert_eq!(
            fault(&format!("{SQUARE}f 1 2 5\n")),
            (Some(5), "the vertex index 5 is out of range; the file has 4".into())
        );
        assert_eq!(fault(&format!("{SQUARE}f 1 2 -5\n")).0, Some(5));
        assert_eq!(fault(&format!("{SQUARE}\n\nf 0 1 2\n")).0, Some(7));
        assert_eq!(fault(&format!("{SQUARE}f 1 2\n")), (Some(5), "a face needs at least three vertices, not 2".into()));
        assert_eq!(fault(&format!("{SQUARE}f 1//7 2 3\nvn 0 0 1\n")).0, Some(5));
        assert_eq!(fault("v 1 2\n"), (Some(1), "expected three numbers, not 2".into()));
        assert_eq!(fault("v 1 2 x\nv 1 0 0\nv 1 1 0\nf 1 2 3").0, Some(1));
        assert_eq!(fault(""), (None, "the mesh has no faces".into()));
        assert_eq!(fault(SQUARE).0, None);
        assert_eq!(fault(&format!("{SQUARE}f 1/1/1/1 2 3\n")).0, Some(5));
    }
}
