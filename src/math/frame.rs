//! Orthonormal frames around a normal.

use glam::Vec3;

/// A right-handed orthonormal basis; local z is the normal.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First tangent.
    pub s: Vec3,
    /// Second tangent.
    pub t: Vec3,
    /// Normal.
    pub n: Vec3,
}

impl Frame {
    /// A frame around the unit vector `n`, continuous but at one pole (Duff et al. 2017, *Building an Orthonormal
    /// Basis, Revisited*, listing 3).
    #[inline]
    pub fn from_normal(n: Vec3) -> Self {
        let sign = 1.0f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// The frame of the unit vector `n` whose first tangent is nearest to `tangent`; that of [`Self::from_normal`] where
    /// `tangent` is along `n`, or zero.
    #[inline]
    pub fn from_tangent(n: Vec3, tangent: Vec3) -> Self {
        let across = |v: Vec3| (v - n * n.dot(v)).try_normalize();
        // Twice, because what cancellation leaves may still lean towards n (Parlett 1998, section 6.9: twice is enough).
        match across(tangent).and_then(across) {
            Some(s) => Self { s, t: n.cross(s), n },
            None => Self::from_normal(n),
        }
    }

    /// World to local.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local to world.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}
