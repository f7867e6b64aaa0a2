//! Coverage by shifts and the update of the masked depth buffer (sections 3.1 and 3.2 of the paper).
//!
//! A row of tiles is as many rows of pixels as a vector has lanes. Each edge gives one event per row; the
//! greatest of the left and the least of the right events bound the row's run of covered pixels, so that a
//! tile takes two shifts whatever the number of edges is. (The paper shifts per edge and splits the triangle
//! at its middle vertex to save one; the fold costs one operation per row of tiles instead.)

use std::hint::black_box;

use crate::buffer::TILE_WIDTH;
use crate::clip::Polygon;
use crate::setup::{FAR_PX, Plane, Triangle};
use crate::simd::Simd;

/// Rows of tiles of a depth buffer, all or a band of them.
pub(crate) struct Band<'a> {
    pub words: &'a mut [u32],
    /// Tiles across.
    pub columns: i32,
    /// Rows of tiles, half-open.
    pub rows: [i32; 2],
    /// Of the whole image, pixels.
    pub size: [i32; 2],
}

/// Rows of tiles up to this many tiles wide are walked whole; in wider ones only from the first to the last
/// event.
const WALKED_WHOLE: i32 = 2;

/// Where the edges meet a row of pixels.
pub(crate) trait Events {
    /// The rightmost left edge and the leftmost right edge, pixels, at the centre of each lane's row.
    fn at<S: Simd>(&self, s: S, row: S::F) -> [S::F; 2];
    /// Between two rows, no greater than any of the left events and no less than any of the right ones.
    fn extremes<S: Simd>(&self, s: S, top: S::F, bottom: S::F) -> [S::F; 2];
}

/// A triangle whose middle vertex is right of its long edge.
pub(crate) struct MiddleRight<'a>(pub &'a Triangle);
/// A triangle whose middle vertex is left of its long edge.
pub(crate) struct MiddleLeft<'a>(pub &'a Triangle);

impl Events for MiddleRight<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, s: S, row: S::F) -> [S::F; 2] {
        let [long, upper, lower] = lines(s, self.0, row);
        [long, s.min(upper, lower)]
    }
    #[inline(always)]
    fn extremes<S: Simd>(&self, s: S, top: S::F, bottom: S::F) -> [S::F; 2] {
        let ([a, b, c], [d, e, f]) = (lines(s, self.0, top), lines(s, self.0, bottom));
        [s.min(a, d), s.min(s.max(b, e), s.max(c, f))]
    }
}

impl Events for MiddleLeft<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, s: S, row: S::F) -> [S::F; 2] {
        let [long, upper, lower] = lines(s, self.0, row);
        [s.max(upper, lower), long]
    }
    #[inline(always)]
    fn extremes<S: Simd>(&self, s: S, top: S::F, bottom: S::F) -> [S::F; 2] {
        let ([a, b, c], [d, e, f]) = (lines(s, self.0, top), lines(s, self.0, bottom));
        [s.max(s.min(b, e), s.min(c, f)), s.max(a, d)]
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
pub(crate) fn triangle<S: Simd>(s: S, band: &mut Band<'_>, it: &Triangle) {
    if it.middle_right {
        rows(s, band, it.rows, it.columns, &it.plane, &MiddleRight(it));
    } else {
        rows(s, band, it.rows, it.columns, &it.plane, &MiddleLeft(it));
    }
}

#[inline(always)]
pub(crate) fn polygon<S: Simd>(s: S, band: &mut Band<'_>, it: &Polygon) {
    rows(s, band, it.rows, it.columns, &it.plane, it);
}

/// Rasterizes the pixels between the left and right events of each row.
#[inline(always)]
fn rows<S: Simd>(
    s: S,
    band: &mut Band<'_>,
    rows: [i32; 2],
    columns: [i32; 2],
    plane: &Plane,
    events: &impl Events,
) {
    let lanes = S::LANES as i32;
    let [width, height] = band.size;
    let first_row = (rows[0] / lanes).max(band.rows[0]);
    let end_row = ((rows[1] - 1) / lanes + 1).min(band.rows[1]);
    let first_column = columns[0] / TILE_WIDTH as i32;
    let end_column = (columns[1] - 1) / TILE_WIDTH as i32 + 1;

    // Subtile of each lane, relative to its tile.
    let lane = s.lane_index();
    let three = s.splat_i(3);
    let subtile_x = s.mul(s.to_float(s.and(lane, three)), s.splat(8.0));
    let subtile_y = s.to_float(s.and_not(lane, three));
    let (dx, dy) = (s.splat(plane.dx), s.splat(plane.dy));
    let (corner, least) = (s.splat(plane.least_corner), s.splat(plane.least));
    let (first, last) = (s.splat_i(rows[0]), s.splat_i(rows[1] - 1));
    let (zero, full_width, width_px) = (s.splat(0.0), s.splat_i(width), s.splat(width as f32));
    // Past the right border all pixels count as the last one on it, so that tiles there can fill up; and
    // rows below the bottom as the last row.
    let everything = s.splat_i(band.columns * TILE_WIDTH as i32);
    let bottom = s.splat_i(height - 1);

    // Opaque: the compiler turns shifts of a known -1 into something slower.
    let ones = s.splat_i(black_box(-1));
    let wide = end_column - first_column > WALKED_WHOLE;
    let mut spans = [[0; 16]; 2];
    for tile_row in first_row..end_row {
        let (mut begin, mut end) = (first_column, end_column);
        if wide {
            let index = (tile_row - first_row) as usize % S::LANES;
            if index == 0 {
                spans = row_spans(s, rows, tile_row, width_px, events);
            }
            begin = begin.max(spans[0][index] as i32 / TILE_WIDTH as i32);
            end = end.min((spans[1][index] as i32 + TILE_WIDTH as i32 - 1) / TILE_WIDTH as i32);
        }
        if begin >= end {
            continue;
        }
        let top = tile_row * lanes;
        let row = s.min_i(s.add_i(lane, s.splat_i(top)), bottom);
        let [left, right] = events.at(s, s.to_float(row));
        let left = s.to_int(s.min(s.max(left, zero), width_px));
        let right = s.to_int(s.min(s.max(right, zero), width_px));
        let right = s.select_i(s.eq_i(right, full_width), everything, right);
        let right = s.drop(s.either(s.gt_i(first, row), s.gt_i(row, last)), right);
        let right = s.max_i(left, right);
        let depth_of_row = s.add(s.mul(dy, s.add(subtile_y, s.splat(top as f32))), corner);
        let begin_px = begin * TILE_WIDTH as i32;
        let mut x = s.add(subtile_x, s.splat(begin_px as f32));
        let mut left = s.sub_saturating(left, s.splat_i(begin_px));
        let mut right = s.sub_saturating(right, s.splat_i(begin_px));
        let tile_words = 3 * S::LANES;
        let row_start = (tile_row - band.rows[0]) * band.columns;
        let words =
            (row_start + begin) as usize * tile_words..(row_start + end) as usize * tile_words;
        for tile in band.words[words].chunks_exact_mut(tile_words) {
            let depth = s.max(s.add(s.mul(dx, x), depth_of_row), least);
            let run = s.xor(s.shl(ones, left), s.shl(ones, right));
            update(s, tile, depth, run);
            x = s.add(x, s.splat(TILE_WIDTH as f32));
            left = s.sub_saturating(left, s.splat_i(TILE_WIDTH as i32));
            right = s.sub_saturating(right, s.splat_i(TILE_WIDTH as i32));
        }
    }
}

/// The first and one past the last pixel that may be covered in each of `LANES` rows of tiles from
/// `tile_row`. An event is monotone in the row, so its extremes in a row of tiles are at the first and last of
/// the rows there; knowing them ahead keeps the walk over tiles from waiting for the events.
#[inline(always)]
fn row_spans<S: Simd>(
    s: S,
    rows: [i32; 2],
    tile_row: i32,
    width_px: S::F,
    events: &impl Events,
) -> [[u32; 16]; 2] {
    let lanes = S::LANES as i32;
    let zero = s.splat(0.0);
    let height = s.splat(lanes as f32);
    let tile_row = s.add(s.to_float(s.lane_index()), s.splat(tile_row as f32));
    let (first, last) = (s.splat(rows[0] as f32), s.splat((rows[1] - 1) as f32));
    let top = s.mul(tile_row, height);
    let bottom = s.min(s.add(top, s.splat((lanes - 1) as f32)), last);
    let [from, to] = events.extremes(s, s.max(top, first), bottom);
    let mut spans = [[0; 16]; 2];
    s.store(s.to_int(s.min(s.max(from, zero), width_px)), &mut spans[0]);
    s.store(s.to_int(s.min(s.max(to, zero), width_px)), &mut spans[1]);
    spans
}

/// `updateHiZBuffer` of the paper, in nearness: lane by lane, and only where the primitive covers pixels of
/// the subtile and is nearer than its reference layer (the hierarchical depth test).
///
/// Filling a lane with ones empties a layer; as the depth of a primitive it means that there is none. Such depths
/// are no number, so that nothing is farther or nearer, and the greatest of integers, so that they lose every
/// minimum. All other depths are positive, and their bits in the order of their values.
#[inline(always)]
fn update<S: Simd>(s: S, tile: &mut [u32], depth: S::F, run: S::I) {
    let (reference_words, tile) = tile.split_at_mut(S::LANES);
    let (working_words, open_words) = tile.split_at_mut(S::LANES);
    let reference = s.of_bits(s.load(reference_words));
    let nearer = s.lt(reference, depth);
    if s.mask_bits(nearer) == 0 {
        return;
    }
    let none = s.splat_i(0);
    let covered = s.keep(nearer, s.transpose_bytes(run));
    let depth = s.fill(s.eq_i(covered, none), s.bits(depth));

    // Discard the working layer if the primitive is farther from it than it is from the reference layer.
    let working = s.of_bits(s.load(working_words));
    let discard = s.lt(
        s.sub(working, reference),
        s.sub(s.of_bits(depth), working),
    );
    let working = s.min_u(s.fill(discard, s.bits(working)), depth);
    let open = s.and_not(s.fill(discard, s.load(open_words)), covered);
    let full = s.eq_i(open, none);
    let reference = s.select_i(full, working, s.bits(reference));
    s.store(reference, reference_words);
    s.store(s.fill(full, working), working_words);
    s.store(s.fill(full, open), open_words);
}
