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

/// A density of points of a surface, as what was sampled has it.
#[derive(Clone, Copy, Debug)]
pub enum PointPdf {
    /// Of points.
    Area(AreaPdf),
    /// Of directions to them.
    SolidAngle(SolidAnglePdf),
}

impl PointPdf {
    /// Per solid angle, for a point at this squared distance that is seen under this cosine; see [`AreaPdf::to_solid_angle`].
    #[inline(always)]
    pub fn to_solid_angle(self, distance_squared: f32, cos_at_surface: f32) -> SolidAnglePdf {
        match self {
            Self::Area(pdf) => pdf.to_solid_angle(distance_squared, cos_at_surface),
            Self::SolidAngle(pdf) => pdf,
        }
    }

    /// Whether it can be divided by.
    pub fn is_positive(self) -> bool {
        let (Self::Area(AreaPdf(pdf)) | Self::SolidAngle(SolidAnglePdf(pdf))) = self;
        pdf > 0.0 && pdf.is_finite()
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
