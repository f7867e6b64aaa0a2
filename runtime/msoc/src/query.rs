//! Occlusion queries against the masked depth buffer.

use bytemuck::Zeroable;

use crate::buffer::{MaskedDepth, TILE_WIDTH};
use crate::options::Depth;
use crate::simd::{Kernel, Simd};
use crate::view::{LEAST_W, U, View};

/// What a query finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Visibility {
    /// In the view, and not known to be hidden.
    Visible,
    /// Behind the occluders wherever it is in the view.
    Occluded,
    /// Not in the view.
    Outside,
}

/// A rectangle of the screen and how near something in it comes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Least x and y in NDC, y up.
    pub min: [f32; 2],
    /// Greatest x and y in NDC.
    pub max: [f32; 2],
    /// View depth (w) of the nearest point; with [`Depth::Reversed`] and [`Depth::Standard`] 1 over its
    /// nearness.
    pub nearest_w: f32,
}

/// Pixels, both ends included, and nearness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PixelRect {
    pub min: [u32; 2],
    pub max: [u32; 2],
    pub nearest: f32,
}

/// Where something may be in the image: pixels touched, or an answer that needs no depth.
pub(crate) type Footprint = Result<PixelRect, Visibility>;

/// Bounds in NDC and nearness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub min: [f32; 2],
    pub max: [f32; 2],
    pub nearest: f32,
    /// 1 over the least w, for the error of clip space.
    pub inverse_w: f32,
}

/// The pixels that `bounds` touch.
#[inline(always)]
pub(crate) fn pixels<S: Simd>(s: S, view: &View, bounds: &Bounds) -> Footprint {
    let mut nearest = bounds.nearest * (1.0 + 16.0 * U);
    // Left, bottom, right, top, with y down.
    let ([x0, y0], [x1, y1]) = (bounds.min, bounds.max);
    let ndc = s.mul(
        s.repeat_four(&[x0, y0, x1, y1]),
        s.repeat_four(&[1.0, -1.0, 1.0, -1.0]),
    );
    let [half_x, half_y] = view.half;
    let mut edges = s.mul(
        s.add(ndc, s.splat(1.0)),
        s.repeat_four(&[half_x, half_y, half_x, half_y]),
    );
    if let Some(inner) = &view.inner {
        let reach = bounds
            .min
            .into_iter()
            .chain(bounds.max)
            .fold(1.0_f32, |most, v| most.max(v.abs()));
        let grow = inner.displacement_px((reach + 1.0) * view.longer_px(), bounds.inverse_w);
        edges = s.add(edges, s.repeat_four(&[-grow, grow, grow, -grow]));
        let [factor, absolute] = inner.depth_margin(view.depth, bounds.inverse_w);
        nearest = nearest * (2.0 - factor) + absolute;
    }
    let zero = s.splat(0.0);
    let [width, height] = view.size_px;
    let size = s.repeat_four(&[width, height, width, height]);
    // Just below 0, so that 0 is not.
    let before = s.splat(-f32::MIN_POSITIVE);
    let begins_before_end = s.mask_bits(s.lt(edges, size)) & 0b1001;
    let ends_after_start = s.mask_bits(s.lt(before, edges)) & 0b0110;
    let [last_x, last_y] = view.last_px;
    let last = s.repeat_four(&[last_x, last_y, last_x, last_y]);
    let [min_x, max_y, max_x, min_y] = four(s, s.to_int(s.min(s.max(edges, zero), last)));
    // False where anything is NaN.
    let is_in_view = begins_before_end | ends_after_start == 0b1111;
    if is_in_view && min_x <= max_x && min_y <= max_y && nearest > 0.0 {
        return Ok(PixelRect {
            min: [min_x, min_y],
            max: [max_x, max_y],
            nearest,
        });
    }
    let [within_x, within_y] = view.within_px;
    let within = s.repeat_four(&[within_x, within_y, within_x, within_y]);
    let ends_before_start = s.mask_bits(s.lt(edges, zero)) & 0b0110;
    let begins_after_end = s.mask_bits(s.lt(within, edges)) & 0b1001;
    Err(if ends_before_start | begins_after_end != 0 {
        Visibility::Outside
    } else {
        Visibility::Visible
    })
}

/// The first four lanes.
#[inline(always)]
fn four<S: Simd>(s: S, vector: S::I) -> [u32; 4] {
    let mut words = S::Words::zeroed();
    s.store(vector, words.as_mut());
    std::array::from_fn(|lane| words.as_ref()[lane])
}

/// The pixels of a rectangle given by a caller.
#[inline(always)]
pub(crate) fn rect_footprint<S: Simd>(s: S, view: &View, rect: &Rect) -> Footprint {
    let nearest = 1.0 / rect.nearest_w;
    let footprint = pixels(
        s,
        view,
        &Bounds {
            min: rect.min,
            max: rect.max,
            nearest,
            inverse_w: nearest,
        },
    )?;
    let in_front = rect.nearest_w > view.near;
    if in_front {
        Ok(footprint)
    } else {
        Err(Visibility::Visible)
    }
}

/// The pixels of the convex hull of points in clip space.
#[inline(always)]
pub(crate) fn hull_footprint<S: Simd>(s: S, view: &View, corners: &[[f32; 4]]) -> Footprint {
    if outside_frustum(view, corners) {
        return Err(Visibility::Outside);
    }
    let mut bounds = Bounds {
        min: [f32::INFINITY; 2],
        max: [f32::NEG_INFINITY; 2],
        nearest: 0.0,
        inverse_w: 0.0,
    };
    for corner in corners {
        let [x, y, _, w] = *corner;
        let n = view.numerator(*corner);
        // Written so that a NaN is not in front.
        let in_front = w > (view.near * n).max(LEAST_W);
        if !in_front {
            return Err(Visibility::Visible);
        }
        let inverse_w = 1.0 / w;
        for (axis, value) in [x * inverse_w, y * inverse_w].into_iter().enumerate() {
            bounds.min[axis] = bounds.min[axis].min(value);
            bounds.max[axis] = bounds.max[axis].max(value);
        }
        bounds.nearest = bounds.nearest.max(n * inverse_w);
        bounds.inverse_w = bounds.inverse_w.max(inverse_w);
    }
    pixels(s, view, &bounds)
}

/// Whether all corners are beyond one plane of the frustum, by more than `inner` allows them to move.
#[inline(always)]
fn outside_frustum(view: &View, corners: &[[f32; 4]]) -> bool {
    let (mut slack_per_w, mut error) = (8.0 * U, 0.0);
    if let Some(inner) = &view.inner {
        slack_per_w += (inner.step_px + 0.01) / view.half[0].min(view.half[1]);
        error = 2.0 * inner.clip_error;
    }
    let beyond = |distance: fn(&View, &[f32; 4]) -> f32| {
        let out = |c: &[f32; 4]| {
            distance(view, c) < -(slack_per_w * (c[3].abs() + c[0].abs() + c[1].abs()) + error)
        };
        corners.iter().all(out)
    };
    beyond(|_, c| c[3] - c[0])
        || beyond(|_, c| c[3] + c[0])
        || beyond(|_, c| c[3] - c[1])
        || beyond(|_, c| c[3] + c[1])
        || beyond(|view, c| match view.depth {
            Depth::InverseW => c[3] - view.near,
            Depth::Reversed | Depth::Standard => c[3] - view.numerator(*c),
        })
}

/// Finds the pixels of a convex hull.
#[derive(Clone, Copy)]
pub(crate) struct FindsHull<'a> {
    pub view: &'a View,
    pub corners: &'a [[f32; 4]; 8],
}

impl Kernel for FindsHull<'_> {
    type Output = Footprint;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Footprint {
        hull_footprint(s, self.view, self.corners)
    }
}

/// Finds the pixels of bounds.
#[derive(Clone, Copy)]
pub(crate) struct FindsBounds<'a> {
    pub view: &'a View,
    pub bounds: &'a Bounds,
}

impl Kernel for FindsBounds<'_> {
    type Output = Footprint;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Footprint {
        pixels(s, self.view, self.bounds)
    }
}

/// Asks about a rectangle given by a caller.
#[derive(Clone, Copy)]
pub(crate) struct AsksRect<'a> {
    pub view: &'a View,
    pub buffer: &'a MaskedDepth,
    pub rect: &'a Rect,
}

impl Kernel for AsksRect<'_> {
    type Output = Visibility;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Visibility {
        let buffer = self.buffer;
        match rect_footprint(s, self.view, self.rect) {
            Err(known) => known,
            Ok(rect) => AsksPixels { buffer, rect }.run(s),
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
        if self.is_hidden(s) {
            Visibility::Occluded
        } else {
            Visibility::Visible
        }
    }
}

/// Of a row of four subtiles, repeated for every row: those from one on, and those up to one.
const FROM: [u32; 4] = [0xFFFF_FFFF, 0xEEEE_EEEE, 0xCCCC_CCCC, 0x8888_8888];
const UP_TO: [u32; 4] = [0x1111_1111, 0x3333_3333, 0x7777_7777, 0xFFFF_FFFF];

impl AsksPixels<'_> {
    #[inline(always)]
    fn is_hidden<S: Simd>(&self, s: S) -> bool {
        let lanes = S::LANES as u32;
        let PixelRect { min, max, nearest } = self.rect;
        let nearest = s.splat(nearest);
        let stride = 3 * S::LANES;
        let row_stride = stride * self.buffer.tiles[0] as usize;
        let words = self.buffer.words();
        // Lanes, four to a row of subtiles, whose subtiles the rectangle touches: all in the tiles between,
        // some in the first and last of each row and column.
        let [first_column, last_column] = [min[0], max[0]].map(|x| (x / TILE_WIDTH) as usize);
        let [first_row, last_row] = [min[1], max[1]].map(|y| (y / lanes) as usize);
        let subtile = |x: u32| (x / 8 % 4) as usize;
        let (first_columns, last_columns) = (FROM[subtile(min[0])], UP_TO[subtile(max[0])]);
        let all = !0_u32 >> (32 - S::LANES);
        // Four lanes for each four rows of pixels.
        let first_rows = (!0 << (min[1] & (lanes - 4))) & all;
        let last_rows = (!0 >> (28 - (max[1] & (lanes - 4)))) & all;
        let first = first_row * row_stride + first_column * stride;
        let (right, down) = (last_column - first_column, last_row - first_row);
        // What is small: four tiles, some of which may be the same, without a loop, whose length nothing would predict.
        if right < 2 && down < 2 {
            let [left, right_columns] = ends(right == 0, first_columns, last_columns);
            let [top, bottom] = ends(down == 0, first_rows, last_rows);
            let (right, down) = (right * stride, down * row_stride);
            let starts = [first, first + right, first + down, first + right + down];
            let touched = [
                left & top,
                right_columns & top,
                left & bottom,
                right_columns & bottom,
            ];
            let mut seen = [0; 4];
            for (seen, (start, touched)) in seen.iter_mut().zip(starts.into_iter().zip(touched)) {
                let hidden =
                    s.mask_bits(s.lt(nearest, s.of_bits(s.load(&words[start..start + S::LANES]))));
                *seen = !hidden & touched;
            }
            if seen[0] | seen[1] | seen[2] | seen[3] == 0 {
                return true;
            }
            let columns = [first_column, last_column, first_column, last_column];
            let rows = [first_row, first_row, last_row, last_row];
            return !(0..4).any(|i| {
                let tile = &words[starts[i]..][..stride];
                seen[i] != 0 && self.rect.is_seen_in(tile, [columns[i], rows[i]], seen[i])
            });
        }
        for (row, tiles) in (first_row..=last_row).zip(words[first..].chunks(row_stride)) {
            let mut rows = all;
            if row == first_row {
                rows &= first_rows;
            }
            if row == last_row {
                rows &= last_rows;
            }
            let mut columns = first_columns;
            for (column, tile) in (first_column..=last_column).zip(tiles.chunks_exact(stride)) {
                if column == last_column {
                    columns &= last_columns;
                }
                let hidden = s.mask_bits(s.lt(nearest, s.of_bits(s.load(tile))));
                let seen = !hidden & rows & columns;
                if seen != 0 && self.rect.is_seen_in(tile, [column, row], seen) {
                    return false;
                }
                columns = !0;
            }
        }
        true
    }
}

/// What is touched in the first and last tile along an axis: nothing in the last if it is the first.
#[inline(always)]
fn ends(same: bool, first: u32, last: u32) -> [u32; 2] {
    let both = first & last;
    if same { [both, 0] } else { [first, last] }
}

impl PixelRect {
    /// Whether the working layer of the tile number `at` leaves some of this to be seen in any of the lanes `seen`,
    /// where the reference layer does.
    #[inline(never)]
    fn is_seen_in(&self, tile: &[u32], at: [usize; 2], mut seen: u32) -> bool {
        let lanes = tile.len() / 3;
        // Columns and rows of the tile that are asked about, a bit each.
        let [columns, rows] = [(0, TILE_WIDTH), (1, lanes as u32)].map(|(axis, side)| {
            let corner = at[axis] as u32 * side;
            let first = self.min[axis].saturating_sub(corner);
            let last = (self.max[axis] - corner).min(side - 1);
            (!0 << first) & (!0 >> (31 - last))
        });
        while seen != 0 {
            let lane = seen.trailing_zeros();
            seen &= seen - 1;
            let columns = columns >> (8 * (lane & 3)) & 0xFF;
            let rows = rows >> (lane & !3) & 0xF;
            // A row's bit becomes the lowest of its byte, and the byte the columns.
            let asked = ((rows * 0x0020_4081) & 0x0101_0101) * columns;
            let [working, open] = [1, 2].map(|layer| tile[layer * lanes + lane as usize]);
            // An empty working layer is open everywhere.
            if asked & open != 0 || self.nearest >= f32::from_bits(working) {
                return true;
            }
        }
        false
    }
}
