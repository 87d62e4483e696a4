//! What the scene file said: plain data with positions, in the file's own units, double precision, nothing rendered.
//!
//! Loaders make it, [`crate::scene::compile`] reads it; neither Embree nor a bsdf is known here. Colours are already
//! linear sRGB; everything with a length in it is in the file's units; angles are in degrees where the field says so.

mod aov;
mod bsdf;
mod inventory;
mod texture;
mod transform;

pub use aov::{Aov, AovKind};
pub use bsdf::{
    Bsdf, BsdfKind, Gltf, MicrofacetDistribution, Microfacets, NormalSource, Plastic, PrincipledShared, SurfaceNeeds,
    Terminator, Varying, Volume,
};
pub use inventory::Inventory;
pub use texture::{Channel, Texture, TextureKind, Wrap};

use crate::error::Span;
pub use crate::image::{ComponentFormat, Crop, Filter, Picture, PixelFormat};
pub use crate::parameter::Parameter;
use crate::spectrum::Rgb;
use glam::{DAffine3, DMat3, DVec2, DVec3, DVec4};
use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

/// A whole scene file.
#[derive(Clone, Debug)]
pub struct SceneDescription {
    /// How to render it.
    pub integrator: Integrator,
    /// The cameras of the file, at least one; the first is rendered unless the user says otherwise.
    pub cameras: Vec<Camera>,
    /// Every bsdf that a shape uses, directly or through another bsdf.
    pub bsdfs: Vec<Bsdf>,
    /// Every texture that one of them uses, directly or through another texture.
    pub textures: Vec<Texture>,
    /// Every shape that stands by itself.
    pub shapes: Vec<Shape>,
    /// Shapes that are placed together, wherever an instance says.
    pub groups: Vec<Group>,
    /// Where groups are placed.
    pub instances: Vec<Instance>,
    /// Whether the texture coordinates of every shape are wanted, not only of those with textures.
    pub wants_uvs: bool,
    /// Lights that are not attached to a shape.
    pub lights: Vec<Light>,
    /// Complaints that were not fatal, each with its place: what `--lenient` let pass, what was never read.
    pub warnings: Vec<String>,
    /// What the file has.
    pub inventory: Inventory,
}

impl SceneDescription {
    /// Every texture that a shape's bsdf or emission asks, be it through others, each once.
    pub fn textures_of(&self, shape: &Shape) -> BTreeSet<TextureId> {
        let mut found: BTreeSet<TextureId> = shape.emission.and_then(|emission| emission.texture).into_iter().collect();
        let (mut seen, mut bsdfs) = (HashSet::from([shape.bsdf]), vec![shape.bsdf]);
        while let Some(id) = bsdfs.pop() {
            let bsdf = &self.bsdfs[id.0];
            found.extend(bsdf.asked_textures());
            bsdfs.extend(bsdf.parts().into_iter().filter(|part| seen.insert(*part)));
        }
        let mut waiting: Vec<TextureId> = found.iter().copied().collect();
        while let Some(id) = waiting.pop() {
            waiting.extend(self.textures[id.0].parts().into_iter().filter(|part| found.insert(*part)));
        }
        found
    }
}

/// Index into [`SceneDescription::bsdfs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BsdfId(pub usize);

/// Index into [`SceneDescription::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TextureId(pub usize);

/// The `<integrator>` of the file.
#[derive(Clone, Debug)]
pub struct Integrator {
    /// Which estimator.
    pub kind: IntegratorKind,
    /// The largest number of segments of a path, camera ray included (1: emission seen directly; 2: direct light);
    /// `None` for no limit.
    pub max_depth: Option<u32>,
    /// Russian roulette decides about every vertex whose number (the first hit is 1) is at least this.
    pub rr_depth: u32,
    /// Whether emitters are invisible to camera rays.
    pub hide_emitters: bool,
    /// What goes into channels beside those of the picture.
    pub aovs: Vec<Aov>,
}

/// Estimators that a scene file can ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorKind {
    /// Light and bsdf sampling combined.
    Path,
    /// The same, for paths of at most one bounce.
    Direct,
}

impl Default for Integrator {
    fn default() -> Self {
        Self { kind: IntegratorKind::Path, max_depth: None, rr_depth: 5, hide_emitters: false, aovs: Vec::new() }
    }
}

/// A camera with its film and sampler.
///
/// Camera space is Mitsuba's: the camera looks along +z, +y is up, and +x points to the *left* of the picture.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Where in the file.
    pub at: Span,
    /// Camera space to the file's world space; no scale, unless it is orthographic.
    pub to_world: DAffine3,
    /// How it sees.
    pub projection: Projection,
    /// Nearest visible distance along the viewing axis (of a panorama: in any direction), positive.
    pub near_clip: f64,
    /// Farthest visible distance, larger than `near_clip`.
    pub far_clip: f64,
    /// The film.
    pub film: Film,
    /// The sampler's count and seed.
    pub sampler: Sampler,
}

/// How a camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Through a pinhole.
    Perspective {
        /// The field of view.
        fov: FieldOfView,
        /// Position of the principal point relative to the middle of the film, as a fraction of its width and height.
        principal_point_offset: (f64, f64),
    },
    /// Through a thin lens.
    ThinLens {
        /// The field of view.
        fov: FieldOfView,
        /// Radius of the aperture, not negative.
        aperture_radius: f64,
        /// Distance of what is sharp along the viewing axis, positive.
        focus_distance: f64,
    },
    /// In parallel, along +z, from where the film is: [−1, 1] across in the plane z = 0 of camera space, and as far down as
    /// its pixels are square.
    Orthographic,
    /// In all directions, equirectangular; the middle of the picture is +z.
    Panorama,
}

/// A field of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOfView {
    /// In degrees along `axis`, in (0, 180).
    pub degrees: f64,
    /// What it measures.
    pub axis: FovAxis,
}

/// What a field of view is measured along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FovAxis {
    /// Width.
    X,
    /// Height.
    Y,
    /// Diagonal.
    Diagonal,
    /// The shorter of width and height.
    Smaller,
    /// The longer of width and height.
    Larger,
}

/// A film: the size of the picture, the part of it to render, the reconstruction filter, the file's pixels.
#[derive(Clone, Debug)]
pub struct Film {
    /// Where in the file.
    pub at: Span,
    /// Pixels across, at least 1.
    pub width: u32,
    /// Pixels down, at least 1.
    pub height: u32,
    /// The part to render, inside the picture; the whole of it unless the file says otherwise.
    pub crop: Crop,
    /// The reconstruction filter.
    pub filter: Filter,
    /// Whether samples are taken around the part, too, wherever the filter makes one reach into it.
    pub sample_border: bool,
    /// Type of a stored pixel value.
    pub component_format: ComponentFormat,
    /// What the stored channels are.
    pub pixel_format: PixelFormat,
}

impl Film {
    /// Largest width and height. Reason: a camera ray tells a millionth of the picture's width in single precision, but
    /// not much less.
    pub const MAX_SIDE: u32 = 1_000_000;

    /// Most pixels to render. Reason: their sums take 64 bytes each, 16 GiB in all.
    pub const MAX_PIXELS: u64 = 1 << 28;

    /// Refuses a width or height that is too large.
    pub fn check_side(pixels: u32) -> Result<(), String> {
        if pixels <= Self::MAX_SIDE {
            return Ok(());
        }
        Err(format!("{pixels} pixels a side are too many; at most {} can be rendered", Self::MAX_SIDE))
    }

    /// Refuses more pixels than can be rendered.
    pub fn check_pixels(crop: Crop) -> Result<(), String> {
        let pixels = u64::from(crop.width) * u64::from(crop.height);
        if pixels <= Self::MAX_PIXELS {
            return Ok(());
        }
        Err(format!("{pixels} pixels are too many; at most {} can be rendered", Self::MAX_PIXELS))
    }
}

/// What the file says of the sampler; its type is a hint that snell does not follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampler {
    /// Samples per pixel.
    pub sample_count: u32,
    /// Seed.
    pub seed: u32,
}

/// A shape with its surface and emission.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Where in the file.
    pub at: Span,
    /// What the file calls it (its id, or the name of its mesh file, or its plugin).
    pub name: String,
    /// Its points, in object space.
    pub geometry: Geometry,
    /// Object space to the file's world space; invertible.
    pub to_world: DAffine3,
    /// Whether normals (geometric and shading) point the other way.
    pub flip_normals: bool,
    /// Its surface.
    pub bsdf: BsdfId,
    /// What it emits, if it is an area light.
    pub emission: Option<Emission>,
}

/// What a surface emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance from its front side, in W·sr⁻¹·m⁻².
    pub radiance: Rgb,
    /// A factor on it that varies over the surface.
    pub texture: Option<TextureId>,
    /// Whether it emits from its back side, too.
    pub both_sides: bool,
}

impl Emission {
    /// The same from everywhere on the front side.
    pub fn uniform(radiance: Rgb) -> Self {
        Self { radiance, texture: None, both_sides: false }
    }
}

/// Shapes that are placed together. None emits.
#[derive(Clone, Debug)]
pub struct Group {
    /// The shapes; their world is the group.
    pub shapes: Vec<Shape>,
}

/// Index into [`SceneDescription::groups`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GroupId(pub usize);

/// A group in a place.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Where in the file.
    pub at: Span,
    /// What the file calls it: its id, or its plugin.
    pub name: String,
    /// What is placed.
    pub group: GroupId,
    /// From the group to the file's world space; invertible.
    pub to_world: DAffine3,
}

/// The points of a shape, in object space.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Triangles.
    Mesh(Arc<Mesh>),
    /// The square [−1, 1]² in the plane z = 0, normal +z.
    Rectangle,
    /// The unit disk in the plane z = 0, normal +z.
    Disk,
    /// The side of a cylinder, without its ends; its normal points outwards.
    Cylinder {
        /// The middle of one end.
        p0: DVec3,
        /// The middle of the other, not the same.
        p1: DVec3,
        /// Its radius, positive.
        radius: f64,
    },
    /// A sphere; its normal points outwards.
    Sphere {
        /// Its centre.
        centre: DVec3,
        /// Its radius, positive.
        radius: f64,
        /// Its own axes, of unit length: z leads to its pole, and u is 0 towards x.
        frame: DMat3,
    },
}

/// Triangles as a file gave them. Every index is in range and every number is finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices.
    pub positions: Vec<DVec3>,
    /// Shading normals, one a vertex, not necessarily of unit length; empty where faces are flat.
    pub normals: Vec<DVec3>,
    /// Texture coordinates, one a vertex; empty where the file has none or nothing asks for them.
    pub uvs: Vec<DVec2>,
    /// Further sets of them, each one a vertex.
    pub more_uvs: Vec<Vec<DVec2>>,
    /// Tangents (x, y, z), one a vertex, in object space, and the side of the bitangent: that is w·(n×t), w = ±1, and where
    /// a normal map's green channel points. Empty where a normal map follows ∂p/∂u.
    pub tangents: Vec<DVec4>,
    /// What the file says beside that, by name.
    pub attributes: Vec<Attribute>,
    /// Vertex indices of each triangle, counter-clockwise seen from the front.
    pub faces: Vec<[u32; 3]>,
}

impl Mesh {
    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        let vectors =
            size_of_val(&self.positions[..]) + size_of_val(&self.normals[..]) + size_of_val(&self.tangents[..]);
        let uvs = std::iter::once(&self.uvs).chain(&self.more_uvs).map(|set| size_of_val(&set[..])).sum::<usize>();
        let attributes = self.attributes.iter().map(|a| size_of_val(&a.values[..])).sum::<usize>();
        (vectors + uvs + attributes + size_of_val(&self.faces[..])) as u64
    }
}

/// Numbers that a file gives for the vertices or faces of a mesh: a grey, or a linear colour, or that and an opacity.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// Its name.
    pub name: String,
    /// Whether it has one value a face; otherwise one a vertex.
    pub of_faces: bool,
    /// How many numbers a value has: 1, 3 or 4.
    pub width: usize,
    /// The values, one after the other.
    pub values: Vec<f32>,
}

/// A light that is not attached to a shape.
#[derive(Clone, Debug)]
pub struct Light {
    /// Where in the file.
    pub at: Span,
    /// What it is.
    pub kind: LightKind,
}

/// The kinds of light that are not attached to a shape.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// The same radiance from every direction, from infinitely far away.
    Constant {
        /// Radiance in W·sr⁻¹·m⁻².
        radiance: Rgb,
    },
    /// A map of radiance all around, from infinitely far away; Mitsuba's latitude and longitude.
    Environment {
        /// Radiance, but for `scale`: finite and not negative.
        map: Arc<Picture>,
        /// Factor from the map's values to radiance in W·sr⁻¹·m⁻², not negative.
        scale: f64,
        /// From the map's frame to the file's world space: a rotation, and perhaps a reflection.
        to_world: DMat3,
        /// Whether directions of little light are left to bsdf sampling where that is done, too.
        mis_compensation: bool,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Where it shines, of any length.
        direction: DVec3,
        /// Irradiance of a surface that faces it, in W·m⁻².
        irradiance: Rgb,
    },
    /// The same radiant intensity in every direction, from a point.
    Point {
        /// Where, in the file's world space.
        position: DVec3,
        /// Radiant intensity in W·sr⁻¹, the file's unit of length being the metre.
        intensity: Rgb,
    },
    /// A point that shines into a cone.
    Spot {
        /// Where, in the file's world space.
        position: DVec3,
        /// Along the axis of the cone, of any length.
        direction: DVec3,
        /// Radiant intensity along the axis in W·sr⁻¹, the file's unit of length being the metre.
        intensity: Rgb,
        /// Degrees from the axis from which it is nothing, in (0, 180].
        cutoff_angle: f64,
        /// Degrees from the axis up to which it is full, from 0 to `cutoff_angle`.
        beam_width: f64,
        /// What it shines through.
        texture: Option<SpotTexture>,
    },
    /// A point that shines through a picture, from the space of a camera that would see it.
    Projector {
        /// Irradiance over π at depth 1, the file's unit of length, but for `scale`: finite. Its unit square is the picture,
        /// which has the shape of the texture's pixels.
        texture: TextureId,
        /// Factor of the texture's values, not negative.
        scale: f64,
        /// Camera space to the file's world space; no scale.
        to_world: DAffine3,
        /// Field of view.
        fov: FieldOfView,
    },
}

/// A factor on the intensity of a spot: a texture whose unit square lies around the cone, at right angles to the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotTexture {
    /// The texture.
    pub texture: TextureId,
    /// Directions in which its coordinates grow, of any length.
    pub across: [DVec3; 2],
}
