//! Chooses one of many lights by what it can send to a point: a binary tree of lights, descended at random.
//!
//! Conty Estevez and Kulla 2018, *Importance Sampling of Many Lights with Adaptive Tree Splitting*: the tree is split where the
//! surface area orientation heuristic (their section 4.4) finds the least cost; on the way down each branch is taken in
//! proportion to the bound on what its lights send to the point ([`Beam::importance`]).

use super::reach::{Beam, Reach, Receiver};
use crate::math::bounds::Bounds;
use crate::math::float::max;

/// Places along an axis at which a split is tried.
const BINS: usize = 12;

/// Depth from which splits are in the middle of the list, so that a way down is never longer than the bits of a trail.
const LAST_UNEVEN_DEPTH: u32 = 32;

/// A tree of at least one light.
#[derive(Clone, Debug)]
pub struct LightTree {
    /// A branch stands before all that is in it; its first half follows it.
    nodes: Vec<Node>,
    /// For each light of the scene the way down to it, one bit a branch, the first one lowest; none for those that are not in
    /// the tree.
    trails: Vec<Option<u64>>,
}

#[derive(Clone, Debug)]
struct Node {
    beam: Beam,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// The light's index.
    Leaf(u32),
    /// Where the second half begins.
    Branch(u32),
}

impl LightTree {
    /// Of lights by their indices, of which there are `count` in the scene; `None` without any.
    pub fn new(mut lights: Vec<(u32, Reach)>, count: usize) -> Option<Self> {
        let mut tree = Self { nodes: Vec::with_capacity(2 * lights.len()), trails: vec![None; count] };
        if lights.is_empty() {
            return None;
        }
        tree.build(&mut lights, 0, 0);
        Some(tree)
    }

    fn build(&mut self, lights: &mut [(u32, Reach)], trail: u64, depth: u32) -> Reach {
        if let [(light, reach)] = *lights {
            self.nodes.push(Node { beam: Beam::new(&reach), kind: Kind::Leaf(light) });
            self.trails[light as usize] = Some(trail);
            return reach;
        }
        let at = self.nodes.len();
        let middle = split(lights, depth);
        let (left, right) = lights.split_at_mut(middle);
        // What both halves reach is known only after them.
        self.nodes.push(Node { beam: Beam::new(&left[0].1), kind: Kind::Branch(0) });
        let first = self.build(left, trail, depth + 1);
        let second_at = self.nodes.len() as u32;
        let second = self.build(right, trail | 1 << depth, depth + 1);
        let reach = first.union(&second);
        self.nodes[at] = Node { beam: Beam::new(&reach), kind: Kind::Branch(second_at) };
        reach
    }

    /// A bound on what all lights together send to a receiver.
    pub fn importance(&self, at: &Receiver) -> f32 {
        self.nodes[0].beam.importance(at)
    }

    /// A light and the probability of choosing it, for a uniform number in [0, 1); `None` where no light of the branch that it
    /// falls on can send anything.
    pub fn sample(&self, at: &Receiver, mut u: f64) -> Option<(usize, f64)> {
        let (mut node, mut probability) = (0, 1.0);
        loop {
            match self.nodes[node].kind {
                Kind::Leaf(light) => return Some((light as usize, probability)),
                Kind::Branch(second) => {
                    let [first, other] = self.shares(node, second, at)?;
                    if u < first {
                        (node, probability, u) = (node + 1, probability * first, u / first);
                    } else {
                        (node, probability, u) = (second as usize, probability * other, (u - first) / (1.0 - first));
                    }
                    // The quotient may round to 1.
                    u = if u < 1.0 { u } else { BELOW_ONE };
                }
            }
        }
    }

    /// Probability of choosing a light.
    pub fn pmf(&self, light: usize, at: &Receiver) -> f64 {
        let Some(mut trail) = self.trails[light] else { return 0.0 };
        let (mut node, mut probability) = (0, 1.0);
        while let Kind::Branch(second) = self.nodes[node].kind {
            let Some([first, other]) = self.shares(node, second, at) else { return 0.0 };
            (node, probability) = match trail & 1 {
                0 => (node + 1, probability * first),
                _ => (second as usize, probability * other),
            };
            trail >>= 1;
        }
        probability
    }

    /// The probabilities of a branch's halves; `None` where neither sends anything. In f64, as the uniform number is: beside a
    /// bright half a dim one would vanish, or get more than its share.
    fn shares(&self, node: usize, second: u32, at: &Receiver) -> Option<[f64; 2]> {
        let first = f64::from(self.nodes[node + 1].beam.importance(at));
        let second = f64::from(self.nodes[second as usize].beam.importance(at));
        let sum = first + second;
        (sum > 0.0).then(|| [first / sum, second / sum])
    }
}

/// The largest number below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

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
        points.iter().flat_map(|&p| normals.iter().map(move |&n| Receiver { p, n })).collect()
    }

    #[test]
    fn lights_are_chosen_with_the_probability_that_is_asked_for() {
        for count in [1, 2, 3, 50, 1000] {
            let tree = LightTree::new(lights(count), count as usize).unwrap();
            for at in receivers() {
                let sum: f64 = (0..count as usize).map(|i| tree.pmf(i, &at)).sum();
                let mut missed = 0;
                const N: u32 = 4096;
                for i in 0..N {
                    match tree.sample(&at, (f64::from(i) + 0.5) / f64::from(N)) {
                        Some((light, p)) => {
                            assert_eq!(p.to_bits(), tree.pmf(light, &at).to_bits(), "{count} {light}");
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
                if let Some((light, _)) = tree.sample(&at, (f64::from(i) + 0.5) / f64::from(N)) {
                    counts[light] += 1;
                }
            }
            for (light, count) in counts.into_iter().enumerate() {
                let expected = tree.pmf(light, &at) * f64::from(N);
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
                    assert!(tree.pmf(*light as usize, &at) > 0.0);
                }
            }
        }
    }

    #[test]
    fn many_lights_in_one_place_are_a_tree_all_the_same() {
        let one = lights(1)[0].1;
        let tree = LightTree::new((0..1000).map(|i| (i, one)).collect(), 1000).unwrap();
        let at = Receiver { p: Vec3::ZERO, n: Vec3::ZERO };
        assert!((0..1000).all(|i| (tree.pmf(i, &at) * 1000.0 - 1.0).abs() < 0.1));
    }

    /// Near a light it is chosen more often than others, as far as the boxes around it and its neighbours tell.
    #[test]
    fn near_lights_are_preferred() {
        let mut all = lights(200);
        all.iter_mut().for_each(|(_, reach)| (reach.cos_normals, reach.power) = (-1.0, 1.0));
        all[3].1.bounds = Bounds::of([Vec3::new(0.3, 0.31, 0.29)]);
        let tree = LightTree::new(all, 200).unwrap();
        let at = Receiver { p: Vec3::new(0.3, 0.3, 0.3), n: Vec3::ZERO };
        assert!(tree.pmf(3, &at) > 4.0 / 200.0, "{}", tree.pmf(3, &at));
    }
}
