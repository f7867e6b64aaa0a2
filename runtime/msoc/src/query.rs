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
    let mut grow = 0.0;
    let mut nearest = bounds.nearest * (1.0 + 16.0 * U);
    if let Some(inner) = &view.inner {
        let reach = bounds
            .min
            .into_iter()
            .chain(bounds.max)
            .fold(1.0_f32, |most, v| most.max(v.abs()));
        grow = inner.displacement_px((reach + 1.0) * view.longer_px(), bounds.inverse_w);
        let [factor, absolute] = inner.depth_margin(view.depth, bounds.inverse_w);
        nearest = nearest * (2.0 - factor) + absolute;
    }
    // Left, bottom, right, top, with y down.
    let ([x0, y0], [x1, y1]) = (bounds.min, bounds.max);
    let ndc = s.mul(
        s.repeat_four(&[x0, y0, x1, y1]),
        s.repeat_four(&[1.0, -1.0, 1.0, -1.0]),
    );
    let [half_x, half_y] = view.half;
    let edges = s.add(
        s.mul(
            s.add(ndc, s.splat(1.0)),
            s.repeat_four(&[half_x, half_y, half_x, half_y]),
        ),
        s.repeat_four(&[-grow, grow, grow, -grow]),
    );
    // A NaN compares false and so is never outside.
    let zero = s.splat(0.0);
    let [within_x, within_y] = view.within_px;
    let within = s.repeat_four(&[within_x, within_y, within_x, within_y]);
    let ends_before = s.mask_bits(s.lt(edges, zero)) & 0b0110;
    let begins_beyond = s.mask_bits(s.lt(within, edges)) & 0b1001;
    if ends_before | begins_beyond != 0 {
        return Err(Visibility::Outside);
    }
    let [last_x, last_y] = view.last_px;
    let last = s.repeat_four(&[last_x, last_y, last_x, last_y]);
    let [left, bottom, right, top] = four(s, s.bits(edges)).map(f32::from_bits);
    let inside = s.to_int(s.min(s.max(edges, zero), last));
    let [min_x, max_y, max_x, min_y] = four(s, inside);
    let known = left <= right && top <= bottom && nearest < f32::INFINITY && nearest > 0.0;
    if known {
        Ok(PixelRect {
            min: [min_x, min_y],
            max: [max_x, max_y],
            nearest,
        })
    } else {
        Err(Visibility::Visible)
    }
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
        let columns = self.buffer.tiles[0];
        let words = self.buffer.words();
        let nearest_all = s.splat(nearest);
        // Lanes, four to a row of subtiles, whose subtiles the rectangle touches: all in the tiles between,
        // some in the first and last of each row and column.
        let (first_column, last_column) = (min[0] / TILE_WIDTH, max[0] / TILE_WIDTH);
        let (first_row, last_row) = (min[1] / lanes, max[1] / lanes);
        let subtile = |x: u32| (x / 8 % 4) as usize;
        let (first_columns, last_columns) = (FROM[subtile(min[0])], UP_TO[subtile(max[0])]);
        let all = !0_u32 >> (32 - S::LANES);
        // Four lanes for each four rows of pixels.
        let first_rows = (!0 << (min[1] & (lanes - 4))) & all;
        let last_rows = (!0 >> (28 - (max[1] & (lanes - 4)))) & all;
        let tile_at = |x: u32, y: u32| &words[(y * columns + x) as usize * 3 * S::LANES..];
        // What is small: four tiles, some of which may be the same, without a loop, whose length nothing would predict.
        if last_column - first_column < 2 && last_row - first_row < 2 {
            let [left, right] = ends(first_column == last_column, first_columns, last_columns);
            let [top, bottom] = ends(first_row == last_row, first_rows, last_rows);
            let corners = [
                (first_column, first_row, left & top),
                (last_column, first_row, right & top),
                (first_column, last_row, left & bottom),
                (last_column, last_row, right & bottom),
            ];
            let mut seen = 0_u64;
            for (i, (tile_x, tile_y, touched)) in corners.into_iter().enumerate() {
                let tile = tile_at(tile_x, tile_y);
                let hidden = s.mask_bits(s.lt(nearest_all, s.of_bits(s.load(tile))));
                seen |= u64::from(!hidden & touched) << (i * S::LANES);
            }
            while seen != 0 {
                let place = seen.trailing_zeros() as usize;
                seen &= seen - 1;
                let (tile_x, tile_y, _) = corners[place / S::LANES];
                let tile = tile_at(tile_x, tile_y);
                if self.is_seen::<S>(tile, [tile_x, tile_y], place % S::LANES) {
                    return false;
                }
            }
            return true;
        }
        for tile_y in first_row..=last_row {
            let mut rows = all;
            if tile_y == first_row {
                rows &= first_rows;
            }
            if tile_y == last_row {
                rows &= last_rows;
            }
            for tile_x in first_column..=last_column {
                let mut touched = rows;
                if tile_x == first_column {
                    touched &= first_columns;
                }
                if tile_x == last_column {
                    touched &= last_columns;
                }
                let tile = tile_at(tile_x, tile_y);
                let hidden = s.mask_bits(s.lt(nearest_all, s.of_bits(s.load(tile))));
                let mut seen = !hidden & touched;
                while seen != 0 {
                    let lane = seen.trailing_zeros() as usize;
                    seen &= seen - 1;
                    if self.is_seen::<S>(tile, [tile_x, tile_y], lane) {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// Whether the working layer of a subtile, whose reference layer hides nothing, leaves the rectangle to be seen.
    #[inline(always)]
    fn is_seen<S: Simd>(&self, tile: &[u32], [tile_x, tile_y]: [u32; 2], lane: usize) -> bool {
        let corner = [
            tile_x * TILE_WIDTH + 8 * (lane as u32 & 3),
            tile_y * S::LANES as u32 + (lane as u32 & !3),
        ];
        let asked = subtile_mask(&self.rect, corner);
        let working = f32::from_bits(tile[S::LANES + lane]);
        let open = tile[2 * S::LANES + lane];
        asked & open != 0 || self.rect.nearest >= working
    }
}

/// What is touched in the first and last tile along an axis: nothing in the last if it is the first.
#[inline(always)]
fn ends(same: bool, first: u32, last: u32) -> [u32; 2] {
    let both = first & last;
    if same { [both, 0] } else { [first, last] }
}

/// The pixels of a rectangle in the subtile at `corner`, which it touches.
#[inline(always)]
fn subtile_mask(rect: &PixelRect, corner: [u32; 2]) -> u32 {
    let first = |axis: usize| rect.min[axis].saturating_sub(corner[axis]);
    let last = |axis: usize, most: u32| (rect.max[axis] - corner[axis]).min(most);
    let row = (0xFF << first(0) & 0xFF) & (0xFF >> (7 - last(0, 7)));
    let rows = (!0 << (8 * first(1))) & (!0 >> (8 * (3 - last(1, 3))));
    (row * 0x0101_0101) & rows
}
