//! Occlusion queries against the masked depth buffer.

use crate::buffer::{MaskedDepth, TILE_WIDTH, Tile};
use crate::footprint::{PixelRect, Rect, Visibility, rect_footprint};
use crate::simd::{Kernel, Simd};
use crate::view::View;

/// Asks about a rectangle given by a caller.
#[derive(Clone, Copy)]
pub(crate) struct AsksRect<'a> {
    pub view: &'a View,
    pub buffer: &'a MaskedDepth,
    pub rect: &'a Rect,
}

impl Kernel for AsksRect<'_> {
    /// Or the pixels, if they are many: what asks about those would cost the others registers.
    type Output = Result<Visibility, PixelRect>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let rect = match rect_footprint(s, self.view, self.rect) {
            Err(known) => return Ok(known),
            Ok(rect) => rect,
        };
        let buffer = self.buffer;
        let asks = AsksPixels { buffer, rect };
        let tiles = asks.tiles::<S>();
        if tiles.are_few() {
            Ok(answer(asks.are_hidden_in_few(s, &tiles)))
        } else {
            Err(rect)
        }
    }
}

/// Asks about pixels.
#[derive(Clone, Copy)]
pub(crate) struct AsksPixels<'a> {
    pub buffer: &'a MaskedDepth,
    pub rect: PixelRect,
}

impl Kernel for AsksPixels<'_> {
    type Output = Visibility;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Visibility {
        let tiles = self.tiles::<S>();
        answer(if tiles.are_few() {
            self.are_hidden_in_few(s, &tiles)
        } else {
            self.are_hidden_in(s, &tiles)
        })
    }
}

#[inline(always)]
fn answer(hidden: bool) -> Visibility {
    if hidden {
        Visibility::Occluded
    } else {
        Visibility::Visible
    }
}

/// Tiles that pixels touch.
struct Tiles {
    /// The first column and row.
    first: [u32; 2],
    /// From there to the last.
    more: [u32; 2],
}

impl Tiles {
    /// No more than two across and two down.
    #[inline(always)]
    fn are_few(&self) -> bool {
        self.more[0] < 2 && self.more[1] < 2
    }

    /// Number of the first in a buffer with `across` of them in a row.
    #[inline(always)]
    fn start(&self, across: usize) -> usize {
        self.first[1] as usize * across + self.first[0] as usize
    }
}

impl AsksPixels<'_> {
    #[inline(always)]
    fn tiles<S: Simd>(&self) -> Tiles {
        let PixelRect { min, max, .. } = self.rect;
        let first = [min[0] / TILE_WIDTH, min[1] / S::LANES as u32];
        let last = [max[0] / TILE_WIDTH, max[1] / S::LANES as u32];
        let more = [last[0] - first[0], last[1] - first[1]];
        Tiles { first, more }
    }

    /// In four tiles, some of which may be the same: without a branch that nothing would predict.
    #[inline(always)]
    fn are_hidden_in_few<S: Simd>(&self, s: S, tiles: &Tiles) -> bool {
        let PixelRect { min, max, nearest } = self.rect;
        let nearest = s.splat(nearest);
        let [column, row] = tiles.first;
        let [from_column, up_to_column] =
            [min[0], max[0]].map(|x| (x - column * TILE_WIDTH) as usize);
        let [from_row, up_to_row] = [min[1], max[1]].map(|y| (y - row * S::LANES as u32) as usize);
        let (columns, rows) = (&COLUMNS.up_to[up_to_column], &ROWS.up_to[up_to_row]);
        let left = s.and(
            in_columns(s, &COLUMNS.from[from_column]),
            in_columns(s, &columns[0]),
        );
        let right = in_columns(s, &columns[1]);
        let top = s.and(s.load(&ROWS.from[from_row]), s.load(&rows[..S::LANES]));
        let bottom = s.load(&rows[S::LANES..]);
        let across = self.buffer.tiles[0] as usize;
        let first = tiles.start(across);
        let beside = first + tiles.more[0] as usize;
        let down = tiles.more[1] as usize * across;
        let tiles = self.buffer.in_tiles::<S>();
        let seen = [
            seen_in::<S, true>(s, &tiles[first], s.and(left, top), nearest),
            seen_in::<S, true>(s, &tiles[beside], s.and(right, top), nearest),
            seen_in::<S, true>(s, &tiles[first + down], s.and(left, bottom), nearest),
            seen_in::<S, true>(s, &tiles[beside + down], s.and(right, bottom), nearest),
        ];
        !s.any(s.or(s.or(seen[0], seen[1]), s.or(seen[2], seen[3])))
    }

    /// In any number of tiles. Row after row, as a row ends most that can be seen; the working layers only where the
    /// reference layers leave something, as most are hidden by these.
    #[inline(always)]
    fn are_hidden_in<S: Simd>(&self, s: S, tiles: &Tiles) -> bool {
        let PixelRect { min, max, nearest } = self.rect;
        let nearest = s.splat(nearest);
        let [from_column, up_to_column] = [min[0], max[0]].map(|x| (x % TILE_WIDTH) as usize);
        let [from_row, up_to_row] = [min[1], max[1]].map(|y| (y % S::LANES as u32) as usize);
        let left = in_columns(s, &COLUMNS.from[from_column]);
        let right = in_columns(s, &COLUMNS.up_to[up_to_column][0]);
        let mut in_row = s.load(&ROWS.from[from_row]);
        let bottom = s.load(&ROWS.up_to[up_to_row]);
        let [last, down] = tiles.more.map(|more| more as usize);
        let both = s.and(left, right);
        let ends = if last == 0 {
            [both, both]
        } else {
            [left, right]
        };
        let across = self.buffer.tiles[0] as usize;
        let rows = self.buffer.in_tiles::<S>()[tiles.start(across)..].chunks(across);
        for (row, tiles) in (0..=down).zip(rows) {
            if row == down {
                in_row = s.and(in_row, bottom);
            }
            let tiles = &tiles[..=last];
            if s.any(s.and(in_row, seen_in_row::<S, false>(s, tiles, ends, nearest)))
                && s.any(s.and(in_row, seen_in_row::<S, true>(s, tiles, ends, nearest)))
            {
                return false;
            }
            in_row = s.splat_i(!0);
        }
        true
    }
}

/// Rows of subtiles that are alike.
#[inline(always)]
fn in_columns<S: Simd>(s: S, four: &[u32; 4]) -> S::I {
    s.bits(s.repeat_four(bytemuck::cast_ref(four)))
}

/// What tiles leave to be seen at `nearest`, together: of the first and of the last, which may be one, the pixels
/// `ends`, of those between all.
#[inline(always)]
fn seen_in_row<S: Simd, const BY_BOTH_LAYERS: bool>(
    s: S,
    tiles: &[Tile<S>],
    ends: [S::I; 2],
    nearest: S::F,
) -> S::I {
    let last = tiles.len() - 1;
    let mut seen = s.or(
        seen_in::<S, BY_BOTH_LAYERS>(s, &tiles[0], ends[0], nearest),
        seen_in::<S, BY_BOTH_LAYERS>(s, &tiles[last], ends[1], nearest),
    );
    for tile in tiles.get(1..last).unwrap_or(&[]) {
        let of_tile = seen_in::<S, BY_BOTH_LAYERS>(s, tile, s.splat_i(!0), nearest);
        seen = s.or(seen, of_tile);
    }
    seen
}

/// The pixels of `asked` that the layers of a tile, or the reference layer alone, leave to be seen at `nearest`.
#[inline(always)]
fn seen_in<S: Simd, const BY_BOTH_LAYERS: bool>(
    s: S,
    tile: &Tile<S>,
    asked: S::I,
    nearest: S::F,
) -> S::I {
    let [reference, working, open] = tile;
    let hidden = s.lt(nearest, s.of_bits(s.load(reference.as_ref())));
    if !BY_BOTH_LAYERS {
        return s.drop(hidden, asked);
    }
    // False where the working layer is empty.
    let covered = s.lt(nearest, s.of_bits(s.load(working.as_ref())));
    let closed = s.and_not(s.fill(covered, s.splat_i(0)), s.load(open.as_ref()));
    s.drop(hidden, s.and_not(asked, closed))
}

/// Pixels of subtiles that are on one side of a row or column, which is among them.
struct Sides<From, UpTo> {
    /// In a tile, from each on.
    from: From,
    /// In two tiles, up to each.
    up_to: UpTo,
}

/// Rows of tiles of 16 lanes. For tiles of 8 the first half of rows and lanes is the same: one tile of `from`, two of `up_to`.
const ROWS: &Sides<[[u32; 16]; 16], [[u32; 32]; 32]> = &{
    let mut sides = Sides {
        from: [[0; 16]; 16],
        up_to: [[0; 32]; 32],
    };
    let mut at = 0;
    while at < 32 * 32 {
        let (row, lane) = (at / 32, at % 32);
        let first_row = lane & !3;
        if row < 16 && lane < 16 {
            sides.from[row][lane] = pixels_of(0xFF, (!0 << row) >> first_row);
        }
        sides.up_to[row][lane] = pixels_of(0xFF, (!0 >> (31 - row)) >> first_row);
        at += 1;
    }
    sides
};

/// Columns; of two tiles, a row of subtiles in each.
const COLUMNS: &Sides<[[u32; 4]; 32], [[[u32; 4]; 2]; 64]> = &{
    let mut sides = Sides {
        from: [[0; 4]; 32],
        up_to: [[[0; 4]; 2]; 64],
    };
    let mut at = 0;
    while at < 64 * 8 {
        let (column, lane) = (at / 8, at % 8);
        if column < 32 && lane < 4 {
            sides.from[column][lane] = pixels_of((!0 << column) >> (8 * lane), 0xF);
        }
        let columns = (!0_u64 >> (63 - column)) >> (8 * lane);
        sides.up_to[column][lane / 4][lane % 4] = pixels_of(columns as u32, 0xF);
        at += 1;
    }
    sides
};

/// The pixels of a subtile in some of its eight columns and four rows.
const fn pixels_of(columns: u32, rows: u32) -> u32 {
    let mut pixels = 0;
    let mut row = 0;
    while row < 4 {
        if rows >> row & 1 == 1 {
            pixels |= (columns & 0xFF) << (8 * row);
        }
        row += 1;
    }
    pixels
}
