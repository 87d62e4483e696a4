//! Makes a tree of nodes with up to eight children out of a binary one, at the least cost.
//!
//! After Ylitie, Karras and Laine 2017, *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*,
//! section 3.1, without their merging of leaves. Let C(n, i) be the least cost of making at most i subtrees of the binary
//! subtree n, for i below 8. Either it stays one, a leaf or a node, or its two halves share the i places:
//!
//! * C(leaf, i) = area · cost of a block,
//! * C(n, 1) = area · cost of a node + D(n, 8),
//! * C(n, i) = min(C(n, i − 1), D(n, i)), where D(n, i) = min over k of C(left, k) + C(right, i − k).
//!
//! All areas are relative to the root's, so that f32 holds them whatever the scale.

use super::build::{BinaryNode, Kind};
use super::wide::WIDTH;

/// Cost of a node's eight boxes against that of a block's four triangles: each is one visit to three or four cache lines.
const NODE_COST: f32 = 1.0;

/// The cheapest way to make subtrees of one binary subtree.
#[derive(Clone, Copy)]
struct Plan {
    /// C(n, i) at i − 1.
    cost: [f32; WIDTH - 1],
    /// How many of at most i places the left half gets and how many both get, at i − 1; (0, 1) where it stays one.
    places: [(u8, u8); WIDTH],
}

/// What to do with every binary subtree.
pub(super) struct Plans(Vec<Plan>);

impl Plans {
    /// Plans for a tree, from the leaves up: children come after their parent.
    pub(super) fn new(binary: &[BinaryNode]) -> Self {
        let unused = Plan { cost: [0.0; WIDTH - 1], places: [(0, 1); WIDTH] };
        let mut plans = vec![unused; binary.len()];
        let whole = binary[0].area();
        let scale = if whole > 0.0 { 1.0 / whole } else { 0.0 };
        for (index, node) in binary.iter().enumerate().rev() {
            let area = (node.area() * scale) as f32;
            match node.kind {
                Kind::Leaf { .. } => plans[index].cost = [area; WIDTH - 1],
                Kind::Inner { right } => {
                    plans[index] = Plan::inner(area, &plans[index + 1], &plans[index + right as usize]);
                }
            }
        }
        Self(plans)
    }

    /// Appends the children that a node made of an inner binary node has.
    pub(super) fn children(&self, binary: &[BinaryNode], index: usize, children: &mut Vec<usize>) {
        self.share(binary, index, WIDTH, children);
    }

    fn share(&self, binary: &[BinaryNode], index: usize, places: usize, children: &mut Vec<usize>) {
        let (left, both) = self.0[index].places[places - 1];
        match binary[index].kind {
            Kind::Inner { right } if left > 0 => {
                self.share(binary, index + 1, left.into(), children);
                self.share(binary, index + right as usize, (both - left).into(), children);
            }
            _ => children.push(index),
        }
    }
}

impl Plan {
    fn inner(area: f32, left: &Self, right: &Self) -> Self {
        let shared = |places: usize| {
            let mut least = (f32::INFINITY, (1, places as u8));
            for k in 1..places {
                let cost = left.cost[k - 1] + right.cost[places - k - 1];
                if cost < least.0 {
                    least = (cost, (k as u8, places as u8));
                }
            }
            least
        };
        let (below, all) = shared(WIDTH);
        let mut plan = Self { cost: [area * NODE_COST + below; WIDTH - 1], places: [(0, 1); WIDTH] };
        plan.places[WIDTH - 1] = all;
        for places in 2..WIDTH {
            let (cost, how) = shared(places);
            let better = cost < plan.cost[places - 2];
            plan.cost[places - 1] = if better { cost } else { plan.cost[places - 2] };
            plan.places[places - 1] = if better { how } else { plan.places[places - 2] };
        }
        plan
    }
}
