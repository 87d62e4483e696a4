//! The mesh of the shape `cube`: four vertices of their own to every side, as Mitsuba 3 has them.

use crate::description::Mesh;
use glam::{DVec2, DVec3};

/// For each side its normal and the corners, so ordered that (0, 1, 2) and (3, 0, 2) are its triangles.
const SIDES: [([i8; 3], [[i8; 3]; 4]); 6] = [
    ([0, -1, 0], [[1, -1, -1], [1, -1, 1], [-1, -1, 1], [-1, -1, -1]]),
    ([0, 1, 0], [[1, 1, -1], [-1, 1, -1], [-1, 1, 1], [1, 1, 1]]),
    ([1, 0, 0], [[1, -1, -1], [1, 1, -1], [1, 1, 1], [1, -1, 1]]),
    ([0, 0, 1], [[1, -1, 1], [1, 1, 1], [-1, 1, 1], [-1, -1, 1]]),
    ([-1, 0, 0], [[-1, -1, 1], [-1, 1, 1], [-1, 1, -1], [-1, -1, -1]]),
    ([0, 0, -1], [[1, 1, -1], [1, -1, -1], [-1, -1, -1], [-1, 1, -1]]),
];

/// The cube [−1, 1]³; where it is to be mirrored, with its triangles turned round.
pub(crate) fn mesh(mirrored: bool) -> Mesh {
    let vector = |v: [i8; 3]| DVec3::from_array(v.map(f64::from));
    let triangle = |[a, b, c]: [u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
    Mesh {
        positions: SIDES.iter().flat_map(|(_, corners)| corners.map(vector)).collect(),
        normals: SIDES.iter().flat_map(|&(normal, _)| [vector(normal); 4]).collect(),
        uvs: [DVec2::Y, DVec2::ONE, DVec2::X, DVec2::ZERO].repeat(6),
        faces: (0..6).flat_map(|i| [[0, 1, 2], [3, 0, 2]].map(|t| triangle(t.map(|k| 4 * i + k)))).collect(),
        ..Mesh::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_and_seen_from_outside() {
        for mirrored in [false, true] {
            let mesh = mesh(mirrored);
            assert_eq!((mesh.positions.len(), mesh.normals.len(), mesh.faces.len()), (24, 24, 12));
            let mut volume = 0.0;
            for face in &mesh.faces {
                let [a, b, c] =
                    face.map(|i| mesh.positions[i as usize] * DVec3::new(if mirrored { -1.0 } else { 1.0 }, 1.0, 1.0));
                volume += a.dot(b.cross(c)) / 6.0;
                let normal = mesh.normals[face[0] as usize] * DVec3::new(if mirrored { -1.0 } else { 1.0 }, 1.0, 1.0);
                assert_eq!((b - a).cross(c - a).normalize(), normal);
            }
            assert!((volume - 8.0).abs() < 1e-12);
        }
    }
}
