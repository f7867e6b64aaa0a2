//! Triangle setup: projection, culling, edges and depth plane of one triangle per lane.

use crate::options::Depth;
use crate::rasterize::Triangles;
use crate::simd::{MOST_LANES, Rows, Simd};
use crate::view::{GUARD, HORIZONTAL_PX, INTERPOLATION, LEAST_W, U, View};

/// Where a dropped edge is: left or right of everything.
pub(crate) const FAR_PX: f32 = 1e6;
/// Bounding box over (twice the) area from which on a sliver's depth plane is not trusted in f32.
const SLIVER: f32 = 4096.0;

/// Nearness per pixel from which on a depth plane is not trusted: far from where f32 ends.
pub(crate) const STEEPEST: f32 = 1e30;

/// A triangle ready to be rasterized. An edge is the line `x = x0 + slope (y - y0)`; rows and columns are
/// half-open. One edge, `long`, spans the rows of the other two and is on the other side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub long_x: f32,
    pub long_slope: f32,
    pub upper_x: f32,
    pub upper_slope: f32,
    pub lower_x: f32,
    pub lower_slope: f32,
    pub top_y: f32,
    pub middle_y: f32,
    /// By how much the middle vertex is right of the long edge, pixels.
    pub middle_right: f32,
    pub plane: Plane,
    pub rows: [i32; 2],
    pub columns: [i32; 2],
}

/// Least nearness of a primitive in an 8x4 subtile at (x, y): `max(dx x + (dy y + least_corner), least)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub dx: f32,
    pub dy: f32,
    pub least_corner: f32,
    pub least: f32,
}

const FIELDS: usize = 17;

/// One vector, large enough for any instruction set.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Lanes([u32; MOST_LANES]);

/// As many triangles as there are lanes.
pub(crate) struct Batch {
    fields: [Lanes; FIELDS],
    /// Bit per lane: to be rasterized.
    pub ready: u32,
    /// Bit per lane: crosses the near plane or the guard band.
    pub to_clip: u32,
}

impl Batch {
    #[inline(always)]
    pub fn triangle(&self, lane: usize) -> Triangle {
        let bits = |field: usize| self.fields[field].0[lane % MOST_LANES];
        let value = |field: usize| f32::from_bits(bits(field));
        Triangle {
            long_x: value(0),
            long_slope: value(1),
            upper_x: value(2),
            upper_slope: value(3),
            lower_x: value(4),
            lower_slope: value(5),
            top_y: value(6),
            middle_y: value(7),
            middle_right: value(8),
            plane: Plane {
                dx: value(9),
                dy: value(10),
                least_corner: value(11),
                least: value(12),
            },
            rows: [bits(13) as i32, bits(14) as i32],
            columns: [bits(15) as i32, bits(16) as i32],
        }
    }
}

/// Image coordinates of a corner of each lane's triangle.
struct Corner<S: Simd> {
    x: S::F,
    y: S::F,
    /// Nearness.
    d: S::F,
    inverse_w: S::F,
    too_near: S::M,
}

#[inline(always)]
fn project<S: Simd>(s: S, view: &View, [x, y, z, w]: [S::F; 4]) -> Corner<S> {
    let numerator = match view.depth {
        Depth::InverseW => s.splat(1.0),
        Depth::Reversed => z,
        Depth::Standard => s.sub(w, z),
    };
    let least_w = s.max(s.mul(s.splat(view.near), numerator), s.splat(LEAST_W));
    let inverse_w = s.div(s.splat(1.0), w);
    let x = s.mul(s.mul(x, inverse_w), s.splat(view.half[0]));
    let y = s.mul(s.mul(y, inverse_w), s.splat(view.half[1]));
    Corner {
        x: s.add(x, s.splat(view.centre[0])),
        y: s.sub(s.splat(view.centre[1]), y),
        d: s.mul(numerator, inverse_w),
        inverse_w,
        too_near: s.lt(w, least_w),
    }
}

#[inline(always)]
fn least<S: Simd>(s: S, v: [S::F; 3]) -> S::F {
    s.min(s.min(v[0], v[1]), v[2])
}

#[inline(always)]
fn greatest<S: Simd>(s: S, v: [S::F; 3]) -> S::F {
    s.max(s.max(v[0], v[1]), v[2])
}

/// `a b - c d`
#[inline(always)]
fn cross<S: Simd>(s: S, a: S::F, b: S::F, c: S::F, d: S::F) -> S::F {
    s.sub(s.mul(a, b), s.mul(c, d))
}

/// What [`crate::inner`] asks for; zero in [`crate::Mode::Paper`].
struct Margins<S: Simd> {
    /// Displacement of a vertex along each axis, pixels.
    step: S::F,
    /// Rounding of an event, pixels.
    across: S::F,
    /// Greatest coordinate that occurs, pixels.
    reach: S::F,
}

/// The margins; lowers the corners' nearness to what GPU arithmetic may find.
#[inline(always)]
fn margins<S: Simd>(s: S, view: &View, corners: &mut [Corner<S>; 3], extent: S::F) -> Margins<S> {
    let zero = s.splat(0.0);
    let Some(inner) = &view.inner else {
        return Margins {
            step: zero,
            across: zero,
            reach: zero,
        };
    };
    let [a, b, c] = corners;
    let inverse_w = greatest(s, [a.inverse_w, b.inverse_w, c.inverse_w]);
    let transform = s.mul(s.splat(2.0 * inner.clip_error), inverse_w);
    let [factor, absolute] = inner.depth_margins(s, view.depth, inverse_w);
    let interpolation = s.mul(s.splat(INTERPOLATION), greatest(s, [a.d, b.d, c.d]));
    let tolerance = s.add(absolute, interpolation);
    a.d = s.sub(s.mul(a.d, factor), tolerance);
    b.d = s.sub(s.mul(b.d, factor), tolerance);
    c.d = s.sub(s.mul(c.d, factor), tolerance);
    let reach = s.add(extent, s.splat(view.longer_px()));
    let rounding = s.splat(8.0 * U);
    let moved = s.mul(reach, s.add(rounding, transform));
    Margins {
        step: s.add(s.splat(inner.step_px), moved),
        across: s.mul(reach, rounding),
        reach,
    }
}

/// [`Plane`] per lane.
struct Planes<S: Simd> {
    dx: S::F,
    dy: S::F,
    least_corner: S::F,
    least: S::F,
    /// Twice the area; negative for triangles that are counter-clockwise as seen.
    area: S::F,
}

#[inline(always)]
fn planes<S: Simd>(
    s: S,
    view: &View,
    corners: &[Corner<S>; 3],
    bounds: S::F,
    margins: &Margins<S>,
) -> Planes<S> {
    let zero = s.splat(0.0);
    let [a, b, c] = corners;
    let (x1, x2) = (s.sub(b.x, a.x), s.sub(c.x, a.x));
    let (y1, y2) = (s.sub(b.y, a.y), s.sub(c.y, a.y));
    let (d1, d2) = (s.sub(b.d, a.d), s.sub(c.d, a.d));
    let area = cross(s, x1, y2, x2, y1);
    let trusted = s.lt(bounds, s.mul(s.abs(area), s.splat(SLIVER)));
    let over_area = s.div(s.splat(1.0), area);
    let dx = s.mul(cross(s, d1, y2, d2, y1), over_area);
    let dy = s.mul(cross(s, d2, x1, d1, x2), over_area);
    // False where a depth is no number: the rasterizer wants numbers.
    let moderate = s.lt(s.add(s.abs(dx), s.abs(dy)), s.splat(STEEPEST));
    let trusted = s.both(trusted, moderate);
    let (dx, dy) = (s.select(trusted, dx, zero), s.select(trusted, dy, zero));
    let d_min = least(s, [a.d, b.d, c.d]);
    let origin = s.sub(s.sub(a.d, s.mul(dx, a.x)), s.mul(dy, a.y));
    // Centres of a subtile's pixels: x + 1 to x + 8, y to y + 3.
    let corner_x = s.min(dx, s.mul(dx, s.splat(8.0)));
    let corner_y = s.min(zero, s.mul(dy, s.splat(3.0)));
    let mut least_corner = s.add(s.add(origin, corner_x), corner_y);
    if view.inner.is_some() {
        let d_max = greatest(s, [a.d, b.d, c.d]);
        let slope = s.add(s.abs(dx), s.abs(dy));
        let ratio = s.mul(bounds, over_area);
        let conditioning = s.mul(s.splat(64.0 * U), s.mul(ratio, ratio));
        let conditioning = s.mul(conditioning, s.sub(d_max, d_min));
        let largest = s.max(s.abs(d_min), s.abs(d_max));
        let reach = s.add(margins.reach, s.splat(64.0));
        let rounding = s.mul(s.splat(8.0 * U), s.add(largest, s.mul(slope, reach)));
        let moved = s.mul(slope, margins.step);
        let margin = s.add(s.add(moved, conditioning), rounding);
        least_corner = s.sub(least_corner, margin);
    }
    Planes {
        dx,
        dy,
        least_corner: s.select(trusted, least_corner, d_min),
        least: d_min,
        area,
    }
}

/// Puts the upper of two points first.
#[inline(always)]
fn order<S: Simd>(s: S, a: [S::F; 2], b: [S::F; 2]) -> [[S::F; 2]; 2] {
    let swap = s.lt(b[1], a[1]);
    [
        [s.select(swap, b[0], a[0]), s.select(swap, b[1], a[1])],
        [s.select(swap, a[0], b[0]), s.select(swap, a[1], b[1])],
    ]
}

#[inline(always)]
fn slope<S: Simd>(s: S, upper: [S::F; 2], lower: [S::F; 2]) -> S::F {
    s.div(s.sub(lower[0], upper[0]), s.sub(lower[1], upper[1]))
}

/// How far an event moves for an edge to move by `step` along each axis.
#[inline(always)]
fn inward<S: Simd>(s: S, slope: S::F, margins: &Margins<S>) -> S::F {
    let along = s.add(s.splat(1.0), s.abs(slope));
    s.add(s.mul(margins.step, along), margins.across)
}

/// One of the two edges at the middle vertex: x at the upper end, and slope.
#[inline(always)]
fn short_edge<S: Simd>(
    s: S,
    upper: [S::F; 2],
    lower: [S::F; 2],
    right: S::M,
    margins: &Margins<S>,
) -> [S::F; 2] {
    let dropped = s.lt(s.sub(lower[1], upper[1]), s.splat(HORIZONTAL_PX));
    let slope = slope(s, upper, lower);
    let by = inward(s, slope, margins);
    let x = s.select(right, s.sub(upper[0], by), s.add(upper[0], by));
    let far = s.select(right, s.splat(FAR_PX), s.splat(-FAR_PX));
    [
        s.select(dropped, far, x),
        s.select(dropped, s.splat(0.0), slope),
    ]
}

/// The first row whose pixel centres are below `y`, or one past the last.
#[inline(always)]
fn row_below<S: Simd>(s: S, view: &View, y: S::F) -> S::I {
    let y = s.min(s.max(y, s.splat(-1.0)), s.splat(view.size_px[1] - 1.0));
    s.to_int(s.add(y, s.splat(1.0)))
}

#[inline(always)]
fn column<S: Simd>(s: S, view: &View, x: S::F) -> S::I {
    s.to_int(s.min(s.max(x, s.splat(0.0)), s.splat(view.size_px[0])))
}

/// Sets triangles `from..from + count` up, at most as many as there are lanes and at least one.
#[inline(always)]
pub(crate) fn set_up<S: Simd, T: Triangles>(
    s: S,
    view: &View,
    triangles: &T,
    from: usize,
    count: usize,
) -> Batch {
    // Lanes past the end repeat the last triangle and are masked out.
    let mut corners = [
        project(
            s,
            view,
            s.transpose_rows(&At::<_, 0>(triangles, from, count - 1)),
        ),
        project(
            s,
            view,
            s.transpose_rows(&At::<_, 1>(triangles, from, count - 1)),
        ),
        project(
            s,
            view,
            s.transpose_rows(&At::<_, 2>(triangles, from, count - 1)),
        ),
    ];
    let present = (!0u32).checked_shl(count as u32).map_or(!0, |from| !from);

    let [a, b, c] = &corners;
    let any_near = s.mask_bits(s.either(s.either(a.too_near, b.too_near), c.too_near));
    let all_near = s.mask_bits(s.both(s.both(a.too_near, b.too_near), c.too_near));
    let (x, y) = ([a.x, b.x, c.x], [a.y, b.y, c.y]);
    let (x_min, x_max) = (least(s, x), greatest(s, x));
    let (y_min, y_max) = (least(s, y), greatest(s, y));
    let extent = s.max(
        s.max(s.abs(x_min), s.abs(x_max)),
        s.max(s.abs(y_min), s.abs(y_max)),
    );
    let bounds = s.mul(s.sub(x_max, x_min), s.sub(y_max, y_min));
    let margins = margins(s, view, &mut corners, extent);
    let planes = planes(s, view, &corners, bounds, &margins);

    // Edges, from top to bottom.
    let [a, b, c] = &corners;
    let [upper, lower] = order(s, [a.x, a.y], [b.x, b.y]);
    let [middle, bottom] = order(s, lower, [c.x, c.y]);
    let [top, middle] = order(s, upper, middle);
    let long_slope = slope(s, top, bottom);
    let at_middle = s.add(top[0], s.mul(long_slope, s.sub(middle[1], top[1])));
    let by_right = s.sub(middle[0], at_middle);
    let middle_right = s.lt(s.splat(0.0), by_right);
    let by = inward(s, long_slope, &margins);
    let long_x = s.select(middle_right, s.add(top[0], by), s.sub(top[0], by));
    let [upper_x, upper_slope] = short_edge(s, top, middle, middle_right, &margins);
    let [lower_x, lower_slope] = short_edge(s, middle, bottom, middle_right, &margins);

    // Rows and columns whose pixel centres are within the bounds.
    let margin = match view.inner {
        Some(_) => s.add(margins.step, s.splat(HORIZONTAL_PX)),
        None => s.splat(0.0),
    };
    let first_row = row_below(s, view, s.add(top[1], margin));
    let end_row = row_below(s, view, s.sub(bottom[1], margin));
    let (first_column, end_column) = (column(s, view, x_min), column(s, view, x_max));
    let some = s.both(s.gt_i(end_row, first_row), s.gt_i(end_column, first_column));
    let zero = s.splat(0.0);
    let has_area = s.lt(zero, s.abs(planes.area));
    let has_depth = s.lt(planes.least, s.splat(f32::INFINITY));
    let seen = s.both(s.both(some, has_area), has_depth);
    let mut seen = s.mask_bits(seen) & present;
    if view.cull_back_faces {
        seen &= s.mask_bits(s.lt(planes.area, zero));
    }
    let guard = s.splat(0.5 * (GUARD + 2.0) * view.longer_px());
    let inside_guard = s.mask_bits(s.lt(extent, guard));

    let mut batch = Batch {
        fields: [Lanes([0; MOST_LANES]); FIELDS],
        ready: seen & !any_near & inside_guard,
        to_clip: (any_near & !all_near & present) | (seen & !any_near & !inside_guard),
    };
    let values = [
        s.bits(long_x),
        s.bits(long_slope),
        s.bits(upper_x),
        s.bits(upper_slope),
        s.bits(lower_x),
        s.bits(lower_slope),
        s.bits(top[1]),
        s.bits(middle[1]),
        s.bits(by_right),
        s.bits(planes.dx),
        s.bits(planes.dy),
        s.bits(planes.least_corner),
        s.bits(planes.least),
        first_row,
        end_row,
        first_column,
        end_column,
    ];
    for (field, value) in batch.fields.iter_mut().zip(values) {
        s.store(value, &mut field.0);
    }
    batch
}

/// One corner of consecutive triangles: the triangles, the first, the last that there is from there.
struct At<'a, T, const CORNER: usize>(&'a T, usize, usize);

impl<T: Triangles, const CORNER: usize> Rows for At<'_, T, CORNER> {
    #[inline(always)]
    fn row(&self, lane: usize) -> &[f32; 4] {
        self.0.vertex(self.1 + lane.min(self.2), CORNER)
    }
}
