//! What is asked about, in tiles of the masked depth buffer, and whether it is hidden there.

use bytemuck::Zeroable;

use crate::buffer::{MaskedDepth, TILE_WIDTH, Tile};
use crate::footprint::{Footprints, PixelRect};
use crate::sides::{COLUMNS, ROWS};
use crate::simd::Simd;

/// The tiles of a buffer.
#[derive(Clone, Copy)]
pub(crate) struct Tiles<'a, S: Simd> {
    /// Row after row.
    all: &'a [Tile<S>],
    /// How many there are in a row.
    across: usize,
}

impl<'a, S: Simd> Tiles<'a, S> {
    #[inline(always)]
    pub fn of(buffer: &'a MaskedDepth) -> Self {
        Self {
            all: buffer.in_tiles::<S>(),
            across: buffer.tiles[0] as usize,
        }
    }
}

/// Pixels of tiles.
pub(crate) struct Asked {
    /// Number of the first tile.
    tile: usize,
    /// To be added to it for the last one of the row.
    beside: usize,
    /// To be added to it for the first one of the last row.
    below: usize,
    /// First column and row in the first tile.
    from: [u32; 2],
    /// Last column and row from the start of that tile.
    up_to: [u32; 2],
    nearest: f32,
}

/// [`Asked`] of as many rectangles as there are lanes.
pub(crate) struct Batch<S: Simd> {
    tile: S::Words,
    beside: S::Words,
    below: S::Words,
    from: [S::Words; 2],
    up_to: [S::Words; 2],
    nearest: S::Words,
    /// Bit per lane: [`Asked::is_in_few`].
    pub in_few: u32,
}

impl<S: Simd> Batch<S> {
    /// As [`Asked::new`], lane by lane.
    #[inline(always)]
    pub fn new(s: S, tiles: Tiles<'_, S>, footprints: &Footprints<S>) -> Self {
        let ([min_x, min_y], [max_x, max_y]) = (footprints.min, footprints.max);
        let (in_width, in_height) = (
            s.splat_i(TILE_WIDTH as i32 - 1),
            s.splat_i(S::LANES as i32 - 1),
        );
        let up_to_x = s.sub_saturating(max_x, s.and_not(min_x, in_width));
        let up_to_y = s.sub_saturating(max_y, s.and_not(min_y, in_height));
        // Products of floats, which hold these numbers as they are: MAX_SIDE allows of a million tiles.
        let per_width = s.splat(1.0 / TILE_WIDTH as f32);
        let per_height = s.splat(1.0 / S::LANES as f32);
        let across = s.splat(tiles.across as f32);
        let row = s.to_int(s.mul(s.to_float(min_y), per_height));
        let more_rows = s.to_int(s.mul(s.to_float(up_to_y), per_height));
        let column = s.to_int(s.mul(s.to_float(min_x), per_width));
        let beside = s.to_int(s.mul(s.to_float(up_to_x), per_width));
        let row_start = s.to_int(s.mul(s.to_float(row), across));
        let below = s.to_int(s.mul(s.to_float(more_rows), across));
        let is_few_across = s.gt_i(s.splat_i(2), beside);
        let is_few_down = s.gt_i(s.splat_i(2), more_rows);
        Self {
            tile: stored(s, s.add_i(row_start, column)),
            beside: stored(s, beside),
            below: stored(s, below),
            from: [
                stored(s, s.and(min_x, in_width)),
                stored(s, s.and(min_y, in_height)),
            ],
            up_to: [stored(s, up_to_x), stored(s, up_to_y)],
            nearest: stored(s, s.bits(footprints.nearest)),
            in_few: s.mask_bits(s.both(is_few_across, is_few_down)),
        }
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> Asked {
        let ([from_x, from_y], [up_to_x, up_to_y]) = (&self.from, &self.up_to);
        Asked {
            tile: self.tile.as_ref()[lane] as usize,
            beside: self.beside.as_ref()[lane] as usize,
            below: self.below.as_ref()[lane] as usize,
            from: [from_x.as_ref()[lane], from_y.as_ref()[lane]],
            up_to: [up_to_x.as_ref()[lane], up_to_y.as_ref()[lane]],
            nearest: f32::from_bits(self.nearest.as_ref()[lane]),
        }
    }
}

impl Asked {
    #[inline(always)]
    pub fn new<S: Simd>(tiles: Tiles<'_, S>, rect: PixelRect) -> Self {
        let PixelRect { min, max, nearest } = rect;
        let [width, height] = [TILE_WIDTH, S::LANES as u32];
        let [column, row] = [min[0] / width, min[1] / height];
        let up_to = [max[0] - column * width, max[1] - row * height];
        Self {
            tile: row as usize * tiles.across + column as usize,
            beside: (up_to[0] / width) as usize,
            below: (up_to[1] / height) as usize * tiles.across,
            from: [min[0] % width, min[1] % height],
            up_to,
            nearest,
        }
    }

    /// In no more than two tiles across and two down.
    #[inline(always)]
    pub fn is_in_few<S: Simd>(&self, tiles: Tiles<'_, S>) -> bool {
        self.beside < 2 && self.below < 2 * tiles.across
    }

    /// In four tiles, some of which may be the same: without a branch that nothing would predict.
    #[inline(always)]
    pub fn is_hidden_in_few<S: Simd>(&self, s: S, tiles: Tiles<'_, S>) -> bool {
        let nearest = s.splat(self.nearest);
        let ([from_column, from_row], [up_to_column, up_to_row]) = (self.from, self.up_to);
        let columns = &COLUMNS.up_to[up_to_column as usize];
        let rows = &ROWS.up_to[up_to_row as usize];
        let left = s.and(
            in_columns(s, &COLUMNS.from[from_column as usize]),
            in_columns(s, &columns[0]),
        );
        let right = in_columns(s, &columns[1]);
        let top = s.and(
            s.load(&ROWS.from[from_row as usize]),
            s.load(&rows[..S::LANES]),
        );
        let bottom = s.load(&rows[S::LANES..]);
        let (first, below) = (self.tile, self.tile + self.below);
        let tile = |number: usize| &tiles.all[number];
        let seen = [
            seen_in(s, tile(first), s.and(left, top), nearest),
            seen_in(s, tile(first + self.beside), s.and(right, top), nearest),
            seen_in(s, tile(below), s.and(left, bottom), nearest),
            seen_in(s, tile(below + self.beside), s.and(right, bottom), nearest),
        ];
        !s.any(s.or(s.or(seen[0], seen[1]), s.or(seen[2], seen[3])))
    }

    /// In any number of tiles. Row after row, as a row ends most that can be seen; the working layers only where the
    /// reference layers leave something, as most are hidden by these.
    #[inline(always)]
    pub fn is_hidden<S: Simd>(&self, s: S, tiles: Tiles<'_, S>) -> bool {
        let nearest = s.splat(self.nearest);
        let ([from_column, from_row], [up_to_column, up_to_row]) = (self.from, self.up_to);
        let left = in_columns(s, &COLUMNS.from[from_column as usize]);
        let right = in_columns(s, &COLUMNS.up_to[(up_to_column % TILE_WIDTH) as usize][0]);
        let both = s.and(left, right);
        let ends = if self.beside == 0 {
            [both, both]
        } else {
            [left, right]
        };
        let beside = [left_out(s, ends[0]), left_out(s, ends[1])];
        let mut in_row = s.load(&ROWS.from[from_row as usize]);
        let bottom = s.load(&ROWS.up_to[up_to_row as usize % S::LANES]);
        let (mut first, last) = (self.tile, self.tile + self.below);
        loop {
            if first == last {
                in_row = s.and(in_row, bottom);
            }
            let row = &tiles.all[first..=first + self.beside];
            let least = s.or(left_out(s, in_row), least_reference(s, row, beside));
            let may_be_seen = s.mask_bits(s.gt_i(least, s.bits(nearest))) != all::<S>();
            if may_be_seen && s.any(s.and(in_row, seen_in_row(s, row, ends, nearest))) {
                return false;
            }
            if first >= last {
                return true;
            }
            in_row = s.splat_i(!0);
            first += tiles.across;
        }
    }
}

#[inline(always)]
fn stored<S: Simd>(s: S, vector: S::I) -> S::Words {
    let mut words = S::Words::zeroed();
    s.store(vector, words.as_mut());
    words
}

/// Every lane's bit of [`Simd::mask_bits`].
const fn all<S: Simd>() -> u32 {
    (1 << S::LANES) - 1
}

/// Bits of the greatest f32 of all if taken as an integer: no depth is above it.
const FARTHEST: i32 = i32::MAX;

/// [`FARTHEST`] in the lanes of which no pixel is asked about, 0 in the others.
#[inline(always)]
fn left_out<S: Simd>(s: S, asked: S::I) -> S::I {
    s.keep(s.eq_i(asked, s.splat_i(0)), s.splat_i(FARTHEST))
}

/// The least of the reference layers, as bits, in each lane: those of depths are in the order of depths. Of the first and
/// of the last tile, which may be one, but for the lanes `beside`.
#[inline(always)]
fn least_reference<S: Simd>(s: S, tiles: &[Tile<S>], beside: [S::I; 2]) -> S::I {
    let last = tiles.len() - 1;
    let mut least = s.min_i(
        s.or(beside[0], s.load(tiles[0][0].as_ref())),
        s.or(beside[1], s.load(tiles[last][0].as_ref())),
    );
    for tile in tiles.iter().take(last).skip(1) {
        least = s.min_i(least, s.load(tile[0].as_ref()));
    }
    least
}

/// Rows of subtiles that are alike.
#[inline(always)]
fn in_columns<S: Simd>(s: S, four: &[u32; 4]) -> S::I {
    s.bits(s.repeat_four(bytemuck::cast_ref(four)))
}

/// What tiles leave to be seen at `nearest`, together: of the first and of the last, which may be one, the pixels
/// `ends`, of those between all.
#[inline(always)]
fn seen_in_row<S: Simd>(s: S, tiles: &[Tile<S>], ends: [S::I; 2], nearest: S::F) -> S::I {
    let last = tiles.len() - 1;
    let mut seen = s.or(
        seen_in(s, &tiles[0], ends[0], nearest),
        seen_in(s, &tiles[last], ends[1], nearest),
    );
    for tile in tiles.iter().take(last).skip(1) {
        seen = s.or(seen, seen_in(s, tile, s.splat_i(!0), nearest));
    }
    seen
}

/// The pixels of `asked` that both layers of a tile leave to be seen at `nearest`.
#[inline(always)]
fn seen_in<S: Simd>(s: S, tile: &Tile<S>, asked: S::I, nearest: S::F) -> S::I {
    let [reference, working, open] = tile;
    let hidden = s.lt(nearest, s.of_bits(s.load(reference.as_ref())));
    // So it is where the working layer is empty.
    let in_front = s.not_lt(nearest, s.of_bits(s.load(working.as_ref())));
    let seen = s.fill(in_front, s.load(open.as_ref()));
    s.and(s.drop(hidden, seen), asked)
}
