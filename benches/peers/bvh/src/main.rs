//! Rays per second of one thread for the recorded rays of paths through scene files, for snell's accelerators and those of
//! public crates, in turn, as ratios: see README.md.
#![allow(clippy::unwrap_used, reason = "a benchmark")]

mod by_bvh;
mod by_obvhs;
#[path = "../../../../tests/common/mod.rs"]
mod common;
#[path = "../../../recorded/mod.rs"]
mod recorded;
mod triangles;

use by_bvh::{Built, Ordered, Shrinking};
use by_obvhs::{Obvhs, Tree};
use common::{accelerators, compiled, file_settings, project};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::cwbvh::CwBvh;
use recorded::timed::{Measured, Rays, classes};
use snell::accel::{Accelerator, Quality};
use snell::integrator::{Estimator, PathReuse};
use snell::loader::LoadOptions;
use snell::shape::Shape;
use std::rc::Rc;
use triangles::{Triangles, meshes};

/// Paths that are recorded, at least.
const PATHS: u32 = 60_000;

/// Times that each answers all rays, in turn; the best counts.
const ROUNDS: usize = 7;

/// How carefully to build snell's; what all is compared with comes first.
const QUALITIES: [Quality; 3] = [Quality::Medium, Quality::Low, Quality::High];

/// A tree of `obvhs` by one of its presets.
fn obvhs<T: Tree + 'static>(triangles: &Triangles, preset: &str, params: BvhBuildParams) -> Measured {
    let describe = |built: &Obvhs<T>| (format!("obvhs {}, {preset}", T::NAME), built.memory_bytes());
    Measured::build(|| Obvhs::<T>::build(triangles, params), describe)
}

/// The tree of `bvh`, built once for each way to walk it.
fn bvh(triangles: &Triangles) -> Vec<Measured> {
    let describe = |how: &str, built: &Built| (format!("bvh, {how}"), built.memory_bytes());
    let ordered = || Ordered(Rc::new(Built::new(triangles)));
    let shrinking = || Shrinking(Rc::new(Built::new(triangles)));
    let mut shallow = true;
    let mut all = vec![Measured::build(ordered, |built| {
        shallow = built.0.is_shallow();
        describe("ordered iterator", &built.0)
    })];
    if shallow {
        all.push(Measured::build(shrinking, |built| describe("shrinking query", &built.0)));
    } else {
        println!("  bvh: the tree is deeper than its plain iterator can walk");
    }
    all
}

/// Everything that is compared, built over the same triangles: first what all is compared with.
fn contenders(shapes: &[Shape]) -> Vec<Measured> {
    let triangles = Triangles::of(shapes);
    let own = accelerators().into_iter().rev().flat_map(|which| QUALITIES.map(|quality| (which, quality)));
    let mut all: Vec<_> = own.map(|(which, quality)| Measured::accel(which, quality, shapes)).collect();
    let presets = [("medium", BvhBuildParams::medium_build()), ("very slow", BvhBuildParams::very_slow_build())];
    all.extend(presets.map(|(preset, params)| obvhs::<CwBvh>(&triangles, preset, params)));
    all.extend(presets.map(|(preset, params)| obvhs::<Bvh2>(&triangles, preset, params)));
    all.extend(bvh(&triangles));
    all
}

fn measure(file: &str) {
    // Files are the project's, as for its other benches, and this is a folder of it.
    let path = project("../../..").join(file);
    let description = snell::loader::load(&path, &LoadOptions::default()).unwrap();
    let scene = compiled(&description, Accelerator::Native);
    let size = scene.film.crop;
    let mut settings = file_settings(&description, Estimator::Path, PATHS.div_ceil(size.width * size.height));
    settings.integrator.reuse = PathReuse::Off;
    let rays = Rays::record(&scene, &settings);
    let (shapes, others) = meshes(&scene.shapes);
    let triangles: usize = shapes.iter().map(Shape::primitive_count).sum();
    let counts = rays.counts();
    println!("{file}: {triangles} triangles; {}", classes(counts));
    if others > 0 {
        println!("  without {others} shapes that are no meshes");
    }
    let mut all = contenders(&shapes);
    for _ in 0..ROUNDS {
        all.iter_mut().for_each(|measured| measured.round(&rays));
    }
    // Where there is no Embree, snell's own is what all is compared with.
    let own = &all[if accelerators().len() > 1 { QUALITIES.len() } else { 0 }];
    for measured in &all {
        println!("{}; {} differ", measured.row(counts, &all[0]), measured.differing(own));
    }
}

fn main() {
    let mut files: Vec<String> = std::env::args().skip(1).collect();
    if files.is_empty() {
        files = ["million", "cornell-box"].map(|name| format!("scenes/{name}/scene.xml")).into();
    }
    let vectors = if cfg!(target_feature = "avx2") { "with AVX2" } else { "without AVX2" };
    println!("the crates are compiled {vectors}; snell and Embree take what the processor has");
    files.iter().for_each(|file| measure(file));
}
