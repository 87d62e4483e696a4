//! Shapes: from object space in f64 to the compiled scene's space in f32.

use super::instances;
use crate::accel::Accel;
use crate::description::{self, Geometry, SceneDescription};
use crate::error::{Error, Result, Span};
use crate::math::bounds::DBounds;
use crate::scene::space::ToScene;
use crate::shape::cylinder::Cylinder;
use crate::shape::disk::Disk;
use crate::shape::sphere::Sphere;
use crate::shape::{Shape, TriangleMesh};
use glam::{DMat3, DVec3};

/// The corners of the rectangle [−1, 1]², counter-clockwise from its front.
const RECTANGLE: [DVec3; 4] =
    [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0), DVec3::new(-1.0, 1.0, 0.0)];

/// The box around every surface, in the file's world space.
pub(super) fn bounds(description: &SceneDescription) -> DBounds {
    let own = bounds_of(&description.shapes);
    instances::bounds(description).fold(own, DBounds::union)
}

/// The box around shapes, in the space that their to_world leads to.
pub(super) fn bounds_of(shapes: &[description::Shape]) -> DBounds {
    shapes.iter().fold(DBounds::EMPTY, |all, shape| {
        let points =
            |points: &[DVec3]| points.iter().fold(DBounds::EMPTY, |b, &p| b.with(shape.to_world.transform_point3(p)));
        all.union(match &shape.geometry {
            Geometry::Mesh(mesh) => points(&mesh.positions),
            Geometry::Rectangle => points(&RECTANGLE),
            Geometry::Disk => {
                let m = &shape.to_world;
                ellipse(m.translation, m.matrix3.x_axis, m.matrix3.y_axis)
            }
            Geometry::Cylinder { .. } => {
                let (base, [u, v, h]) = world_cylinder(shape);
                ellipse(base, u, v).union(ellipse(base + h, u, v))
            }
            Geometry::Sphere { .. } => {
                let (centre, radius) = world_sphere(shape).unwrap_or((DVec3::ZERO, 0.0));
                DBounds { min: centre - DVec3::splat(radius), max: centre + DVec3::splat(radius) }
            }
        })
    })
}

/// The shapes of the compiled scene, and for each its description and the space that it was compiled for: the scene's, or
/// that of its group.
#[derive(Default)]
pub(super) struct Compiled<'a> {
    pub(super) shapes: Vec<Shape>,
    pub(super) kept: Vec<&'a description::Shape>,
    pub(super) spaces: Vec<ToScene>,
}

/// Every shape that has a surface: those that stand by themselves, then those of each instance.
pub(super) fn shapes<'a>(
    description: &'a SceneDescription,
    to_scene: &ToScene,
    warnings: &mut Vec<String>,
) -> Result<Compiled<'a>> {
    let Compiled { shapes, kept, spaces } = own_shapes(&description.shapes, to_scene, warnings)?;
    let with_planes = |shape| match shape {
        Shape::Mesh(mesh) => Shape::Mesh(mesh.with_planes()),
        quadric => quadric,
    };
    let mut compiled = Compiled { shapes: shapes.into_iter().map(with_planes).collect(), kept, spaces };
    instances::place(description, to_scene, &mut compiled, warnings)?;
    Ok(compiled)
}

/// Those of `described` that have a surface.
pub(super) fn own_shapes<'a>(
    described: &'a [description::Shape],
    to_scene: &ToScene,
    warnings: &mut Vec<String>,
) -> Result<Compiled<'a>> {
    let Compiled { mut shapes, mut kept, .. } = Compiled::default();
    for shape in described {
        let compiled = match &shape.geometry {
            Geometry::Mesh(mesh) => Some(Shape::Mesh(compile_mesh(shape, mesh, to_scene)?)),
            Geometry::Rectangle => Some(Shape::Mesh(compile_rectangle(shape, to_scene)?)),
            Geometry::Sphere { .. } => compile_sphere(shape, to_scene)?,
            Geometry::Disk => compile_disk(shape, to_scene)?,
            Geometry::Cylinder { .. } => compile_cylinder(shape, to_scene)?,
        };
        match compiled {
            Some(Shape::Mesh(mut mesh)) => {
                let dropped = drop_degenerate(&mut mesh);
                if dropped > 0 {
                    warnings.push(format!("{}: {dropped} triangles of '{}' have no area", shape.at, shape.name));
                }
                if !mesh.faces.is_empty() {
                    if !mesh.normals.is_empty() && mesh.is_flat() {
                        mesh.normals = Vec::new();
                    }
                    shapes.push(Shape::Mesh(mesh));
                    kept.push(shape);
                }
            }
            Some(quadric) => {
                shapes.push(quadric);
                kept.push(shape);
            }
            None => warnings.push(too_small(&shape.at, &shape.name)),
        }
    }
    let spaces = vec![*to_scene; shapes.len()];
    Ok(Compiled { shapes, kept, spaces })
}

pub(super) fn too_small(at: &Span, name: &str) -> String {
    format!("{at}: '{name}' is too small beside the scene to be seen")
}

fn compile_mesh(shape: &description::Shape, mesh: &description::Mesh, to_scene: &ToScene) -> Result<TriangleMesh> {
    check_count(shape, mesh.faces.len())?;
    let positions = positions(shape, &mesh.positions, to_scene)?;
    // Normals are covectors: they move with the inverse transpose.
    let normal_matrix = inverse_transpose(shape)?;
    let sign = if shape.flip_normals { -1.0 } else { 1.0 };
    let normals = mesh.normals.iter().map(|&n| ((normal_matrix * n).normalize_or_zero() * sign).as_vec3()).collect();
    Ok(TriangleMesh { positions, normals, faces: mesh.faces.clone(), flip: shape.flip_normals, planes: Vec::new() })
}

fn compile_rectangle(shape: &description::Shape, to_scene: &ToScene) -> Result<TriangleMesh> {
    inverse_transpose(shape)?;
    // The front is where the transformed normal points, also where the transform mirrors and turns the winding round.
    let mirrored = shape.to_world.matrix3.determinant() < 0.0;
    Ok(TriangleMesh {
        positions: positions(shape, &RECTANGLE, to_scene)?,
        faces: vec![[0, 1, 2], [0, 2, 3]],
        flip: mirrored != shape.flip_normals,
        ..TriangleMesh::default()
    })
}

fn compile_sphere(shape: &description::Shape, to_scene: &ToScene) -> Result<Option<Shape>> {
    let (centre, radius) = world_sphere(shape)
        .ok_or_else(|| Error::scene(&shape.at, "a sphere's to_world may only move, rotate and scale uniformly"))?;
    let centre = to_scene.point(centre).as_vec3();
    let radius = (radius * to_scene.unit) as f32;
    if !centre.is_finite() {
        return Err(not_finite(&shape.at, &shape.name));
    }
    Ok((radius > 0.0).then_some(Shape::Sphere(Sphere { centre, radius, flip: shape.flip_normals })))
}

fn compile_disk(shape: &description::Shape, to_scene: &ToScene) -> Result<Option<Shape>> {
    let m = &shape.to_world;
    // Mirrored or not, the front is where the transformed normal points.
    let front = inverse_transpose(shape)? * if shape.flip_normals { DVec3::NEG_Z } else { DVec3::Z };
    let centre = to_scene.point(m.translation);
    let [u, v] = [m.matrix3.x_axis, m.matrix3.y_axis].map(|axis| axis * to_scene.unit);
    if !centre.is_finite() || !u.is_finite() || !v.is_finite() {
        return Err(not_finite(&shape.at, &shape.name));
    }
    Ok(Disk::new(centre, u, v, front).map(Shape::Disk))
}

fn compile_cylinder(shape: &description::Shape, to_scene: &ToScene) -> Result<Option<Shape>> {
    inverse_transpose(shape)?;
    let (base, axes) = world_cylinder(shape);
    let (base, axes) = (to_scene.point(base), axes.map(|axis| axis * to_scene.unit));
    if !base.is_finite() || !axes.iter().all(|axis| axis.is_finite()) {
        return Err(not_finite(&shape.at, &shape.name));
    }
    Ok(Cylinder::new(base, axes, shape.flip_normals).map(Shape::Cylinder))
}

/// The middle of a cylinder's base in world space, the half axes of its cross section, and its axis.
pub(super) fn world_cylinder(shape: &description::Shape) -> (DVec3, [DVec3; 3]) {
    let Geometry::Cylinder { p0, p1, radius } = shape.geometry else { return Default::default() };
    let along = p1 - p0;
    let (s, t) = along.normalize_or(DVec3::Z).any_orthonormal_pair();
    let axes = [s * radius, t * radius, along].map(|axis| shape.to_world.transform_vector3(axis));
    (shape.to_world.transform_point3(p0), axes)
}

/// The box around the points c + a·u + b·v with a² + b² ≤ 1.
fn ellipse(c: DVec3, u: DVec3, v: DVec3) -> DBounds {
    let reach = (u * u + v * v).map(f64::sqrt);
    DBounds { min: c - reach, max: c + reach }
}

/// Centre and radius of a sphere in world space; `None` where the transform makes it something else.
fn world_sphere(shape: &description::Shape) -> Option<(DVec3, f64)> {
    /// How far the axes of a uniform scale may differ, relatively: a rotation written with six digits is still one.
    const UNIFORM_TOLERANCE: f64 = 1e-4;
    let Geometry::Sphere { centre, radius, .. } = shape.geometry else { return None };
    let m = shape.to_world.matrix3;
    let gram = m.transpose() * m;
    let scale2 = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let off = gram - DMat3::from_diagonal(DVec3::splat(scale2));
    let worst = off.to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    (worst <= UNIFORM_TOLERANCE * scale2)
        .then(|| (shape.to_world.transform_point3(centre), radius * (gram.x_axis.x).sqrt()))
}

fn positions(shape: &description::Shape, points: &[DVec3], to_scene: &ToScene) -> Result<Vec<glam::Vec3>> {
    let points: Vec<_> = points.iter().map(|&p| to_scene.point(shape.to_world.transform_point3(p)).as_vec3()).collect();
    if points.iter().all(|p| p.is_finite()) { Ok(points) } else { Err(not_finite(&shape.at, &shape.name)) }
}

fn inverse_transpose(shape: &description::Shape) -> Result<DMat3> {
    let inverse = shape.to_world.matrix3.inverse();
    let invertible = inverse.to_cols_array().into_iter().all(f64::is_finite);
    if invertible {
        Ok(inverse.transpose())
    } else {
        Err(Error::scene(&shape.at, format!("the to_world of '{}' flattens it: it has no inverse", shape.name)))
    }
}

pub(super) fn not_finite(at: &Span, name: &str) -> Error {
    Error::scene(at, format!("'{name}' reaches to where numbers end: a coordinate is not finite"))
}

/// Refuses, before anything is made of them, more triangles than the accelerators can number.
fn check_count(shape: &description::Shape, triangles: usize) -> Result<()> {
    if triangles <= Accel::MAX_PRIMITIVES {
        return Ok(());
    }
    let (name, most) = (&shape.name, Accel::MAX_PRIMITIVES);
    Err(Error::scene(&shape.at, format!("'{name}' has {triangles} triangles; at most {most} can be numbered")))
}

/// Removes triangles without area, which no ray can meet and which have no normal; returns how many.
fn drop_degenerate(mesh: &mut TriangleMesh) -> usize {
    let before = mesh.faces.len();
    let positions = &mesh.positions;
    mesh.faces.retain(|f| {
        let [a, b, c] = f.map(|i| positions[i as usize].as_dvec3());
        (b - a).cross(c - a).try_normalize().is_some()
    });
    before - mesh.faces.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn more_triangles_than_can_be_numbered_are_refused() {
        let shape = description::Shape {
            at: Span::whole(Path::new("s.xml")),
            name: "m.ply".into(),
            geometry: Geometry::Rectangle,
            to_world: Default::default(),
            flip_normals: false,
            bsdf: description::BsdfId(0),
            emission: None,
        };
        assert!(check_count(&shape, i32::MAX as usize).is_ok());
        let error = check_count(&shape, 1 << 31).unwrap_err().to_string();
        assert_eq!(error, "s.xml: 'm.ply' has 2147483648 triangles; at most 2147483647 can be numbered");
    }
}
