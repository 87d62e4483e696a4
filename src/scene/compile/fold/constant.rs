//! Textures that are the same everywhere, whatever they are made of.

use super::shown;
use crate::description::{Channel, SceneDescription, Texture, TextureId, TextureKind};
use crate::image::Raster;
use crate::spectrum::Rgb;

/// What each texture of a description is everywhere, if it is.
pub(super) struct Constants(Vec<Constant>);

/// What is known of a texture: what it gives where a colour is asked for, a number, an opacity.
#[derive(Clone, Copy, Default)]
struct Constant {
    colour: Option<Rgb>,
    number: Option<f32>,
    alpha: Option<f32>,
}

impl Constant {
    fn of(colour: Option<Rgb>, alpha: Option<f32>) -> Self {
        Self { colour, number: colour.map(Rgb::luminance), alpha }
    }

    fn grey(number: Option<f32>) -> Self {
        Self { colour: number.map(Rgb::splat), number, alpha: Some(1.0) }
    }
}

impl Constants {
    /// Its colour, if it has one only.
    pub(super) fn colour(&self, id: TextureId) -> Option<Rgb> {
        self.0[id.0].colour
    }

    /// The number that it gives, if it is one only.
    pub(super) fn number(&self, id: TextureId) -> Option<f32> {
        self.0[id.0].number
    }
}

/// Makes one colour of every texture that is one, and says what is known of all.
pub(super) fn textures(description: &mut SceneDescription, notes: &mut Vec<String>) -> Constants {
    let mut known: Vec<Constant> = Vec::with_capacity(description.textures.len());
    for texture in &description.textures {
        // They refer to those before them only.
        known.push(constant(texture, &known, &description.textures));
    }
    // The shape of a light's picture matters, too.
    let shown = shown(description);
    for (index, (texture, constant)) in description.textures.iter_mut().zip(&known).enumerate() {
        // Asked for a number it gives its luminance then: rounding may have that differ by a bit from what it gave before.
        let same = constant.colour.filter(|c| Some(c.luminance()) == constant.number);
        if let Some(colour) = same
            && texture.is_varying()
            && !shown.contains(&TextureId(index))
        {
            let [r, g, b] = colour.to_array();
            let saved = match &texture.kind {
                TextureKind::Bitmap { image, .. } => format!(" instead of the {} bytes of", image.memory_bytes()),
                _ => " instead of".into(),
            };
            let what = match &texture.kind {
                TextureKind::Bitmap { image, .. } => image.name(),
                _ => "a texture",
            };
            notes.push(format!("{}: one colour ({r}, {g}, {b}){saved} {what}", texture.at));
            texture.kind = TextureKind::Constant(colour);
        }
    }
    Constants(known)
}

/// What a texture is everywhere, where this is `known` of those before it.
fn constant(texture: &Texture, known: &[Constant], all: &[Texture]) -> Constant {
    let two = |ids: [TextureId; 2]| ids.map(|id| known[id.0]);
    match &texture.kind {
        TextureKind::Constant(colour) => Constant::of(Some(*colour), Some(1.0)),
        TextureKind::Bitmap { image, .. } => Constant::of(one(image, Raster::colour), None),
        TextureKind::Checkerboard { colors } => {
            let [a, b] = two(*colors);
            let colour = a.colour.filter(|_| a.colour == b.colour && a.number == b.number);
            Constant { colour, number: a.number.filter(|_| colour.is_some()), alpha: Some(1.0) }
        }
        TextureKind::Attribute { .. } => Constant::default(),
        TextureKind::Product(factors) => {
            let [a, b] = two(*factors);
            Constant {
                colour: a.colour.zip(b.colour).map(|(a, b)| a * b),
                number: a.number.zip(b.number).map(|(a, b)| a * b),
                alpha: alpha(factors[0], known, all).zip(alpha(factors[1], known, all)).map(|(a, b)| a * b),
            }
        }
        TextureKind::Sum(terms) => {
            let [a, b] = two(*terms);
            Constant {
                colour: a.colour.zip(b.colour).map(|(a, b)| a + b),
                number: a.number.zip(b.number).map(|(a, b)| a + b),
                alpha: Some(1.0),
            }
        }
        TextureKind::Channel { of, channel } => {
            let colour = known[of.0].colour;
            Constant::grey(match channel {
                Channel::Red => colour.map(|c| c.0.x),
                Channel::Green => colour.map(|c| c.0.y),
                Channel::Blue => colour.map(|c| c.0.z),
                Channel::Alpha => alpha(*of, known, all),
            })
        }
        TextureKind::Threshold { of, cutoff } => {
            let number = known[of.0].number;
            Constant::grey(number.map(|number| f32::from(u8::from(number >= *cutoff as f32))))
        }
    }
}

/// The opacity of a texture. That of pictures is looked at only if it is asked for.
fn alpha(of: TextureId, known: &[Constant], all: &[Texture]) -> Option<f32> {
    match &all[of.0].kind {
        TextureKind::Bitmap { image, .. } => one(image, Raster::alpha),
        _ => known[of.0].alpha,
    }
}

/// What all pixels of a picture are, if they are the same; NaN is not.
fn one<T: PartialEq + Copy>(image: &Raster, of: impl Fn(&Raster, u32, u32) -> T) -> Option<T> {
    let first = of(image, 0, 0);
    let is_same = |y: u32| (0..image.width()).all(|x| of(image, x, y) == first);
    (0..image.height()).all(is_same).then_some(first)
}
