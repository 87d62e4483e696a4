//! Materials: the metallic-roughness model, how it is cut out, and which of its sides there are.
//!
//! A material's surface is a [`Gltf`] with textures, under the normal of its normal map. One that is not double-sided has
//! nothing behind it ([`BsdfKind::Null`] is its back), which is what the culling of faces looks like; but shadow rays end
//! there as they do at masks. What transmits has both sides anyway. Occlusion is not read: it is what a path tracer finds.

use super::layers;
use super::model::Model;
use super::primitives::Wanted;
use super::textures::{Reference, Textures, Value};
use crate::description::{
    Bsdf, BsdfId, BsdfKind, Channel, Emission, Gltf, NormalSource, Parameter, Terminator, TextureId, Varying,
};
use crate::error::Result;
use crate::spectrum::Rgb;
use gltf::json::Material;
use gltf::json::material::{AlphaMode, NormalTexture};
use gltf::json::texture::Info;
use gltf::json::validation::Checked;
use std::collections::HashMap;

/// What a primitive looks like.
#[derive(Clone, Debug)]
pub(super) struct Look {
    /// Its surface; `None` where nothing of it can be seen.
    pub(super) bsdf: Option<BsdfId>,
    pub(super) emission: Option<Emission>,
    /// What it asks of the mesh.
    pub(super) wanted: Wanted,
}

/// Makes bsdfs of materials, each once.
pub(super) struct Materials<'m> {
    pub(super) model: &'m Model,
    pub(super) textures: Textures<'m>,
    pub(super) bsdfs: Vec<Bsdf>,
    /// By the material and whether it is varied by the colours of vertices.
    looks: HashMap<(Option<usize>, bool), Look>,
    nothing: Option<BsdfId>,
    /// Whether a surface emits as lamps do, more than white.
    pub(super) has_lamp: bool,
}

/// A surface while it is put together.
pub(super) struct Surface {
    pub(super) gltf: Gltf,
    pub(super) varying: Vec<(Parameter, TextureId)>,
    /// The sets of texture coordinates that it looks up.
    pub(super) sets: Vec<u32>,
    /// The place among those of a normal map's.
    pub(super) tangents: Option<usize>,
    /// Where in the JSON.
    pub(super) place: String,
}

/// The colour and opacity of a material's base.
#[derive(Clone, Copy)]
struct Base {
    color: Value,
    /// What of `color` does not vary.
    factor: Rgb,
    /// What does.
    varying: Value,
    alpha: Value,
}

impl<'m> Materials<'m> {
    pub(super) fn new(model: &'m Model) -> Self {
        Self {
            model,
            textures: Textures::new(model),
            bsdfs: Vec::new(),
            looks: HashMap::new(),
            nothing: None,
            has_lamp: false,
        }
    }

    /// What `materials[index]` looks like, or the material of what has none; with or without the colours of vertices.
    /// `place` refers to it.
    pub(super) fn look(&mut self, index: Option<usize>, colors: bool, place: &str) -> Result<Look> {
        if let Some(known) = self.looks.get(&(index, colors)) {
            return Ok(known.clone());
        }
        let default = Material::default();
        let material = match index {
            Some(index) => self.model.get(&self.model.root.materials, index, "materials", place)?,
            None => &default,
        };
        let place = index.map_or_else(|| place.to_owned(), |index| format!("materials[{index}]"));
        let look = self.make(material, colors, place)?;
        self.looks.insert((index, colors), look.clone());
        Ok(look)
    }

    pub(super) fn add(&mut self, name: &str, kind: BsdfKind, varying: Vec<(Parameter, TextureId)>) -> BsdfId {
        self.bsdfs.push(Bsdf { at: self.model.at.clone(), name: name.into(), kind, varying });
        BsdfId(self.bsdfs.len() - 1)
    }

    fn make(&mut self, material: &Material, colors: bool, place: String) -> Result<Look> {
        let sets = if self.model.wants_uvs { vec![0] } else { Vec::new() };
        let mut surface = Surface { gltf: Gltf::default(), varying: Vec::new(), sets, tangents: None, place };
        let name = material.name.as_deref().unwrap_or("");
        let extensions = material.extensions.as_ref();
        let is_unlit = extensions.is_some_and(|e| e.unlit.is_some());
        let base = self.base(material, colors, &mut surface)?;
        let opacity = self.opacity(material, base, &surface.place)?;
        let (own, emission) = if is_unlit {
            let black = self.add(name, BsdfKind::Diffuse { reflectance: Rgb::BLACK }, Vec::new());
            (self.sided(name, black, &surface, material.double_sided), (base.factor, base.varying))
        } else {
            surface.gltf.base_color = base.factor;
            surface.varying.extend(base.color.texture().map(|id| (Parameter::BaseColor, id)));
            if extensions.is_none_or(|e| e.pbr_specular_glossiness.is_none()) {
                self.metal(material, &mut surface)?;
            }
            layers::read(self, material, &mut surface)?;
            let varying = std::mem::take(&mut surface.varying);
            let leaf = self.add(name, BsdfKind::Gltf(surface.gltf), varying);
            let is_double = material.double_sided || surface.gltf.transmission > 0.0;
            // A bump seen from behind is a dent: there a normal map turns the surface before its side is chosen.
            let inner = if material.double_sided { self.sided(name, leaf, &surface, true) } else { leaf };
            let own = self.normal(material, inner, &mut surface)?;
            let own = if is_double { own } else { self.sided(name, own, &surface, false) };
            (own, self.glow(material, &mut surface)?)
        };
        let bsdf = match Textures::number(opacity) {
            Varying::Constant(0.0) => None,
            Varying::Constant(1.0) => Some(own),
            opacity => Some(self.add(name, BsdfKind::Mask { nested: own, opacity }, Vec::new())),
        };
        let emission = self.emission(emission, opacity, material.double_sided, !is_unlit);
        Ok(Look { bsdf, emission, wanted: Wanted { sets: surface.sets, colors, tangents: surface.tangents } })
    }

    /// With the same behind it, or nothing. What transmits has two sides of its own.
    fn sided(&mut self, name: &str, front: BsdfId, surface: &Surface, both: bool) -> BsdfId {
        if surface.gltf.transmission > 0.0 {
            return front;
        }
        let back = if both { front } else { self.nothing() };
        self.add(name, BsdfKind::TwoSided { front, back }, Vec::new())
    }

    fn nothing(&mut self) -> BsdfId {
        if let Some(id) = self.nothing {
            return id;
        }
        let id = self.add("", BsdfKind::Null, Vec::new());
        *self.nothing.insert(id)
    }

    /// Colour and opacity of the base: a factor, a texture, the colours of vertices.
    fn base(&mut self, material: &Material, colors: bool, surface: &mut Surface) -> Result<Base> {
        let pbr = &material.pbr_metallic_roughness;
        let old = material.extensions.as_ref().and_then(|e| e.pbr_specular_glossiness.as_ref());
        let (factor, texture, name) = match old {
            Some(old) => (old.diffuse_factor.0, &old.diffuse_texture, "diffuse"),
            None => (pbr.base_color_factor.0, &pbr.base_color_texture, "baseColor"),
        };
        let place = format!("{}.{name}Factor", surface.place);
        let [r, g, b, alpha] = self.numbers(&place, factor.map(f64::from), 0.0, 1.0)?;
        let factor = Rgb::new(r as f32, g as f32, b as f32);
        let mut varying = Value::ONE;
        let mut alpha = Value::Constant(Rgb::splat(alpha as f32));
        let is_opaque = matches!(material.alpha_mode, Checked::Valid(AlphaMode::Opaque));
        if let Some(info) = texture {
            let place = format!("{}.{name}Texture", surface.place);
            varying = self.textures.picture(&Reference::new(info, &place), false, &mut surface.sets)?;
            if !is_opaque {
                let own = self.textures.channel(varying, Channel::Alpha);
                alpha = self.textures.product(alpha, own);
            }
        }
        if colors {
            let of_vertices = self.textures.vertex_colors();
            varying = self.textures.product(varying, of_vertices);
            if !is_opaque {
                let own = self.textures.channel(of_vertices, Channel::Alpha);
                alpha = self.textures.product(alpha, own);
            }
        }
        let color = self.textures.product(Value::Constant(factor), varying);
        Ok(Base { color, factor, varying, alpha })
    }

    /// How much of it is there.
    fn opacity(&mut self, material: &Material, base: Base, place: &str) -> Result<Value> {
        match material.alpha_mode {
            Checked::Valid(AlphaMode::Opaque) => Ok(Value::ONE),
            Checked::Valid(AlphaMode::Blend) => Ok(base.alpha),
            Checked::Valid(AlphaMode::Mask) => {
                let cutoff = f64::from(material.alpha_cutoff.unwrap_or_default().0);
                let cutoff = self.model.number(&format!("{place}.alphaCutoff"), cutoff, 0.0, f64::MAX)?;
                Ok(self.textures.threshold(base.alpha, cutoff))
            }
            Checked::Invalid => Err(self.model.error(place, "its alphaMode is not one of OPAQUE, MASK, BLEND")),
        }
    }

    fn metal(&mut self, material: &Material, surface: &mut Surface) -> Result<()> {
        let pbr = &material.pbr_metallic_roughness;
        let texture = pbr.metallic_roughness_texture.as_ref();
        let name = |name| format!("{}.{name}", surface.place);
        let metallic = self.number(&name("metallicFactor"), pbr.metallic_factor.0)?;
        let roughness = self.number(&name("roughnessFactor"), pbr.roughness_factor.0)?;
        (surface.gltf.metallic, surface.gltf.roughness) = (metallic, roughness);
        let Some(info) = texture.filter(|_| metallic > 0.0 || roughness > 0.0) else { return Ok(()) };
        let picture = self.look_up(info, "metallicRoughnessTexture", true, surface)?;
        self.vary(surface, (Parameter::Metallic, metallic), picture, Channel::Blue);
        self.vary(surface, (Parameter::Roughness, roughness), picture, Channel::Green);
        Ok(())
    }

    /// The bsdf under its normal map, if it has one.
    fn normal(&mut self, material: &Material, leaf: BsdfId, surface: &mut Surface) -> Result<BsdfId> {
        let Some(info) = &material.normal_texture else { return Ok(leaf) };
        let Some(normal) = self.normal_map(info, "normalTexture", surface)? else { return Ok(leaf) };
        let kind = BsdfKind::Perturbed { nested: leaf, normal, terminator: Terminator::Bend };
        Ok(self.add(material.name.as_deref().unwrap_or(""), kind, Vec::new()))
    }

    /// Where a normal comes from, unless it is flat. If it is the material's first, tangents follow its texture coordinates.
    pub(super) fn normal_map(
        &mut self,
        info: &NormalTexture,
        name: &str,
        surface: &mut Surface,
    ) -> Result<Option<NormalSource>> {
        let place = format!("{}.{name}", surface.place);
        let limits = (f64::from(f32::MIN), f64::from(f32::MAX));
        let scale = self.model.number(&format!("{place}.scale"), f64::from(info.scale), limits.0, limits.1)?;
        let reference = Reference::normal(self.model, info, &place)?;
        let picture = self.textures.picture(&reference, true, &mut surface.sets)?;
        let Some(texture) = picture.texture().filter(|_| scale != 0.0) else { return Ok(None) };
        let set = surface.sets.iter().position(|&s| s == reference.set());
        surface.tangents = surface.tangents.or(set);
        Ok(Some(NormalSource::Map { texture, scale }))
    }

    /// What it emits: what does not vary, and what does.
    fn glow(&mut self, material: &Material, surface: &mut Surface) -> Result<(Rgb, Value)> {
        let strength = material.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
        let strength = strength.map_or(1.0, |s| f64::from(s.emissive_strength.0));
        let place = format!("{}.emissiveFactor", surface.place);
        let factor = material.emissive_factor.0.map(|f| f64::from(f) * strength);
        let [r, g, b] = self.numbers(&place, factor, 0.0, f64::from(f32::MAX))?.map(|v| v as f32);
        let factor = Rgb::new(r, g, b);
        match &material.emissive_texture {
            Some(info) if !factor.is_black() => Ok((factor, self.look_up(info, "emissiveTexture", false, surface)?)),
            _ => Ok((factor, Value::ONE)),
        }
    }

    fn emission(
        &mut self,
        (factor, varying): (Rgb, Value),
        opacity: Value,
        both_sides: bool,
        is_lit: bool,
    ) -> Option<Emission> {
        let (radiance, texture) = match self.textures.product(varying, opacity) {
            Value::Constant(c) => (factor * c, None),
            Value::Texture(id) => (factor, Some(id)),
        };
        self.has_lamp |= is_lit && radiance.max_component() > 1.0;
        (!radiance.is_black()).then_some(Emission { radiance, texture, both_sides })
    }

    /// The picture that an attribute of a material refers to.
    pub(super) fn look_up(&mut self, info: &Info, name: &str, raw: bool, surface: &mut Surface) -> Result<Value> {
        let place = format!("{}.{name}", surface.place);
        self.textures.picture(&Reference::new(info, &place), raw, &mut surface.sets)
    }

    /// Gives a parameter to a channel of a picture, times a factor.
    pub(super) fn vary(
        &mut self,
        surface: &mut Surface,
        (parameter, factor): (Parameter, f64),
        picture: Value,
        channel: Channel,
    ) {
        if factor > 0.0 {
            let channel = self.textures.channel(picture, channel);
            let product = self.textures.product(Value::Constant(Rgb::splat(factor as f32)), channel);
            surface.varying.extend(product.texture().map(|id| (parameter, id)));
        }
    }

    /// A number from 0 to 1.
    pub(super) fn number(&self, place: &str, value: f32) -> Result<f64> {
        self.model.number(place, f64::from(value), 0.0, 1.0)
    }

    /// Numbers between two.
    pub(super) fn numbers<const N: usize>(&self, place: &str, v: [f64; N], low: f64, high: f64) -> Result<[f64; N]> {
        let mut checked = v;
        for value in &mut checked {
            *value = self.model.number(place, *value, low, high)?;
        }
        Ok(checked)
    }
}
