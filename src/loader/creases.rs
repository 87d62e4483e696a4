//! Keeps the creases of a mesh that is shown by itself and has no normals: smooth normals would show a cube as a ball.
//!
//! A vertex on a crease is split into copies, one for each bundle of faces whose normals are near one another, so that
//! normals computed for the vertices do not mix faces across the crease. Scenes keep Mitsuba's normals, which do.

use super::normals::face_normal;
use glam::DVec3;

/// Cosine of the largest angle between the normals of faces that are one smooth surface. Reason: 40° keeps the edges of an
/// octahedron (70°) and of a hexagonal prism (60°), and smooths cylinders of nine sides or more.
const SMOOTH_COS: f64 = 0.766;

/// Splits vertices on creases. A face joins the first bundle whose first face is within the angle of it; so bundles are
/// few, their first faces being farther apart than that, and the time is linear.
pub(super) fn split(positions: &mut Vec<DVec3>, faces: &mut [[u32; 3]]) {
    const NONE: u32 = u32::MAX;
    // Of each copy of a vertex: the normal of the first face of its bundle, and the next copy of the same vertex.
    let mut bundles: Vec<(Option<DVec3>, u32)> = vec![(None, NONE); positions.len()];
    for face in faces {
        // A face without area does not shine; it may go with any bundle.
        let Some(normal) = face_normal(face.map(|i| positions[i as usize])) else { continue };
        for corner in face {
            loop {
                let (first, next) = &mut bundles[*corner as usize];
                if first.get_or_insert(normal).dot(normal) >= SMOOTH_COS {
                    break;
                }
                if *next == NONE {
                    let copy = positions.len() as u32;
                    *next = copy;
                    let position = positions[*corner as usize];
                    positions.push(position);
                    bundles.push((Some(normal), NONE));
                    *corner = copy;
                    break;
                }
                *corner = *next;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A prism of `n` sides around +y without ends, its faces turned outwards.
    fn prism(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let positions = (0..2 * n).map(|i| {
            let angle = std::f64::consts::TAU * f64::from(i / 2) / f64::from(n);
            DVec3::new(angle.cos(), f64::from(i % 2), angle.sin())
        });
        let sides = (0..n).map(|i| [2 * i, 2 * i + 1, (2 * i + 2) % (2 * n), (2 * i + 3) % (2 * n)]);
        (positions.collect(), sides.flat_map(|[a, b, c, d]| [[a, b, c], [c, b, d]]).collect())
    }

    #[test]
    fn creases_are_kept_and_round_sides_are_smooth() {
        for (sides, expected) in [(4, 16), (6, 24), (9, 18), (12, 24)] {
            let (mut positions, mut faces) = prism(sides);
            let before: Vec<_> = faces.iter().map(|f| f.map(|i| positions[i as usize])).collect();
            split(&mut positions, &mut faces);
            assert_eq!(positions.len(), expected, "{sides} sides");
            assert!(faces.iter().map(|f| f.map(|i| positions[i as usize])).eq(before), "points stay where they are");
        }
    }

    #[test]
    fn faces_without_area_split_nothing() {
        let (mut positions, mut faces) = (vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2], [0, 1, 1], [2, 2, 2]]);
        split(&mut positions, &mut faces);
        assert_eq!((positions.len(), faces[1]), (3, [0, 1, 1]));
    }
}
