//! In which chunks a pixel's samples are taken, and to which half of the film each goes.

use std::ops::Range;

/// Samples a pixel in one unit of work: enough to fill waves, few enough that a stop is never far.
const CHUNK: u32 = 16;

/// The chunks of a render, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Schedule {
    /// Of some of the samples of which there are so many in all: the film's halves are those of the whole sequence.
    Counted {
        /// Which ones.
        samples: Range<u32>,
        /// The first sample of the later half.
        middle: u32,
    },
    /// Of as many as there is time for: chunks grow with what is there, as far as a sixteenth of it, so that little time is left
    /// over. Halves take turns as in the sequence of Thue and Morse, so that of any number both have a fair share.
    Open {
        /// There are no more than this.
        most: u32,
    },
}

impl Schedule {
    /// For the samples `samples` of `all`.
    pub(super) fn counted(samples: Range<u32>, all: u32) -> Self {
        Self::Counted { samples, middle: all.div_ceil(2) }
    }

    /// How many chunks there are.
    pub(super) fn chunks(&self) -> u64 {
        match self {
            Self::Counted { samples, middle } => {
                let middle = (*middle).clamp(samples.start, samples.end.max(samples.start));
                let chunks = |from: u32, to: u32| u64::from(to.saturating_sub(from).div_ceil(CHUNK));
                chunks(samples.start, middle) + chunks(middle, samples.end)
            }
            Self::Open { most } => u64::from(open_chunks(*most)),
        }
    }

    /// The samples of chunk `chunk`, and the half that they belong to.
    pub(super) fn chunk(&self, chunk: u64) -> (Range<u32>, usize) {
        match self {
            Self::Counted { samples, middle } => {
                let middle = (*middle).clamp(samples.start, samples.end.max(samples.start));
                let before = u64::from((middle - samples.start).div_ceil(CHUNK));
                let (half, start, end) = match chunk.checked_sub(before) {
                    None => (0, u64::from(samples.start) + chunk * u64::from(CHUNK), middle),
                    Some(chunk) => (1, u64::from(middle) + chunk * u64::from(CHUNK), samples.end),
                };
                let start = u32::try_from(start).unwrap_or(end).min(end);
                (start..start.saturating_add(CHUNK).min(end), half)
            }
            Self::Open { most } => {
                let (start, size) = open_chunk(chunk);
                (start..start.saturating_add(size).min(*most), (start / size).count_ones() as usize % 2)
            }
        }
    }

    /// How many samples of a pixel there are in all chunks before this one.
    pub(super) fn before(&self, chunk: u64) -> u32 {
        match self {
            Self::Counted { samples, .. } => self.chunk(chunk).0.start - samples.start,
            Self::Open { .. } => open_chunk(chunk).0,
        }
    }
}

/// Samples that come one by one in a render without end.
const OPEN_SINGLE: u32 = 16;

/// Chunks of each size after the first.
const OF_A_SIZE: u32 = 8;

/// First sample and size of chunk `chunk` of a render without end: 16 of one, then 8 of each power of two up to [`CHUNK`], and of that
/// as many as there are.
fn open_chunk(chunk: u64) -> (u32, u32) {
    let chunk = u32::try_from(chunk).unwrap_or(u32::MAX);
    let Some(after) = chunk.checked_sub(OPEN_SINGLE) else { return (chunk, 1) };
    let step = (after / OF_A_SIZE).min(CHUNK.ilog2() - 1);
    let start = (OPEN_SINGLE << step).saturating_add((after - step * OF_A_SIZE).saturating_mul(2 << step));
    (start, 2 << step)
}

/// How many of these chunks so many samples take.
fn open_chunks(most: u32) -> u32 {
    let (mut count, mut start) = (most.min(OPEN_SINGLE), OPEN_SINGLE);
    for step in 0..CHUNK.ilog2() {
        let left = most.saturating_sub(start).div_ceil(2 << step);
        let here = if step + 1 < CHUNK.ilog2() { left.min(OF_A_SIZE) } else { left };
        (count, start) = (count + here, start.saturating_add(here.saturating_mul(2 << step)));
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chunks follow each other without gaps, and nothing is in two halves.
    fn check(schedule: &Schedule, count: u64, first: u32) -> u32 {
        let mut next = first;
        for chunk in 0..count {
            let (samples, half) = schedule.chunk(chunk);
            assert_eq!((samples.start, schedule.before(chunk)), (next, next - first), "{schedule:?} {chunk}");
            assert!(!samples.is_empty() && samples.len() <= CHUNK as usize && half < 2);
            next = samples.end;
        }
        next
    }

    #[test]
    fn every_sample_is_in_one_chunk_and_halves_are_halves() {
        for all in [1, 2, 3, 15, 16, 17, 31, 64, 100, 1000] {
            let schedule = Schedule::counted(0..all, all);
            assert_eq!(check(&schedule, schedule.chunks(), 0), all);
            let later: usize = (0..schedule.chunks()).map(|c| schedule.chunk(c)).map(|(s, half)| half * s.len()).sum();
            assert_eq!(later as u32, all / 2);
            // Parts of it have the halves of the whole.
            for samples in [0..all / 3, all / 3..all / 2, all / 2..all, all / 3..all] {
                let part = Schedule::counted(samples.clone(), all);
                assert_eq!(check(&part, part.chunks(), samples.start), samples.end.max(samples.start));
                for (of_part, half) in (0..part.chunks()).map(|c| part.chunk(c)) {
                    assert_eq!(half, usize::from(of_part.start >= all.div_ceil(2)));
                }
            }
        }
    }

    #[test]
    fn without_end_halves_are_balanced_and_chunks_are_small() {
        let schedule = Schedule::Open { most: u32::MAX };
        check(&schedule, 1000, 0);
        let (mut all, mut later) = (0, 0);
        for (samples, half) in (0..1000).map(|c| schedule.chunk(c)) {
            assert!(samples.len() as u32 <= (samples.start / 8).max(1));
            assert_eq!(samples.start as usize % samples.len(), 0, "chunks are aligned");
            (all, later) = (all + samples.len(), later + half * samples.len());
            assert!((2 * later).abs_diff(all) <= 2 * CHUNK as usize);
        }
        for most in [1, 2, 15, 16, 17, 31, 32, 33, 100, 127, 128, 129, 1000] {
            let schedule = Schedule::Open { most };
            assert_eq!(check(&schedule, schedule.chunks(), 0), most);
        }
    }
}
