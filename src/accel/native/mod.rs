//! Our own accelerator: wide bounding volume hierarchies, one over the triangles and one over the spheres.
//!
//! The answer does not depend on the order in which boxes are visited, nor on how the tree was built: every primitive
//! has one f32 distance (computed in f64 and rounded, see [`crate::shape::triangle`]), the nearest wins, at equal
//! distance the lowest (shape, primitive), and a box is left out only if nothing in it can be as near ([`wide`]).

mod block;
mod build;
mod collapse;
mod wide;

use super::Hit;
use crate::math::ray::Ray;
use crate::shape::Shape;
use crate::shape::triangle::WatertightRay;
use block::{SphereBlock, TriangleBlock};
use build::Item;
#[cfg(feature = "embree")]
pub(crate) use wide::Stack as TraversalStack;
use wide::{SlabRay, Stack, Tree};

/// Both hierarchies; each is absent where the scene has nothing for it.
#[derive(Debug)]
pub(crate) struct Native {
    triangles: Option<Tree<TriangleBlock>>,
    spheres: Option<Tree<SphereBlock>>,
}

/// A ray as the blocks of primitives want it.
#[derive(Clone, Copy, Debug)]
pub(super) struct PreparedRay {
    ray: Ray,
    watertight: WatertightRay,
}

/// The nearest hit so far; at first none, at the end of the ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    /// Distance in units of the direction.
    pub(crate) t: f32,
    /// What was hit.
    pub(crate) hit: Hit,
}

impl Nearest {
    /// Nothing hit yet.
    #[inline]
    pub(crate) fn none(ray: &Ray) -> Self {
        Self { t: ray.tmax, hit: Hit::NONE }
    }

    /// Takes a hit if it is nearer, or as near and of lower id.
    #[inline]
    pub(crate) fn offer(&mut self, t: f32, hit: Hit) {
        if t < self.t || (t == self.t && hit < self.hit) {
            *self = Self { t, hit };
        }
    }
}

impl Native {
    /// Builds over all of `shapes`, on the current rayon pool. The same trees for any number of threads.
    pub(crate) fn build(shapes: &[Shape]) -> Self {
        Self {
            triangles: Tree::build(items(shapes, |s| matches!(s, Shape::Mesh(_))), shapes),
            ..Self::build_spheres(shapes)
        }
    }

    /// Builds over the spheres alone.
    pub(crate) fn build_spheres(shapes: &[Shape]) -> Self {
        Self { triangles: None, spheres: Tree::build(items(shapes, |s| matches!(s, Shape::Sphere(_))), shapes) }
    }

    /// Whether it holds nothing.
    #[cfg(feature = "embree")]
    pub(crate) fn is_empty(&self) -> bool {
        self.triangles.is_none() && self.spheres.is_none()
    }

    /// The closest hit of each ray.
    pub(crate) fn closest_hits(&self, rays: &[Ray], hits: &mut [Hit]) {
        let mut stack = Stack::new();
        for (ray, hit) in rays.iter().zip(hits) {
            let mut nearest = Nearest::none(ray);
            self.improve(ray, &mut nearest, &mut stack);
            *hit = nearest.hit;
        }
    }

    /// Takes what is nearer than `nearest`.
    pub(crate) fn improve(&self, ray: &Ray, nearest: &mut Nearest, stack: &mut Stack) {
        let prepared = PreparedRay { ray: *ray, watertight: WatertightRay::new(ray) };
        if let Some(tree) = &self.triangles {
            tree.closest(&prepared, &SlabRay::new(ray, tree.reach()), nearest, stack);
        }
        if let Some(tree) = &self.spheres {
            tree.closest(&prepared, &SlabRay::new(ray, tree.reach()), nearest, stack);
        }
    }

    /// Whether each ray meets anything. An answer that is true already is left alone.
    pub(crate) fn occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        let mut stack = Stack::new();
        for (ray, occluded) in rays.iter().zip(occluded) {
            if *occluded {
                continue;
            }
            let prepared = PreparedRay { ray: *ray, watertight: WatertightRay::new(ray) };
            *occluded = self
                .triangles
                .as_ref()
                .is_some_and(|tree| tree.any(&prepared, &SlabRay::new(ray, tree.reach()), &mut stack))
                || self
                    .spheres
                    .as_ref()
                    .is_some_and(|tree| tree.any(&prepared, &SlabRay::new(ray, tree.reach()), &mut stack));
        }
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.triangles.as_ref().map_or(0, Tree::memory_bytes) + self.spheres.as_ref().map_or(0, Tree::memory_bytes)
    }
}

/// The primitives of the shapes that `wanted` picks.
fn items(shapes: &[Shape], wanted: impl Fn(&Shape) -> bool) -> Vec<Item> {
    let mut items = Vec::with_capacity(shapes.iter().filter(|s| wanted(s)).map(Shape::primitive_count).sum());
    for (index, shape) in (0u32..).zip(shapes).filter(|(_, shape)| wanted(shape)) {
        items.extend(
            (0..shape.primitive_count() as u32).map(|primitive| Item {
                bounds: shape.primitive_bounds(primitive),
                id: Hit { shape: index, primitive },
            }),
        );
    }
    items
}
