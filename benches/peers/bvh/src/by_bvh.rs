//! The tree of the crate `bvh`, with its own triangle test, walked by two of its iterators.
//!
//! Its triangles have a front only, so a triangle that is missed is asked again the other way around. Its rays have no end:
//! [`Ordered`] takes the iterator that tells the nearest boxes first and stops where they are farther than a hit;
//! [`Shrinking`] gives the plain iterator a query that has an end.

use crate::recorded::Batch;
use crate::recorded::timed::Tracer;
use crate::triangles::{Triangles, scaled};
use bvh::aabb::{Aabb, Bounded, IntersectsAabb};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh, BvhNode};
use bvh::ray::Ray;
use glam::Vec3;
use nalgebra::{Point3, Vector3};
use snell::shape::Hit;
use std::cell::Cell;
use std::rc::Rc;

/// Nodes on a way down that the plain iterator has room for; it panics beyond.
const MOST_LEVELS: usize = 32;

/// A triangle, and whose it is.
struct Triangle {
    corners: [Point3<f32>; 3],
    hit: Hit,
    node: usize,
}

impl Triangle {
    fn distance(&self, ray: &Ray<f32, 3>) -> f32 {
        let [a, b, c] = &self.corners;
        let front = ray.intersects_triangle(a, b, c).distance;
        if front < f32::INFINITY { front } else { ray.intersects_triangle(a, c, b).distance }
    }
}

impl Bounded<f32, 3> for Triangle {
    fn aabb(&self) -> Aabb<f32, 3> {
        self.corners.iter().fold(Aabb::empty(), |bounds, corner| bounds.grow(corner))
    }
}

impl BHShape<f32, 3> for Triangle {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

/// A tree and its triangles.
pub(crate) struct Built {
    tree: Bvh<f32, 3>,
    triangles: Vec<Triangle>,
}

impl Built {
    /// Builds the tree.
    pub(crate) fn new(triangles: &Triangles) -> Self {
        let point = |v: Vec3| Point3::from(v.to_array());
        let triangle = |(corners, &hit): (&[Vec3; 3], _)| Triangle { corners: corners.map(point), hit, node: 0 };
        let mut triangles: Vec<Triangle> = triangles.corners.iter().zip(&triangles.hits).map(triangle).collect();
        Self { tree: Bvh::build(&mut triangles), triangles }
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> u64 {
        (size_of_val(&self.tree.nodes[..]) + size_of_val(&self.triangles[..])) as u64
    }

    /// Whether the plain iterator can walk it.
    pub(crate) fn is_shallow(&self) -> bool {
        let mut below = if self.tree.nodes.is_empty() { vec![] } else { vec![(0, 1)] };
        let mut most = 0;
        while let Some((node, level)) = below.pop() {
            most = most.max(level);
            if let BvhNode::Node { child_l_index, child_r_index, .. } = self.tree.nodes[node] {
                below.extend([child_l_index, child_r_index].map(|child| (child, level + 1)));
            }
        }
        most <= MOST_LEVELS
    }
}

/// A ray with an interval that can become shorter.
struct Query {
    ray: Ray<f32, 3>,
    tmin: f32,
    tmax: Cell<f32>,
}

impl Query {
    /// The crate's rays have unit directions; `None` where there is no direction.
    fn new(ray: &snell::math::ray::Ray) -> Option<Self> {
        let ray = scaled(ray);
        let length = ray.d.length();
        let vector = Vector3::from(ray.d.to_array());
        let [tmin, tmax] = [ray.tmin, ray.tmax].map(|t| t * length);
        let query = || Self { ray: Ray::new(Point3::from(ray.o.to_array()), vector), tmin, tmax: Cell::new(tmax) };
        (length > 0.0).then(query)
    }

    /// Distance of the triangle if the ray meets it in the interval and neither starts nor ends on it.
    fn meets(&self, triangle: &Triangle, ends: &[Hit]) -> Option<f32> {
        let t = triangle.distance(&self.ray);
        (t > self.tmin && t < self.tmax.get() && !ends.contains(&triangle.hit)).then_some(t)
    }

    /// The same, and the interval ends there from now on.
    fn shorten(&self, triangle: &Triangle, ends: &[Hit]) -> Option<Hit> {
        let t = self.meets(triangle, ends)?;
        self.tmax.set(t);
        Some(triangle.hit)
    }
}

impl IntersectsAabb<f32, 3> for Query {
    fn intersects_aabb(&self, aabb: &Aabb<f32, 3>) -> bool {
        self.ray.intersection_slice_for_aabb(aabb).is_some_and(|(entry, _)| entry <= self.tmax.get())
    }
}

/// By the iterator that orders boxes by distance; the first hit of all for shadow rays.
pub(crate) struct Ordered(pub(crate) Rc<Built>);

impl Tracer for Ordered {
    fn closest(&self, batch: &Batch, hits: &mut [Hit]) {
        let Built { tree, triangles } = &*self.0;
        for ((ray, &from), hit) in batch.rays.iter().zip(&batch.from).zip(hits) {
            let Some(query) = Query::new(ray) else { continue };
            for triangle in tree.nearest_traverse_iterator(&query.ray, triangles) {
                if !query.intersects_aabb(&triangle.aabb()) {
                    break;
                }
                *hit = query.shorten(triangle, &[from]).unwrap_or(*hit);
            }
        }
    }

    fn occluded(&self, batch: &Batch, ends: &[[Hit; 2]], occluded: &mut [bool]) {
        let Built { tree, triangles } = &*self.0;
        for ((ray, ends), occluded) in batch.rays.iter().zip(ends).zip(occluded) {
            let Some(query) = Query::new(ray) else { continue };
            let near = tree.nearest_traverse_iterator(&query.ray, triangles);
            let mut near = near.take_while(|triangle| query.intersects_aabb(&triangle.aabb()));
            *occluded = near.any(|triangle| query.meets(triangle, ends).is_some());
        }
    }
}

/// By the plain iterator, with a query that ends where the nearest hit so far is.
pub(crate) struct Shrinking(pub(crate) Rc<Built>);

impl Tracer for Shrinking {
    fn closest(&self, batch: &Batch, hits: &mut [Hit]) {
        let Built { tree, triangles } = &*self.0;
        for ((ray, &from), hit) in batch.rays.iter().zip(&batch.from).zip(hits) {
            let Some(query) = Query::new(ray) else { continue };
            for triangle in tree.traverse_iterator(&query, triangles) {
                *hit = query.shorten(triangle, &[from]).unwrap_or(*hit);
            }
        }
    }

    fn occluded(&self, batch: &Batch, ends: &[[Hit; 2]], occluded: &mut [bool]) {
        let Built { tree, triangles } = &*self.0;
        for ((ray, ends), occluded) in batch.rays.iter().zip(ends).zip(occluded) {
            let Some(query) = Query::new(ray) else { continue };
            let mut met = tree.traverse_iterator(&query, triangles);
            *occluded = met.any(|triangle| query.meets(triangle, ends).is_some());
        }
    }
}
