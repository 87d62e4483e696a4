//! What a texture may be anywhere, for those who must know before they look it up.

use super::{Channel, MeshValues, TextureKind, Textures};

/// What opacities and thresholds are between.
const UNIT: [f32; 2] = [0.0, 1.0];

impl Textures {
    /// Bounds of all values that texture `index` takes in any channel, on a mesh that says this or on none; `None` where one
    /// is not finite.
    pub fn range(&self, index: u32, on: Option<&MeshValues>) -> Option<[f32; 2]> {
        let range = |index| self.range(index, on);
        match &self.0[index as usize].kind {
            TextureKind::Constant(colour) => {
                colour.is_finite().then(|| [colour.0.min_element(), colour.0.max_element()])
            }
            // What is between pixels is between their values.
            TextureKind::Bitmap(bitmap) => bitmap.image.range(),
            TextureKind::Checkerboard { colors } => {
                let [low, high] = range(colors[0])?;
                let [other_low, other_high] = range(colors[1])?;
                Some([low.min(other_low), high.max(other_high)])
            }
            TextureKind::Attribute { index, scale } => {
                let attribute = on.and_then(|values| values.attributes.get(*index as usize)?.as_ref());
                bounds(attribute.map_or(&[0.0][..], |a| &a.values).iter().map(|v| v * scale))
            }
            TextureKind::Product(factors) => {
                let [a, b] = [range(factors[0])?, range(factors[1])?];
                bounds(a.into_iter().flat_map(|a| b.map(|b| a * b)))
            }
            TextureKind::Sum(terms) => {
                let [a, b] = [range(terms[0])?, range(terms[1])?];
                bounds([a[0] + b[0], a[1] + b[1]].into_iter())
            }
            TextureKind::Channel { channel: Channel::Alpha, .. } | TextureKind::Threshold { .. } => Some(UNIT),
            TextureKind::Channel { of, .. } => range(*of),
        }
    }

    /// Pixels across and down of a picture; one of what has none.
    pub fn resolution(&self, index: u32) -> (u32, u32) {
        match &self.0[index as usize].kind {
            TextureKind::Bitmap(bitmap) => (bitmap.image.width(), bitmap.image.height()),
            _ => (1, 1),
        }
    }
}

/// The smallest and the largest of some numbers; `None` where one is not finite.
fn bounds(mut values: impl Iterator<Item = f32>) -> Option<[f32; 2]> {
    values
        .try_fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| v.is_finite().then(|| [low.min(v), high.max(v)]))
}
