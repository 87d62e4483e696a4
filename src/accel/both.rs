//! Every ray through both accelerators: our own answers, and each disagreement is judged and counted.

use super::comparison::{ComparisonCounts, Disagreement, EXAMPLES};
use super::embree::{Embree, EmbreeMode};
use super::native::Native;
use super::oracle::{self, Verdict};
use super::{Hit, Quality, Start};
use crate::error::Result;
use crate::math::ray::Ray;
use crate::shape::Shape;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Both accelerators over the same shapes.
#[derive(Debug)]
pub(super) struct Both {
    embree: Embree,
    native: Native,
    rays: AtomicU64,
    /// The disagreements; few, so that a lock does no harm.
    found: Mutex<ComparisonCounts>,
}

impl Both {
    /// See [`super::Accel::build`].
    pub(super) fn build(shapes: &[Shape], threads: usize, quality: Quality) -> Result<Self> {
        Ok(Self {
            embree: Embree::build(shapes, threads, quality, EmbreeMode::Robust)?,
            native: Native::build(shapes, quality),
            rays: AtomicU64::new(0),
            found: Mutex::default(),
        })
    }

    /// See [`super::Accel::closest_hits`].
    pub(super) fn closest_hits(&self, rays: &[Ray], start: Start<'_>, hits: &mut [Hit]) {
        self.rays.fetch_add(rays.len() as u64, Ordering::Relaxed);
        self.native.closest_hits(rays, start, hits);
        let mut others = vec![Hit::NONE; rays.len()];
        self.embree.closest_hits(rays, start, &mut others);
        for (i, ((ray, &native), &embree)) in rays.iter().zip(&*hits).zip(&others).enumerate() {
            if embree != native {
                let from = start.primitives().get(i).copied().unwrap_or(Hit::NONE);
                self.judge((ray, false), [from, Hit::NONE], embree, native);
            }
        }
    }

    /// See [`super::Accel::occluded`].
    pub(super) fn occluded(&self, rays: &[Ray], ends: &[[Hit; 2]], occluded: &mut [bool]) {
        self.rays.fetch_add(rays.len() as u64, Ordering::Relaxed);
        self.native.occluded(rays, ends, occluded);
        let mut others = vec![false; rays.len()];
        self.embree.occluded(rays, ends, &mut others);
        for (i, ((ray, &native), &embree)) in rays.iter().zip(&*occluded).zip(&others).enumerate() {
            if embree != native {
                let ends = ends.get(i).copied().unwrap_or([Hit::NONE; 2]);
                let witness = self.witness(ray, ends, native);
                let (of_embree, of_native) = if native { (Hit::NONE, witness) } else { (witness, Hit::NONE) };
                self.judge((ray, true), ends, of_embree, of_native);
            }
        }
    }

    /// What is in the way for the one who says that something is, our own or Embree. Who finds nothing when asked for the closest, or
    /// what the ray ends on, which that search is not told of, lets the oracle say what there is. If there is nothing, it is what the
    /// ray starts on: a false hit.
    fn witness(&self, ray: &Ray, ends: [Hit; 2], native: bool) -> Hit {
        let (mut hit, start) = ([Hit::NONE], [ends[0]]);
        if native {
            self.native.closest_hits(&[*ray], Start::Primitives(&start), &mut hit);
        } else {
            self.embree.closest_hits(&[*ray], Start::Primitives(&start), &mut hit);
        }
        if hit[0].is_some() && !ends.contains(&hit[0]) {
            return hit[0];
        }
        oracle::occluder(self.embree.shapes(), ray, &ends).unwrap_or(if hit[0].is_some() { hit[0] } else { ends[0] })
    }

    fn judge(&self, (ray, any): (&Ray, bool), ends: [Hit; 2], embree: Hit, native: Hit) {
        let verdict = oracle::verdict(self.embree.shapes(), ray, &ends, embree, native);
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        *found.of(verdict) += 1;
        if verdict != Verdict::Tie && found.examples.len() < EXAMPLES {
            found.examples.push(Disagreement { ray: *ray, any, embree, native, verdict });
        }
    }

    /// What has been found so far.
    pub(super) fn counts(&self) -> ComparisonCounts {
        let found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        ComparisonCounts { rays: self.rays.load(Ordering::Relaxed), ..found.clone() }
    }

    /// See [`super::Accel::name`].
    pub(super) fn name(&self) -> String {
        format!("native, compared with {}", self.embree.name())
    }

    /// See [`super::Accel::memory_bytes`].
    pub(super) fn memory_bytes(&self) -> u64 {
        self.embree.memory_bytes() + self.native.memory_bytes()
    }

    /// See [`super::Accel::embree_false_hits`].
    pub(super) fn embree_false_hits(&self) -> u64 {
        self.embree.false_hits()
    }
}
