//! Which surfaces a point in space lies on, as far as rounding can tell: a light that hangs on a ceiling.

use super::Shape;
use super::offset::SurfacePoint;
use crate::math::bounds::Bounds;
use crate::math::float::UNIT_ROUNDOFF;
use glam::{DVec3, Vec3};

/// Half ulps of a primitive's largest coordinates that may lie between it and a point that was meant to lie on it: the
/// rounding of the primitive, that of a ray's end at the point, and that of the normal, over an extent of at most twice
/// these coordinates.
const ROUNDINGS: f32 = 4.0;

/// For each of `points` the surfaces of which rounding may put it on either side, as points there with the surfaces'
/// normals, to be offset from. In time proportional to the number of primitives, and to the logarithm of that of points.
pub fn touching(shapes: &[Shape], points: &[DVec3]) -> Vec<Vec<SurfacePoint>> {
    let mut found = vec![Vec::new(); points.len()];
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&i, &j| points[i].x.total_cmp(&points[j].x));
    if order.is_empty() {
        return found;
    }
    for shape in shapes {
        let far = |b: Bounds| points.iter().all(|p| p.cmplt(b.min.as_dvec3()).any() || p.cmpgt(b.max.as_dvec3()).any());
        if shape.known_bounds().map(|b| reached(shape, b)).is_some_and(far) {
            continue;
        }
        for primitive in 0..shape.primitive_count() as u32 {
            let bounds = shape.primitive_bounds(primitive);
            let reach = reach(shape, bounds);
            let Bounds { min, max } = reached(shape, bounds);
            let (min, max) = (min.as_dvec3(), max.as_dvec3());
            let first = order.partition_point(|&i| points[i].x < min.x);
            for &i in order[first..].iter().take_while(|&&i| points[i].x <= max.x) {
                let p = points[i];
                if p.cmpge(min).all() && p.cmple(max).all() {
                    found[i].extend(touch(shape, primitive, p, reach));
                }
            }
        }
    }
    found
}

/// How far along each axis rounding reaches around a part of `shape` in a box. What is placed was rounded in its group.
fn reach(shape: &Shape, b: Bounds) -> Vec3 {
    let group = if let Shape::Placed(placed) = shape { placed.placement.reach().as_vec3() } else { Vec3::ZERO };
    ROUNDINGS * UNIT_ROUNDOFF * (b.min.abs().max(b.max.abs()) + group)
}

/// That box, wider by this.
fn reached(shape: &Shape, b: Bounds) -> Bounds {
    let reach = reach(shape, b);
    Bounds { min: b.min - reach, max: b.max + reach }
}

/// `p` with the normal of the primitive there, if it is no farther off, along that, than these distances along the axes.
fn touch(shape: &Shape, primitive: u32, p: DVec3, reach: Vec3) -> Option<SurfacePoint> {
    let point = shape.beside(primitive, p).point;
    let height = point.n.as_dvec3().dot(p - point.p);
    // Not so on the axis of a cylinder, where there is no normal.
    (height.abs() <= f64::from(point.n.abs().dot(reach))).then_some(SurfacePoint { p, ..point })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::TriangleMesh;
    use crate::shape::sphere::Sphere;

    #[test]
    fn what_is_near_enough_and_what_is_not() {
        let positions = vec![Vec3::new(-1.0, -1.0, 0.3), Vec3::new(1.0, -1.0, 0.3), Vec3::new(0.0, 1.0, 0.3)];
        let mesh = TriangleMesh { positions, faces: vec![[0, 1, 2]], ..TriangleMesh::default() };
        let sphere = Sphere { centre: Vec3::new(0.0, 0.0, 0.7), radius: 0.4, flip: false };
        let shapes = [Shape::Mesh(mesh), Shape::Sphere(sphere)];
        // 0.3 is not a number of f32; nor is it 0.7 − 0.4 there.
        let points = [
            DVec3::new(0.0, 0.0, 0.3),
            DVec3::new(0.2, -0.3, 0.3),
            DVec3::new(0.2, -0.3, 0.301),
            DVec3::new(0.0, 0.4, 0.7),
            DVec3::new(2.0, 0.0, 0.3),
            DVec3::new(0.0, 0.0, 0.7),
        ];
        let counts: Vec<usize> = touching(&shapes, &points).iter().map(Vec::len).collect();
        assert_eq!(counts, [2, 1, 0, 1, 0, 0]);
        assert!(touching(&shapes, &[]).is_empty());
    }
}
