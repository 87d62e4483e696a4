//! What goes beside the radiance of a sample: quantities of the surface that its camera ray meets, and of the radiance.
//!
//! Nothing of this is in the loop over paths. A wave's camera rays are looked at once, when what they meet is known, by a
//! function that a render without such quantities does not have ([`Sink`]).
//!
//! Where a camera ray meets nothing, everything is zero, as in Mitsuba.

use super::path_state::PathState;
use super::work::Tiles;
use crate::accel::Hit;
use crate::bsdf::BsdfSample;
use crate::film::exact::Scale;
use crate::film::{Extras, SampleId};
use crate::math::ray::Ray;
use crate::scene::Scene;
use crate::spectrum::{Rgb, rgb_to_xyz};
use glam::DVec3;

/// A quantity of which means are taken, like those of radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The directional albedo of the surface, estimated by the weight of the very bsdf sample by which the path goes on:
    /// exactly the reflectance of a diffuse surface, a mean that converges for others. What refraction does to radiance by
    /// changing its solid angle is taken out, so that clear glass is white.
    Albedo,
    /// Mitsuba's `albedo`: the diffuse reflectance ([`crate::bsdf::Bsdf::diffuse_reflectance`]).
    DiffuseReflectance,
    /// Geometric normal of the front side, in world space.
    Normal,
    /// Shading normal of the front side, in world space.
    ShadingNormal,
    /// Distance from the origin of the camera ray, in the file's unit.
    Depth,
    /// Mitsuba's `depth`: distance from the near clip plane, along the ray, in the file's unit.
    DepthFromNear,
    /// The point, in the file's world space.
    Position,
    /// Texture coordinates: [`Scene::uv`].
    Uv,
    /// Radiance of the sample.
    Radiance,
    /// The same as CIE XYZ.
    Xyz,
    /// 1 where there is something to be seen, 0 elsewhere: its mean is alpha.
    Alpha,
    /// 1 for the samples whose surfaces are looked at ([`Aovs::looked_at`]): its mean is their part of the weight.
    LookedAt,
}

/// A whole number that the first sample of a pixel tells: the index of something, plus [`Self::first`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Number {
    /// Of what.
    pub index: Index,
    /// What the first of them is called. Where nothing is met the number is 0.
    pub first: u32,
}

/// What a [`Number`] counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Index {
    /// Primitives of a shape.
    Primitive,
    /// Shapes of the scene.
    Shape,
    /// Materials of the scene.
    Material,
}

/// A quantity, or the square of each of its components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Aov {
    /// The quantity.
    pub quantity: Quantity,
    /// Whether it is squared.
    pub squared: bool,
}

/// Everything that goes beside radiance.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Aovs {
    /// Means.
    pub means: Vec<Aov>,
    /// Whole numbers.
    pub numbers: Vec<Number>,
    /// Whether the samples that count are wanted, too.
    pub sample_counts: bool,
    /// Whether a sky that the camera sees counts for alpha, as it does in Mitsuba's `path`, but not in its `direct`.
    pub sky_counts: bool,
    /// Of how many samples of a pixel the surface is looked at, from the first on.
    pub looked_at: u32,
}

impl Default for Aovs {
    /// Nothing, of all samples.
    fn default() -> Self {
        Self { means: Vec::new(), numbers: Vec::new(), sample_counts: false, sky_counts: false, looked_at: u32::MAX }
    }
}

impl Quantity {
    /// How many components it has.
    pub fn components(self) -> usize {
        match self {
            Self::Depth | Self::DepthFromNear | Self::Alpha | Self::LookedAt => 1,
            Self::Uv => 2,
            _ => 3,
        }
    }

    /// Whether it tells of the surface that the camera ray meets: zero for samples that are not looked at.
    pub fn is_of_the_surface(self) -> bool {
        !self.is_of_the_path()
    }

    /// Whether it is known only when the path has ended.
    fn is_of_the_path(self) -> bool {
        matches!(self, Self::Radiance | Self::Xyz | Self::Alpha | Self::LookedAt)
    }

    /// Whether it is a length, which changes with the unit.
    fn is_length(self) -> bool {
        matches!(self, Self::Depth | Self::DepthFromNear | Self::Position)
    }
}

impl Aov {
    /// The factor that brings its mean to the file's unit of length: a power of two.
    pub fn unit(self, scene: &Scene) -> f64 {
        match (self.quantity.is_length(), self.squared) {
            (false, _) => 1.0,
            (true, false) => 1.0 / scene.unit,
            (true, true) => 1.0 / (scene.unit * scene.unit),
        }
    }

    /// The scale of its sums. Lengths are in the compiled scene's unit, in which surfaces are within 1 of its centre.
    fn scale(self, scene: &Scene) -> Scale {
        /// Squares of radiance may reach 2^(8 + 31) times the square of the brightest light's, so that samples up to
        /// 2^19 times as bright are squared rightly; squares down to 2^−56 of it are counted.
        const SQUARED_RADIANCE_BITS: i32 = 8;
        let exponent = match self.quantity {
            Quantity::Radiance | Quantity::Xyz => Scale::for_radiance(scene.brightest()).exponent(),
            Quantity::Position => libm::frexp(1.0 + scene.centre.abs().max_element() * scene.unit).1,
            _ => 0,
        };
        let headroom = match self.quantity {
            Quantity::Radiance | Quantity::Xyz => SQUARED_RADIANCE_BITS,
            _ => 0,
        };
        Scale::for_exponent(if self.squared { 2 * exponent + headroom } else { exponent })
    }
}

impl Aovs {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.means.is_empty() && self.numbers.is_empty() && !self.sample_counts
    }

    /// Adds alpha if it is not there yet, and says at which of the film's means.
    pub fn alpha(&mut self) -> usize {
        let alpha = Aov { quantity: Quantity::Alpha, squared: false };
        let found = self.means.iter().position(|aov| *aov == alpha);
        let index = found.unwrap_or_else(|| {
            self.means.push(alpha);
            self.means.len() - 1
        });
        self.means[..index].iter().map(|aov| aov.quantity.components()).sum()
    }

    /// What a film is to keep.
    pub fn extras(&self, scene: &Scene) -> Extras {
        let scales = |aov: &Aov| std::iter::repeat_n(aov.scale(scene), aov.quantity.components());
        Extras { means: self.means.iter().flat_map(scales).collect(), numbers: self.numbers.len() }
    }
}

/// Takes what a walk finds. A function of paths that have ended is one.
pub(super) trait Sink {
    /// Whether it looks at what camera rays meet, also where paths have no other use for that.
    const LOOKS: bool;

    /// What the camera rays of a wave met: `rays` as they left the camera, `paths` with the rays that met the `hits`.
    fn first_hits(&mut self, rays: &[Ray], paths: &[PathState], hits: &[Hit]);

    /// Path `index` of the wave has ended.
    fn finished(&mut self, index: usize, path: &PathState);
}

impl<F: FnMut(&PathState)> Sink for F {
    const LOOKS: bool = false;

    #[inline(always)]
    fn first_hits(&mut self, _: &[Ray], _: &[PathState], _: &[Hit]) {}

    #[inline(always)]
    fn finished(&mut self, _: usize, path: &PathState) {
        self(path);
    }
}

/// Adds samples to a tile with everything that goes beside radiance.
pub(super) struct AovSink<'a, 'b> {
    scene: &'a Scene,
    aovs: &'a Aovs,
    tiles: Tiles<'a, 'b>,
    /// Alpha of a path that met nothing at all.
    sky_alpha: f64,
    /// Values of each path of the wave, one after the other.
    values: Vec<f64>,
    numbers: Vec<u32>,
}

impl<'a, 'b> AovSink<'a, 'b> {
    /// For the samples of `tiles`, from which the sky can be seen if `sees_sky`.
    pub(super) fn new(scene: &'a Scene, aovs: &'a Aovs, tiles: Tiles<'a, 'b>, sees_sky: bool) -> Self {
        let counts = aovs.sky_counts && sees_sky && !scene.infinite_lights.is_empty();
        Self { scene, aovs, tiles, sky_alpha: f64::from(u8::from(counts)), values: Vec::new(), numbers: Vec::new() }
    }

    fn stride(&self) -> usize {
        self.aovs.means.iter().map(|aov| aov.quantity.components()).sum()
    }

    /// The surface's part of a quantity.
    fn of_surface(&self, quantity: Quantity, start: &Ray, path: &PathState, hit: Hit) -> DVec3 {
        let (scene, ray) = (self.scene, &path.ray);
        let point = || scene.shapes[hit.shape as usize].meet(ray, hit.primitive);
        let along = || (point().point.p - start.o.as_dvec3()).dot(start.d.as_dvec3());
        match quantity {
            Quantity::Albedo => colour(self.albedo(path, hit)),
            Quantity::DiffuseReflectance => {
                let mut layers = Vec::new();
                let surface = scene.surface(ray, hit, &mut layers);
                colour(surface.bsdf.diffuse_reflectance(surface.frame.to_local(surface.wo)))
            }
            Quantity::Normal => point().point.n.as_dvec3(),
            Quantity::ShadingNormal => point().shading_normal.as_dvec3(),
            Quantity::Depth => DVec3::splat(along()),
            Quantity::DepthFromNear => DVec3::splat(along() - f64::from(start.tmin)),
            Quantity::Position => point().point.p + scene.centre * scene.unit,
            Quantity::Uv => scene.uv(ray, hit).as_dvec2().extend(0.0),
            Quantity::Radiance | Quantity::Xyz | Quantity::Alpha | Quantity::LookedAt => DVec3::ZERO,
        }
    }

    /// See [`Quantity::Albedo`].
    fn albedo(&self, path: &PathState, hit: Hit) -> Rgb {
        let mut layers = Vec::new();
        let surface = self.scene.surface(&path.ray, hit, &mut layers);
        let wo = surface.frame.to_local(surface.wo);
        match surface.bsdf.sample(wo, path.stream.bsdf(0)) {
            Some(BsdfSample { weight, eta, .. }) => weight * (eta * eta),
            None => Rgb::BLACK,
        }
    }

    /// The numbers of a pixel whose first sample met this.
    fn tell(&mut self, id: SampleId, hit: Hit) {
        self.numbers.clear();
        self.numbers.extend(self.aovs.numbers.iter().map(|number| {
            if !hit.is_some() {
                return 0;
            }
            let index = match number.index {
                Index::Primitive => hit.primitive,
                Index::Shape => hit.shape,
                Index::Material => self.scene.appearances[hit.shape as usize].material,
            };
            number.first + index
        }));
        self.tiles.of(id).set_numbers(id.x, id.y, &self.numbers);
    }

    /// What the path says of a quantity that is its own.
    fn of_path(&self, quantity: Quantity, path: &PathState) -> Option<DVec3> {
        Some(match quantity {
            Quantity::Radiance => colour(path.radiance),
            Quantity::Xyz => DVec3::from(rgb_to_xyz(path.radiance).map(f64::from)),
            Quantity::Alpha => DVec3::splat(if path.met { 1.0 } else { self.sky_alpha }),
            Quantity::LookedAt => DVec3::splat(f64::from(u8::from(path.id.index < self.aovs.looked_at))),
            _ => return None,
        })
    }
}

fn colour(c: Rgb) -> DVec3 {
    c.0.as_dvec3()
}

/// Puts a quantity into its place.
fn store(to: &mut [f64], aov: Aov, value: DVec3) {
    let value = if aov.squared { value * value } else { value };
    to.copy_from_slice(&value.to_array()[..to.len()]);
}

impl Sink for AovSink<'_, '_> {
    const LOOKS: bool = true;

    fn first_hits(&mut self, rays: &[Ray], paths: &[PathState], hits: &[Hit]) {
        let stride = self.stride();
        let mut values = std::mem::take(&mut self.values);
        values.clear();
        values.resize(paths.len() * stride, 0.0);
        let mut first = 0;
        for ((start, path), &hit) in rays.iter().zip(paths).zip(hits) {
            if path.id.index == 0 && !self.aovs.numbers.is_empty() {
                self.tell(path.id, hit);
            }
            let looks = hit.is_some() && path.id.index < self.aovs.looked_at;
            for aov in &self.aovs.means {
                let last = first + aov.quantity.components();
                if looks && aov.quantity.is_of_the_surface() {
                    store(&mut values[first..last], *aov, self.of_surface(aov.quantity, start, path, hit));
                }
                first = last;
            }
        }
        self.values = values;
    }

    fn finished(&mut self, index: usize, path: &PathState) {
        let mut first = index * self.stride();
        let own = first..first + self.stride();
        for aov in &self.aovs.means {
            let last = first + aov.quantity.components();
            if let Some(value) = self.of_path(aov.quantity, path) {
                store(&mut self.values[first..last], *aov, value);
            }
            first = last;
        }
        let film = || path.stream.film();
        self.tiles.of_finished(path).add_sample_with(path.id, path.radiance, film, &self.values[own]);
    }
}
