//! Which pixels share what their paths find: those of a block of 8×8, aligned in the whole film, sample by sample.
//!
//! A block that a tile or the film's edge cuts has what is left of its pixels. Errors are alike within a block, so that blocks are
//! seen where noise is strong; blocks that move from sample to sample are cut by the tiles' edges, and have more of it.

use crate::film::SampleId;
use crate::image::Area;
use std::ops::Range;

/// Pixels of a block along an edge, as a power of two: tiles are whole blocks.
const BLOCK_BITS: u32 = 3;
pub(in crate::integrator) const BLOCK: i32 = 1 << BLOCK_BITS;

/// What the samples of a group have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::integrator) struct Group {
    block: [i32; 2],
    sample: u32,
}

impl Group {
    /// That of a sample.
    #[inline]
    pub(in crate::integrator) fn of(id: SampleId) -> Self {
        Self { block: [id.x >> BLOCK_BITS, id.y >> BLOCK_BITS], sample: id.index }
    }
}

/// The samples `samples` of every pixel, the members of a group together.
pub(in crate::integrator) fn grouped_ids(pixels: Area, samples: Range<u32>) -> impl Iterator<Item = SampleId> {
    let blocks = |start: i32, size: u32| start >> BLOCK_BITS..(start + size.cast_signed() + BLOCK - 1) >> BLOCK_BITS;
    let (columns, rows) = (blocks(pixels.x, pixels.width), blocks(pixels.y, pixels.height));
    rows.flat_map(move |row| columns.clone().map(move |column| [column, row])).flat_map(move |block| {
        let (x, y) = (block[0] << BLOCK_BITS, block[1] << BLOCK_BITS);
        let inside = Area { x, y, width: BLOCK as u32, height: BLOCK as u32 }.intersection(pixels);
        samples.clone().flat_map(move |index| {
            (inside.y..inside.y + inside.height.cast_signed()).flat_map(move |y| {
                (inside.x..inside.x + inside.width.cast_signed()).map(move |x| SampleId { x, y, index })
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn every_sample_comes_once_and_groups_stay_together() {
        let pixels = Area { x: -3, y: 5, width: 21, height: 9 };
        let ids: Vec<_> = grouped_ids(pixels, 2..5).collect();
        let different: HashSet<_> = ids.iter().map(|id| (id.x, id.y, id.index)).collect();
        assert_eq!(ids.len(), 21 * 9 * 3);
        assert_eq!(different.len(), ids.len());
        assert!(ids.iter().all(|id| pixels.contains(id.x, id.y) && (2..5).contains(&id.index)));
        let groups: Vec<_> = ids.chunk_by(|a, b| Group::of(*a) == Group::of(*b)).map(|ids| Group::of(ids[0])).collect();
        assert!(groups.iter().enumerate().all(|(i, group)| !groups[..i].contains(group)), "a group is torn apart");
    }

    #[test]
    fn a_whole_block_is_a_group() {
        let ids: Vec<_> = grouped_ids(Area { x: 8, y: 16, width: 16, height: 8 }, 5..8).collect();
        let sizes: Vec<_> = ids.chunk_by(|a, b| Group::of(*a) == Group::of(*b)).map(<[_]>::len).collect();
        assert_eq!(sizes, [64; 6]);
    }
}
