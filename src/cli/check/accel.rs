//! `snell check --accel`: whether accelerators are right about nasty rays.

use super::page::{self, chosen, print};
use crate::accel::{Hit, oracle};
use crate::check::accel::{ASKED, Answer, Contest, Counts, Faults, Wrong, judge, truth};
use crate::check::meshes::{MESHES, Mesh};
use crate::check::rays::{Aimed, RayKind, aim};
use crate::cli::args::CheckArgs;
use crate::error::{Error, Result};
use crate::math::ray::Ray;
use glam::Vec3;
use std::io::Write;
use std::time::Instant;

/// Wrong answers that are shown of each kind and mesh.
const SHOWN: usize = 3;

/// After so many rays of a kind and mesh a line says how far it is.
const STEP: u64 = 1 << 24;

/// Random rays of `--long`, in all.
const LONG_RANDOM: u64 = 100_000_000;

/// Rays at edges and vertices of closed meshes of `--long`, in all.
const LONG_RIM: u64 = 1_000_000_000;

/// Rays of every other kind at each mesh.
const LONG_OTHER: u64 = 1_000_000;

/// Rays of each kind at each mesh, unless the user says how many; and where they are one check of many.
const RAYS: u64 = 8000;
const FEW_RAYS: u64 = 1500;

/// The whole table, or one ray. Returns whether our own accelerator is right.
pub(super) fn run(args: &CheckArgs) -> Result<bool> {
    let meshes = chosen("mesh", args.mesh.as_deref(), &MESHES.map(|(name, _)| name))?;
    let kinds = chosen("kind", args.kind.as_deref(), &RayKind::ALL.map(RayKind::name))?;
    match args.ray {
        Some(_) if args.mesh.is_none() => Err(Error::Usage("--ray: which mesh's? Expected --mesh, too".into())),
        Some(index) => replay(args, meshes[0], RayKind::ALL[kinds[0]], index),
        None => all(args, &meshes, &kinds),
    }
}

/// A line for each mesh. Returns whether our own accelerator is right.
pub(super) fn summary(args: &CheckArgs) -> Result<bool> {
    let mut right = true;
    for (index, (name, what)) in MESHES.into_iter().enumerate() {
        let mesh = Mesh::new(index, args.seed);
        let contest = Contest::new(&mesh, args.seed)?;
        let mut sum = Counts::default();
        let mut wrong = Vec::new();
        for kind in RayKind::ALL {
            let counts = trace(&contest, &mesh, kind, rays(args, &mesh, kind, FEW_RAYS));
            wrong.extend(counts.native.examples.iter().map(|wrong| (kind, wrong.index)));
            sum = sum.and(counts);
        }
        let embree = sum.embree.wrong + sum.embree.lost;
        let of_embree = if embree > 0 { format!("; {embree} wrong ones of embree") } else { String::new() };
        page::line("accel", name, &format!("{} rays, {what}{of_embree}", sum.rays), sum.native.is_empty());
        for (kind, index) in wrong.into_iter().take(SHOWN) {
            page::replay(&replay_line(&mesh, kind, index, args.seed));
        }
        right &= sum.native.is_empty();
    }
    Ok(right)
}

/// How many rays of a kind are for a mesh.
fn rays(args: &CheckArgs, mesh: &Mesh, kind: RayKind, default: u64) -> u64 {
    let closed = || (0..MESHES.len()).filter(|&i| Mesh::new(i, args.seed).is_closed()).count() as u64;
    match kind {
        _ if !args.long => args.rays.unwrap_or(default),
        RayKind::Random => LONG_RANDOM.div_ceil(MESHES.len() as u64),
        RayKind::Edge | RayKind::Vertex if mesh.is_closed() => LONG_RIM.div_ceil(2 * closed()),
        _ => LONG_OTHER,
    }
}

/// The table. Returns whether our own is right.
fn all(args: &CheckArgs, meshes: &[usize], kinds: &[usize]) -> Result<bool> {
    print(format_args!("{:<10} {:<8} {:>10} {:>10} {:>8} | {:^15} | {:^15} |", "", "", "", "", "", "native", "embree"));
    print(format_args!(
        "{:<10} {:<8} {:>10} {:>10} {:>8} | {:>7} {:>7} | {:>7} {:>7} |",
        "mesh", "rays", "number", "hits", "ties", "wrong", "lost", "wrong", "lost"
    ));
    let start = Instant::now();
    let (mut sum, mut must_hit) = (Counts::default(), 0);
    for &index in meshes {
        let mesh = Mesh::new(index, args.seed);
        let contest = Contest::new(&mesh, args.seed)?;
        for &kind in kinds {
            let kind = RayKind::ALL[kind];
            let counts = trace(&contest, &mesh, kind, rays(args, &mesh, kind, RAYS));
            row(args, &contest, &mesh, kind, &counts);
            must_hit += if can_lose(&mesh, kind) { counts.rays } else { 0 };
            sum = sum.and(counts);
        }
    }
    let Counts { rays, asked, ties, native, embree, .. } = &sum;
    print(format_args!(
        "{rays} rays in {:.1} s, {must_hit} of them through closed meshes",
        start.elapsed().as_secs_f64()
    ));
    print(format_args!(
        "{asked} were put to the oracle: one of {ASKED}, and all where answers differ by more; {ties} were ties or on rims"
    ));
    print(format_args!(
        "native: {} wrong, {} lost; embree: {} wrong, {} lost",
        native.wrong, native.lost, embree.wrong, embree.lost
    ));
    Ok(native.is_empty())
}

/// Whether rays of a kind are known to meet something.
fn can_lose(mesh: &Mesh, kind: RayKind) -> bool {
    mesh.is_closed() && matches!(kind, RayKind::Edge | RayKind::Vertex)
}

/// Traces in steps, and says after each how far it is.
fn trace(contest: &Contest<'_>, mesh: &Mesh, kind: RayKind, rays: u64) -> Counts {
    let mut counts = Counts::default();
    let start = Instant::now();
    while counts.rays < rays {
        let done = counts.rays;
        counts = counts.and(contest.run(kind, done, rays.min(done + STEP)));
        if counts.rays < rays {
            let (percent, seconds) = (100 * counts.rays / rays, start.elapsed().as_secs_f64());
            let _ = writeln!(std::io::stderr(), "{} {}: {percent} % after {seconds:.0} s", mesh.name, kind.name());
        }
    }
    counts
}

/// A line of the table, and what was answered wrong.
fn row(args: &CheckArgs, contest: &Contest<'_>, mesh: &Mesh, kind: RayKind, counts: &Counts) {
    let right = counts.native.is_empty();
    let word = page::verdict(right);
    let lost = |faults: &Faults| if can_lose(mesh, kind) { faults.lost.to_string() } else { "-".into() };
    let embree = if contest.has_embree() {
        [counts.embree.wrong.to_string(), lost(&counts.embree)]
    } else {
        ["-".into(), "-".into()]
    };
    print(format_args!(
        "{:<10} {:<8} {:>10} {:>10} {:>8} | {:>7} {:>7} | {:>7} {:>7} | {word}",
        mesh.name,
        kind.name(),
        counts.rays,
        counts.hits,
        counts.ties,
        counts.native.wrong,
        lost(&counts.native),
        embree[0],
        embree[1],
    ));
    let of_embree = if args.verbose { &counts.embree.examples[..] } else { &[] };
    for wrong in counts.native.examples.iter().take(SHOWN).chain(of_embree.iter().take(SHOWN)) {
        show(args, mesh, kind, wrong);
    }
}

fn show(args: &CheckArgs, mesh: &Mesh, kind: RayKind, wrong: &Wrong) {
    let Wrong { index, answer, fault } = wrong;
    let aimed = aim(mesh, kind, args.seed, *index);
    print(format_args!("  {}: {fault:?}: {}", answer.who.name(), said(answer)));
    print(format_args!("    oracle: {}", find(mesh, &aimed).1));
    print(format_args!("    {}", literal(&aimed.ray)));
    print(format_args!("    {}", replay_line(mesh, kind, *index, args.seed)));
}

/// The command that traces a ray alone.
fn replay_line(mesh: &Mesh, kind: RayKind, index: u64, seed: u64) -> String {
    format!("snell check --accel --mesh {} --kind {} --ray {index} --seed {seed}", mesh.name, kind.name())
}

/// Traces one ray with its neighbours and tells what everyone says. Returns whether our own is right.
fn replay(args: &CheckArgs, mesh: usize, kind: RayKind, index: u64) -> Result<bool> {
    let mesh = Mesh::new(mesh, args.seed);
    let contest = Contest::new(&mesh, args.seed)?;
    let (aimed, answers) = contest.answers(kind, index);
    print(format_args!("{}", literal(&aimed.ray)));
    if aimed.must_hit {
        print(format_args!("through a closed mesh: it meets something"));
    }
    if aimed.ends.iter().any(|hit| hit.is_some()) {
        print(format_args!("left out: {}, at the end {}", named(aimed.ends[0]), named(aimed.ends[1])));
    }
    let (closest, text) = find(&mesh, &aimed);
    print(format_args!("oracle: {text}"));
    for answer in answers {
        let verdict = match judge(&mesh.shapes, &aimed, closest, answer) {
            Ok(false) => "right".into(),
            Ok(true) => "as right: a tie, or on a rim".into(),
            Err(fault) => format!("wrong: {fault:?}"),
        };
        print(format_args!("{}: {}: {verdict}", answer.who.name(), said(&answer)));
        if answer.hit.is_some() {
            print(format_args!("  {:?}", oracle::contact(&mesh.shapes, answer.hit, &aimed.ray)));
        }
    }
    Ok(contest.run(kind, index, index.saturating_add(1)).native.is_empty())
}

/// What the oracle finds, and where.
fn find(mesh: &Mesh, aimed: &Aimed) -> (Hit, String) {
    let contact = |hit| oracle::contact(&mesh.shapes, hit, &aimed.ray);
    match truth(&mesh.shapes, aimed) {
        None => (Hit::NONE, "nothing".into()),
        Some((hit, t)) => (hit, format!("{} at {t:e}, {:?}", named(hit), contact(hit))),
    }
}

fn named(hit: Hit) -> String {
    if hit.is_some() { format!("shape {} primitive {}", hit.shape, hit.primitive) } else { "nothing".into() }
}

fn said(answer: &Answer) -> String {
    format!("{}, {}", named(answer.hit), if answer.any { "hidden" } else { "free" })
}

/// A ray as Rust reads it, to the last bit.
fn literal(ray: &Ray) -> String {
    let number = |x: f32| if x.is_infinite() { "f32::INFINITY".into() } else { format!("{x:e}") };
    let vector = |v: Vec3| format!("Vec3::new({})", v.to_array().map(number).join(", "));
    let [tmin, tmax] = [ray.tmin, ray.tmax].map(number);
    format!("Ray {{ o: {}, tmin: {tmin}, d: {}, tmax: {tmax} }}", vector(ray.o), vector(ray.d))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_named_to_the_last_bit() {
        let mesh = Mesh::new(0, 4);
        let line = replay_line(&mesh, RayKind::Axis, 3, 4);
        assert_eq!(line, "snell check --accel --mesh soup --kind axis --ray 3 --seed 4");
        let ray = Ray { o: Vec3::new(0.1, -0.0, 1.0), tmin: f32::from_bits(1), d: Vec3::X, tmax: f32::INFINITY };
        let text =
            "Ray { o: Vec3::new(1e-1, -0e0, 1e0), tmin: 1e-45, d: Vec3::new(1e0, 0e0, 0e0), tmax: f32::INFINITY }";
        assert_eq!(literal(&ray), text);
    }
}
