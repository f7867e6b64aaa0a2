//! The peer of the paper's Table 1: a software hierarchical depth buffer of full resolution. Occluders go to
//! one depth per pixel, which is then reduced to the farthest of each 8x8 pixels, and queries ask those.

use crate::clip::Polygon;
use crate::footprint::{FindsHull, Footprint, Rect, Visibility, rect_footprint};
use crate::geometry::{Aabb, Matrix4, Occluder, Transform, compose, transform};
use crate::msoc::{MeshError, check_indices};
use crate::options::{Options, OptionsError};
use crate::raster::Events;
use crate::rasterize::{Indexed, Triangles, Visit, for_each};
use crate::setup::{Plane, Triangle};
use crate::simd::{Isa, Kernel, Portable, Simd};
use crate::view::View;

/// Pixels across and down per texel of the reduced buffer.
const REDUCED: usize = 8;

/// A depth per pixel, and the least nearness per 8x8 pixels.
#[derive(Clone, Debug)]
pub struct SoftwareHiZ {
    isa: Isa,
    view: View,
    depth: Vec<f32>,
    /// Pixels from row to row: the width rounded up to whole vectors.
    stride: usize,
    reduced: Vec<f32>,
    reduced_width: usize,
    vertices: Vec<[f32; 4]>,
}

impl SoftwareHiZ {
    /// An empty buffer; options as for [`crate::Msoc`], of which `parallel` is not used.
    ///
    /// # Errors
    /// If the size or an option is out of range.
    pub fn new(size: [u32; 2], options: &Options) -> Result<Self, OptionsError> {
        options.check(size)?;
        let [width, height] = size.map(|side| side as usize);
        let stride = width.next_multiple_of(16);
        let reduced_width = width.div_ceil(REDUCED);
        Ok(Self {
            isa: options.isa.unwrap_or_else(Isa::best),
            view: View::new(size, options),
            depth: vec![0.0; stride * height],
            stride,
            reduced: vec![0.0; reduced_width * height.div_ceil(REDUCED)],
            reduced_width,
            vertices: Vec::new(),
        })
    }

    /// Forgets all occluders.
    pub fn clear(&mut self) {
        self.depth.fill(0.0);
    }

    /// Rasterizes occluders. Queries know of them after the next [`Self::reduce`].
    ///
    /// # Errors
    /// If an index is out of range.
    pub fn rasterize(
        &mut self,
        clip_from_world: &Matrix4,
        occluders: &[Occluder<'_>],
    ) -> Result<(), MeshError> {
        for Occluder {
            mesh,
            world_from_object,
        } in occluders
        {
            check_indices(mesh)?;
            self.isa.run(Transform {
                clip_from_object: compose(clip_from_world, world_from_object),
                positions: mesh.positions,
                out: &mut self.vertices,
            });
            let triangles = Indexed {
                vertices: &self.vertices,
                indices: mesh.indices,
            };
            self.isa.run(Fill {
                view: &self.view,
                triangles: &triangles,
                target: Pixels {
                    depth: &mut self.depth,
                    stride: self.stride,
                    size: self.view.size,
                },
            });
        }
        Ok(())
    }

    /// As [`crate::Msoc::rasterize_clip`].
    pub fn rasterize_clip(&mut self, triangles: &[[[f32; 4]; 3]]) {
        self.isa.run(Fill {
            view: &self.view,
            triangles: &triangles,
            target: Pixels {
                depth: &mut self.depth,
                stride: self.stride,
                size: self.view.size,
            },
        });
    }

    /// The pass from pixels to 8x8 pixels.
    pub fn reduce(&mut self) {
        self.isa.run(Reduce {
            depth: &self.depth,
            stride: self.stride,
            width: self.view.size[0] as usize,
            reduced: &mut self.reduced,
            reduced_width: self.reduced_width,
        });
    }

    /// As [`crate::Msoc::query_rect`].
    pub fn query_rect(&self, rect: &Rect) -> Visibility {
        self.ask(rect_footprint(Portable, &self.view, rect))
    }

    /// As [`crate::Msoc::query_box_clip`].
    pub fn query_box_clip(&self, corners: &[[f32; 4]; 8]) -> Visibility {
        let view = &self.view;
        self.ask(self.isa.run(FindsHull { view, corners }))
    }

    /// As [`crate::Msoc::query_box`].
    pub fn query_box(&self, clip_from_world: &Matrix4, bounds: &Aabb) -> Visibility {
        let corners = bounds
            .corners()
            .map(|corner| transform(clip_from_world, corner));
        let view = self.view.of_bounds(clip_from_world, bounds);
        self.ask(self.isa.run(FindsHull {
            view: &view,
            corners: &corners,
        }))
    }

    /// Nearness at a pixel.
    ///
    /// # Panics
    /// Outside the image.
    pub fn depth(&self, [x, y]: [u32; 2]) -> f32 {
        assert!(x < self.view.size[0], "a pixel of the image");
        self.depth[y as usize * self.stride + x as usize]
    }

    fn ask(&self, footprint: Footprint) -> Visibility {
        let rect = match footprint {
            Ok(rect) => rect,
            Err(known) => return known,
        };
        let texels =
            |axis: usize| rect.min[axis] as usize / REDUCED..=rect.max[axis] as usize / REDUCED;
        let seen = texels(1).any(|y| {
            let row = y * self.reduced_width;
            let texels = &self.reduced[row + texels(0).start()..=row + texels(0).end()];
            texels.iter().any(|&farthest| rect.nearest >= farthest)
        });
        if seen {
            Visibility::Visible
        } else {
            Visibility::Occluded
        }
    }
}

struct Pixels<'a> {
    depth: &'a mut [f32],
    stride: usize,
    size: [u32; 2],
}

struct Fill<'a, T> {
    view: &'a View,
    triangles: &'a T,
    target: Pixels<'a>,
}

impl<T: Triangles> Kernel for Fill<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(mut self, s: S) {
        let range = 0..self.triangles.count();
        for_each(s, self.view, self.triangles, range, &mut self.target);
    }
}

impl<S: Simd> Visit<S> for Pixels<'_> {
    #[inline(always)]
    fn triangle(&mut self, s: S, it: &Triangle) {
        self.fill(s, it.rows, &it.plane, it);
    }
    #[inline(always)]
    fn polygon(&mut self, s: S, it: &Polygon) {
        self.fill(s, it.rows, &it.plane, it);
    }
}

impl Pixels<'_> {
    #[inline(always)]
    fn fill<S: Simd>(&mut self, s: S, rows: [i32; 2], plane: &Plane, events: &impl Events) {
        let lanes = S::LANES as i32;
        let lane = s.lane_index();
        let (zero, width) = (s.splat(0.0), s.splat(self.size[0] as f32));
        // From the subtile's least corner back to the plane itself; pixel x has its centre at x + 1.
        let origin = plane.least_corner - plane.dx.min(8.0 * plane.dx) - (3.0 * plane.dy).min(0.0);
        let (dx, least) = (s.splat(plane.dx), s.splat(plane.least));
        let (mut left, mut right) = ([0; 16], [0; 16]);
        for first in (rows[0]..rows[1]).step_by(S::LANES) {
            let row = s.to_float(s.add_i(lane, s.splat_i(first)));
            let [from, to] = events.at(s, row);
            s.store(s.to_int(s.min(s.max(from, zero), width)), &mut left);
            s.store(s.to_int(s.min(s.max(to, zero), width)), &mut right);
            for row in first..rows[1].min(first + lanes) {
                let index = (row - first) as usize & 15;
                let (from, to) = (left[index] as i32, right[index] as i32);
                let start = s.splat(plane.dy * row as f32 + origin);
                let (from_all, to_all) = (s.splat_i(from), s.splat_i(to));
                let line = row as usize * self.stride;
                let mut x = from & !(lanes - 1);
                while x < to {
                    let column = s.add_i(lane, s.splat_i(x));
                    let inside = s.but_not(s.gt_i(to_all, column), s.gt_i(from_all, column));
                    let centre = s.to_float(s.add_i(column, s.splat_i(1)));
                    let depth = s.max(s.add(s.mul(dx, centre), start), least);
                    let at = line + x as usize;
                    let pixels: &mut [u32] =
                        bytemuck::cast_slice_mut(&mut self.depth[at..at + S::LANES]);
                    let old = s.of_bits(s.load(pixels));
                    s.store(s.bits(s.select(inside, s.max(old, depth), old)), pixels);
                    x += lanes;
                }
            }
        }
    }
}

struct Reduce<'a> {
    depth: &'a [f32],
    stride: usize,
    width: usize,
    reduced: &'a mut [f32],
    reduced_width: usize,
}

impl Kernel for Reduce<'_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let far = s.splat(f32::INFINITY);
        let rows = self.depth.chunks(self.stride * REDUCED);
        for (rows, texels) in rows.zip(self.reduced.chunks_mut(self.reduced_width)) {
            for from in (0..self.width).step_by(S::LANES) {
                let mut least = far;
                for row in rows.chunks_exact(self.stride) {
                    least = s.min(
                        least,
                        s.of_bits(s.load(bytemuck::cast_slice(&row[from..from + S::LANES]))),
                    );
                }
                let mut columns = [f32::INFINITY.to_bits(); 16];
                s.store(s.bits(least), &mut columns);
                for (i, column) in columns.iter_mut().enumerate() {
                    // Columns past the border are nobody's.
                    if from + i >= self.width {
                        *column = f32::INFINITY.to_bits();
                    }
                }
                for (texel, columns) in texels[from / REDUCED..]
                    .iter_mut()
                    .zip(columns[..S::LANES].chunks(REDUCED))
                {
                    *texel = columns.iter().fold(f32::INFINITY, |least, &bits| {
                        least.min(f32::from_bits(bits))
                    });
                }
            }
        }
    }
}
