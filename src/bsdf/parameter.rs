//! How a number of a bsdf that varies over a surface is overridden where a texture says so.

use super::{Bsdf, each};
use crate::math::float::{max, min};
pub use crate::parameter::Parameter;
use crate::spectrum::Rgb;

impl Bsdf {
    /// Overrides one parameter. A scalar is the first channel of `value`. What is out of the parameter's range is brought
    /// into it; a parameter that this bsdf does not have is left alone.
    pub fn set(&mut self, parameter: Parameter, value: Rgb) {
        let known = each!(self, b => b.set(parameter, value));
        debug_assert!(known, "{self:?} has no {parameter:?}");
    }
}

/// `value` without negative channels; NaN counts as 0.
#[inline]
pub(super) fn not_negative(value: Rgb) -> Rgb {
    value.map(|c| max(c, 0.0))
}

/// The scalar that `value` stands for.
#[inline]
pub(super) fn scalar(value: Rgb) -> f32 {
    value.0.x
}

/// The scalar that `value` stands for, brought into [0, `most`]; NaN counts as 0.
#[inline]
pub(super) fn up_to(most: f32, value: Rgb) -> f32 {
    min(max(scalar(value), 0.0), most)
}
