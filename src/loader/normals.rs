//! Vertex normals of meshes that have none: the mean of the faces' normals, weighted by their angles at the vertex.
//!
//! G. Thürmer and C. A. Wüthrich, Computing Vertex Normals from Polygonal Facets, Journal of Graphics Tools 3(1), 1998.
//! Mitsuba computes them after the transformation to world space, and so do we: angles do not survive a scale that is
//! not uniform. The result is then brought back, so that the description's normals are in object space like its
//! positions.

use glam::{DMat3, DVec3};

/// Relative departure from a rotation with uniform scale that does not matter to a normal.
const SIMILARITY_TOLERANCE: f64 = 1e-9;

/// The matrix in whose space to compute the normals of a mesh with this linear transformation to world space: the
/// identity wherever that is the same.
pub(crate) fn frame(linear: DMat3) -> DMat3 {
    let largest = linear.to_cols_array().into_iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let m = linear * (1.0 / largest);
    let gram = m.transpose() * m;
    let is_similar = gram.abs_diff_eq(DMat3::IDENTITY * gram.x_axis.x, SIMILARITY_TOLERANCE);
    if is_similar && m.determinant() > 0.0 || !m.is_finite() { DMat3::IDENTITY } else { m }
}

/// Normals in object space, one a vertex, of unit length, such that the inverse transpose of `linear` makes of them
/// what the faces have in world space.
pub(crate) fn compute(positions: &[DVec3], faces: &[[u32; 3]], linear: DMat3) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for face in faces {
        let corners = face.map(|i| linear * positions[i as usize]);
        let Some(normal) = face_normal(corners) else { continue };
        for j in 0..3 {
            let (a, b) = (corners[(j + 1) % 3] - corners[j], corners[(j + 2) % 3] - corners[j]);
            sums[face[j] as usize] += normal * angle_between(a, b);
        }
    }
    let back = linear.transpose();
    for sum in &mut sums {
        // A vertex of no face, or of faces that cancel, gets an arbitrary normal: Mitsuba's.
        let normal = sum.try_normalize().unwrap_or(DVec3::X);
        *sum = (back * normal).normalize_or(DVec3::X);
    }
    sums
}

/// Unit normal of a triangle; `None` where it has no area.
pub(super) fn face_normal([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let (u, v) = (scaled(b - a), scaled(c - a));
    u.cross(v).try_normalize()
}

fn angle_between(a: DVec3, b: DVec3) -> f64 {
    let (a, b) = (scaled(a), scaled(b));
    // Exact for small angles as well as large, unlike the arc cosine.
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// The same direction with the largest component 1, so that no product over- or underflows.
fn scaled(v: DVec3) -> DVec3 {
    let largest = v.abs().max_element();
    if largest > 0.0 { v / largest } else { v }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest difference from Mitsuba 3.9.1, which computes in single precision.
    const TOLERANCE: f64 = 2e-7;

    const QUAD: [DVec3; 4] =
        [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.3_f32 as f64), DVec3::new(0.0, 1.0, 0.1_f32 as f64)];
    const FACES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    fn assert_world(linear: DMat3, want: [[f64; 3]; 4]) {
        let frame = frame(linear);
        let to_world = linear.inverse().transpose();
        for (n, w) in compute(&QUAD, &FACES, frame).into_iter().zip(want) {
            let n = (to_world * n).normalize();
            assert!(n.abs_diff_eq(DVec3::from(w), TOLERANCE), "{n}, Mitsuba has {w:?}");
        }
    }

    #[test]
    fn normals_are_mitsuba_s() {
        let want = [
            [-0.09701602905988693, -0.19573765993118286, 0.9758455753326416],
            [0.0, -0.2873478829860687, 0.9578262567520142],
            [-0.09880682080984116, -0.19399721920490265, 0.9760134220123291],
            [-0.1951800435781479, -0.09759001433849335, 0.9759001135826111],
        ];
        assert_world(DMat3::IDENTITY, want);
        assert_world(DMat3::IDENTITY * 1e-90, want);
    }

    #[test]
    fn normals_are_mitsuba_s_under_a_scale() {
        assert_world(
            DMat3::from_diagonal(DVec3::new(3.0, 0.5, 1.0)),
            [
                [-0.057689376175403595, -0.2359015792608261, 0.9700629711151123],
                [0.0, -0.5144957900047302, 0.8574928641319275],
                [-0.007111954502761364, -0.482761949300766, 0.8757227659225464],
                [-0.06523281335830688, -0.19569842517375946, 0.9784921407699585],
            ],
        );
    }

    #[test]
    fn normals_are_mitsuba_s_under_a_mirror() {
        assert_world(
            DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)),
            [
                [-0.09701602905988693, 0.19573765993118286, -0.9758455753326416],
                [0.0, 0.2873478829860687, -0.9578262567520142],
                [-0.09880682080984116, 0.19399721920490265, -0.9760134220123291],
                [-0.1951800435781479, 0.09759001433849335, -0.9759001135826111],
            ],
        );
    }

    #[test]
    fn similar_frames_are_one() {
        assert_eq!(frame(DMat3::IDENTITY * 7.0), DMat3::IDENTITY);
        assert_eq!(frame(DMat3::from_rotation_x(1.0) * 0.1), DMat3::IDENTITY);
        assert_ne!(frame(DMat3::from_diagonal(DVec3::new(1.0, 2.0, 1.0))), DMat3::IDENTITY);
    }

    #[test]
    fn vertices_without_faces_get_a_normal() {
        assert_eq!(compute(&QUAD, &[[0, 1, 1]], DMat3::IDENTITY), [DVec3::X; 4]);
    }
}
