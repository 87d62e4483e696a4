//! Lights that are not attached to a shape.

use super::camera::half_width;
use crate::description::{self, FieldOfView, LightKind};
use crate::error::{Error, Result, Span};
use crate::image::Picture;
use crate::light::{ConstantLight, DirectionalLight, EnvironmentLight, Light, PointLight, ProjectorLight, SpotLight};
use crate::math::bounds::DBounds;
use crate::scene::space::ToScene;
use crate::spectrum::Rgb;
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// Where the scene is.
pub(super) struct Place {
    /// The box around every surface, in the file's world space.
    pub(super) bounds: DBounds,
    /// From there to the compiled scene's space.
    pub(super) to_scene: ToScene,
}

/// A light of the scene's own, and what it is called; `None` where it is black.
pub(super) fn compile(light: &description::Light, place: &Place) -> Result<Option<(Light, String)>> {
    let at = &light.at;
    let (kind, compiled) = match &light.kind {
        &LightKind::Constant { radiance } => {
            check_colour(at, "a radiance", radiance)?;
            ("constant", visible(radiance).map(|radiance| Light::Constant(ConstantLight { radiance })))
        }
        LightKind::Environment { map, scale, to_world, mis_compensation } => {
            let light = environment(at, map, *scale, *to_world, *mis_compensation)?;
            ("envmap", light.map(Light::Environment))
        }
        &LightKind::Directional { direction, irradiance } => {
            check_colour(at, "an irradiance", irradiance)?;
            let wi = -unit(at, direction)?.as_vec3();
            (
                "directional",
                visible(irradiance).map(|irradiance| Light::Directional(DirectionalLight { wi, irradiance })),
            )
        }
        &LightKind::Point { position, intensity } => {
            check_colour(at, "an intensity", intensity)?;
            let point = point_light(at, position, intensity, place)?;
            ("point", visible(intensity).map(|_| Light::Point(point)))
        }
        &LightKind::Spot { position, direction, intensity, cutoff_angle, beam_width } => {
            check_colour(at, "an intensity", intensity)?;
            let spot = SpotLight {
                point: point_light(at, position, intensity, place)?,
                axis: unit(at, direction)?,
                beam: beam_width.to_radians(),
                cutoff: cutoff_angle.to_radians(),
            };
            ("spot", visible(intensity).map(|_| Light::Spot(spot)))
        }
        LightKind::Projector { map, scale, to_world, fov } => {
            let light = projector(at, map, *scale, to_world, *fov, place)?;
            ("projector", light.map(Light::Projector))
        }
    };
    Ok(compiled.map(|light| (light, format!("{kind} ({at})"))))
}

fn visible(colour: Rgb) -> Option<Rgb> {
    (!colour.is_black()).then_some(colour)
}

fn unit(at: &Span, direction: DVec3) -> Result<DVec3> {
    direction.try_normalize().ok_or_else(|| Error::scene(at, "the light's direction must be neither zero nor infinite"))
}

fn environment(
    at: &Span,
    map: &Arc<Picture>,
    scale: f64,
    to_world: DMat3,
    compensated: bool,
) -> Result<Option<EnvironmentLight>> {
    let (width, height) = EnvironmentLight::LEAST_SIZE;
    if map.width() < width || map.height() < height {
        let message =
            format!("an environment map has at least {width}x{height} pixels, not {}x{}", map.width(), map.height());
        return Err(Error::scene(at, message));
    }
    check_map(at, "a radiance", map, scale)?;
    let [x, y, z] = orthonormal(at, to_world)?;
    Ok(EnvironmentLight::new(map.clone(), scale as f32, DMat3::from_cols(x, y, z), compensated))
}

fn projector(
    at: &Span,
    map: &Arc<Picture>,
    scale: f64,
    to_world: &DAffine3,
    fov: FieldOfView,
    place: &Place,
) -> Result<Option<ProjectorLight>> {
    let brightest = check_map(at, "an irradiance", map, scale)?;
    let aspect = f64::from(map.width()) / f64::from(map.height());
    let half_width = half_width(fov, aspect);
    let axes = orthonormal(at, to_world.matrix3)?;
    let unit = place.to_scene.unit;
    let point = point_light(at, to_world.translation, brightest, place)?;
    let light = ProjectorLight::new(point, map.clone(), scale * unit * unit, axes, half_width);
    Ok((!brightest.is_black()).then_some(light))
}

/// Refuses maps that are no amounts of light; the brightest value of any channel.
fn check_map(at: &Span, what: &str, map: &Picture, scale: f64) -> Result<Rgb> {
    let mut brightest = 0.0;
    for &pixel in map.pixels() {
        check_colour(at, what, pixel)?;
        brightest = pixel.max_component().max(brightest);
    }
    let brightest = Rgb::splat(brightest * scale as f32);
    check_colour(at, what, brightest)?;
    Ok(brightest)
}

/// The columns of a matrix that rotates and reflects, but for the rounding of files.
fn orthonormal(at: &Span, m: DMat3) -> Result<[DVec3; 3]> {
    let x = unit(at, m.x_axis)?;
    let y = unit(at, m.y_axis - x * x.dot(m.y_axis))?;
    let z = x.cross(y);
    Ok([x, y, z * z.dot(m.z_axis).signum()])
}

fn point_light(at: &Span, position: DVec3, intensity: Rgb, place: &Place) -> Result<PointLight> {
    let (to_scene, bounds) = (&place.to_scene, &place.bounds);
    let beside = (bounds.min - position).max(position - bounds.max).max(DVec3::ZERO);
    let light = PointLight {
        position: to_scene.point(position),
        // The unit is a power of two: its square changes no bit.
        intensity: intensity.map(|c| (f64::from(c) * to_scene.unit * to_scene.unit) as f32),
        clearance: beside.length() * to_scene.unit,
        touching: Vec::new(),
    };
    if !light.position.as_vec3().is_finite() {
        return Err(Error::scene(at, "the light is too far away for the size of the scene"));
    }
    let fits = |c: f32, of: f32| c.is_normal() || of == 0.0;
    let [r, g, b] = light.intensity.to_array();
    let [r0, g0, b0] = intensity.to_array();
    if !(fits(r, r0) && fits(g, g0) && fits(b, b0)) {
        let message = format!("the light's intensity ({r0}, {g0}, {b0}) is out of proportion to the size of the scene");
        return Err(Error::scene(at, message));
    }
    Ok(light)
}

/// Refuses what is no amount of light.
pub(super) fn check_colour(at: &Span, what: &str, colour: Rgb) -> Result<()> {
    if colour.is_finite() && colour.0.min_element() >= 0.0 {
        Ok(())
    } else {
        let [r, g, b] = colour.to_array();
        Err(Error::scene(at, format!("{what} must be finite and not negative, but this is ({r}, {g}, {b})")))
    }
}
