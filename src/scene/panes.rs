//! Where a scene is clear: boxes around parts of all panes, to be asked before light is sought behind them.

use super::Appearance;
use crate::math::bounds::Bounds;
use crate::math::ray::Ray;
use crate::shape::Shape;
use glam::Vec3A;

/// How often parts are parted at most.
const LEVELS: u32 = 7;

/// What it takes to follow a ray in vain, in questions about boxes: some 400 ns against 10 or 20.
const FOLLOWING: f64 = 30.0;

/// Boxes around all surfaces that light may be sought behind ([`Appearance::is_pane`]).
#[derive(Debug, Default)]
pub struct Panes {
    /// A binary tree, each box before those of its parts.
    nodes: Vec<Node>,
}

/// What hits and origins are rounded by, and what is computed of them here, many times over: part of their coordinates, or of the scene's size.
const MARGIN: f32 = 1.0 / (1 << 19) as f32;

/// A box, and where to go on if it is not met.
#[derive(Debug)]
struct Node {
    min: Vec3A,
    max: Vec3A,
    /// How many nodes of its parts, and of theirs, follow; none of a leaf.
    below: u32,
}

impl Panes {
    /// Around the primitives of all shapes that are panes.
    pub(super) fn new(shapes: &[Shape], appearances: &[Appearance]) -> Self {
        let boxes: Vec<Bounds> = shapes
            .iter()
            .zip(appearances)
            .filter(|(_, appearance)| appearance.is_pane)
            .flat_map(|(shape, _)| (0..shape.primitive_count() as u32).map(|i| shape.primitive_bounds(i)))
            .collect();
        let mut panes = Self::default();
        if !boxes.is_empty() {
            panes.add(boxes, LEVELS);
        }
        panes
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Whether a ray from within the scene, with a direction of unit length or to the end of a segment, may meet one: not certain to, but certain not to
    /// if this is false.
    pub fn may_be_met(&self, ray: &Ray) -> bool {
        let slabs = Slabs::new(ray);
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let is_met = slabs.meet(node);
            if is_met && node.below == 0 {
                return true;
            }
            at += 1 + if is_met { 0 } else { node.below as usize };
        }
        false
    }

    /// Adds the box around some boxes, at least one, and those of its parts where they are worth it. What is returned is the time it takes to ask
    /// about them and to follow in vain, times the density of rays: they meet a box in proportion to its surface.
    fn add(&mut self, boxes: Vec<Bounds>, levels: u32) -> f64 {
        let bounds = boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union);
        let at = self.nodes.len();
        self.nodes.push(Node { min: bounds.min.into(), max: bounds.max.into(), below: 0 });
        let whole = bounds.half_area() * FOLLOWING;
        let middles = boxes.iter().fold(Bounds::EMPTY, |all, part| all.with(part.middle()));
        let axis = middles.extent().max_position();
        let half = middles.middle()[axis];
        let (low, high): (Vec<_>, Vec<_>) = boxes.into_iter().partition(|part| part.middle()[axis] < half);
        if levels == 0 || low.is_empty() || high.is_empty() {
            return whole;
        }
        // Whatever meets the whole asks about both parts.
        let parted = 2.0 * bounds.half_area() + self.add(low, levels - 1) + self.add(high, levels - 1);
        if parted < whole {
            self.nodes[at].below = (self.nodes.len() - at - 1) as u32;
            return parted;
        }
        self.nodes.truncate(at + 1);
        whole
    }
}

/// What of a ray it takes to be tested with boxes.
struct Slabs {
    /// The origin, moved up and down by the margin.
    above: Vec3A,
    below: Vec3A,
    /// 1 over the direction; where that is 0 the largest number, which takes any distance but 0 beyond all others.
    inverse: Vec3A,
    tmin: f32,
    tmax: f32,
}

impl Slabs {
    fn new(ray: &Ray) -> Self {
        let o = Vec3A::from(ray.o);
        let margin = Vec3A::splat(MARGIN * o.abs().max_element().max(1.0));
        let inverse = Vec3A::from(ray.d).recip().clamp(Vec3A::splat(f32::MIN), Vec3A::MAX);
        Self { above: o + margin, below: o - margin, inverse, tmin: ray.tmin, tmax: ray.tmax }
    }

    /// Whether the ray may meet what is in a box. A plane's distance is off by the rounding of a difference, far less than the
    /// margin, and by 2⁻²³ of itself, for which the interval is made longer.
    #[inline]
    fn meet(&self, node: &Node) -> bool {
        let (a, b) = ((node.min - self.above) * self.inverse, (node.max - self.below) * self.inverse);
        let (enter, leave) = (a.min(b).max_element().max(self.tmin), a.max(b).min_element().min(self.tmax));
        enter <= leave * (1.0 + MARGIN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vec3> {
        (-1.0..1.0f32, -1.0..1.0f32, -1.0..1.0f32).prop_map(Vec3::from)
    }

    fn small_boxes() -> impl Strategy<Value = Vec<Bounds>> {
        let small = (point(), point()).prop_map(|(p, e)| Bounds::of([p, p + 0.01 * e]));
        proptest::collection::vec(small, 1..200)
    }

    proptest! {
        #[test]
        fn no_box_that_a_ray_meets_is_missed(boxes in small_boxes(), which: prop::sample::Index, o in point(), t in 1.0..2.0f32) {
            let mut panes = Panes::default();
            panes.add(boxes.clone(), LEVELS);
            let aim = which.get(&boxes).middle();
            prop_assert!(panes.may_be_met(&Ray::new(o, (aim - o).normalize())));
            prop_assert!(panes.may_be_met(&Ray::segment(o, o + t * (aim - o))));
            // Along an axis, and within a plane along two.
            for d in [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::new(0.6, -0.8, 0.0)] {
                prop_assert!(panes.may_be_met(&Ray::new(aim - 0.7 * d, d)));
                prop_assert!(panes.may_be_met(&Ray::segment(aim - 0.7 * d, aim + 0.1 * d)));
            }
        }

        #[test]
        fn what_lies_apart_is_not_met_between(x in -0.5..0.5f32, y in -1.0..1.0f32) {
            let far = |x: f32| (0..100).map(move |i| Vec3::new(x, 0.02 * i as f32 - 1.0, 0.0)).map(|p| Bounds::of([p, p + Vec3::splat(0.01)]));
            let mut panes = Panes::default();
            panes.add(far(-0.9).chain(far(0.9)).collect(), LEVELS);
            prop_assert!(!panes.may_be_met(&Ray::new(Vec3::new(x, y, -1.0), Vec3::Z)));
        }
    }
}
