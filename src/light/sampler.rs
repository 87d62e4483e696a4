//! Chooses one of the lights for a point, by what each can send there.
//!
//! A single light is no choice. Of a few lights the bound on what each sends ([`Beam::importance`]) is computed, which knows
//! more than any summary of them; many are in a [`LightTree`]. Skies and parallel light, which are equally far from
//! everything, are chosen against all that is at some distance by the irradiance that they make on average. What hides a
//! light nobody knows here, and rooms hide more of a sky than of their own lamps; so the share of either is bounded.
//!
//! The same point and normal give the same probabilities, whether a light is chosen or was found.

use super::Light;
use super::beams::{Beams, LANES};
use super::reach::{Beam, Reach, Receiver, SLACK};
use super::tree::LightTree;
use crate::math::float::{max, min};
use crate::shape::Shape;
use crate::spectrum::Rgb;
use fearless_simd::Level;
use glam::Vec3;
use std::f64::consts::PI;

/// Most lights that are looked at one by one: two vectors of them, as many as the steps down a tree would be.
const MOST_IN_LIST: usize = 16;

/// Least share of what is infinitely far away, and of what is not, where there is both.
const LEAST_SHARE: f64 = 0.2;

/// Powers below this part of the largest count as this much: what is never chosen would be missing, and what is chosen once
/// in 10¹² samples would be a spot in the picture.
const LEAST_POWER: f64 = 1e-9;

/// Chooses among the lights of a scene.
#[derive(Clone, Debug)]
pub struct LightSampler {
    count: usize,
    /// `None` where there is no choice.
    choice: Option<Box<Choice>>,
}

#[derive(Clone, Debug)]
struct Choice {
    finite: Finite,
    infinite: Vec<Infinite>,
    /// Which element of `infinite` each light is, if it is one.
    infinite_index: Vec<Option<u32>>,
    /// What the processor can do.
    level: Level,
}

/// The lights that are at some distance.
#[derive(Clone, Debug)]
enum Finite {
    /// A few, their indices and what they send. Perhaps none.
    List(Vec<u32>, Vec<Beams>),
    /// Many.
    Tree(LightTree),
}

/// A light that is infinitely far away.
#[derive(Clone, Copy, Debug)]
struct Infinite {
    light: u32,
    /// Unit vector towards it; zero where it is all around.
    wi: Vec3,
    /// π times the irradiance of a surface that faces it; of a sky the mean over all directions that a surface may face.
    power: f32,
}

impl LightSampler {
    /// For these lights on these shapes.
    pub fn new(lights: &[Light], shapes: &[Shape]) -> Self {
        let choice = (lights.len() > 1).then(|| Box::new(Choice::new(lights, shapes)));
        Self { count: lights.len(), choice }
    }

    /// A light and the probability of choosing it at a point, for a uniform number in [0, 1); neither is asked for where
    /// there is no choice. `None` where there is no light, or none that reaches the point.
    #[inline(always)]
    pub fn sample(&self, at: impl FnOnce() -> Receiver, u: impl FnOnce() -> f64) -> Option<(usize, f32)> {
        match &self.choice {
            None if self.count == 0 => None,
            None => Some((0, 1.0)),
            Some(choice) => choice.sample(&at(), u()),
        }
    }

    /// What [`Self::sample`] needs to know of a point, for asking several times.
    #[inline(always)]
    pub fn at(&self, at: impl FnOnce() -> Receiver) -> LightsAt<'_> {
        LightsAt { count: self.count, choice: self.choice.as_ref().map(|choice| Importances::new(choice, &at())) }
    }

    /// The probability of choosing a light at a point.
    #[inline(always)]
    pub fn pmf(&self, light: usize, at: impl FnOnce() -> Receiver) -> f32 {
        self.choice.as_ref().map_or(1.0, |choice| choice.pmf(light, &at()))
    }

    /// How it chooses, in words.
    pub fn description(&self) -> String {
        let Some(choice) = &self.choice else {
            return if self.count == 0 { "nothing to choose".into() } else { "the only one".into() };
        };
        let infinite = choice.infinite.len();
        let how = match &choice.finite {
            Finite::List(list, _) if list.is_empty() => "by their irradiance".into(),
            Finite::List(list, _) => format!("each of {} by what it sends to a point", list.len()),
            Finite::Tree(_) => format!("a tree of {}", self.count - infinite),
        };
        if infinite > 0 && infinite < self.count { format!("{how}, and {infinite} at infinity") } else { how }
    }
}

impl Choice {
    fn new(lights: &[Light], shapes: &[Shape]) -> Self {
        let mut finite: Vec<(u32, Reach, f64)> = Vec::new();
        let mut infinite: Vec<(u32, Vec3, f64)> = Vec::new();
        for (index, light) in (0..).zip(lights) {
            match light {
                Light::Constant(sky) => infinite.push((index, Vec3::ZERO, PI * PI * weigh(sky.radiance))),
                Light::Environment(sky) => infinite.push((index, Vec3::ZERO, PI * sky.mean_irradiance())),
                Light::Directional(light) => infinite.push((index, light.wi, PI * weigh(light.irradiance))),
                light => {
                    if let Some((reach, power)) = Reach::of(light, shapes) {
                        finite.push((index, reach, power));
                    }
                }
            }
        }
        // Only ratios matter; so none is too large or too small for f32.
        let largest = |powers: &mut dyn Iterator<Item = f64>| powers.fold(0.0, f64::max);
        let [most, most_infinite] =
            [largest(&mut finite.iter().map(|f| f.2)), largest(&mut infinite.iter().map(|i| i.2))];
        let unit = if most > 0.0 { most } else { most_infinite };
        let scaled = |power: f64, most: f64| {
            let power = power.max(LEAST_POWER * most) / unit;
            power.clamp(f64::from(f32::MIN_POSITIVE), f64::from(Reach::MOST)) as f32
        };
        let mut infinite_index = vec![None; lights.len()];
        for (i, (light, ..)) in (0..).zip(&infinite) {
            infinite_index[*light as usize] = Some(i);
        }
        let reaches: Vec<(u32, Reach)> = finite
            .into_iter()
            .map(|(light, reach, power)| (light, Reach { power: scaled(power, most), ..reach }))
            .collect();
        let finite = match reaches.len() {
            0..=MOST_IN_LIST => {
                let beams: Vec<Beam> = reaches.iter().map(|(_, reach)| Beam::new(reach)).collect();
                Finite::List(reaches.iter().map(|r| r.0).collect(), beams.chunks(LANES).map(Beams::new).collect())
            }
            _ => LightTree::new(reaches, lights.len()).map_or(Finite::List(vec![], vec![]), Finite::Tree),
        };
        let infinite = infinite
            .into_iter()
            .map(|(light, wi, power)| Infinite { light, wi, power: scaled(power, most_infinite) })
            .collect();
        Self { finite, infinite, infinite_index, level: Level::new() }
    }

    #[inline(never)]
    fn sample(&self, at: &Receiver, u: f64) -> Option<(usize, f32)> {
        Importances::new(self, at).sample(u)
    }

    #[inline(never)]
    fn pmf(&self, light: usize, at: &Receiver) -> f32 {
        Importances::new(self, at).pmf(light)
    }
}

/// A choice among the lights of a scene at one point.
pub struct LightsAt<'a> {
    count: usize,
    choice: Option<Importances<'a>>,
}

impl LightsAt<'_> {
    /// As [`LightSampler::sample`].
    #[inline(always)]
    pub fn sample(&self, u: impl FnOnce() -> f64) -> Option<(usize, f32)> {
        match &self.choice {
            None if self.count == 0 => None,
            None => Some((0, 1.0)),
            Some(choice) => choice.sample(u()),
        }
    }
}

/// What the lights can send to a point.
struct Importances<'a> {
    choice: &'a Choice,
    at: Receiver,
    /// What all lights at infinity send.
    infinite: f64,
    /// What the others send: a bound on all together.
    finite: f64,
    /// The importance of each of a list, or of the tree's first branches.
    weights: [f32; MOST_IN_LIST],
}

impl<'a> Importances<'a> {
    #[inline]
    fn new(choice: &'a Choice, at: &Receiver) -> Self {
        let mut weights = [0.0; MOST_IN_LIST];
        let finite = match &choice.finite {
            Finite::List(_, beams) => {
                for (beams, weights) in beams.iter().zip(weights.chunks_exact_mut(LANES)) {
                    weights.copy_from_slice(&beams.importances(choice.level, at));
                }
                weights.iter().map(|w| f64::from(*w)).sum()
            }
            Finite::Tree(tree) => {
                weights[..LANES].copy_from_slice(&tree.first(at));
                // Where there is nothing else, nobody compares it.
                if choice.infinite.is_empty() { 1.0 } else { tree.importance(at).into() }
            }
        };
        let infinite = choice.infinite.iter().map(|light| light.importance(at)).sum();
        Self { choice, at: *at, infinite, finite, weights }
    }

    /// Of a tree: what its first branches send.
    fn first(&self) -> [f32; LANES] {
        std::array::from_fn(|i| self.weights[i])
    }

    fn sample(&self, u: f64) -> Option<(usize, f32)> {
        let &Self { choice, at, infinite, finite, weights } = &self;
        let share = share(*infinite, *finite)?;
        if u < share {
            let weights = choice.infinite.iter().map(|light| (light.light, light.importance(at)));
            return pick(weights, u / share * infinite).map(|(light, w)| (light, (share * (w / infinite)) as f32));
        }
        let (u, rest) = ((u - share) / (1.0 - share), 1.0 - share);
        match &choice.finite {
            Finite::List(list, _) => {
                let weights = list.iter().zip(weights).map(|(light, weight)| (*light, f64::from(*weight)));
                pick(weights, u * finite).map(|(light, w)| (light, (rest * (w / finite)) as f32))
            }
            Finite::Tree(tree) => tree.sample(at, self.first(), u).map(|(light, p)| (light, (rest * p) as f32)),
        }
    }

    fn pmf(&self, light: usize) -> f32 {
        let &Self { choice, at, infinite, finite, weights } = &self;
        let Some(share) = share(*infinite, *finite) else { return 0.0 };
        // Of a weight of zero the sum may be zero, too.
        let part = |weight: f64, sum: f64| if weight > 0.0 { weight / sum } else { 0.0 };
        if let Some(index) = choice.infinite_index[light] {
            return (share * part(choice.infinite[index as usize].importance(at), *infinite)) as f32;
        }
        let part = match &choice.finite {
            Finite::List(list, _) => {
                let index = list.iter().position(|index| *index as usize == light);
                index.map_or(0.0, |index| part(weights[index].into(), *finite))
            }
            Finite::Tree(tree) => tree.pmf(at, self.first(), light),
        };
        ((1.0 - share) * part) as f32
    }
}

/// The probability of choosing a light at infinity, where those and the others send so much; `None` where neither sends
/// anything.
fn share(infinite: f64, finite: f64) -> Option<f64> {
    match (infinite > 0.0, finite > 0.0) {
        (false, false) => None,
        (false, true) => Some(0.0),
        (true, false) => Some(1.0),
        (true, true) => Some((infinite / (infinite + finite)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE)),
    }
}

impl Infinite {
    fn importance(&self, at: &Receiver) -> f64 {
        let cos = if self.wi == Vec3::ZERO || at.n == Vec3::ZERO { 1.0 } else { at.n.dot(self.wi) };
        if cos < -SLACK { 0.0 } else { f64::from(min(self.power * max(cos, SLACK), Reach::MOST)) }
    }
}

/// In f64, where the luminance of no colour vanishes.
fn weigh(colour: Rgb) -> f64 {
    colour.to_array().iter().zip(Rgb::LUMINANCE).map(|(c, weight)| f64::from(*c) * f64::from(weight)).sum()
}

/// The light in whose part of the sum of weights `x` is, and its weight; the last of any weight where rounding has put `x`
/// behind all.
fn pick(weights: impl Iterator<Item = (u32, f64)>, mut x: f64) -> Option<(usize, f64)> {
    let mut last = None;
    for (light, weight) in weights.filter(|(_, weight)| *weight > 0.0) {
        last = Some((light as usize, weight));
        if x < weight {
            break;
        }
        x -= weight;
    }
    last
}

#[cfg(test)]
mod tests;
