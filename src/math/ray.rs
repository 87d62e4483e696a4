//! Rays.

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3, Vec3, Vec4};

/// The points `o + t·d` with `tmin < t < tmax`, in the compiled scene's space.
///
/// `d` need not have unit length: a shadow ray's `d` spans the whole segment and its `tmax` is 1.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Origin.
    pub o: Vec3,
    /// Start of the interval, in units of `d`; 0 but for camera rays with a near clip plane.
    pub tmin: f32,
    /// Direction; of the segment between two points that round to the same it is zero, and it meets nothing.
    pub d: Vec3,
    /// End of the interval, in units of `d`; infinite where nothing bounds the ray.
    pub tmax: f32,
}

impl Ray {
    /// Origin and start, and direction and end, as they lie in memory: two loads instead of six.
    #[inline(always)]
    #[must_use]
    pub fn halves(&self) -> [Vec4; 2] {
        bytemuck::cast(*self)
    }

    /// The ray from `o` along `d` to infinity.
    #[inline]
    pub fn new(o: Vec3, d: Vec3) -> Self {
        Self { o, tmin: 0.0, d, tmax: f32::INFINITY }
    }

    /// Whether the distance `t` lies in the open interval.
    #[inline]
    pub fn contains(&self, t: f64) -> bool {
        t > f64::from(self.tmin) && t < f64::from(self.tmax)
    }

    /// The same in another space, in f64; distances stay the same.
    #[inline]
    pub fn transformed(&self, map: &DAffine3) -> DRay {
        DRay {
            o: map.transform_point3(self.o.as_dvec3()),
            d: map.matrix3 * self.d.as_dvec3(),
            tmin: self.tmin,
            tmax: self.tmax,
        }
    }

    /// The open segment from `a` to `b`.
    #[inline]
    pub fn segment(a: Vec3, b: Vec3) -> Self {
        Self { o: a, tmin: 0.0, d: b - a, tmax: 1.0 }
    }
}

/// The same with f64 coordinates: a [`Ray`] in another space. Distances are those of the ray it was made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DRay {
    /// Origin.
    pub o: DVec3,
    /// Direction.
    pub d: DVec3,
    /// Start of the interval, in units of `d`.
    pub tmin: f32,
    /// End of the interval.
    pub tmax: f32,
}

impl DRay {
    /// The nearest ray in f32.
    #[inline]
    pub fn rounded(&self) -> Ray {
        Ray { o: self.o.as_vec3(), tmin: self.tmin, d: self.d.as_vec3(), tmax: self.tmax }
    }
}

/// What intersection tests in f64 read of a ray.
pub trait Line {
    /// Origin.
    fn origin(&self) -> DVec3;

    /// Direction.
    fn direction(&self) -> DVec3;

    /// The ends of the open interval.
    fn interval(&self) -> [f64; 2];

    /// Whether the distance `t` lies in the open interval.
    #[inline(always)]
    fn contains(&self, t: f64) -> bool {
        let [tmin, tmax] = self.interval();
        t > tmin && t < tmax
    }
}

impl Line for Ray {
    #[inline(always)]
    fn origin(&self) -> DVec3 {
        self.o.as_dvec3()
    }

    #[inline(always)]
    fn direction(&self) -> DVec3 {
        self.d.as_dvec3()
    }

    #[inline(always)]
    fn interval(&self) -> [f64; 2] {
        [f64::from(self.tmin), f64::from(self.tmax)]
    }
}

impl Line for DRay {
    #[inline(always)]
    fn origin(&self) -> DVec3 {
        self.o
    }

    #[inline(always)]
    fn direction(&self) -> DVec3 {
        self.d
    }

    #[inline(always)]
    fn interval(&self) -> [f64; 2] {
        [f64::from(self.tmin), f64::from(self.tmax)]
    }
}
