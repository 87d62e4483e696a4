//! The same scene in another place and at another size.

use super::{BsdfKind, Gltf, LightKind, NormalSource, Projection, SceneDescription};
use glam::{DAffine3, DQuat, DVec3};

impl SceneDescription {
    /// Multiplies everything that has a length in it by `scale`, which is positive, and moves it: p becomes p·scale + offset.
    /// What a scene without a size emits is adjusted, so that the picture stays the same: intensities grow with scale², and
    /// what absorbs does so over scale times the distance. A power of two changes no bit of the picture.
    #[must_use]
    pub fn transformed(mut self, scale: f64, offset: DVec3) -> Self {
        let at = DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::IDENTITY, offset);
        for shape in &mut self.shapes {
            shape.to_world = at * shape.to_world;
        }
        // What is in a group grows where it is, and is moved where it is placed.
        for shape in self.groups.iter_mut().flat_map(|group| &mut group.shapes) {
            shape.to_world = DAffine3::from_scale(DVec3::splat(scale)) * shape.to_world;
        }
        for instance in &mut self.instances {
            instance.to_world.translation = instance.to_world.translation * scale + offset;
        }
        self.lights.iter_mut().for_each(|light| transform_light(&mut light.kind, scale, offset));
        self.bsdfs.iter_mut().for_each(|bsdf| transform_bsdf(&mut bsdf.kind, scale));
        for camera in &mut self.cameras {
            camera.to_world.translation = camera.to_world.translation * scale + offset;
            camera.near_clip *= scale;
            camera.far_clip *= scale;
            match &mut camera.projection {
                Projection::ThinLens { aperture_radius, focus_distance, .. } => {
                    *aperture_radius *= scale;
                    *focus_distance *= scale;
                }
                Projection::Orthographic => {
                    // The clip planes move with the axis that the camera looks along.
                    camera.to_world.matrix3.x_axis *= scale;
                    camera.to_world.matrix3.y_axis *= scale;
                }
                Projection::Perspective { .. } | Projection::Panorama => {}
            }
        }
        self
    }
}

fn transform_light(light: &mut LightKind, scale: f64, offset: DVec3) {
    match light {
        LightKind::Point { position, intensity } | LightKind::Spot { position, intensity, .. } => {
            *position = *position * scale + offset;
            *intensity = intensity.map(|c| (f64::from(c) * scale * scale) as f32);
        }
        LightKind::Projector { to_world, scale: brightness, .. } => {
            to_world.translation = to_world.translation * scale + offset;
            *brightness *= scale * scale;
        }
        LightKind::Constant { .. } | LightKind::Environment { .. } | LightKind::Directional { .. } => {}
    }
}

fn transform_bsdf(bsdf: &mut BsdfKind, scale: f64) {
    let heights = |normal: &mut NormalSource| {
        if let NormalSource::Bump { scale: height, .. } = normal {
            *height *= scale;
        }
    };
    match bsdf {
        BsdfKind::Perturbed { normal, .. } => heights(normal),
        BsdfKind::Gltf(Gltf { volume, coat_normal, .. }) => {
            if let Some(volume) = volume {
                volume.attenuation_distance *= scale;
            }
            coat_normal.iter_mut().for_each(heights);
        }
        _ => {}
    }
}
