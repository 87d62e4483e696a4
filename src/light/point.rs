//! A point that sends the same radiant intensity in every direction.

use super::{End, LightSample};
use crate::shape::Hit;
use crate::shape::offset::SurfacePoint;
use crate::spectrum::Rgb;
use glam::{DVec3, Vec3};

/// A light without size: only sampling it finds it.
#[derive(Clone, Debug)]
pub struct PointLight {
    /// Where, in the compiled scene's space.
    pub position: DVec3,
    /// Radiant intensity in W·sr⁻¹ where the compiled scene's unit of length stands for the metre: the file's, times the
    /// square of [`crate::scene::Scene::unit`].
    pub intensity: Rgb,
    /// Distance to the box around all surfaces: 0 inside it.
    pub clearance: f64,
    /// The surfaces that it hangs on, if any ([`crate::shape::touch`]): they do not hide it from either side.
    pub touching: Vec<SurfacePoint>,
}

impl PointLight {
    /// Distance from a light within a scene at which [`Self::scale`] is taken: 1/256 of about half the scene. The film
    /// has 31 bits above the scale ([`crate::film`]), so white surfaces fit until they are nearer than a
    /// 10⁻⁷th of the scene, and between there and the far wall a thing loses no bit that an f32 has.
    const NEAR: f64 = 1.0 / 256.0;

    /// What arrives at `p`: the direction, and E⊥ = I/d², the irradiance of a surface that faces the light, in place of
    /// a radiance (W·m⁻², as if per steradian: the light fills one, in the limit). `None` at the light itself.
    #[inline(never)]
    pub(super) fn sample(&self, p: &DVec3) -> Option<LightSample> {
        // In f64, where no square of a distance overflows or vanishes, nor its product with an intensity too early.
        let to = self.position - *p;
        let distance_squared = to.length_squared();
        let wi = (to / distance_squared.sqrt()).as_vec3();
        let segment = to.abs().as_vec3();
        let end = self.touching.iter().fold(self.position, |p, on| SurfacePoint { p, ..*on }.before(-wi, segment));
        (distance_squared > 0.0).then(|| LightSample {
            wi,
            radiance: self.intensity.map(|c| (f64::from(c) / distance_squared) as f32),
            pdf: None,
            end: Some(End::Point(SurfacePoint { p: end, n: Vec3::ZERO, slack: 0.0 })),
            on: Hit::NONE,
        })
    }

    /// A radiance of the order that it makes: E⊥ at the nearest surface, or at [`Self::NEAR`] where surfaces may be nearer
    /// than that.
    pub fn scale(&self) -> f32 {
        let distance = self.clearance.max(Self::NEAR);
        (f64::from(self.intensity.max_component()) / (distance * distance)) as f32
    }
}
