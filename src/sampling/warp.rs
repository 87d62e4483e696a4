//! Maps from the unit square to directions and points, each beside its density and its inverse.
//!
//! Directions are unit vectors in a local frame whose z axis is the normal. Densities are per solid angle or per area
//! as their types say. Inverses give back the point of the square, up to rounding.

use super::pdf::SolidAnglePdf;
use crate::math::float::{ONE_MINUS_EPSILON, max, min, safe_sqrt};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// (sin x, cos x) by one library on every machine, so that pictures do not depend on the system's.
#[inline]
pub fn sin_cos(x: f32) -> (f32, f32) {
    libm::sincosf(x)
}

/// (sin x, cos x) for |x| ≤ π/4, to about an ulp, without branches: minimax polynomials in x², of relative error 2⁻²⁷ for
/// (sin x − x)/x³ and absolute error 2⁻³² for cos x (Remez exchange).
#[inline(always)]
fn sin_cos_octant(x: f32) -> (f32, f32) {
    const SIN: [f32; 3] = [-0.166_666_55, 8.332_101e-3, -1.950_393e-4];
    const COS: [f32; 3] = [0.041_666_654, -1.388_765_4e-3, 2.446_380_9e-5];
    let z = x * x;
    let s = x + x * z * (SIN[0] + z * (SIN[1] + z * SIN[2]));
    let c = 1.0 - 0.5 * z + z * z * (COS[0] + z * (COS[1] + z * COS[2]));
    (s, c)
}

/// (sin, cos) of `x` turns, an angle of 2π·x, for x from 0 to 2.
#[inline(always)]
pub fn sin_cos_turns(x: f32) -> (f32, f32) {
    /// A number so large that its last digit counts ones: a sum with it is rounded to an integer, which its last bits are.
    const ROUNDS: f32 = 12_582_912.0;
    let sum = 4.0 * x + ROUNDS;
    let quarter = sum.to_bits();
    // Exact: both are multiples of the last digit of x, and the difference is less.
    let (s, c) = sin_cos_octant(TAU * (x - 0.25 * (sum - ROUNDS)));
    let (s, c) = if quarter & 1 == 0 { (s, c) } else { (c, -s) };
    let sign = (quarter & 2) << 30;
    (f32::from_bits(s.to_bits() ^ sign), f32::from_bits(c.to_bits() ^ sign))
}

/// The angle of the point (x, y) in turns, between −½ and ½: the inverse of [`sin_cos_turns`], where (x, y) is (cos, sin). Within
/// 2⁻²⁴ of itself, and at the origin 0. The polynomial, on |t| ≤ tan π/8, is that of Cephes (Moshier 1989, *Methods and Programs for
/// Mathematical Functions*, `atanf`).
#[inline(always)]
pub fn turns(x: f32, y: f32) -> f32 {
    const ATAN: [f32; 4] = [-0.333_329_5, 0.199_777_1, -0.138_776_85, 8.053_744_5e-2];
    /// tan π/8.
    const OCTANT: f32 = 0.414_213_56;
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ay > ax;
    let (near, far) = if steep { (ax, ay) } else { (ay, ax) };
    // Of what is beyond half of the octant, the rest to its end: tan(a − π/4) = (tan a − 1)/(tan a + 1).
    let beyond = near > OCTANT * far;
    let (above, below) = if beyond { (near - far, near + far) } else { (near, far) };
    let t = if below > 0.0 { above / below } else { 0.0 };
    let z = t * t;
    let angle = t + t * z * (ATAN[0] + z * (ATAN[1] + z * (ATAN[2] + z * ATAN[3])));
    let octant = angle * (0.5 * FRAC_1_PI) + if beyond { 0.125 } else { 0.0 };
    let quarter = if steep { 0.25 - octant } else { octant };
    let half = if x < 0.0 { 0.5 - quarter } else { quarter };
    half.copysign(y)
}

/// Uniform on the unit disk; concentric squares become concentric circles (Shirley and Chiu 1997, *A Low Distortion Map
/// Between Disk and Square*).
#[inline(always)]
pub fn square_to_disk(u: Vec2) -> Vec2 {
    let (x, y) = (2.0 * u.x - 1.0, 2.0 * u.y - 1.0);
    let wide = x.abs() > y.abs();
    let (r, other) = if wide { (x, y) } else { (y, x) };
    // At the centre, where r is zero, any angle will do.
    let (s, c) = sin_cos_octant(FRAC_PI_4 * (other / if r == 0.0 { 1.0 } else { r }));
    let (along, across) = (r * c, r * s);
    if wide { Vec2::new(along, across) } else { Vec2::new(across, along) }
}

/// Density of [`square_to_disk`] per area of the disk.
#[inline]
pub fn square_to_disk_pdf() -> f32 {
    FRAC_1_PI
}

/// Inverse of [`square_to_disk`].
pub fn disk_to_square(p: Vec2) -> Vec2 {
    let r = p.length();
    let phi = libm::atan2f(p.y, p.x);
    // The sector of the square that the angle falls into: right, top, left, bottom.
    let (a, b) = if (-FRAC_PI_4..FRAC_PI_4).contains(&phi) {
        (r, phi * r / FRAC_PI_4)
    } else if (FRAC_PI_4..3.0 * FRAC_PI_4).contains(&phi) {
        (-(phi - FRAC_PI_2) * r / FRAC_PI_4, r)
    } else if !(-3.0 * FRAC_PI_4..3.0 * FRAC_PI_4).contains(&phi) {
        let from_left = if phi < 0.0 { phi + PI } else { phi - PI };
        (-r, -from_left * r / FRAC_PI_4)
    } else {
        ((phi + FRAC_PI_2) * r / FRAC_PI_4, -r)
    };
    Vec2::new(0.5 * (a + 1.0), 0.5 * (b + 1.0))
}

/// Cosine-weighted on the hemisphere around +z (Malley's method: the disk, raised).
#[inline(always)]
pub fn square_to_cosine_hemisphere(u: Vec2) -> Vec3 {
    let p = square_to_disk(u);
    p.extend(safe_sqrt(1.0 - p.length_squared()))
}

/// Density of [`square_to_cosine_hemisphere`]: cos θ / π above, 0 below.
#[inline(always)]
pub fn square_to_cosine_hemisphere_pdf(w: Vec3) -> SolidAnglePdf {
    SolidAnglePdf(max(w.z, 0.0) * FRAC_1_PI)
}

/// Inverse of [`square_to_cosine_hemisphere`].
pub fn cosine_hemisphere_to_square(w: Vec3) -> Vec2 {
    disk_to_square(w.truncate())
}

/// Uniform on the hemisphere around +z.
#[inline]
pub fn square_to_uniform_hemisphere(u: Vec2) -> Vec3 {
    // The area of a spherical cap is proportional to its height; the disk keeps the map of low distortion.
    let p = square_to_disk(u);
    let r2 = p.length_squared();
    (p * safe_sqrt(2.0 - r2)).extend(max(1.0 - r2, 0.0))
}

/// Density of [`square_to_uniform_hemisphere`]: 1 / 2π above, 0 below.
#[inline]
pub fn square_to_uniform_hemisphere_pdf(w: Vec3) -> SolidAnglePdf {
    SolidAnglePdf(if w.z >= 0.0 { 0.5 * FRAC_1_PI } else { 0.0 })
}

/// Inverse of [`square_to_uniform_hemisphere`].
pub fn uniform_hemisphere_to_square(w: Vec3) -> Vec2 {
    disk_to_square(w.truncate() / safe_sqrt(1.0 + w.z))
}

/// Uniform on the unit sphere.
#[inline]
pub fn square_to_uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    // 1 − z² without cancellation near the poles.
    let r = 2.0 * safe_sqrt(u.x * (1.0 - u.x));
    let (s, c) = sin_cos_turns(u.y);
    Vec3::new(r * c, r * s, z)
}

/// Density of [`square_to_uniform_sphere`]: 1 / 4π.
#[inline]
pub fn square_to_uniform_sphere_pdf() -> SolidAnglePdf {
    SolidAnglePdf(0.25 * FRAC_1_PI)
}

/// Inverse of [`square_to_uniform_sphere`].
pub fn uniform_sphere_to_square(w: Vec3) -> Vec2 {
    let turn = libm::atan2f(w.y, w.x) / TAU;
    Vec2::new(0.5 * (1.0 - w.z), if turn < 0.0 { min(turn + 1.0, ONE_MINUS_EPSILON) } else { turn })
}

/// Uniform in the cone of directions around +z within an angle θ, given 1 − cos θ (which keeps its digits where the
/// cone is narrow).
#[inline]
pub fn square_to_uniform_cone(u: Vec2, one_minus_cos: f32) -> Vec3 {
    // As the hemisphere, whose 1 − cos θ is 1.
    let p = square_to_disk(u);
    let h = p.length_squared() * one_minus_cos;
    (p * safe_sqrt(one_minus_cos * (2.0 - h))).extend(1.0 - h)
}

/// Density of [`square_to_uniform_cone`] inside the cone: 1 / (2π (1 − cos θ)).
#[inline]
pub fn square_to_uniform_cone_pdf(one_minus_cos: f32) -> SolidAnglePdf {
    SolidAnglePdf(1.0 / (TAU * one_minus_cos))
}

/// Inverse of [`square_to_uniform_cone`].
pub fn uniform_cone_to_square(w: Vec3, one_minus_cos: f32) -> Vec2 {
    disk_to_square(w.truncate() / safe_sqrt(one_minus_cos * (1.0 + w.z)))
}

/// Barycentric coordinates of a uniform point of a triangle (Heitz 2019, *A Low-Distortion Map Between Triangle and
/// Square*): the three weights, which add to one up to rounding.
#[inline(always)]
pub fn square_to_triangle(u: Vec2) -> Vec3 {
    let (a, b) = if u.y > u.x {
        let a = 0.5 * u.x;
        (a, u.y - a)
    } else {
        let b = 0.5 * u.y;
        (u.x - b, b)
    };
    Vec3::new(a, b, 1.0 - a - b)
}

/// Density of [`square_to_triangle`] per area of the plane of its first two coordinates, inside.
#[inline]
pub fn square_to_triangle_pdf() -> f32 {
    2.0
}

/// Inverse of [`square_to_triangle`].
pub fn triangle_to_square(b: Vec3) -> Vec2 {
    if b.x > b.y { Vec2::new(b.x + b.y, 2.0 * b.y) } else { Vec2::new(2.0 * b.x, b.x + b.y) }
}

/// A number in [0, 1) with density in proportion to the linear function that is `a` at 0 and `b` at 1; neither may be
/// negative, nor both zero, and the sum must be a normal number.
#[inline(always)]
pub fn unit_to_linear(u: f32, a: f32, b: f32) -> f32 {
    let a = a / (a + b);
    // With a + b = 1, the root of a·x + (b − a)·x²/2 = u/2 that is inside, in the form in which no digits cancel.
    let root = safe_sqrt(a * a + u * (1.0 - 2.0 * a));
    let x = if u > 0.0 { u / (a + root) } else { 0.0 };
    min(x, ONE_MINUS_EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_those_of_f64() {
        let mut worst = 0.0f64;
        for i in 0..200_000 {
            let angle = f64::from(i) * 1e-4 - 10.0;
            for size in [1e-30, 1.0, 3e20] {
                let (x, y) = ((size * libm::cos(angle)) as f32, (size * libm::sin(angle)) as f32);
                let exact = libm::atan2(f64::from(y), f64::from(x)) / std::f64::consts::TAU;
                worst = worst.max((f64::from(turns(x, y)) - exact).abs());
            }
        }
        assert!(worst < f64::from(UNIT_ROUNDOFF), "{worst}");
        assert_eq!([turns(0.0, 0.0), turns(1.0, 0.0), turns(0.0, 1.0), turns(-1.0, -0.0)], [0.0, 0.0, 0.25, -0.5]);
    }

    use crate::math::float::UNIT_ROUNDOFF;

    fn grid() -> impl Iterator<Item = Vec2> {
        let n = 101;
        (0..n * n).map(move |i| Vec2::new(((i % n) as f32 + 0.37) / n as f32, ((i / n) as f32 + 0.61) / n as f32))
    }

    fn assert_inverts(name: &str, tolerance: f32, f: impl Fn(Vec2) -> Vec2) {
        for u in grid() {
            let v = f(u);
            assert!((u - v).length() < tolerance, "{name}: {u} came back as {v}");
        }
    }

    #[test]
    fn warps_are_inverted_by_their_inverses() {
        // The bounds are rounding, magnified by the derivative of the inverse over the grid.
        assert_inverts("disk", 2e-6, |u| disk_to_square(square_to_disk(u)));
        assert_inverts("cosine hemisphere", 2e-6, |u| cosine_hemisphere_to_square(square_to_cosine_hemisphere(u)));
        assert_inverts("uniform hemisphere", 2e-6, |u| uniform_hemisphere_to_square(square_to_uniform_hemisphere(u)));
        assert_inverts("uniform sphere", 2e-6, |u| uniform_sphere_to_square(square_to_uniform_sphere(u)));
        for one_minus_cos in [1e-7, 0.1, 1.7] {
            // 1 − z of a wide cone keeps no more digits than z has.
            let f = |u| uniform_cone_to_square(square_to_uniform_cone(u, one_minus_cos), one_minus_cos);
            assert_inverts("cone", 4e-6, f);
        }
        assert_inverts("triangle", 1e-6, |u| triangle_to_square(square_to_triangle(u)));
    }

    #[test]
    fn directions_have_unit_length() {
        for u in grid() {
            for w in [
                square_to_cosine_hemisphere(u),
                square_to_uniform_hemisphere(u),
                square_to_uniform_sphere(u),
                square_to_uniform_cone(u, 1e-7),
                square_to_uniform_cone(u, 1.7),
            ] {
                assert!((w.length() - 1.0).abs() < 4.0 * f32::EPSILON, "{w}");
            }
        }
    }

    #[test]
    fn corners_of_the_square_stay_finite_and_inside() {
        for x in [0.0, 0.5, ONE_MINUS_EPSILON] {
            for y in [0.0, 0.5, ONE_MINUS_EPSILON] {
                let u = Vec2::new(x, y);
                assert!(square_to_cosine_hemisphere(u).z >= 0.0, "{u}");
                assert!(square_to_uniform_hemisphere(u).z >= 0.0, "{u}");
                assert!(square_to_triangle(u).min_element() >= 0.0, "{u}");
            }
        }
    }

    #[test]
    fn turns_are_angles() {
        for i in 0..=20_000_u16 {
            let x = f32::from(i) / 10_000.0;
            let (sin, cos) = sin_cos_turns(x);
            let angle = f64::from(x) * std::f64::consts::TAU;
            let error = (f64::from(sin) - angle.sin()).abs().max((f64::from(cos) - angle.cos()).abs());
            // An ulp of numbers up to 1, and the rounding of 2π.
            assert!(error < 2.0 * f64::from(UNIT_ROUNDOFF), "{x}: {sin}, {cos}");
        }
    }

    /// The integral up to what comes back is the part of the whole that was asked for; the bound is the rounding of what
    /// comes back, times a density of at most 2.
    #[test]
    fn linear_densities_are_inverted_to_the_resolution_of_f32() {
        for [a, b] in [[1.0, 1.0], [0.0, 1.0], [1.0, 0.0], [1.0, 5e4], [1e-30, 1e30], [2.0, 3.0], [1e-37, 2e-37]] {
            for i in 0..=1000u16 {
                let u = min(f32::from(i) / 1000.0, ONE_MINUS_EPSILON);
                let x = unit_to_linear(u, a, b);
                assert!((0.0..1.0).contains(&x), "{x}");
                let (a, b) = (f64::from(a), f64::from(b));
                let part = f64::from(x) * (a + 0.5 * (b - a) * f64::from(x)) / (0.5 * (a + b));
                assert!((part - f64::from(u)).abs() < 4.0 * f64::from(f32::EPSILON), "{a} {b} {u}: {x}, {part}");
            }
        }
    }
}
