//! What a compiled scene has, as far as rendering depends on it.

use crate::facts::{self, Feature};
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
    /// Some surface absorbs light inside of it.
    pub volumes: bool,
    /// Textures.
    pub textures: u64,
    /// Materials that are worked out at each point.
    pub varying_materials: u64,
    /// Some material has holes.
    pub masks: bool,
    /// The camera has a lens.
    pub lens: bool,
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

    /// Lights of any kind.
    pub fn lights(&self) -> u64 {
        self.area_lights + self.infinite_lights + self.lights_without_size()
    }

    /// Stops a build that was made to do without something that the scene has.
    pub(super) fn allow(&self) {
        let lights = self.lights();
        for (feature, there) in [
            (Feature::Textures, self.varying_materials > 0),
            (Feature::Masks, self.masks),
            (Feature::Tangents, self.anisotropy),
            (Feature::Normals, self.vertex_normals),
            (Feature::Transmission, self.transmission),
            (Feature::Volumes, self.volumes),
            (Feature::LightChoice, lights > 1),
            (Feature::Environment, self.infinite_lights > 0),
            (Feature::Instances, self.instances > 0),
            (Feature::Quadrics, self.quadrics > 0),
            (Feature::Lens, self.lens),
            (Feature::Mis, lights > self.lights_without_size()),
        ] {
            facts::allow(feature, there);
        }
    }
}
