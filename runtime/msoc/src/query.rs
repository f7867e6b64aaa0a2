//! Occlusion queries against the masked depth buffer.

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
    pub min: [i32; 2],
    pub max: [i32; 2],
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
pub(crate) fn pixels(view: &View, bounds: &Bounds) -> Footprint {
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
    let x = |ndc: f32| (ndc + 1.0) * view.half[0];
    let y = |ndc: f32| (1.0 - ndc) * view.half[1];
    let [width, height] = view.size_px;
    let (left, right) = (x(bounds.min[0]) - grow, x(bounds.max[0]) + grow);
    let (top, bottom) = (y(bounds.max[1]) - grow, y(bounds.min[1]) + grow);
    // A NaN compares false and so is never outside.
    if right < 0.0 || left >= width || bottom < 0.0 || top >= height {
        return Err(Visibility::Outside);
    }
    let inside = |v: f32, most: f32| (v.max(0.0) as i32).min(most as i32 - 1);
    let rect = PixelRect {
        min: [inside(left, width), inside(top, height)],
        max: [inside(right, width), inside(bottom, height)],
        nearest,
    };
    let known = left <= right && top <= bottom && nearest < f32::INFINITY && nearest > 0.0;
    if known {
        Ok(rect)
    } else {
        Err(Visibility::Visible)
    }
}

/// The pixels of a rectangle given by a caller.
#[inline(always)]
pub(crate) fn rect_footprint(view: &View, rect: &Rect) -> Footprint {
    let nearest = 1.0 / rect.nearest_w;
    let footprint = pixels(
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
pub(crate) fn hull_footprint(view: &View, corners: &[[f32; 4]]) -> Footprint {
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
    pixels(view, &bounds)
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

/// Whether the buffer hides a rectangle.
#[derive(Clone, Copy)]
pub(crate) struct HidesRect<'a> {
    pub buffer: &'a MaskedDepth,
    pub rect: PixelRect,
}

impl Kernel for HidesRect<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let lanes = S::LANES as i32;
        let PixelRect { min, max, nearest } = self.rect;
        let columns = self.buffer.tiles[0] as i32;
        let words = self.buffer.words();
        let nearest_all = s.splat(nearest);
        // Lanes, four to a row of subtiles, whose subtiles the rectangle touches: all in the tiles between,
        // some in the first and last of each row and column.
        let whole = TILE_WIDTH as i32;
        let (first_column, last_column) = (min[0] / whole, max[0] / whole);
        let (first_row, last_row) = (min[1] / lanes, max[1] / lanes);
        let right_of = |x: i32| (0xF << ((x % whole) >> 3) & 0xF) * 0x1111_1111_u32;
        let left_of = |x: i32| (0xF >> (3 - ((x % whole) >> 3))) * 0x1111_1111_u32;
        let below = |y: i32| !0_u32 << (4 * ((y % lanes) >> 2));
        let above = |y: i32| !0_u32 >> (28 - 4 * ((y % lanes) >> 2));
        let (first_columns, last_columns) = (right_of(min[0]), left_of(max[0]));
        let (first_rows, last_rows) = (below(min[1]), above(max[1]));
        // Mostly the reference layer hides what is small. Without a loop, whose length nothing would predict: of four
        // tiles, some of which may be the same.
        if last_column - first_column < 2 && last_row - first_row < 2 {
            let all = !0_u32 >> (32 - S::LANES);
            let [left, right] = ends(first_column == last_column, first_columns, last_columns);
            let [top, bottom] = ends(first_row == last_row, first_rows & all, last_rows & all);
            let mut seen = 0;
            for (tile_y, rows) in [(first_row, top), (last_row, bottom)] {
                for (tile_x, columns_touched) in [(first_column, left), (last_column, right)] {
                    let tile = &words[(tile_y * columns + tile_x) as usize * 3 * S::LANES..];
                    let hidden = s.mask_bits(s.lt(nearest_all, s.of_bits(s.load(tile))));
                    seen |= !hidden & rows & columns_touched;
                }
            }
            if seen == 0 {
                return true;
            }
        }
        for tile_y in first_row..=last_row {
            let mut rows = !0_u32 >> (32 - S::LANES);
            if tile_y == first_row {
                rows &= first_rows;
            }
            if tile_y == last_row {
                rows &= last_rows;
            }
            let row = &words[(tile_y * columns) as usize * 3 * S::LANES..];
            for tile_x in first_column..=last_column {
                let mut touched = rows;
                if tile_x == first_column {
                    touched &= first_columns;
                }
                if tile_x == last_column {
                    touched &= last_columns;
                }
                let tile = &row[tile_x as usize * 3 * S::LANES..][..3 * S::LANES];
                let hidden = s.mask_bits(s.lt(nearest_all, s.of_bits(s.load(tile))));
                let mut seen = !hidden & touched;
                // The reference layer does not hide these: perhaps the working layer does.
                while seen != 0 {
                    let lane = seen.trailing_zeros() as usize;
                    seen &= seen - 1;
                    let corner = [
                        tile_x * TILE_WIDTH as i32 + 8 * (lane as i32 & 3),
                        tile_y * lanes + (lane as i32 & !3),
                    ];
                    let asked = subtile_mask(&self.rect, corner);
                    let working = f32::from_bits(tile[S::LANES + lane]);
                    let open = tile[2 * S::LANES + lane];
                    if asked & open != 0 || nearest >= working {
                        return false;
                    }
                }
            }
        }
        true
    }
}

/// What is touched in the first and last tile along an axis, which may be the same.
#[inline(always)]
fn ends(same: bool, first: u32, last: u32) -> [u32; 2] {
    let both = first & last;
    if same { [both, both] } else { [first, last] }
}

/// The pixels of a rectangle in the subtile at `corner`, which it touches.
#[inline(always)]
fn subtile_mask(rect: &PixelRect, corner: [i32; 2]) -> u32 {
    let first = |axis: usize| (rect.min[axis] - corner[axis]).max(0) as u32;
    let last = |axis: usize, most: i32| (rect.max[axis] - corner[axis]).min(most) as u32;
    let row = (0xFF << first(0) & 0xFF) & (0xFF >> (7 - last(0, 7)));
    let rows = (!0 << (8 * first(1))) & (!0 >> (8 * (3 - last(1, 3))));
    (row * 0x0101_0101) & rows
}
