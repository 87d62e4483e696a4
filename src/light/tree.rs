//! Chooses one of many lights by what it can send to a point: a tree of lights, descended at random.
//!
//! Conty Estevez and Kulla 2018, *Importance Sampling of Many Lights with Adaptive Tree Splitting*: lights are split where the
//! surface area orientation heuristic (their section 4.4) finds the least cost; on the way down each branch is taken in
//! proportion to what its lights can send to the point ([`Beam::importance`]). Splits are in two, branches in up to
//! eight: looking at eight takes as long as at one ([`Beams`]), and knows more.

use super::beams::{Beams, LANES};
use super::reach::{Beam, Reach, Receiver};
use super::weights::Weights;
use crate::math::bounds::Bounds;
use crate::math::float::max;
use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch};

/// Places along an axis at which a split is tried.
const BINS: usize = 12;

/// Depth from which splits are in the middle of the list, so that no way down is long.
const LAST_UNEVEN_DEPTH: u32 = 32;

/// A tree of at least one light.
#[derive(Clone, Debug)]
pub struct LightTree {
    /// All lights together.
    whole: Beam,
    /// The first is the root.
    nodes: Vec<Node>,
    /// For each light of the scene the node and the lane that it is in, if it is in the tree.
    places: Vec<Option<Place>>,
    /// What the processor can do.
    level: Level,
}

#[derive(Clone, Debug)]
struct Node {
    beams: Beams,
    children: [Child; LANES],
    /// Where it hangs; `None` of the root.
    parent: Option<Place>,
}

#[derive(Clone, Copy, Debug)]
enum Child {
    /// Index of a light. Of lanes that have none, 0.
    Light(u32),
    /// Index of a node.
    Node(u32),
}

/// A lane of a node.
#[derive(Clone, Copy, Debug)]
struct Place {
    node: u32,
    lane: u8,
}

/// A tree of splits in two.
enum Split {
    Light(u32, Reach),
    Both(Reach, Box<[Split; 2]>),
}

impl Split {
    fn new(lights: &mut [(u32, Reach)], depth: u32) -> Self {
        if let [(light, reach)] = *lights {
            return Self::Light(light, reach);
        }
        let middle = split(lights, depth);
        let (left, right) = lights.split_at_mut(middle);
        let both = [Self::new(left, depth + 1), Self::new(right, depth + 1)];
        Self::Both(both[0].reach().union(both[1].reach()), Box::new(both))
    }

    fn reach(&self) -> &Reach {
        match self {
            Self::Light(_, reach) | Self::Both(reach, _) => reach,
        }
    }

    /// The parts that make a branch: those that cost most are split until there are as many as it can have.
    fn parts(&self) -> Vec<&Self> {
        let mut parts = vec![self];
        while parts.len() < LANES {
            let costs = parts.iter().enumerate().filter_map(|(i, part)| match part {
                Self::Light(..) => None,
                Self::Both(reach, _) => Some((i, cost(reach))),
            });
            let Some((dearest, _)) = costs.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            if let Self::Both(_, both) = parts[dearest] {
                parts.splice(dearest..=dearest, both.iter());
            }
        }
        parts
    }
}

impl LightTree {
    /// Of lights by their indices, of which there are `count` in the scene; `None` without any.
    pub fn new(mut lights: Vec<(u32, Reach)>, count: usize) -> Option<Self> {
        if lights.is_empty() {
            return None;
        }
        let splits = Split::new(&mut lights, 0);
        let whole = Beam::new(splits.reach());
        let mut tree = Self { whole, nodes: Vec::new(), places: vec![None; count], level: crate::math::simd::level() };
        tree.add(&splits, None);
        Some(tree)
    }

    /// Adds a node and all that is in it, and says which it is.
    fn add(&mut self, splits: &Split, parent: Option<Place>) -> u32 {
        let node = self.nodes.len() as u32;
        let parts = splits.parts();
        let beams: Vec<Beam> = parts.iter().map(|part| Beam::new(part.reach())).collect();
        self.nodes.push(Node { beams: Beams::new(&beams), children: [Child::Light(0); LANES], parent });
        for (lane, part) in parts.into_iter().enumerate() {
            let place = Place { node, lane: lane as u8 };
            self.nodes[node as usize].children[lane] = match part {
                Split::Light(light, _) => {
                    self.places[*light as usize] = Some(place);
                    Child::Light(*light)
                }
                Split::Both(..) => Child::Node(self.add(part, Some(place))),
            };
        }
        node
    }

    /// [`Beam::importance`] of all lights together.
    pub fn importance(&self, at: &Receiver) -> f32 {
        self.whole.importance(at)
    }

    /// What the first branches send to a receiver: [`Self::sample`] and [`Self::pmf`] ask for it.
    #[inline(always)]
    pub(super) fn first(&self, at: &Receiver) -> Weights<LANES> {
        dispatch!(self.level, simd => Weights::new(self.nodes[0].beams.weights(simd, at)))
    }

    /// A light and the probability of choosing it, for a uniform number in [0, 1); `None` where no light of the branch that it
    /// falls on can send anything.
    #[inline(never)]
    pub(super) fn sample(&self, at: &Receiver, first: &Weights<LANES>, u: f64) -> Option<(usize, f64)> {
        dispatch!(self.level, simd => self.descend(simd, at, first, u))
    }

    #[inline(always)]
    fn descend<S: Simd>(&self, simd: S, at: &Receiver, first: &Weights<LANES>, u: f64) -> Option<(usize, f64)> {
        let mut node = &self.nodes[0];
        let (mut lane, mut probability, mut rest) = first.choose(u)?;
        loop {
            match node.children[lane] {
                Child::Light(light) => return Some((light as usize, probability)),
                Child::Node(index) => {
                    node = &self.nodes[index as usize];
                    let p;
                    (lane, p, rest) = Weights::new(node.beams.weights(simd, at)).choose(rest)?;
                    probability *= p;
                }
            }
        }
    }

    /// Probability of choosing a light.
    #[inline(never)]
    pub(super) fn pmf(&self, at: &Receiver, first: &Weights<LANES>, light: usize) -> f64 {
        dispatch!(self.level, simd => self.ascend(simd, at, first, light))
    }

    #[inline(always)]
    fn ascend<S: Simd>(&self, simd: S, at: &Receiver, first: &Weights<LANES>, light: usize) -> f64 {
        let Some(mut place) = self.places[light] else { return 0.0 };
        let mut probability = 1.0;
        loop {
            let node = &self.nodes[place.node as usize];
            let Some(parent) = node.parent else { return probability * first.pmf(place.lane.into()) };
            probability *= Weights::new(node.beams.weights(simd, at)).pmf(place.lane.into());
            if !(probability > 0.0) {
                return 0.0;
            }
            place = parent;
        }
    }
}

/// Puts lights that belong together next to each other, and says how many are the first half: at least one, and not all.
fn split(lights: &mut [(u32, Reach)], depth: u32) -> usize {
    let centre = |reach: &Reach| (reach.bounds.min + reach.bounds.max) * 0.5;
    let centres = Bounds::of(lights.iter().map(|(_, reach)| centre(reach)));
    let bounds = lights.iter().fold(Bounds::EMPTY, |all, (_, reach)| all.union(reach.bounds));
    let extent = centres.extent();
    let bin_of = |axis: usize, reach: &Reach| {
        let place = (centre(reach)[axis] - centres.min[axis]) / extent[axis];
        ((place * BINS as f32) as usize).min(BINS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    if depth < LAST_UNEVEN_DEPTH {
        for axis in (0..3).filter(|&axis| extent[axis] > 0.0) {
            let mut bins: [Option<Reach>; BINS] = [None; BINS];
            for (_, reach) in lights.iter() {
                let bin = &mut bins[bin_of(axis, reach)];
                *bin = Some(bin.map_or(*reach, |sum| sum.union(reach)));
            }
            let joined = |bins: &[Option<Reach>]| bins.iter().flatten().copied().reduce(|a, b| a.union(&b));
            // A long side is worth splitting (the K_r of the paper).
            let regular = bounds.extent().max_element() / bounds.extent()[axis];
            for end in 1..BINS {
                if let (Some(a), Some(b)) = (joined(&bins[..end]), joined(&bins[end..])) {
                    let cost = regular * (cost(&a) + cost(&b));
                    if best.is_none_or(|(least, ..)| cost < least) {
                        best = Some((cost, axis, end));
                    }
                }
            }
        }
    }
    if let Some((_, axis, end)) = best {
        // Stable, so that equal lights keep their order.
        lights.sort_by_key(|(_, reach)| bin_of(axis, reach) >= end);
        return lights.iter().filter(|(_, reach)| bin_of(axis, reach) < end).count();
    }
    lights.len() / 2
}

/// What a half costs.
fn cost(reach: &Reach) -> f32 {
    let e = reach.bounds.extent();
    let area = e.x * e.y + e.y * e.z + e.z * e.x;
    // Lights without size in one place differ by their directions only.
    reach.power * reach.orientation_cost() * max(area, f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn pmf(tree: &LightTree, light: usize, at: &Receiver) -> f64 {
        tree.pmf(at, &tree.first(at), light)
    }

    /// Lights in a cube, of powers over six decades, some alike.
    fn lights(count: u32) -> Vec<(u32, Reach)> {
        (0..count)
            .map(|i| {
                let digit = |d: u32| ((i * 37 + 11) / d % 10) as f32 / 10.0 - 0.45;
                let p = if i % 7 == 0 { Vec3::splat(0.5) } else { Vec3::new(digit(1), digit(10), digit(100)) };
                let axis = Vec3::new(digit(3), digit(30) + 0.01, digit(5)).normalize();
                let half = Vec3::new(0.01, 0.0, 0.02);
                let (cos_normals, cos_emission) = if i % 3 == 0 { (-1.0, 0.0) } else { (1.0, 0.0) };
                let power = 10.0_f32.powi((i % 7) as i32 - 3);
                let bounds = Bounds { min: p - half, max: p + half };
                (i, Reach { bounds, axis, cos_normals, cos_emission, power, both_sides: i % 5 == 0 })
            })
            .collect()
    }

    fn receivers() -> Vec<Receiver> {
        let normals = [Vec3::ZERO, Vec3::Z, Vec3::new(0.6, -0.8, 0.0)];
        let points = [Vec3::ZERO, Vec3::splat(0.5), Vec3::new(0.9, -0.9, 0.3), Vec3::new(-0.45, -0.45, -0.45)];
        points.iter().flat_map(|&p| normals.iter().map(move |&n| Receiver::new(p, n))).collect()
    }

    #[test]
    fn lights_are_chosen_with_the_probability_that_is_asked_for() {
        for count in [1, 2, 3, 50, 1000] {
            let tree = LightTree::new(lights(count), count as usize).unwrap();
            for at in receivers() {
                let sum: f64 = (0..count as usize).map(|i| pmf(&tree, i, &at)).sum();
                let mut missed = 0;
                const N: u32 = 4096;
                for i in 0..N {
                    match tree.sample(&at, &tree.first(&at), (f64::from(i) + 0.5) / f64::from(N)) {
                        Some((light, p)) => {
                            // The products are taken in different orders.
                            let asked = pmf(&tree, light, &at);
                            assert!((p - asked).abs() <= 1e-14 * p, "{count} {light}: {p} {asked}");
                            assert!(p > 0.0);
                        }
                        None => missed += 1,
                    }
                }
                // What is missing falls on branches that send nothing: their bound is nought only for each light by itself.
                let chosen = 1.0 - f64::from(missed) / f64::from(N);
                assert!(
                    (sum - chosen).abs() < 2.0 / f64::from(N) * f64::from(count).min(40.0),
                    "{count}: {sum} {chosen}"
                );
            }
        }
    }

    /// Every number belongs to the light within whose interval it falls: counts of evenly spaced numbers are its probability.
    #[test]
    fn numbers_are_used_evenly() {
        let tree = LightTree::new(lights(20), 20).unwrap();
        for at in receivers() {
            const N: u32 = 1 << 14;
            let mut counts = [0_u32; 20];
            for i in 0..N {
                if let Some((light, _)) = tree.sample(&at, &tree.first(&at), (f64::from(i) + 0.5) / f64::from(N)) {
                    counts[light] += 1;
                }
            }
            for (light, count) in counts.into_iter().enumerate() {
                let expected = pmf(&tree, light, &at) * f64::from(N);
                assert!((f64::from(count) - expected).abs() <= 1.5, "{light}: {count} {expected}");
            }
        }
    }

    /// A light that can send something is never out of reach.
    #[test]
    fn no_light_is_forgotten() {
        let all = lights(300);
        let tree = LightTree::new(all.clone(), 300).unwrap();
        for at in receivers() {
            for (light, reach) in &all {
                if Beam::new(reach).importance(&at) > 0.0 {
                    assert!(pmf(&tree, *light as usize, &at) > 0.0);
                }
            }
        }
    }

    #[test]
    fn many_lights_in_one_place_are_a_tree_all_the_same() {
        let one = lights(1)[0].1;
        let tree = LightTree::new((0..1000).map(|i| (i, one)).collect(), 1000).unwrap();
        let at = Receiver::new(Vec3::ZERO, Vec3::ZERO);
        assert!((0..1000).all(|i| (pmf(&tree, i, &at) * 1000.0 - 1.0).abs() < 0.1));
    }

    /// Near a light it is chosen more often than others, as far as the boxes around it and its neighbours tell.
    #[test]
    fn near_lights_are_preferred() {
        let mut all = lights(200);
        all.iter_mut().for_each(|(_, reach)| (reach.cos_normals, reach.power) = (-1.0, 1.0));
        all[3].1.bounds = Bounds::of([Vec3::new(0.3, 0.31, 0.29)]);
        let tree = LightTree::new(all, 200).unwrap();
        let at = Receiver::new(Vec3::new(0.3, 0.3, 0.3), Vec3::ZERO);
        assert!(pmf(&tree, 3, &at) > 4.0 / 200.0, "{}", pmf(&tree, 3, &at));
    }
}
