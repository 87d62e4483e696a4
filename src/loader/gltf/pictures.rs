//! The pictures of textures: fetched from where they are, and decoded in parallel, each once.

use super::model::Model;
use crate::description::{Texture, TextureId, TextureKind, Wrap};
use crate::error::Result;
use crate::loader::pictures;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A texture that waits for its picture.
struct Asked {
    texture: TextureId,
    image: usize,
    raw: bool,
    bilinear: bool,
    wrap: [Wrap; 2],
}

/// The textures that wait for pictures.
#[derive(Default)]
pub(super) struct Pictures(Vec<Asked>);

impl Pictures {
    /// Makes a texture `images[image]`; `raw`: its numbers are not colours.
    pub(super) fn ask(&mut self, texture: TextureId, image: usize, raw: bool, bilinear: bool, wrap: [Wrap; 2]) {
        self.0.push(Asked { texture, image, raw, bilinear, wrap });
    }

    /// Gives the textures their pictures.
    pub(super) fn fill(self, model: &Model, textures: &mut [Texture]) -> Result<()> {
        let (mut pictures, mut sources) = (pictures::Pictures::new(model.files.clone()), BTreeMap::new());
        let mut ids = Vec::new();
        for asked in &self.0 {
            let source = match sources.get(&asked.image) {
                Some(&source) => source,
                None => {
                    let bytes = model.image_file(asked.image)?;
                    let source = pictures.bytes(format!("images[{}]", asked.image), bytes, model.at.clone());
                    sources.insert(asked.image, source);
                    source
                }
            };
            ids.push(pictures.ask(source, asked.raw));
        }
        let decoded = pictures.decode()?;
        for (Asked { texture, bilinear, wrap, .. }, id) in self.0.into_iter().zip(ids) {
            textures[texture.0].kind = TextureKind::Bitmap { image: decoded[id.0].clone(), bilinear, wrap };
        }
        Ok(())
    }
}

impl Model {
    /// The bytes of a picture's file.
    fn image_file(&self, index: usize) -> Result<Cow<'_, [u8]>> {
        let place = format!("images[{index}]");
        let image = self.get(&self.root.images, index, "images", &place)?;
        match (&image.buffer_view, &image.uri) {
            (Some(view), None) => Ok(self.view(view.value(), &place)?.bytes.into()),
            (None, Some(uri)) => Ok(self.behind(uri, &place)?.into()),
            _ => Err(self.error(&place, "it needs either a uri or a bufferView")),
        }
    }
}
