//! The trees of the crate `obvhs`, with its own triangle test, in the order of their leaves.

use crate::recorded::Batch;
use crate::recorded::timed::Tracer;
use crate::triangles::{Triangles, scaled};
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use snell::shape::Hit;
use std::time::Duration;

/// What both kinds of tree do alike.
pub(crate) trait Tree: Sized {
    /// What it is called.
    const NAME: &str;

    /// Builds it.
    fn build(triangles: &[Triangle], params: BvhBuildParams) -> Self;

    /// Which triangle stands at which place.
    fn order(&self) -> &[u32];

    /// Bytes of its nodes.
    fn node_bytes(&self) -> usize;

    /// The first place at which `distance` is finite, and less than elsewhere.
    fn nearest(&self, ray: Ray, distance: impl FnMut(&Ray, usize) -> f32) -> Option<usize>;

    /// Whether `distance` is infinite everywhere.
    fn misses(&self, ray: Ray, distance: impl FnMut(&Ray, usize) -> f32) -> bool;
}

/// The crate's trees have the same functions, but no trait that has them all.
macro_rules! tree {
    ($tree:ty, $name:literal, $build:path) => {
        impl Tree for $tree {
            const NAME: &str = $name;

            fn build(triangles: &[Triangle], params: BvhBuildParams) -> Self {
                $build(triangles, params, &mut Duration::default())
            }

            fn order(&self) -> &[u32] {
                &self.primitive_indices
            }

            fn node_bytes(&self) -> usize {
                size_of_val(&self.nodes[..])
            }

            fn nearest(&self, ray: Ray, distance: impl FnMut(&Ray, usize) -> f32) -> Option<usize> {
                let mut hit = RayHit::none();
                self.ray_traverse(ray, &mut hit, distance).then_some(hit.primitive_id as usize)
            }

            fn misses(&self, ray: Ray, distance: impl FnMut(&Ray, usize) -> f32) -> bool {
                self.ray_traverse_miss(ray, distance)
            }
        }
    };
}

tree!(CwBvh, "CwBvh", build_cwbvh_from_tris);
tree!(Bvh2, "Bvh2", build_bvh2_from_tris);

/// A tree, and for each place in it the triangle and whose that is.
pub(crate) struct Obvhs<T> {
    tree: T,
    triangles: Vec<RtTriangle>,
    hits: Vec<Hit>,
}

impl<T: Tree> Obvhs<T> {
    /// Builds the tree.
    pub(crate) fn build(triangles: &Triangles, params: BvhBuildParams) -> Self {
        let all: Vec<Triangle> = triangles.corners.iter().map(|&[a, b, c]| triangle(a, b, c)).collect();
        let tree = T::build(&all, params);
        let order = tree.order().iter().map(|&i| i as usize);
        let hits = order.clone().map(|i| triangles.hits[i]).collect();
        let triangles = order.map(|i| RtTriangle::from(&all[i])).collect();
        Self { tree, triangles, hits }
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let order = size_of_val(self.tree.order());
        (self.tree.node_bytes() + order + size_of_val(&self.triangles[..]) + size_of_val(&self.hits[..])) as u64
    }

    /// A triangle that the ray starts or ends on is none that it meets.
    fn distance(&self, ray: &Ray, place: usize, ends: &[Hit]) -> f32 {
        let t = self.triangles[place].intersect(ray);
        if t < f32::INFINITY && ends.contains(&self.hits[place]) { f32::INFINITY } else { t }
    }
}

fn triangle(a: glam::Vec3, b: glam::Vec3, c: glam::Vec3) -> Triangle {
    Triangle { v0: a.into(), v1: b.into(), v2: c.into() }
}

fn ray_of(ray: &snell::math::ray::Ray) -> Ray {
    let ray = scaled(ray);
    Ray::new(Vec3A::from(ray.o), Vec3A::from(ray.d), ray.tmin, ray.tmax)
}

impl<T: Tree> Tracer for Obvhs<T> {
    fn closest(&self, batch: &Batch, hits: &mut [Hit]) {
        for ((ray, &from), hit) in batch.rays.iter().zip(&batch.from).zip(hits) {
            let place = self.tree.nearest(ray_of(ray), |ray, place| self.distance(ray, place, &[from]));
            *hit = place.map_or(Hit::NONE, |place| self.hits[place]);
        }
    }

    fn occluded(&self, batch: &Batch, ends: &[[Hit; 2]], occluded: &mut [bool]) {
        for ((ray, ends), occluded) in batch.rays.iter().zip(ends).zip(occluded) {
            *occluded = !self.tree.misses(ray_of(ray), |ray, place| self.distance(ray, place, ends));
        }
    }
}
