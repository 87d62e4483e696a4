//! Linear sRGB triples.

use glam::Vec3;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign};

/// Three channels of linear sRGB. As radiance: W·sr⁻¹·m⁻² per channel; as reflectance or weight: unitless.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[repr(transparent)]
pub struct Rgb(pub Vec3);

impl Rgb {
    /// Zero in every channel.
    pub const BLACK: Self = Self(Vec3::ZERO);
    /// One in every channel.
    pub const WHITE: Self = Self(Vec3::ONE);

    /// From three channels.
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self(Vec3::new(r, g, b))
    }

    /// The same value in every channel.
    pub const fn splat(v: f32) -> Self {
        Self(Vec3::splat(v))
    }

    /// The channels as an array.
    pub fn to_array(self) -> [f32; 3] {
        self.0.to_array()
    }

    /// Whether every channel is zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0 == Vec3::ZERO
    }

    /// The largest channel.
    #[inline]
    pub fn max_component(self) -> f32 {
        self.0.max_element()
    }

    /// The mean of the channels.
    #[inline]
    pub fn mean(self) -> f32 {
        self.0.element_sum() / 3.0
    }

    /// Whether no channel is NaN or infinite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// What each channel adds to luminance (ITU-R BT.709-6, item 3.2).
    pub const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

    /// Relative luminance.
    #[inline]
    pub fn luminance(self) -> f32 {
        let [r, g, b] = Self::LUMINANCE;
        r * self.0.x + g * self.0.y + b * self.0.z
    }

    /// `f` of each channel.
    #[inline]
    pub fn map(self, mut f: impl FnMut(f32) -> f32) -> Self {
        Self::new(f(self.0.x), f(self.0.y), f(self.0.z))
    }
}

impl Add for Rgb {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self(self.0 + o.0)
    }
}

impl AddAssign for Rgb {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        self.0 += o.0;
    }
}

impl Mul for Rgb {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self(self.0 * o.0)
    }
}

impl Mul<f32> for Rgb {
    type Output = Self;
    #[inline]
    fn mul(self, s: f32) -> Self {
        Self(self.0 * s)
    }
}

impl Div<f32> for Rgb {
    type Output = Self;
    #[inline]
    fn div(self, s: f32) -> Self {
        Self(self.0 / s)
    }
}

impl MulAssign for Rgb {
    #[inline]
    fn mul_assign(&mut self, o: Self) {
        self.0 *= o.0;
    }
}

impl MulAssign<f32> for Rgb {
    #[inline]
    fn mul_assign(&mut self, s: f32) {
        self.0 *= s;
    }
}
