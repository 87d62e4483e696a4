//! Materials and lights.

use super::material::Materials;
use super::{tangents, uvs};
use crate::description::{LightKind, SceneDescription};
use crate::error::{Error, Result, Span};
use crate::light::{AreaLight, ConstantLight, Light, PointLight};
use crate::math::bounds::DBounds;
use crate::scene::Appearance;
use crate::scene::space::ToScene;
use crate::shape::Shape;
use crate::shape::tangent::TangentField;
use crate::shape::touch::touching;
use crate::shape::uv::UvField;
use crate::spectrum::Rgb;
use glam::DVec3;

/// Where the scene is.
pub(super) struct Place {
    /// The box around every surface, in the file's world space.
    pub(super) bounds: DBounds,
    /// From there to the compiled scene's space.
    pub(super) to_scene: ToScene,
}

/// What shapes look like, and every light.
#[derive(Default)]
pub(super) struct Look {
    pub(super) appearances: Vec<Appearance>,
    pub(super) materials: Materials,
    pub(super) lights: Vec<Light>,
    pub(super) tangents: Vec<TangentField>,
    pub(super) uvs: Vec<UvField>,
    pub(super) light_names: Vec<String>,
}

/// Compiles what the kept shapes look like (`kept[i]` is the description of `shapes[i]`), and every light.
pub(super) fn compile(
    description: &SceneDescription,
    shapes: &[Shape],
    kept: &[usize],
    place: &Place,
    warnings: &mut Vec<String>,
) -> Result<Look> {
    let mut look = Look::default();
    for (index, (shape, &described)) in (0u32..).zip(shapes.iter().zip(kept)) {
        let described = &description.shapes[described];
        let material = look.materials.index(description, described.bsdf, place.to_scene.unit)?;
        let light = match described.emission {
            Some(radiance) if !radiance.is_black() => {
                check_colour(&described.at, "a radiance", radiance)?;
                let light = AreaLight::new(index, shape, radiance);
                if light.is_none() {
                    warnings.push(format!("{}: '{}' is too small to shed light", described.at, described.name));
                }
                let name = format!("'{}' ({})", described.name, described.at);
                light.map(|l| look.add_light(Light::Area(l), name))
            }
            _ => None,
        };
        let needs = description.bsdfs[described.bsdf.0].needs(&description.bsdfs, &description.textures);
        let tangents = needs.tangents.then(|| add(&mut look.tangents, tangents::field(described, shape)));
        let uvs = needs.uvs.then(|| add(&mut look.uvs, uvs::field(described, &place.to_scene)));
        let is_emitter = described.emission.is_some();
        look.appearances.push(Appearance { material, light, is_emitter, tangents, uvs });
    }
    for light in &description.lights {
        let (kind, colour, compiled) = match light.kind {
            LightKind::Constant { radiance } => {
                check_colour(&light.at, "a radiance", radiance)?;
                ("constant", radiance, Light::Constant(ConstantLight { radiance }))
            }
            LightKind::Point { position, intensity } => {
                check_colour(&light.at, "an intensity", intensity)?;
                ("point", intensity, Light::Point(point_light(&light.at, position, intensity, place)?))
            }
        };
        if !colour.is_black() {
            look.add_light(compiled, format!("{kind} ({})", light.at));
        }
    }
    look.hang_up(shapes);
    Ok(look)
}

/// Adds an element to a table; returns its index.
fn add<T>(table: &mut Vec<T>, element: T) -> u32 {
    table.push(element);
    (table.len() - 1) as u32
}

impl Look {
    fn add_light(&mut self, light: Light, name: String) -> u32 {
        self.light_names.push(name);
        add(&mut self.lights, light)
    }

    /// Tells the point lights which surfaces they hang on.
    fn hang_up(&mut self, shapes: &[Shape]) {
        let points =
            || self.lights.iter().filter_map(|l| if let Light::Point(p) = l { Some(p.position) } else { None });
        let mut touching = touching(shapes, &points().collect::<Vec<_>>()).into_iter();
        for light in &mut self.lights {
            if let Light::Point(light) = light {
                light.touching = touching.next().unwrap_or_default();
            }
        }
    }
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

fn check_colour(at: &Span, what: &str, colour: Rgb) -> Result<()> {
    if colour.is_finite() && colour.0.min_element() >= 0.0 {
        Ok(())
    } else {
        let [r, g, b] = colour.to_array();
        Err(Error::scene(at, format!("{what} must be finite and not negative, but this is ({r}, {g}, {b})")))
    }
}
