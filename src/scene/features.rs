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
    /// Textures.
    pub textures: u64,
    /// Lights on surfaces.
    pub area_lights: u64,
    /// Lights at infinity that have a size: skies.
    pub infinite_lights: u64,
    /// Lights at infinity without size.
    pub directional_lights: u64,
    /// Points that shine everywhere.
    pub point_lights: u64,
    /// Points that shine into a cone.
    pub spot_lights: u64,
    /// Points that shine through a picture.
    pub projector_lights: u64,
}

impl Features {
    /// Lights without size, which paths cannot run into.
    pub fn lights_without_size(&self) -> u64 {
        self.directional_lights + self.point_lights + self.spot_lights + self.projector_lights
    }
}
