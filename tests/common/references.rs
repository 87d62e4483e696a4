//! The references of `tests/data/reference`: which there are, and how they are read.

use super::{Estimate, project};
use exr::prelude::*;
use snell::image::Picture;
use snell::spectrum::Rgb;

/// Width and height of the references.
pub const RES: u32 = 64;

/// A scene with a reference.
pub struct Reference {
    pub name: &'static str,
    /// Samples per pixel: see the README beside the pictures.
    pub samples: u32,
}

/// An own scene with a reference whose samples have so heavy a tail (docs/numerics.md) that neither 32 pictures nor their scatter say
/// much of a tile: tests that compare pixels or tiles by normal laws leave it out, and the mean has a test of its own.
pub const HEAVY_TAILED: Reference = Reference { name: "rough-glass-caustic", samples: 65_536 };

/// Every other own scene.
pub const REFERENCES: [Reference; 11] = [
    Reference { name: "caustic", samples: 16_384 },
    Reference { name: "cornell-box", samples: 65_536 },
    Reference { name: "cornell-box-materials", samples: 65_536 },
    Reference { name: "enclosure", samples: 16_384 },
    Reference { name: "furnace", samples: 16_384 },
    Reference { name: "glass", samples: 16_384 },
    Reference { name: "layers", samples: 16_384 },
    Reference { name: "many-lights", samples: 8192 },
    Reference { name: "million", samples: 16_384 },
    Reference { name: "plates", samples: 16_384 },
    Reference { name: "shelf", samples: 16_384 },
];

/// A scene's reference, with its variance.
pub fn read_reference(name: &str) -> Estimate {
    let [mean, variance] = ["", "_var"].map(|suffix| read(&format!("tests/data/reference/{name}{suffix}.exr")));
    Estimate::of_reference(&mean, &variance)
}

fn read(path: &str) -> Picture {
    let set = |picture: &mut Picture, at: Vec2<usize>, (r, g, b, _): (f32, f32, f32, f32)| {
        picture.set(at.x() as u32, at.y() as u32, Rgb::new(r, g, b));
    };
    let new = |size: Vec2<usize>, _: &_| Picture::new(size.width() as u32, size.height() as u32);
    let image = read_first_rgba_layer_from_file(project(path), new, set).unwrap_or_else(|e| panic!("{path}: {e}"));
    image.layer_data.channel_data.pixels
}
