//! Rays spawned from random points of random surfaces: none meets its own surface, none skips a neighbour.
//!
//! A trial is a ray from a point of a surface, found and left as the renderer finds and leaves it ([`crate::shape::Shape::meet`],
//! [`SurfacePoint::origin_towards`]), in a direction whose cosine to the normal is anything from 10⁻⁷ to 1. Nobody is told
//! where it starts. Beside each surface lies another like a skin ([`pairs`]), half a binary order to fourteen farther than
//! offset and tests may err by; what leads towards it must meet it, or the ray would pass through walls. In every
//! [`SEGMENTS`]-th trial, a segment from the surface to its neighbour must be free.

pub mod pairs;

use super::random::Rng;
use crate::accel::oracle::{self, Contact};
use crate::accel::{Accel, Accelerator, Hit, Quality, Start};
use crate::error::Result;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::ray::Ray;
use crate::shape::Shape;
use crate::shape::offset::SurfacePoint;
use glam::{DVec3, Vec3};
use pairs::{Departure, Kind, Pair, Pairs};
use rayon::prelude::*;

/// Trials of one mesh.
pub const TRIALS: u64 = 4096;

/// A segment to the neighbour is asked once in so many trials.
const SEGMENTS: u64 = 4;

/// Trials that are asked together.
const BATCH: u64 = 256;

/// Exponents of the cosines between rays and normals: 10⁻⁷ to 1.
const COSINES: [f32; 2] = [-23.3, 0.0];

/// Failures that are kept of all.
const EXAMPLES: usize = 8;

/// A segment is only asked where the neighbour is so many bounds away: both of its ends are moved, the farther one by the
/// extent of the segment, too.
const SEGMENT_BOUNDS: f64 = 4.0;

/// And so many roundings of its length: the farther end is moved by eight, and the side is told from a product with a normal.
const SEGMENT_ROUNDINGS: f64 = 32.0;

/// What is met again is told from where a ray starts if it is so many bounds away.
const BACK_BOUNDS: f64 = 8.0;

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The ray met the surface that it starts on, where it does not come back to it.
    Own,
    /// The ray started behind the neighbour.
    Jumped,
    /// The ray passed through the neighbour.
    Missed,
    /// A segment between the two surfaces was hidden by one of them.
    Hidden,
}

/// Who answered.
pub const WHO: [&str; 2] = ["native", "embree"];

/// A trial that failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Failure {
    /// Its number.
    pub index: u64,
    /// Who failed, in [`WHO`].
    pub who: usize,
    /// What happened.
    pub fault: Fault,
    /// The ray.
    pub ray: Ray,
    /// What was met.
    pub met: Hit,
}

/// What came of trials.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts {
    /// Rays that were spawned, each put to all that there are.
    pub trials: u64,
    /// Rays of these that Embree was asked about.
    pub of_embree: u64,
    /// Rays towards a neighbour.
    pub towards: u64,
    /// Rays of these that met it: others pass beside it at a small angle, or meet another surface first.
    pub met: u64,
    /// Segments that had to be free.
    pub segments: u64,
    /// Failures of each of [`WHO`].
    pub failures: [u64; 2],
    /// Of Embree's those that are nothing but a hit that it did not find.
    pub lost_by_embree: u64,
    /// The first few.
    pub examples: Vec<Failure>,
}

impl Counts {
    /// Both together; the trials of `later` have larger numbers.
    #[must_use]
    pub fn and(mut self, later: Self) -> Self {
        self.examples.extend(later.examples);
        self.examples.truncate(EXAMPLES);
        Self {
            trials: self.trials + later.trials,
            of_embree: self.of_embree + later.of_embree,
            towards: self.towards + later.towards,
            met: self.met + later.met,
            segments: self.segments + later.segments,
            failures: [0, 1].map(|i| self.failures[i] + later.failures[i]),
            lost_by_embree: self.lost_by_embree + later.lost_by_embree,
            examples: self.examples,
        }
    }
}

/// A ray that was spawned.
struct Trial {
    index: u64,
    pair: usize,
    at: SurfacePoint,
    ray: Ray,
    /// Whether it leads to the neighbour, which is farther than the bound.
    towards: bool,
    /// A segment to the neighbour, if there is room.
    segment: Option<Ray>,
}

/// One mesh with its accelerators.
struct Place {
    pairs: Pairs,
    accels: Vec<(usize, Accel)>,
}

impl Place {
    fn new(kind: Kind, seed: u64, mesh: u64) -> Result<Option<Self>> {
        let Some(pairs) = Pairs::new(kind, seed, mesh) else { return Ok(None) };
        let mut accels = vec![(0, Accel::build(Accelerator::Native, &pairs.shapes, 0, Quality::Low)?)];
        if cfg!(feature = "embree") && pairs.suits_embree {
            accels.push((1, Accel::build(Accelerator::Embree, &pairs.shapes, 1, Quality::Medium)?));
        }
        Ok(Some(Self { pairs, accels }))
    }

    fn trial(&self, kind: Kind, seed: u64, index: u64) -> Trial {
        let rng = &mut Rng::of(seed, &[kind as u64, 1, index]);
        let number = rng.below(self.pairs.pairs.len());
        let pair = &self.pairs.pairs[number];
        let at = self.pairs.start(rng, pair);
        let w = direction(rng, at.n);
        let ray = Ray::new(at.origin_towards(w), w);
        let height = self.pairs.height(pair, &at);
        let bound = self.pairs.bound(pair, &at);
        let towards = height.abs() > bound && (height > 0.0) == (at.n.dot(w) > 0.0);
        let has_room = index.is_multiple_of(SEGMENTS) && height.abs() > SEGMENT_BOUNDS * bound;
        let segment = has_room.then(|| self.segment(rng, pair, &at, height.abs())).flatten();
        Trial { index, pair: number, at, ray, towards, segment }
    }

    /// A segment from a point of a flat surface to a random one of its neighbour.
    fn segment(&self, rng: &mut Rng, pair: &Pair, at: &SurfacePoint, height: f64) -> Option<Ray> {
        let end = self.pairs.end(rng, pair);
        let way = end.p - at.p;
        // Nobody can tell on which side of a surface a direction in f32 leads that is as good as in it.
        if height < SEGMENT_ROUNDINGS * f64::from(UNIT_ROUNDOFF) * way.length() {
            return None;
        }
        // Between curved surfaces the nearer may be in the way.
        self.pairs.departure(pair, at, way).is_none().then(|| {
            let way = way.as_vec3();
            Ray::segment(at.origin_towards(way), end.end_towards(-way, way.abs()))
        })
    }

    /// What trials with these numbers come to.
    fn run(&self, kind: Kind, seed: u64, from: u64, to: u64) -> Counts {
        let trials: Vec<Trial> = (from..to).map(|index| self.trial(kind, seed, index)).collect();
        let mut counts = Counts { trials: to - from, ..Counts::default() };
        counts.towards = trials.iter().filter(|t| t.towards).count() as u64;
        let rays: Vec<Ray> = trials.iter().map(|t| t.ray).collect();
        let segments: Vec<Ray> = trials.iter().filter_map(|t| t.segment).collect();
        counts.segments = segments.len() as u64;
        let own = |t: &Trial| self.pairs.pairs[t.pair].own;
        let both = |t: &Trial| [own(t), self.pairs.pairs[t.pair].neighbour];
        let starts: Vec<Hit> = trials.iter().map(own).collect();
        let ends: Vec<[Hit; 2]> = trials.iter().filter(|t| t.segment.is_some()).map(both).collect();
        for (who, accel) in &self.accels {
            counts.of_embree += if *who == 1 { counts.trials } else { 0 };
            let mut hits = vec![Hit::NONE; rays.len()];
            accel.closest_hits_from(&rays, Start::Primitives(&starts), &mut hits);
            if *who == 0 {
                let met = |(trial, met): &(&Trial, &Hit)| trial.towards && **met == both(trial)[1];
                counts.met = trials.iter().zip(&hits).filter(met).count() as u64;
            }
            let failures = trials.iter().zip(&hits).filter_map(|(trial, &met)| {
                let fault = self.judge(trial, met)?;
                Some(Failure { index: trial.index, who: *who, fault, ray: trial.ray, met })
            });
            let mut hidden = vec![false; segments.len()];
            accel.occluded_between(&segments, &ends, &mut hidden);
            let of_segments = trials.iter().filter_map(|t| t.segment.map(|s| (t, s))).zip(&hidden);
            let hidden = of_segments.filter(|((trial, segment), hidden)| **hidden && !self.others_hide(trial, segment));
            let hidden = hidden.map(|((trial, ray), _)| Failure {
                index: trial.index,
                who: *who,
                fault: Fault::Hidden,
                ray,
                met: Hit::NONE,
            });
            let failures: Vec<Failure> = failures.chain(hidden).collect();
            counts.failures[*who] += failures.len() as u64;
            let lost = |failure: &&Failure| failure.who == 1 && failure.fault == Fault::Missed;
            counts.lost_by_embree += failures.iter().filter(lost).count() as u64;
            counts.examples.extend(failures.into_iter().take(EXAMPLES));
        }
        counts.examples.sort_by_key(|failure| failure.index);
        counts.examples.truncate(EXAMPLES);
        counts
    }

    /// Whether anything but the pair may be in the way of a segment.
    fn others_hide(&self, trial: &Trial, segment: &Ray) -> bool {
        let Pair { own, neighbour, .. } = self.pairs.pairs[trial.pair];
        oracle::may_be_occluded(&self.pairs.shapes, segment, &[own, neighbour])
    }

    fn judge(&self, trial: &Trial, met: Hit) -> Option<Fault> {
        let pair = &self.pairs.pairs[trial.pair];
        if met == pair.own && !self.comes_back(trial) {
            return Some(Fault::Own);
        }
        if !trial.towards || met == pair.neighbour {
            return None;
        }
        // Rarely: what leads away at a small angle passes beside the neighbour, or meets another pair.
        let shapes = &self.pairs.shapes;
        if self.is_behind(trial) {
            return Some(Fault::Jumped);
        }
        let t = self.meets(pair.neighbour, &trial.ray)?;
        let nearer = met.is_some()
            && match oracle::contact(shapes, met, &trial.ray) {
                Contact::Inside(other, error) | Contact::Rim(other, error) => other <= t + error,
                Contact::Miss => false,
            };
        (!nearer).then_some(Fault::Missed)
    }

    /// Where the ray certainly meets a surface: what is known of rims of quadrics, all know by the same code.
    fn meets(&self, hit: Hit, ray: &Ray) -> Option<f64> {
        let shape = &self.pairs.shapes[hit.shape as usize];
        let is_quadric = match shape {
            Shape::Mesh(_) => false,
            Shape::Placed(placed) => !matches!(placed.shape(), Shape::Mesh(_)),
            _ => true,
        };
        if is_quadric {
            return shape.intersect(hit.primitive, ray).map(|_| shape.resolve_distance(hit.primitive, ray));
        }
        let contact = oracle::contact(&self.pairs.shapes, hit, ray);
        if let Contact::Inside(t, _) = contact { Some(t) } else { None }
    }

    /// Whether a ray that met its own surface does so a second time, as it does on the inside of a curved one. Which side that
    /// is, the rounded normal says; where it is wrong by its rounding, the ray runs in the surface.
    fn comes_back(&self, trial: &Trial) -> bool {
        let pair = &self.pairs.pairs[trial.pair];
        let w = trial.ray.d.as_dvec3();
        let Some(Departure { chord, outward, skew }) = self.pairs.departure(pair, &trial.at, w) else { return false };
        let n = trial.at.n.as_dvec3();
        let n = n * outward.dot(n).signum();
        if (n.dot(w) < 0.0) != (chord > 0.0) {
            let error = NORMAL_ROUNDINGS * f64::from(UNIT_ROUNDOFF) * skew;
            return (n - outward).length() <= error && outward.dot(w).abs() <= error;
        }
        // What is no thicker than the bound nobody can be on one side of.
        let bound = BACK_BOUNDS * self.pairs.bound(pair, &trial.at);
        let through = self.pairs.departure(pair, &trial.at, -outward).map_or(0.0, |d| d.chord);
        let shape = &self.pairs.shapes[pair.own.shape as usize];
        let again = || shape.resolve_distance(pair.own.primitive, &trial.ray) > 0.5 * chord;
        chord > 0.0 && (through < bound || chord < bound || again())
    }

    /// Whether the ray starts on the other side of the neighbour.
    fn is_behind(&self, trial: &Trial) -> bool {
        let pair = &self.pairs.pairs[trial.pair];
        let height = self.pairs.height(pair, &trial.at);
        let moved = trial.at.n.as_dvec3().normalize().dot(trial.ray.o.as_dvec3() - trial.at.p);
        moved.abs() >= height.abs() && (moved > 0.0) == (height > 0.0)
    }
}

/// Roundings of f32 that a unit normal has, and the map that it goes through may magnify: three of its coordinates, those of
/// its dot product with a direction, and that direction's.
const NORMAL_ROUNDINGS: f64 = 8.0;

/// A unit vector with a random cosine to the normal `n`, over many decades.
fn direction(rng: &mut Rng, n: Vec3) -> Vec3 {
    let n = n.as_dvec3();
    let cos = rng.power(COSINES[0], COSINES[1]) * f64::from(rng.sign());
    let along: DVec3 = n.cross(rng.direction().as_dvec3()).normalize_or(n.any_orthonormal_vector());
    (along * (1.0 - cos * cos).max(0.0).sqrt() + n * cos).normalize().as_vec3()
}

/// What comes of the trials with the numbers `from` to `to`, on the current rayon pool, whatever its threads.
pub fn run(kind: Kind, seed: u64, from: u64, to: u64) -> Result<Counts> {
    let mesh = |mesh: u64| -> Result<Counts> {
        let (first, last) = (from.max(mesh * TRIALS), to.min((mesh + 1) * TRIALS));
        let Some(place) = Place::new(kind, seed, mesh)? else { return Ok(Counts::default()) };
        let batches = (first / BATCH..last.div_ceil(BATCH))
            .map(|batch| place.run(kind, seed, first.max(batch * BATCH), last.min((batch + 1) * BATCH)));
        Ok(batches.fold(Counts::default(), Counts::and))
    };
    (from / TRIALS..to.div_ceil(TRIALS)).into_par_iter().map(mesh).try_reduce(Counts::default, |a, b| Ok(a.and(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20,000 rays of each kind, and those that once met the inside of a thin cylinder at once, as rounding along it took their
    /// origins outside.
    #[test]
    fn rays_leave_their_surfaces() {
        for kind in Kind::ALL {
            let counts = run(kind, 3, 0, 20_000).unwrap();
            assert_eq!(counts.failures[0], 0, "{kind:?}: {counts:?}");
            assert!(counts.towards > 5000, "{kind:?}: {counts:?}");
        }
        for index in [6_411_857, 6_414_183, 7_725_798, 14_850_734, 15_146_201, 15_146_553, 16_351_773, 16_353_087] {
            let counts = run(Kind::Cylinder, 0, index, index + 1).unwrap();
            assert_eq!((counts.trials, counts.failures[0]), (1, 0), "{index}: {counts:?}");
        }
    }

    fn place(kind: Kind) -> Place {
        (0..).find_map(|mesh| Place::new(kind, 1, mesh).unwrap()).unwrap()
    }

    /// Of trials that lead to a neighbour, at ten meshes: the surface itself, nothing, the neighbour, and an origin behind it.
    #[test]
    fn wrong_answers_are_noticed() {
        let (mut noticed, mut met) = (0, 0);
        for place in (0..10).filter_map(|mesh| Place::new(Kind::Triangle, 1, mesh).unwrap()) {
            let trials = (0..500).map(|index| place.trial(Kind::Triangle, 1, index));
            for trial in trials.filter(|trial| trial.towards) {
                let Pair { own, neighbour, .. } = place.pairs.pairs[trial.pair];
                assert_eq!(place.judge(&trial, own), Some(Fault::Own));
                assert_eq!(place.judge(&trial, neighbour), None);
                met += usize::from(place.pairs.shapes[0].intersect(neighbour.primitive, &trial.ray).is_some());
                noticed += usize::from(place.judge(&trial, Hit::NONE) == Some(Fault::Missed));
                let height = place.pairs.height(&place.pairs.pairs[trial.pair], &trial.at);
                let o = (trial.at.p + trial.at.n.as_dvec3() * (2.0 * height)).as_vec3();
                let behind = Trial { ray: Ray { o, ..trial.ray }, ..trial };
                assert_eq!(place.judge(&behind, Hit::NONE), Some(Fault::Jumped));
            }
        }
        // On a rim either answer is right.
        assert!(met > 300 && noticed > met / 2 && noticed <= met, "{noticed} of {met}");
    }

    /// From inside a sphere, its other side is met; from outside it is not.
    #[test]
    fn what_comes_back_is_told_from_what_never_left() {
        let place = place(Kind::Sphere);
        let (mut inside, mut outside) = (0, 0);
        for index in 0..2000 {
            let trial = place.trial(Kind::Sphere, 1, index);
            let pair = &place.pairs.pairs[trial.pair];
            let leads_in = place.pairs.departure(pair, &trial.at, trial.ray.d.as_dvec3()).unwrap().chord > 0.0;
            if trial.at.n.dot(trial.ray.d).abs() < 1e-3 {
                continue;
            }
            assert_eq!(place.judge(&trial, pair.own) == Some(Fault::Own), !leads_in);
            *(if leads_in { &mut inside } else { &mut outside }) += 1;
        }
        assert!(inside > 300 && outside > 300, "{inside} {outside}");
    }
}
