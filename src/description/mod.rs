//! What the scene file said: plain data with positions, in the file's own units, double precision, nothing rendered.
//!
//! Loaders make it, [`crate::scene::compile`] reads it; neither Embree nor a bsdf is known here. Colours are already
//! linear sRGB; everything with a length in it is in the file's units; angles are in degrees where the field says so.

use crate::error::Span;
pub use crate::image::{ComponentFormat, Crop, Filter};
use crate::spectrum::Rgb;
use glam::{DAffine3, DVec2, DVec3};
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
    /// Every shape that stands by itself.
    pub shapes: Vec<Shape>,
    /// Shapes that are placed together, wherever an instance says.
    pub groups: Vec<Group>,
    /// Where groups are placed.
    pub instances: Vec<Instance>,
    /// Lights that are not attached to a shape.
    pub lights: Vec<Light>,
    /// Complaints that were not fatal, each with its place: what `--lenient` let pass, what was never read.
    pub warnings: Vec<String>,
}

/// Index into [`SceneDescription::bsdfs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BsdfId(pub usize);

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
        Self { kind: IntegratorKind::Path, max_depth: None, rr_depth: 5, hide_emitters: false }
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
    /// Radiance that it emits from its front side, in W·sr⁻¹·m⁻², if it is an area light.
    pub emission: Option<Rgb>,
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
        /// Unit vector to its pole: u runs around it.
        axis: DVec3,
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
    /// Vertex indices of each triangle, counter-clockwise seen from the front.
    pub faces: Vec<[u32; 3]>,
}

/// A bsdf.
#[derive(Clone, Debug)]
pub struct Bsdf {
    /// Where in the file.
    pub at: Span,
    /// Its `id`, or empty.
    pub name: String,
    /// What it is.
    pub kind: BsdfKind,
}

/// The kinds of bsdf, with Mitsuba's parameters. Colours are linear sRGB.
#[derive(Clone, Debug, PartialEq)]
pub enum BsdfKind {
    /// Lambertian, front side only.
    Diffuse {
        /// Albedo.
        reflectance: Rgb,
    },
    /// A smooth conductor, front side only.
    Conductor {
        /// Real part of the index of refraction relative to the outside.
        eta: Rgb,
        /// Imaginary part.
        k: Rgb,
        /// Factor on the reflection; 1 is physical.
        specular_reflectance: Rgb,
    },
    /// A rough conductor, front side only.
    RoughConductor {
        /// Its microfacets.
        facets: Microfacets,
        /// Real part of the index of refraction relative to the outside.
        eta: Rgb,
        /// Imaginary part.
        k: Rgb,
        /// Factor on the reflection; 1 is physical.
        specular_reflectance: Rgb,
    },
    /// A smooth interface between two dielectrics.
    Dielectric {
        /// Index of refraction inside (where the normal does not point).
        int_ior: f64,
        /// Index of refraction outside.
        ext_ior: f64,
        /// Factor on the reflection; 1 is physical.
        specular_reflectance: Rgb,
        /// Factor on the transmission; 1 is physical.
        specular_transmittance: Rgb,
    },
    /// A rough interface between two dielectrics.
    RoughDielectric {
        /// Its microfacets.
        facets: Microfacets,
        /// Index of refraction inside (where the normal does not point).
        int_ior: f64,
        /// Index of refraction outside; another than inside.
        ext_ior: f64,
        /// Factor on the reflection; 1 is physical.
        specular_reflectance: Rgb,
        /// Factor on the transmission; 1 is physical.
        specular_transmittance: Rgb,
    },
    /// One-sided bsdfs made two-sided.
    TwoSided {
        /// Seen from the front.
        front: BsdfId,
        /// Seen from the back.
        back: BsdfId,
    },
}

impl BsdfKind {
    /// Whether it matters where the tangents of a surface point. `bsdfs` are those that it may refer to.
    pub fn is_anisotropic(&self, bsdfs: &[Bsdf]) -> bool {
        match self {
            Self::RoughConductor { facets, .. } | Self::RoughDielectric { facets, .. } => {
                facets.alpha_u != facets.alpha_v
            }
            Self::TwoSided { front, back } => {
                [front, back].into_iter().any(|side| bsdfs[side.0].kind.is_anisotropic(bsdfs))
            }
            Self::Diffuse { .. } | Self::Conductor { .. } | Self::Dielectric { .. } => false,
        }
    }
}

/// A distribution of microfacets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacets {
    /// Its shape.
    pub distribution: MicrofacetDistribution,
    /// Roughness α (the square of what artists call roughness) along ∂p/∂u, not negative.
    pub alpha_u: f64,
    /// Roughness across it.
    pub alpha_v: f64,
}

/// The shapes of a distribution of microfacets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MicrofacetDistribution {
    /// Beckmann's.
    Beckmann,
    /// GGX, that is, Trowbridge's and Reitz'.
    Ggx,
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
    /// The same radiant intensity in every direction, from a point.
    Point {
        /// Where, in the file's world space.
        position: DVec3,
        /// Radiant intensity in W·sr⁻¹, the file's unit of length being the metre.
        intensity: Rgb,
    },
}
