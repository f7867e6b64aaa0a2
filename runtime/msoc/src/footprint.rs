//! What a query asks about: where in the image something may be, and how near.

use bytemuck::{Pod, Zeroable};

use crate::options::Depth;
use crate::simd::{Kernel, Rows, Simd};
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
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
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

/// Rectangles, a row of the floats of each from one of these on: left, bottom, right, top, w.
struct Floats<'a, const FROM: usize>(&'a [Rect]);

impl<const FROM: usize> Rows for Floats<'_, FROM> {
    #[inline(always)]
    fn row(&self, lane: usize) -> &[f32; 4] {
        let rect: &[f32; 5] = bytemuck::cast_ref(&self.0[lane]);
        rect[FROM..].first_chunk().expect("four of five")
    }
}

/// [`Footprint`] of as many rectangles as there are lanes.
pub(crate) struct Footprints<S: Simd> {
    pub min: [S::I; 2],
    pub max: [S::I; 2],
    pub nearest: S::F,
    /// Bit per lane: in the view and in front. What the others have for pixels means nothing.
    pub has_pixels: u32,
    /// Bit per lane, none of those with pixels.
    pub is_outside: u32,
}

/// As [`rect_footprint`] of each of `LANES` rectangles, operation by operation.
#[inline(always)]
pub(crate) fn rect_footprints<S: Simd>(s: S, view: &View, rects: &[Rect]) -> Footprints<S> {
    let [x0, y0, x1, y1] = s.transpose_rows(&Floats::<0>(rects));
    let [_, _, _, nearest_w] = s.transpose_rows(&Floats::<1>(rects));
    let (zero, one) = (s.splat(0.0), s.splat(1.0));
    let inverse_w = s.div(one, nearest_w);
    let mut nearest = s.mul(inverse_w, s.splat(1.0 + 16.0 * U));
    let [half_x, half_y] = view.half;
    let (half_x, half_y) = (s.splat(half_x), s.splat(half_y));
    let mut left = s.mul(s.add(x0, one), half_x);
    let mut right = s.mul(s.add(x1, one), half_x);
    let mut top = s.mul(s.sub(one, y1), half_y);
    let mut bottom = s.mul(s.sub(one, y0), half_y);
    if let Some(inner) = &view.inner {
        let reach = s.max(s.abs(x1), s.max(s.abs(y0), s.max(s.abs(x0), one)));
        let reach = s.max(s.abs(y1), reach);
        let extent = s.mul(s.add(reach, one), s.splat(view.longer_px()));
        let grow = inner.displacements_px(s, extent, inverse_w);
        left = s.sub(left, grow);
        right = s.add(right, grow);
        top = s.sub(top, grow);
        bottom = s.add(bottom, grow);
        let [factor, absolute] = inner.depth_margins(s, view.depth, inverse_w);
        nearest = s.add(s.mul(nearest, s.sub(s.splat(2.0), factor)), absolute);
    }
    let ([width, height], [last_x, last_y]) = (view.size_px, view.last_px);
    let (last_x, last_y) = (s.splat(last_x), s.splat(last_y));
    let min_x = s.to_int(s.min(s.max(left, zero), last_x));
    let max_x = s.to_int(s.min(s.max(right, zero), last_x));
    let min_y = s.to_int(s.min(s.max(top, zero), last_y));
    let max_y = s.to_int(s.min(s.max(bottom, zero), last_y));
    // Just below 0, so that 0 is not.
    let before = s.splat(-f32::MIN_POSITIVE);
    let begins = s.both(s.lt(left, s.splat(width)), s.lt(top, s.splat(height)));
    let ends = s.both(s.lt(before, right), s.lt(before, bottom));
    let is_mixed_up = s.either(s.gt_i(min_x, max_x), s.gt_i(min_y, max_y));
    // False where anything is NaN.
    let is_in_view = s.but_not(
        s.both(s.both(begins, ends), s.lt(zero, nearest)),
        is_mixed_up,
    );
    let is_in_front = s.lt(s.splat(view.near), nearest_w);
    let [within_x, within_y] = view.within_px;
    let begins_after_end = s.either(s.lt(s.splat(within_x), left), s.lt(s.splat(within_y), top));
    let ends_before_start = s.either(s.lt(right, zero), s.lt(bottom, zero));
    let is_beside = s.either(begins_after_end, ends_before_start);
    Footprints {
        min: [min_x, min_y],
        max: [max_x, max_y],
        nearest,
        has_pixels: s.mask_bits(s.both(is_in_view, is_in_front)),
        is_outside: s.mask_bits(s.but_not(is_beside, is_in_view)),
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
