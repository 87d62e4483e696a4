//! Which pixels share what their paths find: those of a block of 8×8, aligned in the whole film, sample by sample, or eight of them.
//!
//! Eights are latin squares of a block: a pixel of each row and of each column, on a slope that changes from sample to sample, so
//! that none are always together.
//!
//! A block that a tile or the film's edge cuts has what is left of its pixels. Errors are alike within a block, so that blocks are
//! seen where noise is strong; blocks that move from sample to sample are cut by the tiles' edges, and have more of it.

use crate::film::SampleId;
use crate::image::Area;
use crate::sampler::mix64;
use std::ops::Range;

/// Pixels of a block along an edge, as a power of two: tiles are whole blocks.
const BLOCK_BITS: u32 = 3;
pub(in crate::integrator) const BLOCK: i32 = 1 << BLOCK_BITS;

/// How many pixels share what their paths find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathReuse {
    /// None.
    Off,
    /// Eight of a block: a light sample's price or two.
    Eights,
    /// All of a block: the most that can be gained, for the price of several paths where everything is lit.
    Blocks,
}

/// What the samples of a group have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::integrator) struct Group {
    block: [i32; 2],
    sample: u32,
    /// Which of the eights of its block, if it is one.
    eight: i32,
}

impl Group {
    /// That of a sample.
    #[inline]
    pub(in crate::integrator) fn of(id: SampleId, reuse: PathReuse) -> Self {
        let block = [id.x >> BLOCK_BITS, id.y >> BLOCK_BITS];
        let eight = if reuse == PathReuse::Eights { (id.x + slope(block, id.index) * id.y) & (BLOCK - 1) } else { 0 };
        Self { block, sample: id.index, eight }
    }
}

/// The slope of a block's eights: odd, so that it takes the rows through all columns.
fn slope([x, y]: [i32; 2], sample: u32) -> i32 {
    let block = u64::from(y.cast_unsigned()) << 32 | u64::from(x.cast_unsigned());
    (mix64(mix64(block) ^ u64::from(sample)) & (BLOCK - 1) as u64) as i32 | 1
}

/// The samples `samples` of every pixel, the members of a group together.
pub(in crate::integrator) fn grouped_ids(pixels: Area, samples: Range<u32>) -> impl Iterator<Item = SampleId> {
    let blocks = |start: i32, size: u32| start >> BLOCK_BITS..(start + size.cast_signed() + BLOCK - 1) >> BLOCK_BITS;
    let (columns, rows) = (blocks(pixels.x, pixels.width), blocks(pixels.y, pixels.height));
    rows.flat_map(move |row| columns.clone().map(move |column| [column, row])).flat_map(move |block| {
        let x = block[0] << BLOCK_BITS;
        let inside =
            Area { x, y: block[1] << BLOCK_BITS, width: BLOCK as u32, height: BLOCK as u32 }.intersection(pixels);
        samples.clone().flat_map(move |index| {
            let slope = slope(block, index);
            (0..BLOCK).flat_map(move |eight| {
                let rows = inside.y..inside.y + inside.height.cast_signed();
                let id = move |y| SampleId { x: x + ((eight - slope * y) & (BLOCK - 1)), y, index };
                rows.map(id).filter(move |id| inside.contains(id.x, id.y))
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
        for reuse in [PathReuse::Eights, PathReuse::Blocks] {
            let of = |id: &SampleId| Group::of(*id, reuse);
            let groups: Vec<_> = ids.chunk_by(|a, b| of(a) == of(b)).map(|ids| of(&ids[0])).collect();
            assert!(groups.iter().enumerate().all(|(i, group)| !groups[..i].contains(group)), "a group is torn apart");
        }
    }

    #[test]
    fn a_whole_block_is_a_group_or_eight() {
        let ids: Vec<_> = grouped_ids(Area { x: -8, y: 16, width: 16, height: 8 }, 5..8).collect();
        for (reuse, expected) in [(PathReuse::Blocks, vec![64; 6]), (PathReuse::Eights, vec![8; 48])] {
            let of = |id: &SampleId| Group::of(*id, reuse);
            let groups: Vec<_> = ids.chunk_by(|a, b| of(a) == of(b)).collect();
            assert_eq!(groups.iter().map(|group| group.len()).collect::<Vec<_>>(), expected);
            for eight in groups.iter().filter(|_| reuse == PathReuse::Eights) {
                let places = |place: fn(&SampleId) -> i32| eight.iter().map(place).collect::<HashSet<_>>().len();
                assert_eq!([places(|id| id.x), places(|id| id.y)], [8; 2], "a row or a column has two");
            }
        }
    }
}
