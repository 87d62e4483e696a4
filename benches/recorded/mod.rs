//! The rays of some paths of a scene, in the batches in which the renderer asks them.
#![allow(dead_code, unreachable_pub, reason = "each of its users is a crate of its own and needs a part")]

pub mod timed;

use snell::accel::Hit;
use snell::film::SampleId;
use snell::integrator::record::{Event, Record};
use snell::math::ray::Ray;
use snell::render::RenderSettings;
use snell::scene::Scene;
use std::collections::BTreeMap;

/// What kind of ray a batch is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Camera,
    Bounce,
    Shadow,
}

/// Rays that are asked together.
pub struct Batch {
    pub kind: Kind,
    pub vertex: u32,
    pub rays: Vec<Ray>,
    /// What each starts on.
    pub from: Vec<Hit>,
    /// What each meets; of a shadow ray something or nothing.
    pub hits: Vec<Hit>,
}

/// Collects batches: paths are told of wave by wave, vertex by vertex.
#[derive(Default)]
struct Recorder {
    batches: Vec<Batch>,
    id: Option<SampleId>,
    /// What each path of the wave has met last.
    last: BTreeMap<SampleId, Hit>,
}

impl Recorder {
    fn push(&mut self, kind: Kind, vertex: u32, ray: Ray, from: Hit, hit: Hit) {
        let fits = |batch: &Batch| batch.kind == kind && batch.vertex == vertex;
        if !self.batches.last().is_some_and(fits) {
            self.batches.push(Batch { kind, vertex, rays: vec![], from: vec![], hits: vec![] });
        }
        let batch = self.batches.last_mut().unwrap();
        batch.rays.push(ray);
        batch.from.push(from);
        batch.hits.push(hit);
    }
}

impl Record for Recorder {
    fn at(&mut self, id: impl FnOnce() -> SampleId) {
        self.id = Some(id());
    }

    fn event(&mut self, event: Event) {
        let Some(id) = self.id else { return };
        match event {
            Event::Traced { vertex, ray, hit } => {
                let from = self.last.insert(id, hit).filter(|_| vertex > 1).unwrap_or(Hit::NONE);
                self.push(if vertex > 1 { Kind::Bounce } else { Kind::Camera }, vertex, ray, from, hit);
            }
            Event::Shadow { ray, occluded, .. } => {
                let met = if occluded { Hit { shape: 0, primitive: 0 } } else { Hit::NONE };
                self.push(Kind::Shadow, 0, ray, self.last[&id], met);
            }
            Event::Finished { .. } => drop(self.last.remove(&id)),
            _ => {}
        }
    }
}

/// The batches of the paths of all samples that `settings` ask for.
pub fn record(scene: &Scene, settings: &RenderSettings) -> Vec<Batch> {
    let area = scene.film.filter.sampled_area(scene.film.crop, scene.film.sample_border);
    let mut recorder = Recorder::default();
    settings.integrator.record(scene, &settings.sampler, area, 0..settings.samples, &mut recorder);
    recorder.batches
}
