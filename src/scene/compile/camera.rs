//! Cameras: from the file's space to the compiled scene's.

use crate::camera::{Camera, Lens, Orthographic, Panorama, Perspective, Pinhole, Slab, Sphere, ThinLens};
use crate::description::{self, FieldOfView, FovAxis, Projection};
use crate::error::{Error, Result};
use crate::scene::space::ToScene;
use glam::{DVec2, DVec3};

/// Compiles a camera.
pub(super) fn compile(camera: &description::Camera, to_scene: &ToScene) -> Result<Camera> {
    let matrix = camera.to_world.matrix3;
    let axis = |v: DVec3| {
        let a = (matrix * v).normalize();
        let fail = || Error::scene(&camera.at, "the camera's to_world gives it no direction");
        if a.is_finite() { Ok(a) } else { Err(fail()) }
    };
    let film = DVec2::new(f64::from(camera.film.width), f64::from(camera.film.height));
    let origin = to_scene.point(camera.to_world.translation);
    let clip = (camera.near_clip * to_scene.unit, camera.far_clip * to_scene.unit);
    let too_far = || Error::scene(&camera.at, "the camera is too far away for the size of the scene");
    if !origin.as_vec3().is_finite() || !(clip.0 as f32).is_finite() {
        return Err(too_far());
    }
    let pinhole = |fov: FieldOfView, principal_point: (f64, f64)| {
        Ok(Pinhole {
            origin,
            left: axis(DVec3::X)?,
            up: axis(DVec3::Y)?,
            forward: axis(DVec3::Z)?,
            film,
            half_width: half_width(fov, film.x / film.y),
            principal_point: principal_point.into(),
            clip,
        })
    };
    Ok(match camera.projection {
        Projection::Perspective { fov, principal_point_offset } => {
            Camera::Perspective(Perspective::new(&pinhole(fov, principal_point_offset)?))
        }
        Projection::ThinLens { fov, aperture_radius, focus_distance } => {
            let lens = Lens { radius: aperture_radius * to_scene.unit, focus: focus_distance * to_scene.unit };
            if !(lens.radius as f32).is_finite() || lens.focus == 0.0 {
                return Err(too_far());
            }
            Camera::ThinLens(ThinLens::new(&pinhole(fov, (0.0, 0.0))?, &lens))
        }
        Projection::Orthographic => {
            // The film is moved and scaled with everything else, but the distance between the clip planes is not.
            let near = (matrix * DVec3::Z).length() * clip.0;
            let clip = (near, near + (clip.1 - clip.0));
            let [left, up] = [DVec3::X, DVec3::Y].map(|v| matrix * v * to_scene.unit);
            if !left.as_vec3().is_finite() || !up.as_vec3().is_finite() || !(clip.0 as f32).is_finite() {
                return Err(too_far());
            }
            Camera::Orthographic(Orthographic::new(&Slab { origin, left, up, forward: axis(DVec3::Z)?, film, clip }))
        }
        Projection::Panorama => {
            let (left, up, forward) = (axis(DVec3::X)?, axis(DVec3::Y)?, axis(DVec3::Z)?);
            Camera::Panorama(Panorama::new(&Sphere { origin, left, up, forward, film, clip }))
        }
    })
}

/// Tangent of half the horizontal field of view, for a film of this width over height.
pub(super) fn half_width(fov: FieldOfView, aspect: f64) -> f64 {
    let tan = libm::tan(0.5 * fov.degrees.to_radians());
    let along_x = match fov.axis {
        FovAxis::X => true,
        FovAxis::Y => false,
        FovAxis::Smaller => aspect <= 1.0,
        FovAxis::Larger => aspect >= 1.0,
        FovAxis::Diagonal => return tan / (1.0 + 1.0 / (aspect * aspect)).sqrt(),
    };
    if along_x { tan } else { tan * aspect }
}
