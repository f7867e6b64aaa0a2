//! Near clipping: triangles that cross the near plane or the guard band, one at a time, in f64.

use crate::setup::{FAR_PX, Plane, STEEPEST};
use crate::view::{GUARD, HORIZONTAL_PX, INTERPOLATION, LEAST_W, U, View};

/// Three vertices and one more per plane: near, w > 0, four of the guard band.
const MOST_VERTICES: usize = 9;

/// The line `x = x0 + slope (y - y0)`, which bounds a polygon on its left or right.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Edge {
    pub x: f32,
    pub y: f32,
    pub slope: f32,
    pub right: bool,
}

/// A convex polygon ready to be rasterized.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Polygon {
    edges: [Edge; MOST_VERTICES],
    edge_count: usize,
    pub plane: Plane,
    pub rows: [i32; 2],
    pub columns: [i32; 2],
}

impl Polygon {
    #[inline(always)]
    pub fn edges(&self) -> &[Edge] {
        &self.edges[..self.edge_count]
    }
}

/// Homogeneous image coordinates, x and y in pixels times w, the numerator of nearness, and w.
type Vertex = [f64; 4];

/// A convex polygon of clip-space vertices.
#[derive(Clone, Copy)]
struct Corners {
    vertices: [Vertex; MOST_VERTICES],
    count: usize,
}

impl Corners {
    fn as_slice(&self) -> &[Vertex] {
        &self.vertices[..self.count]
    }

    /// Sutherland-Hodgman: what is on the side of a plane where `distance` is not negative.
    fn clip(&self, distance: impl Fn(&Vertex) -> f64) -> Self {
        let mut out = Self {
            vertices: [[0.0; 4]; MOST_VERTICES],
            count: 0,
        };
        let mut push = |vertex: Vertex| {
            // A convex polygon gains one vertex per plane; rounding cannot be allowed to gain more.
            if out.count < MOST_VERTICES {
                out.vertices[out.count] = vertex;
                out.count += 1;
            }
        };
        let vertices = self.as_slice();
        for (i, a) in vertices.iter().enumerate() {
            let b = &vertices[(i + 1) % vertices.len()];
            let (at_a, at_b) = (distance(a), distance(b));
            if at_a >= 0.0 {
                push(*a);
            }
            if (at_a >= 0.0) != (at_b >= 0.0) {
                let t = at_a / (at_a - at_b);
                push(std::array::from_fn(|k| a[k] + t * (b[k] - a[k])));
            }
        }
        out
    }
}

/// The visible part of a triangle, or `None` if there is none.
#[inline(never)]
pub(crate) fn clip(view: &View, triangle: [&[f32; 4]; 3]) -> Option<Polygon> {
    if triangle.iter().any(|v| v.iter().any(|c| !c.is_finite())) {
        return None;
    }
    let mut corners = Corners {
        vertices: [[0.0; 4]; MOST_VERTICES],
        count: 3,
    };
    for (corner, vertex) in corners.vertices.iter_mut().zip(triangle) {
        let [x, y, _, w] = vertex.map(f64::from);
        *corner = [x, y, f64::from(view.numerator(*vertex)), w];
    }
    // A hair behind the GPU's near plane, so that rounding here shows nothing that is cut off there.
    let near = f64::from(view.near) * (1.0 + 1e-6);
    let guard = f64::from(GUARD);
    let corners = corners
        .clip(|v| v[3] - near * v[2])
        .clip(|v| v[3] - f64::from(LEAST_W))
        .clip(|v| guard * v[3] - v[0])
        .clip(|v| guard * v[3] + v[0])
        .clip(|v| guard * v[3] - v[1])
        .clip(|v| guard * v[3] + v[1]);
    set_up(view, corners.as_slice())
}

/// A corner in the image: pixels as [`View`] has them, nearness, 1/w.
#[derive(Clone, Copy, Default)]
struct Projected {
    x: f64,
    y: f64,
    d: f64,
    inverse_w: f64,
}

fn set_up(view: &View, corners: &[Vertex]) -> Option<Polygon> {
    if corners.len() < 3 {
        return None;
    }
    let (half, centre) = (view.half.map(f64::from), view.centre.map(f64::from));
    let mut projected = [Projected::default(); MOST_VERTICES];
    for (p, [x, y, n, w]) in projected.iter_mut().zip(corners) {
        *p = Projected {
            x: x / w * half[0] + centre[0],
            y: centre[1] - y / w * half[1],
            d: n / w,
            inverse_w: 1.0 / w,
        };
    }
    let points = &mut projected[..corners.len()];
    let area = signed_area(points);
    if area == 0.0 || !area.is_finite() || view.cull_back_faces && area > 0.0 {
        return None;
    }
    if area > 0.0 {
        // Now every polygon is counter-clockwise as seen: its left edges lead down.
        points.reverse();
    }
    let (u, longer) = (f64::from(U), f64::from(view.longer_px()));
    let range = |f: fn(&Projected) -> f64| {
        let values = points.iter().map(f);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
            (a.min(v), b.max(v))
        })
    };
    let ((x_min, x_max), (y_min, y_max)) = (range(|p| p.x), range(|p| p.y));
    let reach = [x_min, x_max, y_min, y_max]
        .into_iter()
        .fold(0.0, |most: f64, v| most.max(v.abs()))
        + longer;

    let (mut step, mut across) = (0.0, 0.0);
    let (mut factor, mut tolerance) = (1.0, 0.0);
    if let Some(inner) = &view.inner {
        let transform = 2.0 * f64::from(inner.clip_error) * range(|p| p.inverse_w).1;
        step = f64::from(inner.step_px) + reach * (8.0 * u + transform);
        across = 8.0 * u * reach;
        let inverse_w = range(|p| p.inverse_w).1 as f32;
        let [shrunk, absolute] = inner.depth_margin(view.depth, inverse_w);
        let interpolation = f64::from(INTERPOLATION) * range(|p| p.d).1;
        (factor, tolerance) = (shrunk.into(), f64::from(absolute) + interpolation);
    }
    for p in points.iter_mut() {
        p.d = p.d * factor - tolerance;
    }
    let points = &*points;

    let mut polygon = Polygon {
        edges: [Edge::default(); MOST_VERTICES],
        edge_count: 0,
        plane: plane(view, points, step, reach),
        rows: [0; 2],
        columns: [0; 2],
    };
    for (i, a) in points.iter().enumerate() {
        let b = &points[(i + 1) % points.len()];
        let right = a.y > b.y;
        // From the upper vertex, as in the other triangle that has this edge.
        let (upper, lower) = if right { (b, a) } else { (a, b) };
        if lower.y - upper.y < f64::from(HORIZONTAL_PX) {
            continue;
        }
        let slope = (lower.x - upper.x) / (lower.y - upper.y);
        let inward = step * (1.0 + slope.abs()) + across;
        let x = upper.x + if right { -inward } else { inward };
        polygon.edges[polygon.edge_count] = Edge {
            x: x.clamp(f64::from(-FAR_PX), f64::from(FAR_PX)) as f32,
            y: upper.y as f32,
            slope: slope as f32,
            right,
        };
        // An edge moved beyond everything covers nothing, whatever its slope.
        if x.abs() >= f64::from(FAR_PX) && view.inner.is_some() {
            return None;
        }
        polygon.edge_count += 1;
    }
    let margin = if view.inner.is_some() {
        step + f64::from(HORIZONTAL_PX) + 8.0 * u * reach
    } else {
        0.0
    };
    let [width, height] = view.size.map(f64::from);
    let row = |y: f64| y.floor().clamp(-1.0, height - 1.0) as i32 + 1;
    polygon.rows = [row(y_min + margin), row(y_max - margin)];
    polygon.columns = [x_min, x_max].map(|x| x.floor().clamp(0.0, width) as i32);
    let empty = |[from, to]: [i32; 2]| from >= to;
    (!empty(polygon.rows) && !empty(polygon.columns)).then_some(polygon)
}

/// Twice the area; negative for polygons that are counter-clockwise as seen.
fn signed_area(points: &[Projected]) -> f64 {
    let fan = points[1..].windows(2);
    fan.map(|edge| triangle_area(&points[0], &edge[0], &edge[1]))
        .sum()
}

fn triangle_area(a: &Projected, b: &Projected, c: &Projected) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)
}

/// The depth plane through the largest triangle of the fan.
fn plane(view: &View, points: &[Projected], step: f64, reach: f64) -> Plane {
    let least = points.iter().fold(f64::INFINITY, |least, p| least.min(p.d));
    let most = points.iter().fold(0.0, |most: f64, p| most.max(p.d.abs()));
    let flat = Plane {
        dx: 0.0,
        dy: 0.0,
        least_corner: least as f32,
        least: (least - f64::from(U) * most) as f32,
    };
    let a = &points[0];
    let fan = points[1..].windows(2).map(|edge| (&edge[0], &edge[1]));
    let size = |(b, c): &(&Projected, &Projected)| triangle_area(a, b, c).abs();
    let Some((b, c)) = fan.max_by(|l, r| size(l).total_cmp(&size(r))) else {
        return flat;
    };
    let area = triangle_area(a, b, c);
    let dx = ((b.d - a.d) * (c.y - a.y) - (c.d - a.d) * (b.y - a.y)) / area;
    let dy = ((c.d - a.d) * (b.x - a.x) - (b.d - a.d) * (c.x - a.x)) / area;
    let moderate = dx.abs() + dy.abs() < f64::from(STEEPEST);
    // f64 keeps 2^-53 times the ratio of bounds to area; past this the plane is worth nothing.
    if area.abs() < 1e-6 || !moderate {
        return flat;
    }
    let corner = a.d - dx * a.x - dy * a.y + dx.min(8.0 * dx) + (3.0 * dy).min(0.0);
    let margin = if view.inner.is_some() {
        let slope = dx.abs() + dy.abs();
        slope * step + 8.0 * f64::from(U) * (most + slope * (reach + 64.0))
    } else {
        0.0
    };
    Plane {
        dx: dx as f32,
        dy: dy as f32,
        least_corner: (corner - margin) as f32,
        least: flat.least,
    }
}
