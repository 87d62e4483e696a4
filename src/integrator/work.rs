//! Samples to be taken of some tiles, and which of the tiles a sample goes to.

use super::path_state::PathState;
use crate::film::{SampleId, Tile};
use std::ops::Range;

/// These samples of every pixel of a tile.
pub struct Work<'a> {
    /// Their indices.
    pub samples: Range<u32>,
    /// What they are added to.
    pub tile: &'a mut Tile,
    /// How many vertices their paths had, once they are taken.
    pub vertices: u64,
}

impl<'a> Work<'a> {
    /// Some samples to be taken.
    pub fn new(samples: Range<u32>, tile: &'a mut Tile) -> Self {
        Self { samples, tile, vertices: 0 }
    }

    /// How many samples these are, over all pixels.
    pub fn count(&self) -> u64 {
        self.tile.bounds().pixels() * self.samples.len() as u64
    }
}

/// The tiles of some work, to be found by samples that come in its order, again and again from the start.
pub(super) struct Tiles<'a, 'b> {
    work: &'a mut [Work<'b>],
    at: usize,
}

impl<'a, 'b> Tiles<'a, 'b> {
    /// Of some work: at least one tile.
    pub(super) fn new(work: &'a mut [Work<'b>]) -> Self {
        Self { work, at: 0 }
    }

    /// The tile of a path that has ended, and is counted.
    #[inline]
    pub(super) fn of_finished(&mut self, path: &PathState) -> &mut Tile {
        self.find(path.id);
        let work = &mut self.work[self.at];
        work.vertices += u64::from(path.depth);
        work.tile
    }

    /// The tile of a sample.
    #[inline]
    pub(super) fn of(&mut self, id: SampleId) -> &mut Tile {
        self.find(id);
        self.work[self.at].tile
    }

    #[inline]
    fn find(&mut self, id: SampleId) {
        if self.work.len() > 1 {
            let holds = |work: &Work<'_>| work.samples.contains(&id.index) && work.tile.bounds().contains(id.x, id.y);
            while !holds(&self.work[self.at]) {
                self.at = (self.at + 1) % self.work.len();
            }
        }
    }
}
