//! Which pixels share what their paths find.
//!
//! A block of 8×8 pixels, aligned in the whole film, is cut into four groups of sixteen: the cosets of a subgroup of the places
//! in it under exclusive or, another one for every sample, so that no two pixels always go together and errors do not form
//! blocks. A block that a tile or the film's edge cuts has what is left of its groups.

use crate::film::SampleId;
use crate::image::Area;
use crate::sampler::mix64;
use std::ops::Range;

/// Pixels of a block along an edge, as a power of two: tiles are whole blocks.
const BLOCK_BITS: u32 = 3;
pub(in crate::integrator) const BLOCK: i32 = 1 << BLOCK_BITS;

/// Places in a block.
const PLACES: u32 = 1 << (2 * BLOCK_BITS);

/// What the samples of a group have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::integrator) struct Group {
    block: [i32; 2],
    sample: u32,
    coset: u32,
}

impl Group {
    /// That of a sample.
    pub(in crate::integrator) fn of(id: SampleId) -> Self {
        let block = [id.x >> BLOCK_BITS, id.y >> BLOCK_BITS];
        let place = (id.y - (block[1] << BLOCK_BITS)) * BLOCK + id.x - (block[0] << BLOCK_BITS);
        let [a, b] = masks(block, id.index).map(|mask| (place.cast_unsigned() & mask).count_ones() & 1);
        Self { block, sample: id.index, coset: 2 * a + b }
    }
}

/// Two different masks that are not zero, each pair as likely as the others: the parities of the bits that they leave of a
/// place tell its coset.
fn masks(block: [i32; 2], sample: u32) -> [u32; 2] {
    let block = u64::from(block[1].cast_unsigned()) << 32 | u64::from(block[0].cast_unsigned());
    let random = mix64(mix64(block) ^ u64::from(sample));
    let a = 1 + (random % u64::from(PLACES - 1)) as u32;
    let b = 1 + (random / u64::from(PLACES - 1) % u64::from(PLACES - 2)) as u32;
    [a, if b >= a { b + 1 } else { b }]
}

/// The samples `samples` of every pixel, the members of a group together.
pub(in crate::integrator) fn grouped_ids(pixels: Area, samples: Range<u32>) -> impl Iterator<Item = SampleId> {
    let blocks = |start: i32, size: u32| start >> BLOCK_BITS..(start + size.cast_signed() + BLOCK - 1) >> BLOCK_BITS;
    let (columns, rows) = (blocks(pixels.x, pixels.width), blocks(pixels.y, pixels.height));
    rows.flat_map(move |row| columns.clone().map(move |column| [column, row])).flat_map(move |block| {
        let (left, top) = (block[0] << BLOCK_BITS, block[1] << BLOCK_BITS);
        let inside = Area { x: left, y: top, width: BLOCK as u32, height: BLOCK as u32 }.intersection(pixels);
        samples.clone().flat_map(move |index| {
            let mut ids = Vec::with_capacity(PLACES as usize);
            for y in inside.y..inside.y + inside.height.cast_signed() {
                ids.extend((inside.x..inside.x + inside.width.cast_signed()).map(|x| SampleId { x, y, index }));
            }
            ids.sort_by_cached_key(|&id| Group::of(id).coset);
            ids
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
    fn a_whole_block_makes_four_groups_of_sixteen() {
        for sample in 0..100 {
            let ids: Vec<_> = grouped_ids(Area { x: 8, y: 16, width: 8, height: 8 }, sample..sample + 1).collect();
            let sizes: Vec<_> = ids.chunk_by(|a, b| Group::of(*a) == Group::of(*b)).map(<[_]>::len).collect();
            assert_eq!(sizes, [16; 4]);
        }
    }

    /// Over many samples every pixel of a block meets every other about as often: 15 partners of 63 each time.
    #[test]
    fn partners_change() {
        const SAMPLES: u32 = 4000;
        for other in [(1, 0), (7, 7), (0, 1), (3, 5)] {
            let id = |(x, y), index| Group::of(SampleId { x, y, index });
            let together = (0..SAMPLES).filter(|&s| id((0, 0), s) == id(other, s)).count();
            // Binomial: 952 ± 27; five standard deviations, so one false alarm in a million.
            assert!((together as f64 - f64::from(SAMPLES) * 15.0 / 63.0).abs() < 5.0 * 27.0, "{other:?}: {together}");
        }
    }
}
