//! Chooses one of the lights for a point, by what each can send there.
//!
//! A single light is no choice. Of a few lights it is computed what each can send ([`Beam::importance`]), which knows
//! more than any summary of them; many are in a [`LightTree`]. Skies and parallel light, which are equally far from
//! everything, are chosen against all that is at some distance by the irradiance that they make on average. What hides a
//! light nobody knows here, and rooms hide more of a sky than of their own lamps; so the share of either is bounded.
//!
//! The same point, normal and lobe give the same probabilities, whether a light is chosen or was found.

use super::Light;
use super::beams::{Beams, LANES};
use super::reach::{Beam, Reach, Receiver, SLACK};
use super::tree::LightTree;
use super::weights::{Weights, mixed};
use crate::facts::{Feature, has};
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
        has(Feature::LightChoice, self.choice.is_some());
        match &self.choice {
            None if self.count == 0 => None,
            None => Some((0, 1.0)),
            Some(choice) => choice.sample(&at(), u()),
        }
    }

    /// What [`Self::sample`] needs to know of a point, for asking several times.
    #[inline(always)]
    pub fn at(&self, at: impl FnOnce() -> Receiver) -> LightsAt<'_> {
        has(Feature::LightChoice, self.choice.is_some());
        LightsAt { count: self.count, choice: self.choice.as_ref().map(|choice| Importances::new(choice, &at())) }
    }

    /// Whether there is a choice.
    #[inline(always)]
    pub fn has_choice(&self) -> bool {
        has(Feature::LightChoice, self.choice.is_some())
    }

    /// The probability of choosing a light at a point.
    #[inline(always)]
    pub fn pmf(&self, light: usize, at: impl FnOnce() -> Receiver) -> f32 {
        has(Feature::LightChoice, self.choice.is_some());
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
        Self { finite, infinite, infinite_index, level: crate::math::simd::level() }
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
    /// The probability of choosing a light at infinity; `None` where nothing arrives.
    share: Option<f64>,
    /// What all lights at infinity send.
    infinite: f64,
    finite: Sent<'a>,
}

/// What the lights that are at some distance send.
enum Sent<'a> {
    /// There are none.
    Nothing,
    /// Those of a list that fits into one vector.
    Few(&'a [u32], Weights<LANES>),
    /// Those of a list.
    List(&'a [u32], Weights<MOST_IN_LIST>),
    /// The first branches of a tree.
    Tree(&'a LightTree, Weights<LANES>),
}

impl<'a> Importances<'a> {
    #[inline(always)]
    fn new(choice: &'a Choice, at: &Receiver) -> Self {
        let (finite, sum) = match &choice.finite {
            Finite::List(list, _) if list.is_empty() => (Sent::Nothing, 0.0),
            Finite::List(list, beams) if beams.len() <= 1 => {
                let all = beams.first().map_or([[0.0; LANES]; 2], |beams| beams.importances(choice.level, at));
                let weights = Weights::new(if at.has_lobe() { mixed(all) } else { all[0] });
                (Sent::Few(list, weights), weights.sum())
            }
            Finite::List(list, beams) => {
                let mut all = [[0.0; MOST_IN_LIST]; 2];
                for (i, beams) in beams.iter().enumerate() {
                    let some = beams.importances(choice.level, at);
                    all[0][i * LANES..(i + 1) * LANES].copy_from_slice(&some[0]);
                    all[1][i * LANES..(i + 1) * LANES].copy_from_slice(&some[1]);
                }
                let weights = Weights::new(if at.has_lobe() { mixed(all) } else { all[0] });
                (Sent::List(list, weights), weights.sum())
            }
            Finite::Tree(tree) => {
                // Where there is nothing else, nobody compares it.
                let sum = if choice.infinite.is_empty() { 1.0 } else { tree.importance(at).into() };
                (Sent::Tree(tree, tree.first(at)), sum)
            }
        };
        // A loop: an iterator's sum is a function of its own.
        let mut infinite = 0.0;
        for light in &choice.infinite {
            infinite += light.importance(at);
        }
        Self { choice, at: *at, share: share(infinite, sum), infinite, finite }
    }

    #[inline(always)]
    fn sample(&self, u: f64) -> Option<(usize, f32)> {
        let share = self.share?;
        if u < share {
            return self.sample_infinite(share, u);
        }
        let rest = 1.0 - share;
        let u = if share > 0.0 { (u - share) / rest } else { u };
        let (light, p) = match &self.finite {
            Sent::Nothing => return None,
            Sent::Few(list, weights) => weights.choose(u).map(|(i, p, _)| (list[i] as usize, p))?,
            Sent::List(list, weights) => weights.choose(u).map(|(i, p, _)| (list[i] as usize, p))?,
            Sent::Tree(tree, first) => tree.sample(&self.at, first, u)?,
        };
        Some((light, (rest * p) as f32))
    }

    /// The light in whose part of the sum of weights the number is; the last of any weight where rounding has put that behind all.
    #[inline(never)]
    fn sample_infinite(&self, share: f64, u: f64) -> Option<(usize, f32)> {
        let mut x = u / share * self.infinite;
        let mut last = None;
        for light in &self.choice.infinite {
            let weight = light.importance(&self.at);
            if weight > 0.0 {
                last = Some((light.light as usize, weight));
                if x < weight {
                    break;
                }
                x -= weight;
            }
        }
        last.map(|(light, w)| (light, (share * (w / self.infinite)) as f32))
    }

    #[inline(always)]
    fn pmf(&self, light: usize) -> f32 {
        let Some(share) = self.share else { return 0.0 };
        if let Some(index) = self.choice.infinite_index[light] {
            let weight = self.choice.infinite[index as usize].importance(&self.at);
            // Of a weight of zero the sum may be zero, too.
            return if weight > 0.0 { (share * (weight / self.infinite)) as f32 } else { 0.0 };
        }
        let place = |list: &[u32]| list.iter().position(|index| *index as usize == light);
        let part = match &self.finite {
            Sent::Nothing => 0.0,
            Sent::Few(list, weights) => place(list).map_or(0.0, |index| weights.pmf(index)),
            Sent::List(list, weights) => place(list).map_or(0.0, |index| weights.pmf(index)),
            Sent::Tree(tree, first) => tree.pmf(&self.at, first, light),
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
    #[inline(always)]
    fn importance(&self, at: &Receiver) -> f64 {
        // Of a sky that is the same all around a lobe scatters as much as what scatters all around.
        if self.wi == Vec3::ZERO || at.n == Vec3::ZERO {
            return f64::from(min(self.power, Reach::MOST));
        }
        let cos = at.n.dot(self.wi);
        if cos < -SLACK {
            return 0.0;
        }
        let cos = max(cos, SLACK);
        // Not mixed with what is sent, as the others are: there are few of these.
        let scattered = if at.lobe.share > 0.0 { at.lobe.scattered(self.wi, cos, 0.0) } else { cos };
        f64::from(min(self.power * scattered, Reach::MOST))
    }
}

/// In f64, where the luminance of no colour vanishes.
fn weigh(colour: Rgb) -> f64 {
    colour.to_array().iter().zip(Rgb::LUMINANCE).map(|(c, weight)| f64::from(*c) * f64::from(weight)).sum()
}

#[cfg(test)]
mod tests;
