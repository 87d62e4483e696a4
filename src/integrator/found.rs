//! Light that paths run into, weighted against sampling it.

use super::path_state::{PathState, Segment};
use super::record::{Event, Record};
use super::technique::Technique;
use super::variant::Variant;
use super::wave::Walker;
use crate::accel::Hit;
use crate::facts::{Feature, has};
use crate::light::{Light, Receiver, VaryingLight};
use crate::sampling::pdf::SolidAnglePdf;
use crate::scene::Surface;
use crate::shape::offset::SurfacePoint;
use crate::spectrum::Rgb;
use glam::{DVec3, Vec3};

impl Walker<'_> {
    /// Light from infinitely far away, where the segment met nothing.
    #[inline(always)]
    pub(super) fn find_sky<T: Technique>(&self, path: &mut PathState, record: &mut impl Record) {
        if path.depth == 1 && self.limits.hides_sky() {
            return;
        }
        // What no light could have been sampled for is not weighed against it.
        let n = if let Segment::Smooth { n, .. } = path.segment { n } else { Vec3::ZERO };
        // Of what came through glass the direction is another one: [`Self::weight_through`] asks for that.
        if !(T::Variant::ANY_LIGHTS && Feature::Environment.is_built()) {
            return;
        }
        for index in self.scene.infinite_lights.iter().map(|i| *i as usize) {
            let (radiance, pdf) = match &self.scene.lights[index] {
                Light::Constant(light) => (light.radiance, light.pdf(path.ray.d, n, T::COMBINES)),
                Light::Environment(_) if matches!(path.segment, Segment::Mirror) => continue,
                Light::Environment(light) => light.seen(&{ path.ray.d }, n, T::COMBINES),
                _ => continue,
            };
            if !radiance.is_black() {
                self.found::<T>(path, radiance, index, |_, _| pdf, record);
            }
        }
    }

    /// Light of the surface that the segment met.
    #[inline(always)]
    pub(super) fn find_light<T: Technique>(
        &self,
        path: &mut PathState,
        surface: &Surface<'_>,
        hit: Hit,
        record: &mut impl Record,
    ) {
        has(Feature::Mis, surface.light.is_some());
        let Some(index) = surface.light.map(|i| i as usize) else { return };
        let light = &self.scene.lights[index];
        has(Feature::Textures, matches!(light, Light::Varying(_)));
        match light {
            Light::Area(light) => {
                let radiance = light.emitted(surface.point.n, surface.wo);
                if !radiance.is_black() {
                    let shape = &self.scene.shapes[light.shape as usize];
                    self.found::<T>(path, radiance, index, |from, n| light.pdf(shape, from, n, &surface.point), record);
                }
            }
            Light::Varying(light) => {
                self.find_varying::<T>(path, (index, light), &{ surface.point }, hit.primitive, record);
            }
            _ => {}
        }
    }

    /// The same for a surface that emits more here than there: not inlined, as most scenes have none.
    #[inline(never)]
    fn find_varying<T: Technique>(
        &self,
        path: &mut PathState,
        (index, light): (usize, &VaryingLight),
        point: &SurfacePoint,
        primitive: u32,
        record: &mut impl Record,
    ) {
        let shape = &self.scene.shapes[light.shape() as usize];
        let radiance = light.emitted(shape, primitive, point, &-path.ray.d);
        if !radiance.is_black() {
            self.found::<T>(path, radiance, index, |from, _| light.pdf(shape, &from, point, primitive), record);
        }
    }

    /// Counts light at the end of the segment, which the light of this index samples with the density `pdf(from, n)`.
    #[inline(always)]
    fn found<T: Technique>(
        &self,
        path: &mut PathState,
        radiance: Rgb,
        index: usize,
        pdf: impl Fn(DVec3, Vec3) -> SolidAnglePdf,
        record: &mut impl Record,
    ) {
        let weight = match path.segment {
            Segment::Delta | Segment::Mirror => 1.0,
            Segment::Through { .. } => self.weight_through::<T>(&path.segment, index),
            Segment::Smooth { pdf: bsdf, from, n, lobe, .. } => {
                let receiver = || Receiver { p: from.as_vec3(), n, lobe };
                let light = match T::SAMPLES_LIGHTS {
                    true => {
                        // As many as there are candidates could have found it.
                        let several = Feature::Candidates.is_built() && path.depth == 2;
                        let samples = if several { self.candidates.count as f32 } else { 1.0 };
                        let pmf = match T::Variant::ANY_LIGHTS {
                            true => self.scene.light_sampler.pmf(index, receiver),
                            false => 1.0,
                        };
                        pdf(from, n) * (pmf * samples)
                    }
                    false => SolidAnglePdf(0.0),
                };
                T::found_weight(bsdf, light)
            }
        };
        let found = path.throughput * radiance * weight;
        record.event(Event::Found { radiance: path.carried * found, weight });
        path.radiance += found;
    }
}
