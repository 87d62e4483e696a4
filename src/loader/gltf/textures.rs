//! Textures of materials: pictures, their channels and products. What is constant is folded and needs no texture.

use super::extensions;
use super::model::Model;
use super::pictures::Pictures;
use super::primitives::COLOR;
use crate::description::{Channel, Texture, TextureId, TextureKind, Varying, Wrap};
use crate::error::Result;
use crate::spectrum::Rgb;
use glam::{DAffine2, DVec2};
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::NormalTexture;
use gltf::json::texture::{Info, MagFilter, WrappingMode};
use gltf::json::validation::Checked;

/// A colour of a surface, or a number as a grey.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value {
    /// The same everywhere.
    Constant(Rgb),
    /// What a texture says.
    Texture(TextureId),
}

impl Value {
    pub(super) const ONE: Self = Self::Constant(Rgb::WHITE);

    /// The texture, if it is one.
    pub(super) fn texture(self) -> Option<TextureId> {
        match self {
            Self::Constant(_) => None,
            Self::Texture(id) => Some(id),
        }
    }
}

/// How a material refers to a texture.
pub(super) struct Reference<'a> {
    index: usize,
    set: u32,
    transform: Option<TextureTransform>,
    /// Where in the JSON.
    place: &'a str,
}

impl<'a> Reference<'a> {
    pub(super) fn new(info: &Info, place: &'a str) -> Self {
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.clone());
        Self { index: info.index.value(), set: info.tex_coord, transform, place }
    }

    pub(super) fn normal(model: &Model, info: &NormalTexture, place: &'a str) -> Result<Self> {
        let value = info.extensions.as_ref().and_then(|e| e.others.get("KHR_texture_transform"));
        let transform = match value {
            Some(value) => Some(
                gltf::json::deserialize::from_value(value.clone())
                    .map_err(|e| model.error(place, format!("its transform is not understood: {e}")))?,
            ),
            None => None,
        };
        Ok(Self { index: info.index.value(), set: info.tex_coord, transform, place })
    }

    /// The set of texture coordinates that it looks up.
    pub(super) fn set(&self) -> u32 {
        self.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(self.set)
    }

    /// From those to the picture's: scaled, turned, moved (`KHR_texture_transform`).
    fn to_uv(&self, model: &Model) -> Result<DAffine2> {
        let Some(t) = &self.transform else { return Ok(DAffine2::IDENTITY) };
        let vector = |v: [f32; 2]| DVec2::from(v.map(f64::from));
        // Its angle turns clockwise where v runs up, so counter-clockwise as seen in coordinates that run down.
        let angle = -f64::from(t.rotation.0);
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let scale = vector(t.scale.0);
        let to_uv = DAffine2 {
            matrix2: glam::DMat2::from_cols(DVec2::new(cos, sin) * scale.x, DVec2::new(-sin, cos) * scale.y),
            translation: vector(t.offset.0),
        };
        if to_uv.is_finite() { Ok(to_uv) } else { Err(model.error(self.place, "its transform is not finite")) }
    }
}

/// Makes the textures of a scene.
pub(super) struct Textures<'m> {
    model: &'m Model,
    /// Those made so far. Pictures are put into their places by [`Self::finish`].
    all: Vec<Texture>,
    pictures: Pictures,
}

impl<'m> Textures<'m> {
    pub(super) fn new(model: &'m Model) -> Self {
        Self { model, all: Vec::new(), pictures: Pictures::default() }
    }

    /// All textures, with their pictures, each of which is read and decoded once.
    pub(super) fn finish(mut self) -> Result<Vec<Texture>> {
        self.pictures.fill(self.model, &mut self.all)?;
        Ok(self.all)
    }

    fn add(&mut self, kind: TextureKind, uv_set: u32, to_uv: DAffine2) -> Value {
        self.all.push(Texture { at: self.model.at.clone(), kind, uv_set, to_uv });
        Value::Texture(TextureId(self.all.len() - 1))
    }

    fn combine(&mut self, kind: TextureKind) -> Value {
        self.add(kind, 0, DAffine2::IDENTITY)
    }

    /// The picture that a material refers to; `raw`: its numbers are not colours. Its set of texture coordinates gets a
    /// place among those of the mesh.
    pub(super) fn picture(&mut self, reference: &Reference<'_>, raw: bool, sets: &mut Vec<u32>) -> Result<Value> {
        let model = self.model;
        let texture = model.get(&model.root.textures, reference.index, "textures", reference.place)?;
        let place = format!("textures[{}]", reference.index);
        let source = texture.source.value();
        if source == u32::MAX as usize {
            let names = texture.extensions.iter().flat_map(|e| e.others.keys());
            let packed = names.filter_map(|name| extensions::packing(name)).next();
            let message = packed.map_or_else(|| "it has no source".into(), |what| format!("it has no source: {what}"));
            return Err(model.error(&place, message));
        }
        model.get(&model.root.images, source, "images", &place)?;
        let (mut bilinear, mut wrap) = (true, [Wrap::Repeat; 2]);
        if let Some(index) = texture.sampler {
            let sampler = model.get(&model.root.samplers, index.value(), "samplers", &place)?;
            let place = format!("samplers[{}]", index.value());
            bilinear = match sampler.mag_filter {
                None | Some(Checked::Valid(MagFilter::Linear)) => true,
                Some(Checked::Valid(MagFilter::Nearest)) => false,
                Some(Checked::Invalid) => return Err(model.error(&place, "its magFilter is not one of 9728, 9729")),
            };
            for (axis, mode) in wrap.iter_mut().zip([sampler.wrap_s, sampler.wrap_t]) {
                *axis = match mode {
                    Checked::Valid(WrappingMode::Repeat) => Wrap::Repeat,
                    Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
                    Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
                    Checked::Invalid => {
                        return Err(model.error(&place, "how it wraps is not one of 10497, 33071, 33648"));
                    }
                };
            }
        }
        let slot = slot(sets, reference.set());
        let value = self.add(TextureKind::Constant(Rgb::WHITE), slot as u32, reference.to_uv(model)?);
        if let Value::Texture(id) = value {
            self.pictures.ask(id, source, raw, bilinear, wrap);
        }
        Ok(value)
    }

    /// The colours of vertices.
    pub(super) fn vertex_colors(&mut self) -> Value {
        self.combine(TextureKind::Attribute { name: COLOR.into(), scale: 1.0 })
    }

    pub(super) fn product(&mut self, a: Value, b: Value) -> Value {
        match (a, b) {
            (Value::Constant(a), Value::Constant(b)) => Value::Constant(a * b),
            (Value::Constant(c), other) | (other, Value::Constant(c)) if c == Rgb::WHITE => other,
            (Value::Constant(c), _) | (_, Value::Constant(c)) if c == Rgb::BLACK => Value::Constant(c),
            _ => {
                let factors = [self.as_texture(a), self.as_texture(b)];
                self.combine(TextureKind::Product(factors))
            }
        }
    }

    pub(super) fn sum(&mut self, a: Value, b: Value) -> Value {
        match (a, b) {
            (Value::Constant(a), Value::Constant(b)) => Value::Constant(a + b),
            _ => {
                let terms = [self.as_texture(a), self.as_texture(b)];
                self.combine(TextureKind::Sum(terms))
            }
        }
    }

    /// A channel of a picture or of vertex colours. Of a constant colour it is that channel.
    pub(super) fn channel(&mut self, of: Value, channel: Channel) -> Value {
        match of {
            Value::Texture(of) => self.combine(TextureKind::Channel { of, channel }),
            Value::Constant(c) => {
                let [r, g, b] = c.to_array();
                Value::Constant(Rgb::splat(match channel {
                    Channel::Red => r,
                    Channel::Green => g,
                    Channel::Blue => b,
                    Channel::Alpha => 1.0,
                }))
            }
        }
    }

    /// One from `cutoff` on, below it zero.
    pub(super) fn threshold(&mut self, of: Value, cutoff: f64) -> Value {
        match of {
            Value::Texture(of) => self.combine(TextureKind::Threshold { of, cutoff }),
            Value::Constant(c) => {
                let is_there = f64::from(c.luminance()) >= cutoff;
                Value::Constant(if is_there { Rgb::WHITE } else { Rgb::BLACK })
            }
        }
    }

    /// As a number that may vary.
    pub(super) fn number(value: Value) -> Varying {
        match value {
            Value::Constant(c) => Varying::Constant(f64::from(c.to_array()[0])),
            Value::Texture(id) => Varying::Texture(id),
        }
    }

    fn as_texture(&mut self, value: Value) -> TextureId {
        match value {
            Value::Texture(id) => id,
            Value::Constant(colour) => {
                self.combine(TextureKind::Constant(colour));
                TextureId(self.all.len() - 1)
            }
        }
    }
}

/// The place of a set of texture coordinates among those of a mesh; a new one where it has none yet.
fn slot(sets: &mut Vec<u32>, set: u32) -> usize {
    sets.iter().position(|&s| s == set).unwrap_or_else(|| {
        sets.push(set);
        sets.len() - 1
    })
}
