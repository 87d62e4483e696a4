//! What a file's `aov` and `moment` integrators want beside the picture.

/// Channels that hold one quantity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Aov {
    /// The channels' names, one for each component of the quantity.
    pub names: Vec<String>,
    /// The quantity.
    pub kind: AovKind,
    /// Whether it is squared, component by component, before its mean is taken.
    pub squared: bool,
}

/// Quantities that a file can ask for. Those of the surface are of the first that a camera ray meets, and zero where there
/// is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AovKind {
    /// Diffuse reflectance.
    Albedo,
    /// Distance from the near clip plane, along the ray.
    Depth,
    /// Point.
    Position,
    /// Texture coordinates.
    Uv,
    /// Geometric normal.
    GeometricNormal,
    /// Shading normal.
    ShadingNormal,
    /// Index of the primitive in its shape.
    PrimitiveIndex,
    /// Index of the shape.
    ShapeIndex,
    /// Radiance of the picture: linear sRGB.
    Radiance,
    /// Radiance of the picture: CIE XYZ.
    Xyz,
    /// Alpha of the picture.
    Alpha,
}

impl AovKind {
    /// The ends of its channels' names in Mitsuba, which follow the name that the file gives.
    pub fn components(self) -> &'static [&'static str] {
        match self {
            Self::Albedo | Self::Radiance => &[".R", ".G", ".B"],
            Self::Depth => &[".T"],
            Self::Position | Self::GeometricNormal | Self::ShadingNormal | Self::Xyz => &[".X", ".Y", ".Z"],
            Self::Uv => &[".U", ".V"],
            Self::PrimitiveIndex | Self::ShapeIndex => &[".I"],
            Self::Alpha => &[".A"],
        }
    }

    /// Whether it is a whole number, of which a mean says nothing.
    pub fn is_index(self) -> bool {
        matches!(self, Self::PrimitiveIndex | Self::ShapeIndex)
    }
}
