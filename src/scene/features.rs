//! What a compiled scene has, as far as rendering depends on it.

use serde::Serialize;

/// Facts about a compiled scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Features {
    /// Triangles.
    pub triangles: u64,
    /// Spheres, disks and cylinders.
    pub quadrics: u64,
    /// Placements of groups, whose triangles and quadrics count once.
    pub instances: u64,
    /// Some mesh has vertex normals.
    pub vertex_normals: bool,
    /// Some bsdf has delta lobes.
    pub delta_lobes: bool,
    /// Some bsdf lets light through.
    pub transmission: bool,
    /// Some bsdf depends on where tangents point, which are then computed.
    pub anisotropy: bool,
    /// Lights on surfaces.
    pub area_lights: u64,
    /// Lights at infinity.
    pub infinite_lights: u64,
    /// Lights without size.
    pub point_lights: u64,
}
