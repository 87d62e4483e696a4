//! Densities that carry their measure in the type, so that a density per area cannot meet one per solid angle.

/// A probability density with respect to solid angle, in sr⁻¹. Never a delta: those have no density.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct SolidAnglePdf(pub f32);

/// A probability density with respect to surface area, in the compiled scene's length⁻².
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct AreaPdf(pub f32);

impl AreaPdf {
    /// The same density per solid angle around a point at squared distance `distance_squared`, where the surface is
    /// seen under the cosine `cos_at_surface` (its sign does not matter): p·d²/|cos θ|. Zero where the surface is seen
    /// edge-on, for then no direction leads to it.
    #[inline]
    pub fn to_solid_angle(self, distance_squared: f32, cos_at_surface: f32) -> SolidAnglePdf {
        let cos = cos_at_surface.abs();
        SolidAnglePdf(if cos > 0.0 { self.0 * distance_squared / cos } else { 0.0 })
    }
}

impl std::ops::Mul<f32> for SolidAnglePdf {
    type Output = Self;
    /// The density of choosing with probability `p` first, then by this density.
    #[inline]
    fn mul(self, p: f32) -> Self {
        Self(self.0 * p)
    }
}
