//! A texture that a light shows.

use crate::spectrum::Rgb;
use crate::texture::{TexturePoint, Textures};
use glam::Vec2;
use std::sync::Arc;

/// A texture of a table, as amounts of light. Values below zero are none.
#[derive(Clone, Debug)]
pub struct Slide {
    textures: Arc<Textures>,
    index: u32,
    /// A bound of every channel.
    largest: f32,
}

impl Slide {
    /// Of the texture `index`, none of whose channels is larger than `largest` anywhere.
    pub fn new(textures: &Arc<Textures>, index: u32, largest: f32) -> Self {
        Self { textures: textures.clone(), index, largest }
    }

    /// A bound of every channel.
    pub fn largest(&self) -> f32 {
        self.largest
    }

    /// Width over height of its picture.
    pub fn aspect(&self) -> f64 {
        let (width, height) = self.textures.resolution(self.index);
        f64::from(width) / f64::from(height)
    }

    /// What it is at a point of a surface.
    pub fn at(&self, point: &TexturePoint<'_>) -> Rgb {
        self.textures.colour(self.index, point).map(|c| c.max(0.0))
    }

    /// What it is at these coordinates where there is no surface.
    pub fn colour(&self, uv: Vec2) -> Rgb {
        self.at(&TexturePoint::new(uv))
    }

    /// The mean over the unit square: of a picture that fills it, of its pixels.
    pub fn mean(&self) -> [f64; 3] {
        /// Rows and columns of points where there are no pixels.
        const GRID: u32 = 256;
        let (width, height) = match self.textures.resolution(self.index) {
            (1, 1) => (GRID, GRID),
            size => size,
        };
        let middle = |i: u32, size: u32| (f64::from(i) + 0.5) / f64::from(size);
        let mut sum = [0.0; 3];
        for y in 0..height {
            for x in 0..width {
                let colour = self.colour(Vec2::new(middle(x, width) as f32, middle(y, height) as f32)).to_array();
                sum = [0, 1, 2].map(|i| sum[i] + f64::from(colour[i]));
            }
        }
        sum.map(|s| s / (f64::from(width) * f64::from(height)))
    }
}
