//! The compiled scene: everything a render needs, in f32, immutable, shared by all threads.
//!
//! # Space
//!
//! The compiled scene is the file's, moved so that the centre of its surfaces is the origin and scaled by a power of two
//! so that the farthest coordinate of a surface is in [½, 1). Both happen in f64, before anything is rounded. So a scene
//! far from the origin loses nothing, no square or product overflows, and a file whose lengths are all multiplied by a
//! power of two gives the same compiled scene, bit for bit. Radiance does not depend on the unit of length.

mod ahead;
pub mod compile;
mod features;
mod panes;
pub mod predict;
mod space;
mod surface;

pub use ahead::{AHEAD, Ahead, LookedAt};
pub use features::Features;
pub use panes::Panes;
pub use surface::Surface;

use crate::accel::{Accel, Hit};
use crate::camera::Camera;
use crate::facts::{Feature, has};
use crate::image::{ComponentFormat, Crop, Filter, PixelFormat};
use crate::light::{Light, LightSampler};
use crate::material::{Graph, Layer, Material, Place, Scatter, Sides};
use crate::math::frame::Frame;
use crate::math::ray::Ray;
use crate::shape::Shape;
use crate::shape::offset::SurfacePoint;
use crate::shape::surface::ShapePoint;
use crate::shape::tangent::TangentField;
use crate::shape::uv::{UvField, UvPoint};
use crate::spectrum::Rgb;
use crate::texture::{Lookup, MeshPoint, MeshValues, TexturePoint, Textures};
use ahead::Met;
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// The picture that the scene's camera takes.
#[derive(Clone, Copy, Debug)]
pub struct FilmSettings {
    /// Pixels across and down of the whole film.
    pub size: (u32, u32),
    /// The part to render.
    pub crop: Crop,
    /// The reconstruction filter.
    pub filter: Filter,
    /// Whether samples are taken around the part, too, wherever one reaches into it.
    pub sample_border: bool,
    /// Type of an EXR's values.
    pub component_format: ComponentFormat,
    /// What a file's channels are.
    pub pixel_format: PixelFormat,
}

/// What a shape looks like.
#[derive(Clone, Copy, Debug)]
pub struct Appearance {
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// Index into [`Scene::lights`], if it emits.
    pub light: Option<u32>,
    /// Whether the file gives it an emitter, be it a black one: then `hide_emitters` hides it.
    pub is_emitter: bool,
    /// Index into [`Scene::tangents`], if its material depends on them.
    pub tangents: Option<u32>,
    /// Index into [`Scene::uvs`], if its material is textured or its texture coordinates are wanted anyway.
    pub uvs: Option<u32>,
    /// Whether its material depends on tangents and takes them from texture coordinates, with their sign, which matters to a
    /// normal map.
    pub along_uvs: bool,
    /// Whether light is sought through it: whether it lets light through in one direction that is not far from straight on.
    pub is_pane: bool,
    /// Index into [`Scene::mesh_values`], if its textures ask for more than its first set of texture coordinates.
    pub values: Option<u32>,
}

/// A compiled scene.
pub struct Scene {
    /// The camera.
    pub camera: Camera,
    /// The picture it takes.
    pub film: FilmSettings,
    /// Every shape.
    pub shapes: Vec<Shape>,
    /// What each shape looks like.
    pub appearances: Vec<Appearance>,
    /// Every surface description in use.
    pub materials: Vec<Material>,
    /// What a path meets in place of each of them once it is regularized ([`Material::regularized`]). Empty if paths are not.
    pub rougher: Vec<Material>,
    /// What is inside of surfaces of each material: the absorption coefficient, per the compiled scene's unit of length; `None`
    /// for materials without an inside. Empty if nothing absorbs.
    pub absorption: Vec<Option<Rgb>>,
    /// Every texture in use.
    pub textures: Arc<Textures>,
    /// Tangents of every shape whose material depends on them.
    pub tangents: Vec<TangentField>,
    /// Texture coordinates of every shape whose material is textured.
    pub uvs: Vec<UvField>,
    /// What meshes give textures beside those.
    pub mesh_values: Vec<Arc<MeshValues>>,
    /// Every light that is not black.
    pub lights: Vec<Light>,
    /// Which of them are at infinity and met by rays that meet nothing else.
    pub infinite_lights: Vec<u32>,
    /// Where all panes are ([`Appearance::is_pane`]), if there is a light with size that may be sought behind them.
    pub panes: Panes,
    /// Chooses among the lights.
    pub light_sampler: LightSampler,
    /// Answers ray queries.
    pub accel: Accel,
    /// What the scene has.
    pub features: Features,
    /// Factor from the file's unit of length to the compiled scene's: a power of two.
    pub unit: f64,
    /// The point of the file's space that is the compiled scene's origin.
    pub centre: DVec3,
}

impl Scene {
    /// The surface that `ray` meets, as seen from its origin.
    ///
    /// `layers` is room for the layers of a material that varies; what is in it does not matter.
    #[inline(always)]
    pub fn surface<'a>(&'a self, ray: &Ray, hit: Hit, layers: &'a mut Vec<Layer>) -> Surface<'a> {
        self.surface_looked_at((ray, hit, None), || None, layers)
    }

    /// The same where the point may be known ([`Self::receiver`]), and [`Self::look_ahead`] may have looked at the hit and found
    /// `met`, which is asked only if it can have.
    #[inline(always)]
    pub fn surface_looked_at<'a, 'm>(
        &'a self,
        at: (&Ray, Hit, Option<&ShapePoint>),
        met: impl FnOnce() -> Option<LookedAt<'m>>,
        layers: &'a mut Vec<Layer>,
    ) -> Surface<'a> {
        self.surface_of(&self.materials, at, met, layers)
    }

    /// The point where `ray` meets a surface whose material is the same everywhere, and the normal on whose side that scatters there,
    /// zero where it lets light through. Of others, if the point is known from looking ahead, that and the side it is shaded on, which
    /// may be another one.
    #[inline(always)]
    pub fn receiver(&self, ray: &Ray, hit: Hit, met: Option<&ShapePoint>) -> Option<(ShapePoint, Vec3)> {
        if let Some(point) = met {
            return Some((*point, point.shading_normal));
        }
        let material = &self.materials[self.appearances[hit.shape as usize].material as usize];
        has(Feature::Textures, matches!(material, Material::Varying(_)));
        let Material::Plain(sides) = material else { return None };
        let shape = &self.shapes[hit.shape as usize];
        has(Feature::Quadrics, shape.is_quadric());
        has(Feature::Instances, matches!(shape, Shape::Placed(_)));
        let point = match shape {
            Shape::Mesh(mesh) => mesh.meet(ray, hit.primitive),
            other => other.meet(ray, hit.primitive),
        };
        let n = point.shading_normal;
        let (bsdf, mirrored) = sides.seen_from(-n.dot(ray.d));
        let n = if has(Feature::Transmission, bsdf.lobes().transmits) { Vec3::ZERO } else { n };
        Some((point, if mirrored { -n } else { n }))
    }

    /// What [`Self::surface_looked_at`] tells, as paths meet it that are regularized, of which the scene must know.
    #[inline(never)]
    pub fn rougher_surface<'a>(
        &'a self,
        ray: &Ray,
        hit: Hit,
        met: Option<LookedAt<'_>>,
        layers: &'a mut Vec<Layer>,
    ) -> Surface<'a> {
        self.surface_of(&self.rougher, (ray, hit, None), || met, layers)
    }

    /// The surface, of one of these materials.
    #[inline(always)]
    fn surface_of<'a, 'm>(
        &'a self,
        materials: &'a [Material],
        (ray, hit, known): (&Ray, Hit, Option<&ShapePoint>),
        met: impl FnOnce() -> Option<LookedAt<'m>>,
        layers: &'a mut Vec<Layer>,
    ) -> Surface<'a> {
        let appearance = self.appearances[hit.shape as usize];
        let material = &materials[appearance.material as usize];
        has(Feature::Textures, matches!(material, Material::Varying(_)));
        let material = match material {
            Material::Plain(sides) => sides,
            Material::Varying(graph) => return self.varying_surface(ray, hit, met(), graph, layers),
        };
        let mut surface = self.surface_by((ray, hit, known), appearance, material);
        has(Feature::Tangents, appearance.tangents.is_some());
        if let Some(field) = appearance.tangents {
            surface.frame = self.anisotropic_frame(field, hit.primitive, surface.frame.n, surface.point);
        }
        surface
    }

    /// The same in a scene none of whose materials is worked out at each point or depends on tangents, so that nothing of that is
    /// here.
    #[inline(always)]
    pub fn plain_surface(&self, at: (&Ray, Hit, Option<&ShapePoint>)) -> Surface<'_> {
        let appearance = self.appearances[at.1.shape as usize];
        match &self.materials[appearance.material as usize] {
            Material::Plain(sides) => self.surface_by(at, appearance, sides),
            Material::Varying(_) => unreachable!("the scene has no material that varies"),
        }
    }

    #[inline(always)]
    fn surface_by<'a>(
        &'a self,
        (ray, hit, known): (&Ray, Hit, Option<&ShapePoint>),
        appearance: Appearance,
        material: &'a Sides,
    ) -> Surface<'a> {
        if let Some(point) = known {
            return Surface::new(*point, -ray.d, material, appearance.light);
        }
        let shape = &self.shapes[hit.shape as usize];
        has(Feature::Quadrics, shape.is_quadric());
        has(Feature::Instances, matches!(shape, Shape::Placed(_)));
        // Twice the same: a point that came from either would have to be put into memory, and read too soon after.
        match shape {
            Shape::Mesh(mesh) => Surface::new(mesh.meet(ray, hit.primitive), -ray.d, material, appearance.light),
            quadric => Surface::new(quadric.meet(ray, hit.primitive), -ray.d, material, appearance.light),
        }
    }

    /// A surface whose material is worked out for the point: not inlined, as most scenes have none.
    #[inline(never)]
    fn varying_surface<'a>(
        &'a self,
        ray: &Ray,
        hit: Hit,
        met: Option<LookedAt<'_>>,
        graph: &Graph,
        layers: &'a mut Vec<Layer>,
    ) -> Surface<'a> {
        let appearance = self.appearances[hit.shape as usize];
        let own;
        let (met, lookups) = match met {
            Some(LookedAt { met, lookups }) => (met, lookups),
            None => {
                own = self.meet(ray, hit);
                (&own, &[][..])
            }
        };
        let Met { shape: ShapePoint { point, shading_normal }, at, .. } = met;
        let frame = match appearance.tangents {
            _ if appearance.along_uvs => Frame::from_tangent(*shading_normal, at.tangent),
            Some(field) => self.anisotropic_frame(field, hit.primitive, *shading_normal, *point),
            None => Frame::from_normal(*shading_normal),
        };
        // Without tangents nothing asks how the surface moves with its texture coordinates.
        let dp = if appearance.along_uvs { [frame.to_local(at.dp[0]), frame.to_local(at.dp[1])] } else { at.dp };
        let place = Place {
            point: self.texture_point(appearance, hit.primitive, at, lookups),
            wo: frame.to_local(-ray.d),
            dp,
            mirrored: at.mirrored,
        };
        graph.resolve(&self.textures, &place, layers);
        let bsdf = match &layers[..] {
            [Layer { bsdf, perturbation: None, .. }] => Scatter::One(bsdf),
            layers => Scatter::Layers(layers),
        };
        Surface { point: *point, frame, wo: -ray.d, bsdf, light: appearance.light }
    }

    /// Where textures are asked, at a point with these texture coordinates, where these lookups were found ahead.
    fn texture_point<'a>(
        &'a self,
        appearance: Appearance,
        primitive: u32,
        at: &UvPoint,
        ahead: &'a [Lookup],
    ) -> TexturePoint<'a> {
        let mesh = appearance.values.zip(at.corners).map(|(values, (corners, weights))| MeshPoint {
            values: &self.mesh_values[values as usize],
            face: primitive,
            corners,
            weights,
        });
        TexturePoint { uv: at.uv, mesh, ahead }
    }

    /// The frame of the shading normal `n` along the tangents of a shape. Not inlined, and given copies: most scenes have
    /// nothing anisotropic.
    #[inline(never)]
    fn anisotropic_frame(&self, field: u32, primitive: u32, n: Vec3, at: SurfacePoint) -> Frame {
        Frame::from_tangent(n, self.tangents[field as usize].at(primitive, &at))
    }

    /// Texture coordinates where `ray` meets a surface; zero unless the surface has been told to have some.
    pub fn uv(&self, ray: &Ray, hit: Hit) -> Vec2 {
        let shape = &self.shapes[hit.shape as usize];
        let field = self.appearances[hit.shape as usize].uvs.map(|uvs| &self.uvs[uvs as usize]);
        let at = |field: &UvField| field.at(shape, hit.primitive, shape.meet(ray, hit.primitive).point.p).uv;
        field.map_or(Vec2::ZERO, at)
    }

    /// Regularizes paths from now on, which is biased: once a path has been scattered by something that is no mirror, it meets
    /// rougher materials (Kaplanyan and Dachsbacher 2013, *Path Space Regularization for Holistic and Robust Light Transport*, as
    /// simplified by pbrt-v4).
    pub fn regularize(&mut self) {
        self.rougher = self.materials.par_iter().map(Material::regularized).collect();
    }

    /// Whether paths are regularized.
    #[inline(always)]
    pub fn regularizes(&self) -> bool {
        !self.rougher.is_empty()
    }

    /// Whether something absorbs light inside of it.
    #[inline(always)]
    pub fn absorbs(&self) -> bool {
        has(Feature::Volumes, !self.absorption.is_empty())
    }

    /// The largest radiance of any light ([`Light::brightest`]).
    pub fn brightest(&self) -> f32 {
        self.lights.iter().map(Light::brightest).fold(0.0, f32::max)
    }
}
