//! Our own accelerator: wide bounding volume hierarchies, one over the triangles, one over the quadrics and one over what is
//! placed, which has hierarchies of its own inside.
//!
//! The answer does not depend on the order in which boxes are visited, nor on how the tree was built: every primitive
//! has one f32 distance (computed in f64 and rounded, see [`crate::shape::triangle`]), the nearest wins, at equal
//! distance the lowest (shape, primitive), and a box is left out only if nothing in it can be as near ([`wide`]).

mod block;
mod build;
mod collapse;
mod flat;
mod instance;
#[cfg(target_arch = "x86_64")]
mod interleaved;
mod item;
mod pages;
mod spatial;
mod triangles;
mod wide;

use super::{Hit, Quality, Start};
use crate::facts::{Feature, has};
use crate::math::ray::Ray;
use crate::shape::Shape;
use block::QuadricBlock;
use fearless_simd::Level;
use flat::FlatList;
use instance::Instances;
use item::Item;
use triangles::{Best, TriangleBlock};
#[cfg(feature = "embree")]
pub(crate) use wide::Stack as TraversalStack;
use wide::{Stack, Tree};

/// Rays that are answered at a time.
const CHUNK: usize = 64;

/// The hierarchies; each is absent where the scene has nothing for it.
#[derive(Debug)]
pub(crate) struct Native {
    triangles: Option<Triangles>,
    quadrics: Option<Tree<QuadricBlock>>,
    instances: Option<Instances>,
}

/// All triangles.
#[derive(Debug)]
enum Triangles {
    /// Few.
    Flat(FlatList),
    /// Many.
    Tree(Tree<TriangleBlock>),
}

impl Triangles {
    fn build(shapes: &[Shape], quality: Quality) -> Option<Self> {
        let items = items(shapes, is_mesh);
        match FlatList::build(&items, shapes) {
            Some(list) => Some(Self::Flat(list)),
            None => Tree::build(items, shapes, quality).map(Self::Tree),
        }
    }

    fn at_level(self, level: Level) -> Self {
        match self {
            Self::Flat(list) => Self::Flat(list.at_level(level)),
            Self::Tree(tree) => Self::Tree(tree.at_level(level)),
        }
    }

    fn memory_bytes(&self) -> u64 {
        match self {
            Self::Flat(list) => list.memory_bytes(),
            Self::Tree(tree) => tree.memory_bytes(),
        }
    }
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
    pub(crate) fn build(shapes: &[Shape], quality: Quality) -> Self {
        Self { triangles: Triangles::build(shapes, quality), ..Self::build_others(shapes, quality) }
    }

    /// The same, walked by the instruction set that every processor of its kind has, and so one ray at a time, but for what
    /// is inside of placed groups.
    pub(crate) fn at_baseline(self) -> Self {
        let level = Level::baseline();
        Self {
            triangles: self.triangles.map(|triangles| triangles.at_level(level)),
            quadrics: self.quadrics.map(|tree| tree.at_level(level)),
            ..self
        }
    }

    /// How many triangles its hierarchy over them would have.
    pub(crate) fn triangles(shapes: &[Shape]) -> usize {
        shapes.iter().filter(|s| is_mesh(s)).map(Shape::primitive_count).sum()
    }

    /// Builds over what is no mesh alone: quadrics and what is placed.
    pub(crate) fn build_others(shapes: &[Shape], quality: Quality) -> Self {
        let is_quadric = |shape: &Shape| !is_mesh(shape) && !matches!(shape, Shape::Placed(_));
        Self {
            triangles: None,
            quadrics: Tree::build(items(shapes, is_quadric), shapes, quality),
            instances: Instances::build(shapes, quality),
        }
    }

    /// Whether its triangles are few enough for a list.
    pub(crate) fn is_flat(&self) -> bool {
        matches!(self.triangles, Some(Triangles::Flat(_)))
    }

    /// Whether it holds nothing.
    #[cfg(feature = "embree")]
    pub(crate) fn is_empty(&self) -> bool {
        self.triangles.is_none() && self.quadrics.is_none() && self.instances.is_none()
    }

    /// The closest hit of each ray; see [`super::Accel::closest_hits_from`].
    pub(crate) fn closest_hits(&self, rays: &[Ray], start: Start<'_>, hits: &mut [Hit]) {
        let from = start.primitives();
        let with_distances =
            has(Feature::Quadrics, self.quadrics.is_some()) | has(Feature::Instances, self.instances.is_some());
        if let Some(Triangles::Tree(tree)) = &self.triangles {
            if with_distances {
                self.closest_of_all(tree, rays, from, hits);
            } else {
                let hit = tree.hits();
                tree.closest_hits(rays, from, |i, best| hits[i] = hit(best));
            }
            return;
        }
        // A list needs none.
        let mut stack = None;
        let mut nearest = [Nearest { t: 0.0, hit: Hit::NONE }; CHUNK];
        for ((chunk, rays), hits) in rays.chunks(CHUNK).enumerate().zip(hits.chunks_mut(CHUNK)) {
            let nearest = &mut nearest[..rays.len()];
            let from = from.get(chunk * CHUNK..chunk * CHUNK + rays.len()).unwrap_or(&[]);
            match &self.triangles {
                Some(Triangles::Flat(list)) => list.closest_hits(rays, from, nearest, with_distances),
                _ => nothing(rays, nearest),
            }
            if with_distances {
                self.improve_by_others(rays, from, nearest, stack.get_or_insert_with(Stack::new));
            }
            hits.iter_mut().zip(nearest).for_each(|(hit, nearest)| *hit = nearest.hit);
        }
    }

    /// The same with a tree of triangles and others. How far a triangle is matters only where another is not beyond its bound.
    fn closest_of_all(&self, tree: &Tree<TriangleBlock>, rays: &[Ray], from: &[Hit], hits: &mut [Hit]) {
        let mut triangles = vec![Best::NONE; rays.len()];
        tree.closest_hits(rays, from, |i, best| triangles[i] = *best);
        let hit = tree.hits();
        let bound = |best: &Best| Nearest { t: best.limit(), hit: hit(best) };
        let mut nearest: Vec<Nearest> = triangles.iter().map(bound).collect();
        self.improve_by_others(rays, from, &mut nearest, &mut Stack::new());
        for (i, (best, other)) in triangles.iter().zip(&nearest).enumerate() {
            hits[i] = other.hit;
            if best.is_some() && other.hit != hit(best) {
                let mut nearest = tree.nearest(&rays[i], best);
                nearest.offer(other.t, other.hit);
                hits[i] = nearest.hit;
            }
        }
    }

    /// Takes for each ray what is no mesh of the scene and nearer than `nearest`, if anything is. The rays start on the
    /// primitives `from`, if these are as many.
    #[inline]
    pub(crate) fn improve_by_others(&self, rays: &[Ray], from: &[Hit], nearest: &mut [Nearest], stack: &mut Stack) {
        if let Some(tree) = &self.quadrics {
            tree.improve_all(rays, from, nearest, stack);
        }
        if let Some(instances) = &self.instances {
            instances.improve_all(rays, from, nearest, stack);
        }
    }

    /// Whether each ray meets anything; see [`super::Accel::occluded_between`]. An answer that is true already is left
    /// alone.
    pub(crate) fn occluded(&self, rays: &[Ray], ends: &[[Hit; 2]], occluded: &mut [bool]) {
        match &self.triangles {
            Some(Triangles::Flat(list)) => list.occluded(rays, ends, occluded),
            Some(Triangles::Tree(tree)) => tree.occluded_all(rays, ends, occluded),
            None => {}
        }
        has(Feature::Quadrics, self.quadrics.is_some());
        has(Feature::Instances, self.instances.is_some());
        if let Some(tree) = &self.quadrics {
            tree.occluded(rays, ends, occluded);
        }
        if let Some(instances) = &self.instances {
            instances.occluded(rays, ends, occluded);
        }
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.triangles.as_ref().map_or(0, Triangles::memory_bytes)
            + self.quadrics.as_ref().map_or(0, Tree::memory_bytes)
            + self.instances.as_ref().map_or(0, Instances::memory_bytes)
    }
}

/// Nothing is hit yet.
fn nothing(rays: &[Ray], nearest: &mut [Nearest]) {
    nearest.iter_mut().zip(rays).for_each(|(nearest, ray)| *nearest = Nearest::none(ray));
}

fn is_mesh(shape: &Shape) -> bool {
    matches!(shape, Shape::Mesh(_))
}

/// The primitives of the shapes that `wanted` picks.
fn items(shapes: &[Shape], wanted: impl Fn(&Shape) -> bool) -> Vec<Item> {
    let mut items = Vec::with_capacity(shapes.iter().filter(|s| wanted(s)).map(Shape::primitive_count).sum());
    for (index, shape) in (0u32..).zip(shapes).filter(|(_, shape)| wanted(shape)) {
        items.extend(
            (0..shape.primitive_count() as u32)
                .map(|primitive| Item::new(shape.primitive_bounds(primitive), Hit { shape: index, primitive })),
        );
    }
    items
}
