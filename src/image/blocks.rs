//! Pictures of 8-bit colours in the order in which lookups read them.

/// Pixels across and down of a block.
const SIDE: u32 = 4;

/// Colours with opacity, in blocks of 4×4 pixels, row by row. A block is a line of the cache: the four pixels around a point
/// are on 1.6 of them in the mean, where they would be on 2.2 of pictures that lie row by row.
#[derive(Clone)]
pub(super) struct Blocks {
    /// How many there are in a row.
    across: usize,
    blocks: Vec<Block>,
}

/// Pixels row by row. What is beyond the picture's rim is black.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Block([[u8; 4]; (SIDE * SIDE) as usize]);

impl Blocks {
    /// From the samples of `channels` channels, 3 or 4, row by row; opaque if they do not say.
    pub(super) fn new(width: u32, channels: u32, samples: &[u8]) -> Self {
        let (width, channels) = (width as usize, channels as usize);
        let side = SIDE as usize;
        let (rows, across) = (samples.len() / (width * channels), width.div_ceil(side));
        let mut blocks = vec![Block([[0; 4]; _]); across * rows.div_ceil(side)];
        for (y, row) in samples.chunks_exact(width * channels).enumerate() {
            for (x, pixel) in row.chunks_exact(channels).enumerate() {
                let alpha = pixel.get(3).copied().unwrap_or(u8::MAX);
                blocks[y / side * across + x / side].0[y % side * side + x % side] =
                    [pixel[0], pixel[1], pixel[2], alpha];
            }
        }
        Self { across, blocks }
    }

    /// [`Self::pixel`] for the columns `x` of the row `y[0]`, and of the row `y[1]`.
    #[inline(always)]
    pub(super) fn four(&self, x: [u32; 2], y: [u32; 2]) -> [[[u8; 4]; 2]; 2] {
        [[self.pixel(x[0], y[0]), self.pixel(x[1], y[0])], [self.pixel(x[0], y[1]), self.pixel(x[1], y[1])]]
    }

    /// Red, green, blue and opacity of the pixel in column `x` of row `y`.
    #[inline(always)]
    pub(super) fn pixel(&self, x: u32, y: u32) -> [u8; 4] {
        let block = &self.blocks[(y / SIDE) as usize * self.across + (x / SIDE) as usize];
        block.0[(y % SIDE * SIDE + x % SIDE) as usize]
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.blocks[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_where_it_was() {
        for (width, height, channels) in [(1, 1, 3), (5, 3, 4), (4, 8, 3), (9, 1, 4)] {
            let samples: Vec<u8> = (0..width * height * channels).map(|i| i as u8).collect();
            let blocks = Blocks::new(width, channels, &samples);
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let first = (y * width + x) * channels;
                let alpha = if channels == 4 { first + 3 } else { u32::from(u8::MAX) };
                assert_eq!(blocks.pixel(x, y).map(u32::from), [first, first + 1, first + 2, alpha], "{x} {y}");
            }
        }
    }
}
