//! Texture coordinates of a point of a surface, and how the point moves with them. Only textured materials ask.
//!
//! Conventions are Mitsuba's: a mesh has those of its file, or else u and v are the barycentric coordinates of the second and
//! third vertex; around an axis u is the angle over 2π; v is the angle from a sphere's pole over π, or the height in a
//! cylinder of height 1; on a disk u is the distance from its middle over its radius, v the angle over 2π.

use super::placed::Placed;
use super::{Shape, TriangleMesh};
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3, Vec4};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// The texture coordinates of one shape.
#[derive(Clone, Debug)]
pub enum UvField {
    /// Those of a mesh.
    Mesh {
        /// One pair for each vertex; if none, u and v are barycentric coordinates.
        uvs: Vec<Vec2>,
        /// Where its file says so, tangents (x, y, z) of the vertices, and the side w = ±1 of the bitangent w·(n×t).
        tangents: Vec<Vec4>,
    },
    /// A quadric, which `to_scene` makes of the unit sphere, the unit disk or the unit cylinder from z = 0 to 1.
    Quadric {
        /// Which.
        kind: Quadric,
        /// Its own space to the compiled scene's.
        to_scene: DAffine3,
        /// And back.
        to_own: DAffine3,
    },
    /// Those of a shape of a group, where the group is placed.
    Placed(Arc<Self>, Placed),
}

/// The quadrics, each in its own space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quadric {
    /// The unit sphere; its pole is +z.
    Sphere,
    /// The unit disk in z = 0.
    Disk,
    /// The unit cylinder.
    Cylinder,
}

/// Texture coordinates, and how the surface moves with them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UvPoint {
    /// (u, v).
    pub uv: Vec2,
    /// ∂p/∂u and ∂p/∂v in the compiled scene's space; both zero where position is no function of (u, v).
    pub dp: [Vec3; 2],
    /// Where the tangent of the shading frame points: ∂p/∂u, or what the file says.
    pub tangent: Vec3,
    /// Whether a normal map's second axis is the negative of the shading frame's, which only a file can say.
    pub mirrored: bool,
    /// Whether the file says so.
    has_side: bool,
    /// On a mesh, the vertices of the face, and the barycentric coordinates.
    pub corners: Option<([u32; 3], [f32; 3])>,
}

impl UvPoint {
    fn of_quadric(uv: Vec2, dp: [Vec3; 2]) -> Self {
        Self { uv, dp, tangent: dp[0], mirrored: false, has_side: false, corners: None }
    }
}

impl UvField {
    /// Bytes held for vertices.
    pub fn memory_bytes(&self) -> u64 {
        match self {
            Self::Mesh { uvs, tangents } => (size_of_val(&uvs[..]) + size_of_val(&tangents[..])) as u64,
            // Of a group once, but it is not known here how often that is placed.
            Self::Quadric { .. } | Self::Placed(..) => 0,
        }
    }

    /// Of a quadric that `to_scene` makes of the one in its own space.
    pub fn quadric(kind: Quadric, to_scene: DAffine3) -> Self {
        Self::Quadric { kind, to_scene, to_own: to_scene.inverse() }
    }

    /// At the point `p` of `primitive` of `shape`.
    pub fn at(&self, shape: &Shape, primitive: u32, p: DVec3) -> UvPoint {
        match (self, shape) {
            (Self::Quadric { kind, to_scene, to_own }, _) => {
                let (uv, dp) = kind.at(to_own.transform_point3(p));
                UvPoint::of_quadric(uv.as_vec2(), dp.map(|d| to_scene.transform_vector3(d).as_vec3()))
            }
            (Self::Mesh { uvs, tangents }, Shape::Mesh(mesh)) => on_triangle(mesh, primitive, p, uvs, tangents),
            (Self::Placed(field, placed), _) => {
                let at = field.at(placed.shape(), primitive, placed.point_to_group(p));
                let [du, dv, tangent] = [at.dp[0], at.dp[1], at.tangent].map(|d| placed.vector_to_scene(d));
                UvPoint { dp: [du, dv], tangent, mirrored: at.mirrored != (at.has_side && placed.mirrors()), ..at }
            }
            // A field is made for its shape.
            (Self::Mesh { .. }, _) => UvPoint::default(),
        }
    }

    /// The same where the barycentric coordinates of a point of a mesh (not of one that is placed) are known; derivatives and
    /// tangents only if they are `wanted`, else they may be zero.
    #[inline]
    pub(crate) fn at_known(
        &self,
        shape: &Shape,
        primitive: u32,
        (p, b): (DVec3, Option<[f64; 3]>),
        wanted: bool,
    ) -> UvPoint {
        match (self, shape, b) {
            (Self::Mesh { uvs, tangents }, Shape::Mesh(mesh), Some(b)) => {
                let vertices = mesh.faces[primitive as usize];
                let corners = corners(vertices, uvs);
                if wanted { moving(mesh, primitive, corners, b, tangents) } else { still(vertices, corners, b) }
            }
            _ => self.at(shape, primitive, p),
        }
    }

    /// Some bits of the memory that the texture coordinates of these vertices are in.
    #[inline]
    pub(crate) fn touch(&self, vertices: [u32; 3]) -> u32 {
        let Self::Mesh { uvs, tangents } = self else { return 0 };
        let mut bits = 0;
        for i in vertices {
            bits ^= uvs.get(i as usize).map_or(0, |uv| uv.x.to_bits());
            bits ^= tangents.get(i as usize).map_or(0, |tangent| tangent.x.to_bits());
        }
        bits
    }
}

fn on_triangle(mesh: &TriangleMesh, face: u32, p: DVec3, uvs: &[Vec2], tangents: &[Vec4]) -> UvPoint {
    let [a, b, c] = mesh.triangle(face).map(|v| v.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    // Barycentric coordinates as ratios of signed areas along the normal.
    let n = e1.cross(e2);
    let (b1, b2) = ((p - a).cross(e2).dot(n) / n.length_squared(), e1.cross(p - a).dot(n) / n.length_squared());
    let corners = corners(mesh.faces[face as usize], uvs);
    moving(mesh, face, corners, [1.0 - b1 - b2, b1, b2], tangents)
}

/// The texture coordinates of the vertices of a triangle.
#[inline]
fn corners([i, j, k]: [u32; 3], uvs: &[Vec2]) -> [DVec2; 3] {
    match uvs {
        [] => [DVec2::ZERO, DVec2::X, DVec2::Y],
        _ => [uvs[i as usize].as_dvec2(), uvs[j as usize].as_dvec2(), uvs[k as usize].as_dvec2()],
    }
}

/// Where there are these barycentric coordinates between corners with these texture coordinates, without derivatives.
#[inline]
fn still(vertices: [u32; 3], corners: [DVec2; 3], b: [f64; 3]) -> UvPoint {
    let uv = corners[0] + (corners[1] - corners[0]) * b[1] + (corners[2] - corners[0]) * b[2];
    let weights = [b[0] as f32, b[1] as f32, b[2] as f32];
    UvPoint { uv: uv.as_vec2(), corners: Some((vertices, weights)), ..UvPoint::default() }
}

/// The same with derivatives and tangents.
fn moving(mesh: &TriangleMesh, face: u32, corners: [DVec2; 3], b: [f64; 3], tangents: &[Vec4]) -> UvPoint {
    let vertices = mesh.faces[face as usize];
    let [v0, v1, v2] = mesh.triangle(face);
    let (e1, e2) = (v1.as_dvec3() - v0.as_dvec3(), v2.as_dvec3() - v0.as_dvec3());
    let (d1, d2) = (corners[1] - corners[0], corners[2] - corners[0]);
    // Cramer's rule for the equations ∂p/∂u·du + ∂p/∂v·dv = dp of the two edges.
    let det = d1.perp_dot(d2);
    let dp = match det == 0.0 {
        true => [Vec3::ZERO; 2],
        false => [((e1 * d2.y - e2 * d1.y) / det).as_vec3(), ((e2 * d1.x - e1 * d2.x) / det).as_vec3()],
    };
    let (mut tangent, mut mirrored) = (dp[0], false);
    if !tangents.is_empty() {
        let [t0, t1, t2] = vertices.map(|i| tangents[i as usize].as_dvec4());
        let between = t0 * b[0] + t1 * b[1] + t2 * b[2];
        (tangent, mirrored) = (between.truncate().as_vec3(), between.w < 0.0);
    }
    UvPoint { dp, tangent, mirrored, has_side: !tangents.is_empty(), ..still(vertices, corners, b) }
}

impl Quadric {
    /// (u, v) of a point of the quadric's own space, and the derivatives of the point.
    fn at(self, q: DVec3) -> (DVec2, [DVec3; 2]) {
        let xy = q.truncate();
        // The angle over 2π, in [0, 1).
        let angle = libm::atan2(xy.y, xy.x) / TAU;
        let turn = if angle < 0.0 { angle + 1.0 } else { angle };
        let around = DVec3::new(-xy.y, xy.x, 0.0) * TAU;
        // Along the circle's radius; any direction in its middle.
        let radial = xy.normalize_or(DVec2::X).extend(0.0);
        match self {
            Self::Sphere => {
                let sin = xy.length();
                let down = (radial * q.z - DVec3::Z * sin) * PI;
                (DVec2::new(turn, libm::atan2(sin, q.z) / PI), [around, down])
            }
            Self::Disk => (DVec2::new(xy.length(), turn), [radial, around]),
            Self::Cylinder => (DVec2::new(turn, q.z), [around, DVec3::Z]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives are differences over small steps, where the field is smooth.
    #[test]
    fn derivatives_are_those_of_the_point() {
        const STEP: f64 = 1e-6;
        let points = |kind, u: f64, v: f64| match kind {
            Quadric::Sphere => {
                let (sin, cos) = libm::sincos(v * PI);
                DVec3::new(sin * libm::cos(u * TAU), sin * libm::sin(u * TAU), cos)
            }
            Quadric::Disk => DVec3::new(u * libm::cos(v * TAU), u * libm::sin(v * TAU), 0.0),
            Quadric::Cylinder => DVec3::new(libm::cos(u * TAU), libm::sin(u * TAU), v),
        };
        for kind in [Quadric::Sphere, Quadric::Disk, Quadric::Cylinder] {
            for (u, v) in [(0.1, 0.3), (0.45, 0.8), (0.9, 0.5)] {
                let p = points(kind, u, v);
                let (uv, dp) = kind.at(p);
                assert!((uv - DVec2::new(u, v)).length() < 1e-12, "{kind:?} {uv}");
                let steps = [points(kind, u + STEP, v) - p, points(kind, u, v + STEP) - p];
                for (derivative, step) in dp.into_iter().zip(steps) {
                    assert!((derivative - step / STEP).length() < 1e-4, "{kind:?} {derivative}");
                }
            }
        }
    }
}
