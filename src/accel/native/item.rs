//! Primitives to be put into a tree, by their boxes, in vectors of four.

use crate::accel::Hit;
use crate::math::bounds::Bounds;
use glam::{BVec4A, Vec4};

/// A primitive to be put into the tree. Its name fills up the vectors of its box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    lower: Vec4,
    upper: Vec4,
}

impl Item {
    pub(super) fn new(bounds: Bounds, id: Hit) -> Self {
        Self {
            lower: bounds.min.extend(f32::from_bits(id.shape)),
            upper: bounds.max.extend(f32::from_bits(id.primitive)),
        }
    }

    /// The same primitive in another box.
    pub(super) fn with_bounds(&self, bounds: Bounds) -> Self {
        Self::new(bounds, self.id())
    }

    pub(super) fn id(&self) -> Hit {
        Hit { shape: self.lower.w.to_bits(), primitive: self.upper.w.to_bits() }
    }

    pub(super) fn bounds(&self) -> Bounds {
        self.box4().bounds()
    }

    #[inline]
    pub(super) fn box4(&self) -> Box4 {
        Box4 { min: self.lower, max: self.upper }
    }

    /// Twice the centre of the box; the last number is 0.
    #[inline(always)]
    pub(super) fn centroid(&self) -> Vec4 {
        without_name(self.lower + self.upper)
    }
}

/// Sets the last number to 0. Names are denormal numbers, and processors take many times as long to multiply these.
#[inline(always)]
pub(super) fn without_name(v: Vec4) -> Vec4 {
    Vec4::select(BVec4A::new(true, true, true, false), v, Vec4::ZERO)
}

/// A box in vectors of four, of which the last number means nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Box4 {
    pub(super) min: Vec4,
    pub(super) max: Vec4,
}

impl Box4 {
    pub(super) const EMPTY: Self = Self { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    pub(super) fn of(bounds: Bounds) -> Self {
        Self { min: bounds.min.extend(0.0), max: bounds.max.extend(0.0) }
    }

    pub(super) fn bounds(self) -> Bounds {
        Bounds { min: self.min.truncate(), max: self.max.truncate() }
    }

    #[inline(always)]
    pub(super) fn with(self, p: Vec4) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    #[inline(always)]
    pub(super) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    #[inline(always)]
    pub(super) fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).bitmask() & 0b111 != 0
    }

    /// Half of the surface area, in squares of 1/`unit`; infinite of [`Self::EMPTY`]. Not of another empty box.
    #[inline(always)]
    pub(super) fn half_area(&self, unit: f32) -> f32 {
        let e = without_name(self.max - self.min) * unit;
        e.x * e.y + e.y * e.z + e.z * e.x
    }
}
