//! Coverage by shifts and the update of the masked depth buffer (sections 3.1 and 3.2 of the paper).
//!
//! A row of tiles is as many rows of pixels as a vector has lanes. Each edge gives one event per row; the
//! greatest of the left and the least of the right events bound the row's run of covered pixels, so that a
//! tile takes two shifts whatever the number of edges is. (The paper shifts per edge and splits the triangle
//! at its middle vertex to save one; the fold costs one operation per row of tiles instead.)

use std::hint::cold_path;

use bytemuck::Zeroable;

use crate::buffer::{TILE_WIDTH, Tile};
use crate::clip::Polygon;
use crate::options::MAX_SIDE;
use crate::setup::{FAR_PX, Plane, Triangle};
use crate::simd::Simd;

/// Rows of tiles of a depth buffer, all or a band of them.
pub(crate) struct Band<'a> {
    pub words: &'a mut [u32],
    /// Tiles across.
    pub columns: usize,
    /// The first row of tiles.
    pub first_row: usize,
    /// Of the whole image, pixels.
    pub size: [u32; 2],
}

/// A band to rasterize into, with what all triangles have in common.
pub(crate) struct Target<'a, S: Simd> {
    tiles: &'a mut [Tile<S>],
    columns: usize,
    /// Rows of tiles, half-open.
    rows: [usize; 2],
    /// Row in its tile of each lane's subtile.
    subtile_y: S::F,
    /// Row in its tile of each lane of coverage.
    lane: S::I,
    /// Top of as many rows of tiles as there are lanes, pixels.
    top: S::I,
    /// The bits of the width.
    width_px: S::I,
    /// The bits of the width with all of the last column of tiles.
    padded_px: S::I,
    /// The last row of pixels.
    bottom: S::I,
}

impl<'a, S: Simd> Target<'a, S> {
    #[inline(always)]
    pub fn new(s: S, band: Band<'a>) -> Self {
        let Band {
            words,
            columns,
            first_row,
            size: [width, height],
        } = band;
        let tiles: &mut [Tile<S>] = bytemuck::cast_slice_mut(words);
        let lane = s.lane_index();
        Self {
            columns,
            rows: [first_row, first_row + tiles.len() / columns],
            subtile_y: s.to_float(s.and_not(lane, s.splat_i(3))),
            lane,
            top: s.to_int(s.mul(s.to_float(lane), s.splat(S::LANES as f32))),
            width_px: s.bits(s.splat(width as f32)),
            padded_px: s.bits(s.splat((columns as u32 * TILE_WIDTH) as f32)),
            bottom: s.splat_i(height as i32 - 1),
            tiles,
        }
    }
}

/// Rows of tiles up to this many tiles wide are walked whole; in wider ones only from the first to the last
/// event.
const WALKED_WHOLE: u32 = 2;

/// Columns of subtiles in each column of tiles that an image may have, pixels.
static SUBTILE_X: [[f32; 4]; (MAX_SIDE / TILE_WIDTH) as usize] = {
    let mut x = [[0.0; 4]; (MAX_SIDE / TILE_WIDTH) as usize];
    let mut column = 0;
    while column < 4 * x.len() {
        x[column / 4][column % 4] = 8.0 * column as f32;
        column += 1;
    }
    x
};

/// Where the edges meet a row of pixels.
pub(crate) trait Events {
    /// The rightmost left edge and the leftmost right edge, pixels, at the centre of each lane's row.
    fn at<S: Simd>(&self, s: S, row: S::F) -> [S::F; 2];
    /// Between two rows, no greater than any of the left events and no less than any of the right ones.
    fn extremes<S: Simd>(&self, s: S, top: S::F, bottom: S::F) -> [S::F; 2];
}

/// Without a branch on where the middle vertex is: nothing would predict it.
impl Events for Triangle {
    #[inline(always)]
    fn at<S: Simd>(&self, s: S, row: S::F) -> [S::F; 2] {
        let [long, upper, lower] = lines(s, self, row);
        let right = s.lt(s.splat(0.0), s.splat(self.middle_right));
        [
            s.select(right, long, s.max(upper, lower)),
            s.select(right, s.min(upper, lower), long),
        ]
    }
    #[inline(always)]
    fn extremes<S: Simd>(&self, s: S, top: S::F, bottom: S::F) -> [S::F; 2] {
        let ([a, b, c], [d, e, f]) = (lines(s, self, top), lines(s, self, bottom));
        let right = s.lt(s.splat(0.0), s.splat(self.middle_right));
        let least = [s.min(a, d), s.max(s.min(b, e), s.min(c, f))];
        let greatest = [s.max(a, d), s.min(s.max(b, e), s.max(c, f))];
        [
            s.select(right, least[0], least[1]),
            s.select(right, greatest[1], greatest[0]),
        ]
    }
}

impl Events for Polygon {
    #[inline(always)]
    fn at<S: Simd>(&self, s: S, row: S::F) -> [S::F; 2] {
        let (mut left, mut right) = (s.splat(-FAR_PX), s.splat(FAR_PX));
        for edge in self.edges() {
            let event = line(s, edge.x, edge.y, edge.slope, row);
            if edge.right {
                right = s.min(right, event);
            } else {
                left = s.max(left, event);
            }
        }
        [left, right]
    }
    #[inline(always)]
    fn extremes<S: Simd>(&self, s: S, top: S::F, bottom: S::F) -> [S::F; 2] {
        let (mut left, mut right) = (s.splat(-FAR_PX), s.splat(FAR_PX));
        for edge in self.edges() {
            let a = line(s, edge.x, edge.y, edge.slope, top);
            let b = line(s, edge.x, edge.y, edge.slope, bottom);
            if edge.right {
                right = s.min(right, s.max(a, b));
            } else {
                left = s.max(left, s.min(a, b));
            }
        }
        [left, right]
    }
}

#[inline(always)]
fn line<S: Simd>(s: S, x: f32, y: f32, slope: f32, row: S::F) -> S::F {
    let down = s.sub(row, s.splat(y));
    s.add(s.mul(s.splat(slope), down), s.splat(x))
}

#[inline(always)]
fn lines<S: Simd>(s: S, it: &Triangle, row: S::F) -> [S::F; 3] {
    [
        line(s, it.long_x, it.top_y, it.long_slope, row),
        line(s, it.upper_x, it.top_y, it.upper_slope, row),
        line(s, it.lower_x, it.middle_y, it.lower_slope, row),
    ]
}

#[inline(always)]
pub(crate) fn triangle<S: Simd>(s: S, target: &mut Target<'_, S>, it: &Triangle) {
    rows(s, target, it.rows, it.columns, &it.plane, it);
}

#[inline(always)]
pub(crate) fn polygon<S: Simd>(s: S, target: &mut Target<'_, S>, it: &Polygon) {
    rows(s, target, it.rows, it.columns, &it.plane, it);
}

/// Rasterizes the pixels between the left and right events of each row.
///
/// Floats that are not negative are in the order of their bits, and no negative one is above them; so most
/// comparisons are of integers, for which CPUs have more units.
#[inline(always)]
fn rows<S: Simd>(
    s: S,
    target: &mut Target<'_, S>,
    rows: [i32; 2],
    columns: [i32; 2],
    plane: &Plane,
    events: &impl Events,
) {
    let first_row = (rows[0] as usize / S::LANES).max(target.rows[0]);
    let end_row = ((rows[1] - 1) as usize / S::LANES + 1).min(target.rows[1]);
    let columns = [
        columns[0] as u32 / TILE_WIDTH,
        (columns[1] - 1) as u32 / TILE_WIDTH + 1,
    ];
    let (lanes, lanes_px) = (s.splat_i(S::LANES as i32), s.splat(S::LANES as f32));
    let (zero, ones) = (s.splat_i(0), s.splat_i(-1));
    let tile_width = s.splat_i(TILE_WIDTH as i32);
    let (dx, dy) = (s.splat(plane.dx), s.splat(plane.dy));
    let (corner, least) = (s.splat(plane.least_corner), s.bits(s.splat(plane.least)));
    let (first, last) = (s.splat_i(rows[0]), s.splat_i(rows[1] - 1));

    let top = first_row * S::LANES;
    let mut row = s.add_i(target.lane, s.splat_i(top as i32));
    let mut subtile_y = s.add(target.subtile_y, s.splat(top as f32));
    let mut row_start = (first_row - target.rows[0]) * target.columns;
    let mut block = first_row;
    while block < end_row {
        let spans = spans(s, target, [first, last], block, columns, events);
        let count = (end_row - block).min(S::LANES);
        let [begin, end, begin_px] = spans.each_ref().map(|words| &words.as_ref()[..count]);
        for ((&begin, &end), &begin_px) in begin.iter().zip(end).zip(begin_px) {
            let tiles = row_start + begin as usize..row_start + end as usize;
            let at = s.min_i(row, target.bottom);
            let down = subtile_y;
            row = s.add_i(row, lanes);
            subtile_y = s.add(subtile_y, lanes_px);
            row_start += target.columns;
            let Some(tiles) = target.tiles.get_mut(tiles) else {
                continue;
            };
            // Past the right border all pixels count as the last one on it, so that tiles there can fill up;
            // and rows below the bottom as the last row.
            let [left, right] = events.at(s, s.to_float(at));
            let left = s.max_i(s.bits(left), zero);
            let right = s.max_i(s.bits(right), zero);
            let right = s.select_i(s.gt_i(target.width_px, right), right, target.padded_px);
            let outside = s.either(s.gt_i(first, at), s.gt_i(at, last));
            let right = s.drop(outside, right);
            let (left, right) = (s.to_int(s.of_bits(left)), s.to_int(s.of_bits(right)));
            let mut left = s.sub_saturating(left, s.splat_i(begin_px as i32));
            let mut right = s.sub_saturating(right, s.splat_i(begin_px as i32));
            let depth_of_row = s.add(s.mul(dy, down), corner);
            for (tile, x) in tiles.iter_mut().zip(&SUBTILE_X[begin as usize..]) {
                let x = s.repeat_four(x);
                let depth = s.bits(s.add(s.mul(dx, x), depth_of_row));
                let depth = s.max_i(depth, least);
                let run = s.and_not(s.shl(ones, left), s.shl(ones, right));
                update(s, tile, depth, run);
                left = s.sub_saturating(left, tile_width);
                right = s.sub_saturating(right, tile_width);
            }
        }
        block += S::LANES;
    }
}

/// For each of `LANES` rows of tiles from `block`: the first tile that may be covered, one past the last, and
/// the place of the first, pixels. An event is monotone in the row, so its extremes in a row
/// of tiles are at the first and last of the rows there; knowing them ahead keeps the walk over tiles from
/// waiting for the events.
#[inline(always)]
fn spans<S: Simd>(
    s: S,
    target: &Target<'_, S>,
    [first, last]: [S::I; 2],
    block: usize,
    columns: [u32; 2],
    events: &impl Events,
) -> [S::Words; 3] {
    let [mut begin, mut end] = columns.map(|column| s.splat_i(column as i32));
    if columns[1] - columns[0] > WALKED_WHOLE {
        let top = s.add_i(target.top, s.splat_i((block * S::LANES) as i32));
        let bottom = s.min_i(s.add_i(top, s.splat_i(S::LANES as i32 - 1)), last);
        let top = s.max_i(top, first);
        let [from, to] = events.extremes(s, s.to_float(top), s.to_float(bottom));
        let to_tile = s.splat(1.0 / TILE_WIDTH as f32);
        let up = s.splat((TILE_WIDTH - 1) as f32);
        let (first_column, end_column) = (s.to_float(begin), s.to_float(end));
        let (from, to) = (s.mul(from, to_tile), s.mul(s.add(to, up), to_tile));
        begin = s.to_int(s.min(s.max(from, first_column), end_column));
        end = s.to_int(s.min(s.max(to, first_column), end_column));
    }
    let begin_px = s.mul(s.to_float(begin), s.splat(TILE_WIDTH as f32));
    let mut spans = [S::Words::zeroed(); 3];
    for (words, values) in spans.iter_mut().zip([begin, end, s.to_int(begin_px)]) {
        s.store(values, words.as_mut());
    }
    spans
}

/// `updateHiZBuffer` of the paper, in nearness: lane by lane, and only where the primitive covers pixels of
/// the subtile and is nearer than its reference layer (the hierarchical depth test).
///
/// Filling a lane with ones empties a layer; as the depth of a primitive it means that there is none. Such depths
/// are no number, so that nothing is farther or nearer, and the greatest of integers, so that they lose every
/// minimum. All other depths are positive, and their bits in the order of their values.
#[inline(always)]
fn update<S: Simd>(s: S, tile: &mut Tile<S>, depth: S::I, run: S::I) {
    let [reference_words, working_words, open_words] = tile.each_mut().map(AsMut::as_mut);
    let reference = s.load(reference_words);
    let nearer = s.gt_i(depth, reference);
    if s.mask_bits(nearer) == 0 {
        cold_path();
        return;
    }
    let none = s.splat_i(0);
    let covered = s.keep(nearer, s.transpose_bytes(run));
    let depth = s.fill(s.eq_i(covered, none), depth);

    // Discard the working layer if the primitive is farther from it than it is from the reference layer.
    let working = s.load(working_words);
    let from_working = s.sub(s.of_bits(depth), s.of_bits(working));
    let from_reference = s.sub(s.of_bits(working), s.of_bits(reference));
    let discard = s.lt(from_reference, from_working);
    let working = s.min_u(s.fill(discard, working), depth);
    let open = s.and_not(s.fill(discard, s.load(open_words)), covered);
    let full = s.eq_i(open, none);
    s.store(s.select_i(full, working, reference), reference_words);
    s.store(s.fill(full, working), working_words);
    s.store(s.fill(full, open), open_words);
}
