//! Writes the mesh of `scenes/million`: a knotted, ribbed tube of 1,048,576 triangles, the same bytes on every machine.
//!
//! `cargo run --release --example million [-- FILE]`; FILE is by default where the scene looks for it.

use glam::{DVec3, dvec3};
use std::f64::consts::TAU;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Rings along the scene's tube, and vertices of a ring.
pub const SIZE: [u32; 2] = [4096, 128];

fn main() -> io::Result<()> {
    let beside_the_scene = || Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/million/mesh.ply");
    write_mesh(&std::env::args_os().nth(1).map_or_else(beside_the_scene, PathBuf::from), SIZE)
}

/// Writes the mesh with so many rings of so many vertices as binary PLY, with positions only.
///
/// # Errors
///
/// Those of creating and writing the file.
pub fn write_mesh(path: &Path, [rings, corners]: [u32; 2]) -> io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    let (vertices, faces) = (rings * corners, 2 * rings * corners);
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}")?;
    writeln!(out, "property float x\nproperty float y\nproperty float z")?;
    writeln!(out, "element face {faces}\nproperty list uchar int vertex_indices\nend_header")?;
    for ring in 0..rings {
        let u = TAU * f64::from(ring) / f64::from(rings);
        let frame = Frame::at(u);
        for corner in 0..corners {
            let v = TAU * f64::from(corner) / f64::from(corners);
            for coordinate in frame.vertex(u, v).as_vec3().to_array() {
                out.write_all(&coordinate.to_le_bytes())?;
            }
        }
    }
    for ring in 0..rings {
        for corner in 0..corners {
            let at = |ring, corner| ring % rings * corners + corner % corners;
            let (a, b) = (at(ring, corner), at(ring, corner + 1));
            let (c, d) = (at(ring + 1, corner), at(ring + 1, corner + 1));
            // Counter-clockwise from outside.
            for triangle in [[a, c, d], [a, d, b]] {
                out.write_all(&[3])?;
                for index in triangle {
                    out.write_all(&index.to_le_bytes())?;
                }
            }
        }
    }
    out.flush()
}

/// The tube's middle line, a (2, 3) torus knot, with two directions across it.
struct Frame {
    middle: DVec3,
    across: [DVec3; 2],
}

impl Frame {
    fn at(u: f64) -> Self {
        // By libm and not by the system's library, whose last bits differ between machines.
        let (sin2, cos2) = libm::sincos(2.0 * u);
        let (sin3, cos3) = libm::sincos(3.0 * u);
        let radius = 1.0 + 0.45 * cos3;
        let middle = dvec3(radius * cos2, radius * sin2, 0.45 * sin3);
        let along =
            dvec3(-1.35 * sin3 * cos2 - 2.0 * radius * sin2, -1.35 * sin3 * sin2 + 2.0 * radius * cos2, 1.35 * cos3);
        // Never zero: the knot goes round z all the time.
        let sideways = DVec3::Z.cross(along).normalize();
        Self { middle, across: [sideways, sideways.cross(along).normalize()] }
    }

    /// Ribs wind about the tube, with finer grain upon them: its valleys are some thirty times as deep as the
    /// 2·10⁻⁴ by which some renderers move the origins of rays, which then see a little over the next hill.
    fn vertex(&self, u: f64, v: f64) -> DVec3 {
        let ribs = libm::sin(40.0 * u + 3.0 * v);
        let grain = libm::sin(155.0 * u - 5.0 * v) * libm::sin(87.0 * u + 9.0 * v);
        let radius = 0.27 * (1.0 + 0.08 * ribs + 0.0125 * grain);
        let (sin, cos) = libm::sincos(v);
        self.middle + radius * (cos * self.across[0] + sin * self.across[1])
    }
}
