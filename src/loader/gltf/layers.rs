//! What extensions add to a material.

use super::materials::{Materials, Surface};
use super::textures::Value;
use crate::description::{Channel, Parameter, Volume};
use crate::error::Result;
use crate::spectrum::Rgb;
use gltf::json::Material;
use gltf::json::extensions::material::PbrSpecularGlossiness;
use gltf::json::material::NormalTexture;
use gltf::json::texture::Info;
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// The index of refraction that stands for the infinite one that an `ior` of 0 means: it reflects all but 4·10⁻⁶.
const INFINITE_IOR: f64 = 1e6;

/// Reflectance at normal incidence of what has the usual index of refraction, 1.5.
const USUAL_REFLECTANCE: f32 = 0.04;

/// Least part of the light that is left after the distance of attenuation: what lets nothing pass would need a density that
/// is no number.
const LEAST_ATTENUATION: f64 = 1e-6;

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Clearcoat {
    clearcoat_factor: f32,
    clearcoat_texture: Option<Info>,
    clearcoat_roughness_factor: f32,
    clearcoat_roughness_texture: Option<Info>,
    clearcoat_normal_texture: Option<NormalTexture>,
}

impl Default for Clearcoat {
    fn default() -> Self {
        Self {
            clearcoat_factor: 0.0,
            clearcoat_texture: None,
            clearcoat_roughness_factor: 0.0,
            clearcoat_roughness_texture: None,
            clearcoat_normal_texture: None,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Sheen {
    sheen_color_factor: [f32; 3],
    sheen_color_texture: Option<Info>,
    sheen_roughness_factor: f32,
    sheen_roughness_texture: Option<Info>,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Iridescence {
    iridescence_factor: f32,
    iridescence_texture: Option<Info>,
    iridescence_ior: f32,
    iridescence_thickness_minimum: f32,
    iridescence_thickness_maximum: f32,
    iridescence_thickness_texture: Option<Info>,
}

impl Default for Iridescence {
    fn default() -> Self {
        Self {
            iridescence_factor: 0.0,
            iridescence_texture: None,
            iridescence_ior: 1.3,
            iridescence_thickness_minimum: 100.0,
            iridescence_thickness_maximum: 400.0,
            iridescence_thickness_texture: None,
        }
    }
}

/// Reads the extensions of a material.
pub(super) fn read(m: &mut Materials<'_>, material: &Material, surface: &mut Surface) -> Result<()> {
    let Some(extensions) = &material.extensions else { return Ok(()) };
    if let Some(old) = &extensions.pbr_specular_glossiness {
        specular_glossiness(m, old, surface)?;
    }
    if let Some(ior) = &extensions.ior {
        let place = place(surface, "KHR_materials_ior.ior");
        let ior = f64::from(ior.ior.0);
        surface.gltf.ior = if ior == 0.0 { INFINITE_IOR } else { m.model.number(&place, ior, 1.0, f64::MAX)? };
    }
    specular(m, material, surface)?;
    transmission(m, material, surface)?;
    clearcoat(m, material, surface)?;
    sheen(m, material, surface)?;
    iridescence(m, material, surface)
}

fn place(surface: &Surface, name: &str) -> String {
    format!("{}.extensions.{name}", surface.place)
}

/// An extension that the crate has no type for.
fn other<T: DeserializeOwned>(m: &Materials<'_>, material: &Material, name: &str, s: &Surface) -> Result<Option<T>> {
    let value = material.extensions.as_ref().and_then(|e| e.others.get(name));
    let fail = |e| m.model.error(&place(s, name), format!("it is not understood: {e}"));
    value.map(|value| gltf::json::deserialize::from_value(value.clone()).map_err(fail)).transpose()
}

/// A number from 0 to 1 that a channel of a texture may vary; the number itself.
fn unit(
    m: &mut Materials<'_>,
    surface: &mut Surface,
    (extension, name): (&str, &str),
    (parameter, factor): (Parameter, f32),
    texture: Option<(&Info, Channel)>,
) -> Result<f64> {
    let factor = m.number(&place(surface, &format!("{extension}.{name}Factor")), factor)?;
    if let Some((info, channel)) = texture.filter(|_| factor > 0.0) {
        // Channels but alpha are numbers; a picture whose alpha is used has colours beside it.
        let raw = channel != Channel::Alpha;
        let picture = m.look_up(info, &format!("extensions.{extension}.{name}Texture"), raw, surface)?;
        m.vary(surface, (parameter, factor), picture, channel);
    }
    Ok(factor)
}

/// A colour that a texture may vary; the colour itself.
fn colour(
    m: &mut Materials<'_>,
    surface: &mut Surface,
    (extension, name): (&str, &str),
    (parameter, factor): (Parameter, [f32; 3]),
    (texture, most): (Option<&Info>, f64),
) -> Result<Rgb> {
    let place = place(surface, &format!("{extension}.{name}Factor"));
    let [r, g, b] = m.numbers(&place, factor.map(f64::from), 0.0, most)?.map(|v| v as f32);
    let factor = Rgb::new(r, g, b);
    if let Some(info) = texture.filter(|_| !factor.is_black()) {
        let picture = m.look_up(info, &format!("extensions.{extension}.{name}Texture"), false, surface)?;
        let product = m.textures.product(Value::Constant(factor), picture);
        surface.varying.extend(product.texture().map(|id| (parameter, id)));
    }
    Ok(factor)
}

/// The older model is a dielectric whose reflectance is coloured.
fn specular_glossiness(m: &mut Materials<'_>, old: &PbrSpecularGlossiness, surface: &mut Surface) -> Result<()> {
    const NAME: &str = "KHR_materials_pbrSpecularGlossiness";
    let gloss = m.number(&place(surface, &format!("{NAME}.glossinessFactor")), old.glossiness_factor.0)?;
    surface.gltf.metallic = 0.0;
    surface.gltf.roughness = 1.0 - gloss;
    let factor = (Parameter::SpecularColor, old.specular_factor.0.map(|f| f / USUAL_REFLECTANCE));
    let most = f64::from(1.0 / USUAL_REFLECTANCE);
    let texture = old.specular_glossiness_texture.as_ref();
    surface.gltf.specular_color = colour(m, surface, (NAME, "specular"), factor, (None, most))?;
    if let Some(info) = texture {
        let picture = m.look_up(info, &format!("extensions.{NAME}.specularGlossinessTexture"), false, surface)?;
        let product = m.textures.product(Value::Constant(surface.gltf.specular_color), picture);
        surface.varying.extend(product.texture().map(|id| (Parameter::SpecularColor, id)));
        // Roughness is 1 − gloss.
        if gloss > 0.0 {
            let own = m.textures.channel(picture, Channel::Alpha);
            let less = m.textures.product(Value::Constant(Rgb::splat(-gloss as f32)), own);
            let roughness = m.textures.sum(Value::ONE, less);
            surface.varying.extend(roughness.texture().map(|id| (Parameter::Roughness, id)));
        }
    }
    Ok(())
}

fn specular(m: &mut Materials<'_>, material: &Material, surface: &mut Surface) -> Result<()> {
    const NAME: &str = "KHR_materials_specular";
    let Some(own) = material.extensions.as_ref().and_then(|e| e.specular.as_ref()) else { return Ok(()) };
    let texture = own.specular_texture.as_ref().map(|info| (info, Channel::Alpha));
    let factor = (Parameter::Specular, own.specular_factor.0);
    surface.gltf.specular = unit(m, surface, (NAME, "specular"), factor, texture)?;
    let factor = (Parameter::SpecularColor, own.specular_color_factor.0);
    let texture = (own.specular_color_texture.as_ref(), f64::from(f32::MAX));
    surface.gltf.specular_color = colour(m, surface, (NAME, "specularColor"), factor, texture)?;
    Ok(())
}

fn transmission(m: &mut Materials<'_>, material: &Material, surface: &mut Surface) -> Result<()> {
    let extensions = material.extensions.as_ref();
    if let Some(own) = extensions.and_then(|e| e.transmission.as_ref()) {
        let names = ("KHR_materials_transmission", "transmission");
        let texture = own.transmission_texture.as_ref().map(|info| (info, Channel::Red));
        let factor = (Parameter::Transmission, own.transmission_factor.0);
        surface.gltf.transmission = unit(m, surface, names, factor, texture)?;
    }
    let Some(own) = extensions.and_then(|e| e.volume.as_ref()) else { return Ok(()) };
    let name = |name: &str| place(surface, &format!("KHR_materials_volume.{name}"));
    let thickness = m.model.number(&name("thicknessFactor"), own.thickness_factor.0.into(), 0.0, f64::MAX)?;
    let color = own.attenuation_color.0.map(f64::from);
    let [r, g, b] = m.numbers(&name("attenuationColor"), color, 0.0, 1.0)?;
    let distance = f64::from(own.attenuation_distance.0);
    if !(distance > 0.0) {
        let message = format!("expected a number above 0, not {distance}");
        return Err(m.model.error(&name("attenuationDistance"), message));
    }
    // How thick it is the mesh itself tells; only whether it has an inside is asked.
    if thickness > 0.0 {
        let [r, g, b] = [r, g, b].map(|v| v.max(LEAST_ATTENUATION) as f32);
        let attenuation_color = Rgb::new(r, g, b);
        surface.gltf.volume = Some(Volume { attenuation_color, attenuation_distance: distance });
    }
    Ok(())
}

fn clearcoat(m: &mut Materials<'_>, material: &Material, surface: &mut Surface) -> Result<()> {
    const NAME: &str = "KHR_materials_clearcoat";
    let Some(own) = other::<Clearcoat>(m, material, NAME, surface)? else { return Ok(()) };
    let texture = own.clearcoat_texture.as_ref().map(|info| (info, Channel::Red));
    let factor = (Parameter::Clearcoat, own.clearcoat_factor);
    surface.gltf.clearcoat = unit(m, surface, (NAME, "clearcoat"), factor, texture)?;
    if surface.gltf.clearcoat == 0.0 {
        return Ok(());
    }
    let texture = own.clearcoat_roughness_texture.as_ref().map(|info| (info, Channel::Green));
    let factor = (Parameter::ClearcoatRoughness, own.clearcoat_roughness_factor);
    surface.gltf.clearcoat_roughness = unit(m, surface, (NAME, "clearcoatRoughness"), factor, texture)?;
    if let Some(info) = &own.clearcoat_normal_texture {
        let name = format!("extensions.{NAME}.clearcoatNormalTexture");
        surface.gltf.coat_normal = m.normal_map(info, &name, surface)?;
    }
    Ok(())
}

fn sheen(m: &mut Materials<'_>, material: &Material, surface: &mut Surface) -> Result<()> {
    const NAME: &str = "KHR_materials_sheen";
    let Some(own) = other::<Sheen>(m, material, NAME, surface)? else { return Ok(()) };
    let factor = (Parameter::SheenColor, own.sheen_color_factor);
    let texture = (own.sheen_color_texture.as_ref(), 1.0);
    surface.gltf.sheen_color = colour(m, surface, (NAME, "sheenColor"), factor, texture)?;
    if surface.gltf.sheen_color.is_black() {
        return Ok(());
    }
    let texture = own.sheen_roughness_texture.as_ref().map(|info| (info, Channel::Alpha));
    let factor = (Parameter::SheenRoughness, own.sheen_roughness_factor);
    surface.gltf.sheen_roughness = unit(m, surface, (NAME, "sheenRoughness"), factor, texture)?;
    Ok(())
}

fn iridescence(m: &mut Materials<'_>, material: &Material, surface: &mut Surface) -> Result<()> {
    const NAME: &str = "KHR_materials_iridescence";
    let Some(own) = other::<Iridescence>(m, material, NAME, surface)? else { return Ok(()) };
    let texture = own.iridescence_texture.as_ref().map(|info| (info, Channel::Red));
    let factor = (Parameter::Iridescence, own.iridescence_factor);
    surface.gltf.iridescence = unit(m, surface, (NAME, "iridescence"), factor, texture)?;
    if surface.gltf.iridescence == 0.0 {
        return Ok(());
    }
    let own_place = surface.place.clone();
    let name = |name: &str| format!("{own_place}.extensions.{NAME}.{name}");
    let ior = m.model.number(&name("iridescenceIor"), own.iridescence_ior.into(), 1.0, f64::MAX)?;
    let ends = [own.iridescence_thickness_minimum, own.iridescence_thickness_maximum].map(f64::from);
    let [least, most] = m.numbers(&name("iridescenceThickness"), ends, 0.0, f64::from(f32::MAX))?;
    surface.gltf.iridescence_ior = ior;
    surface.gltf.iridescence_thickness = most;
    match &own.iridescence_thickness_texture {
        // From the least to the most as the texture goes from 0 to 1.
        Some(info) if least != most => {
            let picture = m.look_up(info, &format!("extensions.{NAME}.iridescenceThicknessTexture"), true, surface)?;
            let part = m.textures.channel(picture, Channel::Green);
            let more = m.textures.product(Value::Constant(Rgb::splat((most - least) as f32)), part);
            let thickness = match least == 0.0 {
                true => more,
                false => m.textures.sum(Value::Constant(Rgb::splat(least as f32)), more),
            };
            surface.varying.extend(thickness.texture().map(|id| (Parameter::IridescenceThickness, id)));
        }
        _ => {}
    }
    Ok(())
}
