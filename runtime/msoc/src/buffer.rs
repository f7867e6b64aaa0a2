//! The masked hierarchical depth buffer (section 3.2 of the paper).
//!
//! Depth here is *nearness* `d`: 1/w in a perspective view, so that nearer is larger, 0 is infinitely far, and
//! `d` is affine in the image. The paper's `Zmax` of a layer is the least `d` of it.
//!
//! A tile is 32 pixels wide and as high as a vector has lanes. It is stored as three vectors, one lane per
//! subtile of 8x4 pixels: the reference layer's depth, the working layer's depth, and the pixels that are open,
//! that is, not covered by the working layer. An empty working layer is all ones in both: a depth of no number,
//! above all others as an integer, and every pixel open.
//! Lane `4 (y / 4) + x / 8` is the subtile of the tile's pixel (x, y), and bit `8 (y % 4) + x % 8` the pixel.

use bytemuck::{Pod, Zeroable};

use crate::simd::Simd;

/// Tile width in pixels: the bits of a lane, one row of coverage.
pub(crate) const TILE_WIDTH: u32 = 32;

/// A tile's reference depth, working depth and open pixels.
pub(crate) type Tile<S> = [<S as Simd>::Words; 3];

/// A tile of 16 lanes, or two of 8: whole cache lines.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
struct Lines([u32; 48]);

#[derive(Clone, Debug)]
pub(crate) struct MaskedDepth {
    pub size: [u32; 2],
    /// Tiles across and down.
    pub tiles: [u32; 2],
    lanes: usize,
    word_count: usize,
    lines: Vec<Lines>,
}

impl MaskedDepth {
    pub fn new(size: [u32; 2], lanes: usize) -> Self {
        let tiles = [size[0].div_ceil(TILE_WIDTH), size[1].div_ceil(lanes as u32)];
        let word_count = tiles[0] as usize * tiles[1] as usize * 3 * lanes;
        let mut buffer = Self {
            size,
            tiles,
            lanes,
            word_count,
            lines: vec![Lines([0; 48]); word_count.div_ceil(48)],
        };
        buffer.clear();
        buffer
    }

    /// Everything infinitely far.
    pub fn clear(&mut self) {
        let lanes = self.lanes;
        for tile in self.words_mut().chunks_exact_mut(3 * lanes) {
            tile[..lanes].fill(0);
            tile[lanes..].fill(!0);
        }
    }

    /// Tile after tile, row after row.
    #[inline]
    pub fn words(&self) -> &[u32] {
        &bytemuck::cast_slice(&self.lines)[..self.word_count]
    }

    /// Tile after tile, for the lanes that this was made for; after the last there may be one that is none.
    #[inline(always)]
    pub fn in_tiles<S: Simd>(&self) -> &[Tile<S>] {
        debug_assert_eq!(self.lanes, S::LANES);
        bytemuck::cast_slice(&self.lines)
    }

    /// As [`Self::words`].
    pub fn words_mut(&mut self) -> &mut [u32] {
        &mut bytemuck::cast_slice_mut(&mut self.lines)[..self.word_count]
    }

    /// Words of a row of tiles.
    pub fn row_words(&self) -> usize {
        self.tiles[0] as usize * 3 * self.lanes
    }

    /// The depth that the buffer vouches for at a pixel, row 0 at the top.
    pub fn pixel(&self, [x, y]: [u32; 2]) -> f32 {
        let lanes = self.lanes as u32;
        let tile = (y / lanes * self.tiles[0] + x / TILE_WIDTH) as usize;
        let tile = &self.words()[tile * 3 * self.lanes..];
        let (x, y) = (x % TILE_WIDTH, y % lanes);
        let lane = (4 * (y / 4) + x / 8) as usize;
        let open = tile[2 * self.lanes + lane] >> (8 * (y % 4) + x % 8) & 1 == 1;
        f32::from_bits(tile[lane + if open { 0 } else { self.lanes }])
    }
}
