//! The steps of a `<transform>`, as matrices. Errors are messages; the caller knows the place.

use super::values::{numbers, vector};
use glam::{DAffine3, DMat3, DVec3};

type Made = Result<DAffine3, String>;

/// Largest departure from a unit length that a rotation axis may have before it is worth a warning.
const AXIS_TOLERANCE: f64 = 1e-6;

/// Whether a rotation about `axis` is one: its length is 1.
pub(crate) fn is_unit_axis(axis: DVec3) -> bool {
    (axis.length() - 1.0).abs() <= AXIS_TOLERANCE
}

/// A rotation by an angle in degrees, counter-clockwise seen from the tip of the axis.
///
/// The axis is used as it is: of another length than 1 it shears and scales, in Mitsuba 3.9 too, and the same file must
/// be the same scene.
pub(crate) fn rotate(axis: DVec3, degrees: f64) -> Made {
    if axis == DVec3::ZERO {
        return Err("the axis of a rotation must not be zero".into());
    }
    let angle = degrees.to_radians();
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let cross = DMat3::from_cols(axis.cross(DVec3::X), axis.cross(DVec3::Y), axis.cross(DVec3::Z));
    let outer = DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
    Ok(DAffine3::from_mat3(DMat3::IDENTITY * cos + cross * sin + outer * (1.0 - cos)))
}

/// From a frame at `origin` that looks along +z towards `target`, +y up, to the space of the arguments.
pub(crate) fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Made {
    let forward = (target - origin).normalize_or_zero();
    if forward == DVec3::ZERO {
        return Err("origin and target of <lookat> must differ".into());
    }
    let up = if up == DVec3::ZERO { forward.any_orthonormal_pair().0 } else { up };
    let left = up.cross(forward).normalize_or_zero();
    if left == DVec3::ZERO {
        return Err("the up vector of <lookat> must not be parallel to the viewing direction".into());
    }
    Ok(DAffine3::from_mat3_translation(DMat3::from_cols(left, forward.cross(left), forward), origin))
}

/// Nine or sixteen numbers, row by row.
pub(crate) fn matrix(text: &str) -> Made {
    const FULL: usize = 16;
    let m = numbers(text, FULL)?;
    let side = match m.len() {
        9 => 3,
        FULL => 4,
        n => {
            return Err(format!(
                "a matrix has 9 or 16 numbers, not {}",
                if n > FULL { "more".into() } else { n.to_string() }
            ));
        }
    };
    let column = |j: usize| DVec3::new(m[j], m[side + j], m[2 * side + j]);
    let linear = DMat3::from_cols(column(0), column(1), column(2));
    if side == 3 {
        return Ok(DAffine3::from_mat3(linear));
    }
    if m[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err("the last row of a matrix must be 0 0 0 1".into());
    }
    Ok(DAffine3::from_mat3_translation(linear, column(3)))
}

/// Three numbers, or zero where there is no text.
pub(crate) fn vector_or_zero(text: Option<&str>) -> Result<DVec3, String> {
    text.filter(|t| !t.is_empty()).map_or(Ok(DVec3::ZERO), vector)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest difference from what Mitsuba 3.9.1 prints (six digits).
    const TOLERANCE: f64 = 5e-6;

    fn assert_rows(m: DAffine3, rows: [[f64; 3]; 3]) {
        let linear = m.matrix3;
        for (i, row) in rows.into_iter().enumerate() {
            assert!(linear.row(i).abs_diff_eq(DVec3::from(row), TOLERANCE), "{linear}, Mitsuba has {rows:?}");
        }
    }

    #[test]
    fn rotations_are_mitsuba_s_even_about_long_axes() {
        let m = rotate(DVec3::new(1.0, 1.0, 0.0), 30.0).unwrap();
        assert_rows(m, [[1.0, 0.133975, 0.5], [0.133975, 1.0, -0.5], [-0.5, 0.5, 0.866025]]);
        let z = rotate(DVec3::Z, 90.0).unwrap();
        assert!(z.transform_point3(DVec3::X).abs_diff_eq(DVec3::Y, TOLERANCE));
        assert!(rotate(DVec3::ZERO, 1.0).is_err());
    }

    #[test]
    fn look_at_is_left_handed_in_x() {
        let m = look_at(DVec3::new(278.0, 273.0, -800.0), DVec3::new(278.0, 273.0, -799.0), DVec3::Y).unwrap();
        assert_rows(m, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        assert!(look_at(DVec3::ZERO, DVec3::ZERO, DVec3::Y).is_err());
        assert!(look_at(DVec3::ZERO, DVec3::Y, DVec3::Y).is_err());
        let no_up = look_at(DVec3::ZERO, DVec3::Y, DVec3::ZERO).unwrap();
        assert_rows(no_up, [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
    }

    #[test]
    fn matrices_are_row_by_row_and_affine() {
        let m = matrix("1 2 3 4  5 6 7 8  9 10 11 12  0 0 0 1").unwrap();
        assert_rows(m, [[1.0, 2.0, 3.0], [5.0, 6.0, 7.0], [9.0, 10.0, 11.0]]);
        assert_eq!(m.translation, DVec3::new(4.0, 8.0, 12.0));
        assert!(matrix("1 0 0 0 1 0 0 0 1").is_ok());
        assert!(matrix("1 0 0 0  0 1 0 0  0 0 1 0  0 0 1 1").unwrap_err().contains("last row"));
        assert!(matrix("1 2 3 4").is_err());
        assert!(matrix(&"1 ".repeat(17)).is_err());
    }
}
