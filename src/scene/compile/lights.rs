//! Lights that are not attached to a shape.

use super::camera::half_width;
use crate::description::{self, Emission, LightKind, TextureId};
use crate::error::{Error, Result, Span};
use crate::image::Picture;
use crate::light::{
    AreaLight, Coat, ConstantLight, DirectionalLight, EnvironmentLight, Light, PointLight, ProjectorLight, Slide,
    SpotLight, SpotSlide, VaryingLight,
};
use crate::math::bounds::DBounds;
use crate::scene::space::ToScene;
use crate::shape::Shape;
use crate::shape::uv::UvField;
use crate::spectrum::Rgb;
use crate::texture::{MeshValues, Textures};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// Where the scene is.
pub(super) struct Place {
    /// The box around every surface, in the file's world space.
    pub(super) bounds: DBounds,
    /// From there to the compiled scene's space.
    pub(super) to_scene: ToScene,
    /// Every texture.
    pub(super) textures: Arc<Textures>,
}

/// The light on a shape, which has texture coordinates and more for the light's texture if there is one; `None` where it is
/// black or too small.
pub(super) fn area(
    (index, shape): (u32, &Shape),
    described: &description::Shape,
    emission: Emission,
    (uvs, values): (Option<UvField>, Option<Arc<MeshValues>>),
    place: &Place,
    warnings: &mut Vec<String>,
) -> Result<Option<Light>> {
    let at = &described.at;
    check_colour(at, "a radiance", emission.radiance)?;
    let texture = match emission.texture.zip(uvs) {
        Some((texture, uvs)) => {
            Some(Coat { slide: slide(at, texture, values.as_deref(), place, warnings)?, uvs, values })
        }
        None => None,
    };
    if let Some(Coat { slide, .. }) = &texture {
        check_colour(at, "a radiance", emission.radiance * slide.largest())?;
        if slide.largest() == 0.0 {
            return Ok(None);
        }
    }
    let Some(light) = AreaLight::new(index, shape, emission.radiance) else {
        warnings.push(format!("{at}: '{}' is too small to shed light", described.name));
        return Ok(None);
    };
    if texture.is_none() && !emission.both_sides {
        return Ok(Some(Light::Area(light)));
    }
    Ok(Some(Light::Varying(Box::new(VaryingLight::new(light, shape, texture, emission.both_sides)))))
}

/// A texture as amounts of light, on a mesh that says this or on none.
fn slide(
    at: &Span,
    texture: TextureId,
    on: Option<&MeshValues>,
    place: &Place,
    warnings: &mut Vec<String>,
) -> Result<Slide> {
    if texture.0 >= place.textures.len() {
        return Err(Error::scene(at, "the light refers to a texture that is not there"));
    }
    let index = texture.0 as u32;
    let Some([least, largest]) = place.textures.range(index, on) else {
        return Err(Error::scene(at, "a value of the light's texture is not finite"));
    };
    if least < 0.0 {
        warnings.push(format!("{at}: negative values of the light's texture are taken for 0"));
    }
    Ok(Slide::new(&place.textures, index, largest.max(0.0)))
}

/// A light of the scene's own, and what it is called; `None` where it is black.
pub(super) fn compile(
    light: &description::Light,
    place: &Place,
    warnings: &mut Vec<String>,
) -> Result<Option<(Light, String)>> {
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
        LightKind::Spot { intensity, .. } => {
            check_colour(at, "an intensity", *intensity)?;
            let spot = spot(light, place, warnings)?.filter(|_| !intensity.is_black());
            ("spot", spot.map(Light::Spot))
        }
        LightKind::Projector { .. } => ("projector", projector(light, place, warnings)?.map(Light::Projector)),
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
    Ok(EnvironmentLight::new(map, scale as f32, DMat3::from_cols(x, y, z), compensated))
}

/// A spot; `None` where its texture is black.
fn spot(light: &description::Light, place: &Place, warnings: &mut Vec<String>) -> Result<Option<SpotLight>> {
    let (LightKind::Spot { position, direction, intensity, cutoff_angle, beam_width, texture }, at) =
        (&light.kind, &light.at)
    else {
        return Ok(None);
    };
    let slide = match texture {
        Some(description::SpotTexture { texture, across: [u, v] }) => {
            let slide = slide(at, *texture, None, place, warnings)?;
            Some(SpotSlide { slide, across: [unit(at, *u)?, unit(at, *v)?] })
        }
        None => None,
    };
    if let Some(slide) = &slide {
        check_colour(at, "an intensity", *intensity * slide.slide.largest())?;
    }
    let is_black = slide.as_ref().is_some_and(|s| s.slide.largest() == 0.0);
    let spot = SpotLight {
        point: point_light(at, *position, *intensity, place)?,
        axis: unit(at, *direction)?,
        beam: beam_width.to_radians(),
        cutoff: cutoff_angle.to_radians(),
        slide,
    };
    Ok((!is_black).then_some(spot))
}

/// A projector; `None` where its picture is black.
fn projector(light: &description::Light, place: &Place, warnings: &mut Vec<String>) -> Result<Option<ProjectorLight>> {
    let (LightKind::Projector { texture, scale, to_world, fov }, at) = (&light.kind, &light.at) else {
        return Ok(None);
    };
    let slide = slide(at, *texture, None, place, warnings)?;
    let brightest = Rgb::splat(slide.largest() * *scale as f32);
    check_colour(at, "an irradiance", brightest)?;
    let half_width = half_width(*fov, slide.aspect());
    let axes = orthonormal(at, to_world.matrix3)?;
    let unit = place.to_scene.unit;
    let point = point_light(at, to_world.translation, brightest, place)?;
    let light = ProjectorLight::new(point, slide, scale * unit * unit, axes, half_width);
    Ok((!brightest.is_black()).then_some(light))
}

/// Refuses maps that are no amounts of light.
fn check_map(at: &Span, what: &str, map: &Picture, scale: f64) -> Result<()> {
    let mut brightest = 0.0;
    for &pixel in map.pixels() {
        check_colour(at, what, pixel)?;
        brightest = pixel.max_component().max(brightest);
    }
    check_colour(at, what, Rgb::splat(brightest * scale as f32))
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
fn check_colour(at: &Span, what: &str, colour: Rgb) -> Result<()> {
    if colour.is_finite() && colour.0.min_element() >= 0.0 {
        Ok(())
    } else {
        let [r, g, b] = colour.to_array();
        Err(Error::scene(at, format!("{what} must be finite and not negative, but this is ({r}, {g}, {b})")))
    }
}
