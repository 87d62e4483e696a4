//! What comes of tracing every ray with both accelerators: how often they differ, why, and the first few rays.

use super::Hit;
use super::oracle::Verdict;
use crate::math::ray::Ray;

/// Disagreements that are kept with their rays.
pub const EXAMPLES: usize = 16;

/// What has been found so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ComparisonCounts {
    /// Rays traced by both.
    pub rays: u64,
    /// Both are right: the hits are equally far, within rounding.
    pub ties: u64,
    /// Within rounding of a triangle's rim.
    pub edges: u64,
    /// Embree lost a true hit.
    pub embree_misses: u64,
    /// Our own lost a true hit.
    pub native_misses: u64,
    /// Embree hit what the ray does not meet.
    pub embree_false: u64,
    /// Our own hit what the ray does not meet.
    pub native_false: u64,
    /// The first few disagreements that are no ties.
    pub examples: Vec<Disagreement>,
}

/// A ray about which the two differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement {
    /// The ray.
    pub ray: Ray,
    /// Whether any hit was asked for, not the closest.
    pub any: bool,
    /// Embree's hit.
    pub embree: Hit,
    /// Our own.
    pub native: Hit,
    /// Who is right.
    pub verdict: Verdict,
}

impl ComparisonCounts {
    /// The number of disagreements with this verdict.
    pub fn of(&mut self, verdict: Verdict) -> &mut u64 {
        match verdict {
            Verdict::Tie => &mut self.ties,
            Verdict::Edge => &mut self.edges,
            Verdict::EmbreeMiss => &mut self.embree_misses,
            Verdict::NativeMiss => &mut self.native_misses,
            Verdict::EmbreeFalse => &mut self.embree_false,
            Verdict::NativeFalse => &mut self.native_false,
        }
    }
}
