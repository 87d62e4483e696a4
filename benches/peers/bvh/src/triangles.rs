//! The triangles of a compiled scene as the other crates take them.

use glam::Vec3;
use snell::math::ray::Ray;
use snell::shape::{Hit, Shape, TriangleMesh};

/// The compiled scene is as large as the unit cube, and both crates know distances and areas that they take to be zero
/// whatever the scene's size. In a scene larger by this power of two, which rounds nothing, those do not matter.
pub(crate) const SCALE: f32 = 1024.0;

/// Triangles, larger by [`SCALE`], and whose they are.
pub(crate) struct Triangles {
    pub(crate) corners: Vec<[Vec3; 3]>,
    pub(crate) hits: Vec<Hit>,
}

impl Triangles {
    /// All of these shapes, which are meshes.
    pub(crate) fn of(shapes: &[Shape]) -> Self {
        let (mut corners, mut hits) = (Vec::new(), Vec::new());
        for (shape, mesh) in (0..).zip(shapes) {
            let Shape::Mesh(mesh) = mesh else { continue };
            for primitive in 0..mesh.faces.len() as u32 {
                corners.push(mesh.triangle(primitive).map(|corner| corner * SCALE));
                hits.push(Hit { shape, primitive });
            }
        }
        Self { corners, hits }
    }
}

/// The shapes with an empty mesh in place of each that is none, and of how many that was so: the crates compared with have
/// triangles only, so all get just these.
pub(crate) fn meshes(shapes: &[Shape]) -> (Vec<Shape>, usize) {
    let mesh = |shape: &Shape| match shape {
        Shape::Mesh(mesh) => Shape::Mesh(mesh.clone()),
        _ => Shape::Mesh(TriangleMesh::default()),
    };
    let others = shapes.iter().filter(|shape| !matches!(shape, Shape::Mesh(_))).count();
    (shapes.iter().map(mesh).collect(), others)
}

/// `ray` in the larger scene: its direction stays, so distances are larger.
pub(crate) fn scaled(ray: &Ray) -> Ray {
    Ray { o: ray.o * SCALE, tmin: ray.tmin * SCALE, d: ray.d, tmax: ray.tmax * SCALE }
}
