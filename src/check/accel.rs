//! The accelerators against each other and the oracle, ray by ray.
//!
//! Each ray is traced by our own accelerator twice, once as it is and once one ray at a time through another tree
//! ([`Accel::build_baseline`]), and by Embree where that is compiled in. Where all say the same, or what is equally
//! far, one of [`ASKED`] rays is still put to the oracle; where they differ, it decides ([`oracle::standing`]). Whether a ray is hidden must follow from
//! its closest hit.

use super::meshes::Mesh;
use super::rays::{Aimed, BLOCK, RayKind, aim};
use crate::accel::comparison::EXAMPLES;
use crate::accel::oracle::{self, Contact, Standing, Verdict};
use crate::accel::{Accel, Accelerator, Hit, Quality, Start};
use crate::error::Result;
use crate::math::ray::Ray;
use crate::shape::Shape;
use rayon::prelude::*;

/// One of so many rays is judged by the oracle even if nobody differs by more than a tie.
pub const ASKED: u64 = 16;

/// Coordinates of Embree are smaller (its `FLT_LARGE` is 1.844·10¹⁸).
pub(super) const EMBREE_RANGE: f32 = (1u64 << 60) as f32;

/// Who answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Who {
    /// Our own accelerator.
    Native,
    /// Our own, one ray at a time.
    Baseline,
    /// Embree.
    Embree,
}

impl Who {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Baseline => "native, one ray at a time",
            Self::Embree => "embree",
        }
    }
}

/// What is wrong with an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Nothing was met by a ray that passes through the inside of a closed mesh.
    Lost,
    /// There is a true hit that is nearer.
    Missed,
    /// What was named is not met.
    False,
    /// Whether anything was met does not follow from what was met first.
    Any,
    /// Our own says something else one ray at a time.
    Unlike,
}

/// What somebody says of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Who.
    pub who: Who,
    /// The closest hit.
    pub hit: Hit,
    /// Whether there is any.
    pub any: bool,
}

/// What somebody said of a ray that is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrong {
    /// The number of the ray.
    pub index: u64,
    /// What was said.
    pub answer: Answer,
    /// What is wrong with it.
    pub fault: Fault,
}

/// What is known of one accelerator, or of our own in both forms.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// Answers that are wrong, but for lost rays.
    pub wrong: u64,
    /// Rays through a closed mesh that met nothing.
    pub lost: u64,
    /// The first few.
    pub examples: Vec<Wrong>,
}

impl Faults {
    fn add(&mut self, wrong: Wrong) {
        *(if wrong.fault == Fault::Lost { &mut self.lost } else { &mut self.wrong }) += 1;
        if self.examples.len() < EXAMPLES {
            self.examples.push(wrong);
        }
    }

    fn and(mut self, later: Self) -> Self {
        self.examples.extend(later.examples);
        self.examples.truncate(EXAMPLES);
        Self { wrong: self.wrong + later.wrong, lost: self.lost + later.lost, examples: self.examples }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.wrong == 0 && self.lost == 0
    }
}

/// What came of rays of a kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts {
    /// Rays traced.
    pub rays: u64,
    /// Rays that met something.
    pub hits: u64,
    /// Rays of which somebody said something else than another or the oracle that is as right.
    pub ties: u64,
    /// Rays that were put to the oracle.
    pub asked: u64,
    /// What our own did wrong.
    pub native: Faults,
    /// What Embree did wrong.
    pub embree: Faults,
}

impl Counts {
    /// Both together; the rays of `later` have larger numbers.
    #[must_use]
    pub fn and(self, later: Self) -> Self {
        Self {
            rays: self.rays + later.rays,
            hits: self.hits + later.hits,
            ties: self.ties + later.ties,
            asked: self.asked + later.asked,
            native: self.native.and(later.native),
            embree: self.embree.and(later.embree),
        }
    }

    /// Takes what all said of a ray. `ask` says that the oracle must be asked.
    pub fn take(&mut self, shapes: &[Shape], index: u64, aimed: &Aimed, answers: &[Answer], ask: bool) {
        self.rays += 1;
        self.hits += u64::from(answers[0].hit.is_some());
        let first = answers[0];
        let differs = |a: &Answer| a.hit != first.hit;
        let is_clear = |a: &Answer| {
            let agrees = !differs(a)
                || a.who == Who::Embree
                    && oracle::verdict(shapes, &aimed.ray, &aimed.ends[..1], a.hit, first.hit) == Verdict::Tie;
            agrees && a.any == a.hit.is_some()
        };
        let is_lost = aimed.must_hit && !first.hit.is_some();
        if !ask && !is_lost && answers.iter().all(is_clear) {
            self.ties += u64::from(answers.iter().any(differs));
            return;
        }
        self.asked += 1;
        let truth = truth(shapes, aimed).map_or(Hit::NONE, |(hit, _)| hit);
        let mut tied = false;
        for &answer in answers {
            let unlike = answer.who == Who::Baseline && (differs(&answer) || answer.any != first.any);
            let judged = if unlike { Err(Fault::Unlike) } else { judge(shapes, aimed, truth, answer) };
            match judged {
                Ok(tie) => tied |= tie,
                Err(fault) => {
                    let faults = if answer.who == Who::Embree { &mut self.embree } else { &mut self.native };
                    faults.add(Wrong { index, answer, fault });
                }
            }
        }
        self.ties += u64::from(tied);
    }
}

/// The closest hit by the oracle and its distance, without the primitive that the ray is known to start on.
pub fn truth(shapes: &[Shape], aimed: &Aimed) -> Option<(Hit, f64)> {
    oracle::closest_but(shapes, &aimed.ray, &aimed.ends[..1])
}

/// Whether a right answer is another one than the oracle's closest hit, the [`truth`]; or what is wrong with it.
pub fn judge(shapes: &[Shape], aimed: &Aimed, truth: Hit, answer: Answer) -> std::result::Result<bool, Fault> {
    let Answer { hit, any, .. } = answer;
    if aimed.must_hit && !(hit.is_some() && any) {
        return Err(Fault::Lost);
    }
    let tie = match oracle::standing(shapes, &aimed.ray, &aimed.ends[..1], truth, hit) {
        Standing::Missed => return Err(Fault::Missed),
        Standing::False => return Err(Fault::False),
        Standing::Tie => true,
        Standing::Same => false,
    };
    if any_follows(shapes, aimed, truth, answer) { Ok(tie) } else { Err(Fault::Any) }
}

/// Whether what was said of any hit follows from the closest, or on a rim may be otherwise.
///
/// Who looks for the closest knows of the start alone. If that is what the ray ends on, the oracle must say what there is
/// else, and, as Embree does, may decide about a rim in another way.
fn any_follows(shapes: &[Shape], aimed: &Aimed, truth: Hit, answer: Answer) -> bool {
    let Answer { who, hit, any } = answer;
    let end = aimed.ends[1];
    let meets_end = end.is_some() && [hit, truth].contains(&end);
    let others = || oracle::closest_but(shapes, &aimed.ray, &aimed.ends).map_or(Hit::NONE, |(hit, _)| hit);
    let truth = if meets_end { others() } else { truth };
    let hit = if meets_end && hit == end { truth } else { hit };
    // Embree takes other code for any hit; ours may not differ.
    let is_strict = who != Who::Embree && !meets_end;
    let certain = |hit: Hit| hit.is_some() && matches!(oracle::contact(shapes, hit, &aimed.ray), Contact::Inside(..));
    let may_be = || oracle::may_be_occluded(shapes, &aimed.ray, &aimed.ends);
    any == hit.is_some() || !is_strict && if any { may_be() } else { !certain(hit) && !certain(truth) }
}

/// The accelerators over one mesh.
#[derive(Debug)]
pub struct Contest<'a> {
    mesh: &'a Mesh,
    seed: u64,
    accels: Vec<(Who, Accel)>,
}

impl<'a> Contest<'a> {
    /// Builds all that there are and that can take the mesh.
    pub fn new(mesh: &'a Mesh, seed: u64) -> Result<Self> {
        let mut accels = vec![
            (Who::Native, Accel::build(Accelerator::Native, &mesh.shapes, 0, Quality::High)?),
            (Who::Baseline, Accel::build_baseline(&mesh.shapes)?),
        ];
        if cfg!(feature = "embree") && mesh.suits_embree {
            accels.push((Who::Embree, Accel::build(Accelerator::Embree, &mesh.shapes, 0, Quality::Medium)?));
        }
        Ok(Self { mesh, seed, accels })
    }

    /// Whether Embree is among them.
    pub fn has_embree(&self) -> bool {
        self.accels.iter().any(|(who, _)| *who == Who::Embree)
    }

    /// What comes of the rays with the numbers `from` to `to`, on the current rayon pool. It does not depend on how many
    /// threads that has.
    pub fn run(&self, kind: RayKind, from: u64, to: u64) -> Counts {
        let block = |block: u64| {
            let mut counts = Counts::default();
            for (place, (aimed, answers)) in self.block(kind, block).iter().enumerate() {
                let index = block * BLOCK + place as u64;
                if (from..to).contains(&index) {
                    counts.take(&self.mesh.shapes, index, aimed, answers, index.is_multiple_of(ASKED));
                }
            }
            counts
        };
        (from / BLOCK..to.div_ceil(BLOCK)).into_par_iter().map(block).reduce(Counts::default, Counts::and)
    }

    /// A ray, and what each says of it, as in [`Self::run`].
    pub fn answers(&self, kind: RayKind, index: u64) -> (Aimed, Vec<Answer>) {
        self.block(kind, index / BLOCK).swap_remove((index % BLOCK) as usize)
    }

    /// The rays of a [`BLOCK`], and what each says of each. Always all of them, so that a ray has the same neighbours
    /// however many are asked for.
    fn block(&self, kind: RayKind, block: u64) -> Vec<(Aimed, Vec<Answer>)> {
        let aimed: Vec<Aimed> = (0..BLOCK).map(|i| aim(self.mesh, kind, self.seed, block * BLOCK + i)).collect();
        let answers = self.ask(kind, &aimed);
        aimed.into_iter().zip(answers).collect()
    }

    /// What each says of each ray, our own first. Of a ray that is beyond its range Embree is not asked.
    fn ask(&self, kind: RayKind, aimed: &[Aimed]) -> Vec<Vec<Answer>> {
        let mut answers = vec![Vec::with_capacity(self.accels.len()); aimed.len()];
        for (who, accel) in &self.accels {
            let takes = |i: &usize| *who != Who::Embree || suits_embree(&aimed[*i].ray);
            let places: Vec<usize> = (0..aimed.len()).filter(takes).collect();
            let rays: Vec<Ray> = places.iter().map(|&i| aimed[i].ray).collect();
            let mut hits = vec![Hit::NONE; rays.len()];
            let mut any = vec![false; rays.len()];
            let ends: Vec<[Hit; 2]> = places.iter().map(|&i| aimed[i].ends).collect();
            let starts: Vec<Hit> = ends.iter().map(|ends| ends[0]).collect();
            let (start, ends) = match kind {
                RayKind::Left | RayKind::Between => (Start::Primitives(&starts), &ends[..]),
                RayKind::Camera => (Start::Camera, &[][..]),
                _ => (Start::Anywhere, &[][..]),
            };
            accel.closest_hits_from(&rays, start, &mut hits);
            accel.occluded_between(&rays, ends, &mut any);
            for ((&i, &hit), &any) in places.iter().zip(&hits).zip(&any) {
                answers[i].push(Answer { who: *who, hit, any });
            }
        }
        answers
    }
}

/// Whether Embree takes such a ray; builds with assertions abort at others.
fn suits_embree(ray: &Ray) -> bool {
    ray.o.abs().max(ray.d.abs()).max_element() < EMBREE_RANGE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::meshes::MESHES;
    use crate::check::random::Rng;
    use glam::Vec3;

    /// A square of two triangles at z = 0, one at z = 1, and one beside them.
    fn squares() -> Vec<Shape> {
        let at = |x: f32, z: f32| {
            let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| Vec3::new(x + u, v, z));
            [[a, b, c], [a, c, d]]
        };
        vec![crate::check::meshes::soup(&[at(0.0, 0.0), at(0.0, 1.0), at(5.0, 0.0)].concat())]
    }

    fn counted(ray: Ray, must_hit: bool, hit: Option<u32>, any: bool) -> Counts {
        let hit = hit.map_or(Hit::NONE, |primitive| Hit { shape: 0, primitive });
        let answers = [Answer { who: Who::Native, hit, any }];
        let mut counts = Counts::default();
        counts.take(&squares(), 3, &Aimed { ray, must_hit, ends: [Hit::NONE; 2] }, &answers, true);
        counts
    }

    #[test]
    fn wrong_answers_are_noticed() {
        let ray = Ray::new(Vec3::new(0.75, 0.25, -1.0), Vec3::Z);
        assert_eq!(counted(ray, false, Some(0), true), Counts { rays: 1, hits: 1, asked: 1, ..Counts::default() });
        for (must_hit, hit, any, fault) in [
            (false, None, false, Fault::Missed),
            (true, None, false, Fault::Lost),
            (true, Some(0), false, Fault::Lost),
            (false, Some(1), true, Fault::False),
            (false, Some(4), true, Fault::False),
            (false, Some(2), true, Fault::Missed),
            (false, Some(0), false, Fault::Any),
        ] {
            let counts = counted(ray, must_hit, hit, any);
            assert_eq!(counts.native.wrong + counts.native.lost, 1, "{hit:?}");
            assert_eq!(counts.native.lost == 1, fault == Fault::Lost, "{hit:?}");
            assert_eq!((counts.native.examples[0].fault, counts.native.examples[0].index), (fault, 3), "{hit:?}");
            assert!(!counts.native.is_empty() && counts.embree.is_empty());
        }
        assert_eq!(counted(Ray::new(ray.o, -ray.d), false, None, true).native.examples[0].fault, Fault::Any);
    }

    #[test]
    fn on_a_rim_either_is_right_but_nothing_behind() {
        let ray = Ray::new(Vec3::new(0.5, 0.5, -1.0), Vec3::Z);
        for primitive in [0, 1] {
            assert!(counted(ray, true, Some(primitive), true).native.is_empty());
        }
        let beside = Ray { o: Vec3::new(1.0, 0.25, -1.0), ..ray };
        assert!(counted(beside, false, Some(0), true).native.is_empty());
        assert!(counted(beside, false, None, false).native.is_empty());
        // Past the rim of both squares f32 may go; but not past what is behind, were that met for certain.
        assert!(counted(ray, false, Some(3), true).native.is_empty());
        let mut shapes = squares();
        shapes.push(crate::check::meshes::soup(&[
            [Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y].map(|v| v - Vec3::new(0.25, 0.25, -0.5))
        ]));
        let answer = Answer { who: Who::Embree, hit: Hit { shape: 0, primitive: 3 }, any: true };
        let mut counts = Counts::default();
        counts.take(&shapes, 0, &Aimed { ray, must_hit: false, ends: [Hit::NONE; 2] }, &[answer], true);
        assert_eq!((counts.embree.examples[0].fault, counts.embree.wrong), (Fault::Missed, 1));
    }

    /// What is as right, but not the same.
    #[test]
    fn both_forms_of_our_own_must_agree() {
        let ray = Ray::new(Vec3::new(0.5, 0.5, -1.0), Vec3::Z);
        let answer = |who, primitive| Answer { who, hit: Hit { shape: 0, primitive }, any: true };
        for (who, fault) in [(Who::Embree, None), (Who::Baseline, Some(Fault::Unlike))] {
            let mut counts = Counts::default();
            let answers = [answer(Who::Native, 0), answer(who, 1)];
            let aimed = Aimed { ray, must_hit: true, ends: [Hit::NONE; 2] };
            counts.take(&squares(), 1, &aimed, &answers, false);
            assert_eq!(counts.native.examples.first().map(|wrong| wrong.fault), fault);
            assert!(counts.embree.is_empty());
        }
    }

    /// With what a ray starts and ends on left out: there are two squares, the second, nearer half of the first is known.
    #[test]
    fn wrong_answers_with_known_ends_are_noticed() {
        let hit = |primitive| Hit { shape: 0, primitive };
        let ray = Ray::new(Vec3::new(0.75, 0.25, -1.0), Vec3::Z);
        for (ends, met, any, fault) in [
            ([hit(0), Hit::NONE], hit(2), true, None),
            ([hit(0), Hit::NONE], hit(0), true, Some(Fault::False)),
            ([hit(0), Hit::NONE], Hit::NONE, false, Some(Fault::Missed)),
            ([hit(0), Hit::NONE], hit(2), false, Some(Fault::Any)),
            ([hit(2), Hit::NONE], hit(2), true, Some(Fault::False)),
            ([hit(2), Hit::NONE], hit(0), true, None),
            ([hit(0), hit(2)], hit(2), false, None),
            ([hit(0), hit(2)], hit(2), true, Some(Fault::Any)),
            ([hit(0), hit(2)], Hit::NONE, false, Some(Fault::Missed)),
            ([hit(4), hit(0)], hit(0), true, None),
            ([hit(4), hit(0)], hit(0), false, Some(Fault::Any)),
            ([hit(4), hit(0)], hit(2), true, Some(Fault::Missed)),
        ] {
            let mut counts = Counts::default();
            let answer = Answer { who: Who::Native, hit: met, any };
            counts.take(&squares(), 0, &Aimed { ray, must_hit: false, ends }, &[answer], true);
            assert_eq!(counts.native.examples.first().map(|wrong| wrong.fault), fault, "{ends:?} {met:?} {any}");
        }
    }

    /// A ray has the same answers alone and among others, and what it is known to start on is not met.
    #[test]
    fn rays_are_asked_with_what_is_known() {
        let mesh = Mesh::new(0, 6);
        let contest = Contest::new(&mesh, 6).unwrap();
        for kind in [RayKind::Left, RayKind::Between, RayKind::Camera] {
            let all = contest.block(kind, 1);
            for (place, (aimed, answers)) in all.iter().enumerate().step_by(50) {
                assert_eq!(contest.answers(kind, BLOCK + place as u64), (*aimed, answers.clone()));
            }
            let known = |aimed: &Aimed| aimed.ends.iter().filter(|hit| hit.is_some()).count();
            let expected = match kind {
                RayKind::Left => 1,
                RayKind::Between => 2,
                _ => 0,
            };
            assert!(all.iter().all(|(aimed, _)| known(aimed) == expected), "{}", kind.name());
        }
        // Through what it is said to start on, to something else. Embree, to which that is untrue, need not believe it.
        let ray = Ray::new(mesh.centre + 2.0 * Vec3::Z, -Vec3::Z);
        let aimed = |ends| Aimed { ray, must_hit: false, ends };
        let first = contest.ask(RayKind::Random, &[aimed([Hit::NONE; 2])])[0][0].hit;
        assert!(first.is_some());
        let left = aimed([first, Hit::NONE]);
        let (second, _) = truth(&mesh.shapes, &left).unwrap();
        assert_ne!(first, second);
        let answers = contest.ask(RayKind::Left, &[left]).concat();
        for answer in answers.iter().filter(|answer| answer.who != Who::Embree) {
            assert_eq!(judge(&mesh.shapes, &left, second, *answer), Ok(false), "{answer:?}");
        }
    }

    /// The same counts for one thread and for three, and in parts.
    #[test]
    fn threads_and_parts_change_nothing() {
        let mesh = Mesh::new(8, 5);
        assert_eq!(MESHES[8].0, "sphere");
        let contest = Contest::new(&mesh, 5).unwrap();
        let whole = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| contest.run(RayKind::Vertex, 0, 9000))
        };
        let all = whole(1);
        assert_eq!(all, whole(3));
        assert_eq!(all, contest.run(RayKind::Vertex, 0, 1234).and(contest.run(RayKind::Vertex, 1234, 9000)));
        assert_eq!((all.rays, all.hits), (9000, 9000));
        assert!(Rng::of(5, &[1]).next() != Rng::of(6, &[1]).next());
    }
}
