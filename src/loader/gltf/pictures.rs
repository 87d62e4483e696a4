//! The pictures of textures: fetched from where they are, and decoded in parallel, each once.

use super::model::Model;
use crate::description::{Texture, TextureId, TextureKind, Wrap};
use crate::error::Result;
use crate::image::Raster;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

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
        let mut files = BTreeMap::new();
        for asked in &self.0 {
            if let Entry::Vacant(place) = files.entry(asked.image) {
                place.insert(model.image_file(asked.image)?);
            }
        }
        let mut wanted: Vec<(usize, bool)> = self.0.iter().map(|asked| (asked.image, asked.raw)).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let decoded: Vec<_> = wanted.par_iter().map(|(image, raw)| Raster::decode(&files[image], None, *raw)).collect();
        let mut rasters = BTreeMap::new();
        for (key, raster) in wanted.into_iter().zip(decoded) {
            let fail = |e| model.error(&format!("images[{}]", key.0), format!("cannot read the picture: {e}"));
            rasters.insert(key, Arc::new(raster.map_err(fail)?));
        }
        for Asked { texture, image, raw, bilinear, wrap } in self.0 {
            let image = rasters[&(image, raw)].clone();
            textures[texture.0].kind = TextureKind::Bitmap { image, bilinear, wrap };
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
