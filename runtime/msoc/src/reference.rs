//! The truth that the masked buffer is held against: a scalar depth buffer of full resolution, in f64.

use crate::footprint::{Footprint, Rect, Visibility, hull_footprint, rect_footprint};
use crate::options::{Mode, Options};
use crate::simd::Portable;
use crate::view::View;

/// One nearness per pixel, f64.
///
/// For [`Mode::Paper`] a pixel is covered if its centre is in the triangle, and as near as the triangle
/// there. For [`Mode::Inner`] it is covered only if every displacement of the vertices by up to one subpixel
/// step along each axis covers it, which is to say if its centre is in the triangle and farther than a step from
/// its border; and as near as the farthest of these displaced triangles.
#[derive(Clone, Debug)]
pub struct Reference {
    view: View,
    near: f64,
    /// A subpixel step, pixels; none in `paper`.
    step: Option<f64>,
    depth: Vec<f64>,
}

/// A vertex in the image: pixels from the top left corner, nearness.
type Projected = [f64; 3];

impl Reference {
    /// An empty buffer. `options` are those of the [`crate::Msoc`] it is to be compared with.
    ///
    /// # Errors
    /// If the size or an option is out of range.
    pub fn new(size: [u32; 2], options: &Options) -> Result<Self, crate::OptionsError> {
        options.check(size)?;
        let step = match options.mode {
            Mode::Paper => None,
            Mode::Inner { subpixel_bits, .. } => Some(0.5_f64.powi(i32::from(subpixel_bits))),
        };
        let view = View::new(size, options);
        Ok(Self {
            near: f64::from(view.near),
            view,
            step,
            depth: vec![0.0; size[0] as usize * size[1] as usize],
        })
    }

    /// Forgets all triangles.
    pub fn clear(&mut self) {
        self.depth.fill(0.0);
    }

    /// Nearness at a pixel, 0 where nothing covers it.
    ///
    /// # Panics
    /// Outside the image.
    pub fn depth(&self, [x, y]: [u32; 2]) -> f64 {
        self.depth[y as usize * self.view.size[0] as usize + x as usize]
    }

    /// Rasterizes clip-space triangles.
    pub fn rasterize_clip(&mut self, triangles: &[[[f32; 4]; 3]]) {
        for triangle in triangles {
            self.triangle(triangle);
        }
    }

    fn triangle(&mut self, triangle: &[[f32; 4]; 3]) {
        // x, y, numerator of nearness, w.
        let corners = triangle.map(|vertex| {
            let [x, y, _, w] = vertex.map(f64::from);
            [x, y, f64::from(self.view.numerator(vertex)), w]
        });
        let near = self.near;
        let corners = clip(&corners, |v| v[3] - near * v[2]);
        let corners = clip(&corners, |v| v[3] - 1e-30);
        let [width, height] = self.view.size.map(f64::from);
        let project = |[x, y, n, w]: &[f64; 4]| {
            [
                (x / w + 1.0) * 0.5 * width,
                (1.0 - y / w) * 0.5 * height,
                n / w,
            ]
        };
        let mut points = corners.iter().map(project).collect::<Vec<Projected>>();
        self.polygon(&mut points);
    }

    fn polygon(&mut self, points: &mut [Projected]) {
        if points.len() < 3 {
            return;
        }
        let cross = |a: &Projected, b: &Projected, p: [f64; 2]| {
            (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
        };
        let area: f64 = points[1..]
            .windows(2)
            .map(|e| cross(&points[0], &e[0], [e[1][0], e[1][1]]))
            .sum();
        if !(area.abs() > 0.0 && area.is_finite()) || self.view.cull_back_faces && area > 0.0 {
            return;
        }
        if area < 0.0 {
            points.reverse();
        }
        // The plane through the largest triangle of the fan.
        let a = points[0];
        let size = |e: &[Projected]| cross(&a, &e[0], [e[1][0], e[1][1]]);
        let Some(edge) = points[1..]
            .windows(2)
            .max_by(|l, r| size(l).total_cmp(&size(r)))
        else {
            return;
        };
        let (b, c) = (edge[0], edge[1]);
        let det = size(edge);
        let (b, c): (Projected, Projected) = (
            std::array::from_fn(|k| b[k] - a[k]),
            std::array::from_fn(|k| c[k] - a[k]),
        );
        let gradient = [
            (b[2] * c[1] - c[2] * b[1]) / det,
            (c[2] * b[0] - b[2] * c[0]) / det,
        ];
        let step = self.step.unwrap_or(0.0);
        let least = points
            .iter()
            .fold(f64::INFINITY, |least, p| least.min(p[2]));
        let most = points
            .iter()
            .fold(f64::NEG_INFINITY, |most, p| most.max(p[2]));
        let margin = step * (gradient[0].abs() + gradient[1].abs());

        let range = |axis: usize| {
            let values = points.iter().map(|p| p[axis]);
            let (from, to) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), v| {
                (from.min(v), to.max(v))
            });
            let last = f64::from(self.view.size[axis]);
            (from - 1.0).clamp(0.0, last) as u32..(to + 1.0).clamp(0.0, last) as u32
        };
        let edges = points.iter().zip(points.iter().cycle().skip(1));
        let edges = edges.map(|(a, b)| {
            // Eroding a convex polygon by a square moves each edge by the square's half width along the normal.
            (a, b, step * ((b[0] - a[0]).abs() + (b[1] - a[1]).abs()))
        });
        let edges = edges.collect::<Vec<_>>();
        let clear = |distance: f64, inward: f64| match self.step {
            Some(_) => distance > inward,
            None => distance >= 0.0,
        };
        for y in range(1) {
            for x in range(0) {
                let p = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                if edges
                    .iter()
                    .all(|(a, b, inward)| clear(cross(a, b, p), *inward))
                {
                    let on_plane = a[2] + gradient[0] * (p[0] - a[0]) + gradient[1] * (p[1] - a[1]);
                    let depth = (on_plane - margin).clamp(least, most);
                    let pixel =
                        &mut self.depth[y as usize * self.view.size[0] as usize + x as usize];
                    *pixel = pixel.max(depth);
                }
            }
        }
    }

    /// As [`crate::Msoc::query_rect`].
    pub fn query_rect(&self, rect: &Rect) -> Visibility {
        let nearest = 1.0 / f64::from(rect.nearest_w);
        self.ask(rect_footprint(Portable, &self.view, rect), nearest)
    }

    /// As [`crate::Msoc::query_box_clip`].
    pub fn query_box_clip(&self, corners: &[[f32; 4]; 8]) -> Visibility {
        let nearness = |c: &[f32; 4]| f64::from(self.view.numerator(*c)) / f64::from(c[3]);
        let nearest = corners.iter().map(nearness).fold(0.0, f64::max);
        self.ask(hull_footprint(Portable, &self.view, corners), nearest)
    }

    fn ask(&self, footprint: Footprint, nearest: f64) -> Visibility {
        let rect = match footprint {
            Ok(rect) => rect,
            Err(known) => return known,
        };
        let seen = (rect.min[1]..=rect.max[1]).any(|y| {
            let row = y as usize * self.view.size[0] as usize;
            let pixels = &self.depth[row + rect.min[0] as usize..=row + rect.max[0] as usize];
            pixels.iter().any(|&depth| nearest >= depth)
        });
        if seen {
            Visibility::Visible
        } else {
            Visibility::Occluded
        }
    }
}

/// What is on the side of a plane where `distance` is not negative.
fn clip(corners: &[[f64; 4]], distance: impl Fn(&[f64; 4]) -> f64) -> Vec<[f64; 4]> {
    let mut out = Vec::with_capacity(corners.len() + 1);
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let (at_a, at_b) = (distance(a), distance(b));
        if at_a >= 0.0 {
            out.push(*a);
        }
        if (at_a >= 0.0) != (at_b >= 0.0) {
            let t = at_a / (at_a - at_b);
            out.push(std::array::from_fn(|k| a[k] + t * (b[k] - a[k])));
        }
    }
    out
}
