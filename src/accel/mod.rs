//! Which surface does a ray meet first, and is a segment free? Answered by Embree or by our own BVH, in batches.

/// Which primitive a ray met.
///
/// Only the identity: the distance and the point are computed from it, once, by [`crate::shape`], so that they do not
/// depend on who found the hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
pub struct Hit {
    /// Index of the shape, or [`Hit::NONE`]'s.
    pub shape: u32,
    /// Index of the primitive in the shape: the face of a mesh, 0 of a sphere.
    pub primitive: u32,
}

impl Hit {
    /// No hit.
    pub const NONE: Self = Self {
        shape: u32::MAX,
        primitive: u32::MAX,
    };

    /// Whether there is one.
    #[inline]
    pub fn is_some(self) -> bool {
        self.shape != u32::MAX
    }
}
