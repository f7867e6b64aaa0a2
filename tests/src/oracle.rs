//! f64 oracles: what the stages should find, computed without regard for speed.

use std::ops::Range;

use glam::{DMat4, DVec2, DVec3, DVec4};
use hroc_format::{ArchivedObjectBounds, ArchivedScene};
use hroc_runtime::twin::bounds::{DEPTH_TOLERANCE_RELATIVE, LARGEST_NDC};
use hroc_runtime::{DepthConvention, FrameUniform};

/// How an object's bounds stand to an occlusion map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Even the padded bounds are behind the map at every pixel, and clear of the near plane.
    Hidden,
    /// Padding and rounding decide.
    Between,
    /// The bare bounds are in front of the map at some pixel's centre.
    Showing,
}

/// A frame's numbers in f64, as the shaders get them (rounded to f32).
#[derive(Debug)]
struct Lens {
    eye: [DVec3; 3],
    direction: [DVec3; 3],
    planes: [DVec4; 6],
    forward: DVec4,
    /// Everywhere, per reach, per depth.
    padding: [f64; 3],
    box_padding: [f64; 3],
}

impl Lens {
    fn new(frame: &FrameUniform) -> Self {
        let v = |x: [f32; 3]| DVec3::from_array(x.map(f64::from));
        let w = |x: [f32; 4]| DVec4::from_array(x.map(f64::from));
        Self {
            eye: [
                v(frame.ray_origin),
                v(frame.ray_origin_dx),
                v(frame.ray_origin_dy),
            ],
            direction: [
                v(frame.ray_direction),
                v(frame.ray_direction_dx),
                v(frame.ray_direction_dy),
            ],
            planes: frame.planes.map(w),
            forward: w(frame.forward),
            padding: [
                frame.padding_everywhere,
                frame.padding_per_reach,
                frame.padding_per_depth,
            ]
            .map(f64::from),
            box_padding: [
                frame.box_padding_everywhere,
                frame.box_padding_per_reach,
                frame.box_padding_per_depth,
            ]
            .map(f64::from),
        }
    }

    fn padded(&self, b: [DVec3; 2], share: f64) -> [DVec3; 2] {
        self.grown(b, self.padding.map(|part| share * part))
    }

    fn rasterized(&self, b: [DVec3; 2]) -> [DVec3; 2] {
        self.grown(b, self.box_padding.map(|part| 1.01 * part))
    }

    fn grown(
        &self,
        [lo, hi]: [DVec3; 2],
        [everywhere, per_reach, per_depth]: [f64; 3],
    ) -> [DVec3; 2] {
        let farthest = extreme(self.forward, [lo, hi], true).max(0.0);
        let padding = everywhere + per_reach * reach([lo, hi]) + per_depth * farthest;
        [lo - padding, hi + padding]
    }

    /// The distance at which a box is taken to touch the near plane.
    fn rounding(&self, b: [DVec3; 2]) -> f64 {
        self.padding[0] + self.padding[1] * reach(b)
    }

    /// Ray parameter of the entry into a box at a pixel position, if it is met in front of the near plane.
    fn entry(&self, position: DVec2, [lo, hi]: [DVec3; 2], near: f64) -> Option<f64> {
        let at = |[o, dx, dy]: [DVec3; 3]| o + position.x * dx + position.y * dy;
        let (eye, direction) = (at(self.eye), at(self.direction));
        let (mut first, mut last) = (near, f64::INFINITY);
        for axis in 0..3 {
            if direction[axis] == 0.0 {
                if eye[axis] < lo[axis] || eye[axis] > hi[axis] {
                    return None;
                }
                continue;
            }
            let a = (lo[axis] - eye[axis]) / direction[axis];
            let b = (hi[axis] - eye[axis]) / direction[axis];
            first = first.max(a.min(b));
            last = last.min(a.max(b));
        }
        (first <= last).then_some(first)
    }
}

/// Signed distance from a plane to the farthest or nearest corner of a box.
fn extreme(plane: DVec4, [lo, hi]: [DVec3; 2], farthest: bool) -> f64 {
    (0..3)
        .map(|i| {
            plane[i]
                * if (plane[i] > 0.0) == farthest {
                    hi[i]
                } else {
                    lo[i]
                }
        })
        .sum::<f64>()
        + plane.w
}

/// The largest sum of absolute coordinates of a corner.
fn reach([lo, hi]: [DVec3; 2]) -> f64 {
    lo.abs().max(hi.abs()).element_sum()
}

/// The corners of an object's bounds, eye-relative.
fn corners(frame: &FrameUniform, bounds: &ArchivedObjectBounds) -> [DVec3; 2] {
    let [x, y, z, _] = frame.cells[bounds.cell.to_native() as usize].map(f64::from);
    [bounds.min, bounds.max].map(|corner| {
        DVec3::from_array(corner.map(|x| f64::from(x.to_native()))) + DVec3::new(x, y, z)
    })
}

/// Where the bounds of one object stand at one pixel position whose map depth is `there`, within this share of the
/// padding.
#[derive(Debug)]
pub struct RayOracle<'a> {
    lens: Lens,
    frame: &'a FrameUniform,
    depth: DepthConvention,
    share: f64,
}

impl<'a> RayOracle<'a> {
    /// For the rays of one frame.
    pub fn new(frame: &'a FrameUniform, depth: DepthConvention, share: f64) -> Self {
        Self {
            lens: Lens::new(frame),
            frame,
            depth,
            share,
        }
    }

    /// Hidden: the ray does not meet the padded bounds in front of the map, not even within the margin. Showing: it meets
    /// the bare bounds in front of the map, without any tolerance.
    pub fn standing(&self, position: DVec2, bare: [DVec3; 2], there: f64) -> Standing {
        let near = f64::from(self.frame.near);
        let loose = self.lens.padded(bare, self.share);
        let shows = |t, share: f64| {
            let here = self.depth_at(t);
            let relative = f64::from(DEPTH_TOLERANCE_RELATIVE) * there;
            // The shader divides in f32: a few ulps either way.
            let tolerance = share * (self.tolerance(loose, t) + relative + 1e-6 * here.abs());
            match self.depth {
                DepthConvention::Standard => here - tolerance <= there,
                DepthConvention::Reversed => here + tolerance >= there,
            }
        };
        let entry = self.lens.entry(position, loose, near);
        if !entry.is_some_and(|t| shows(t * (1.0 - 1e-5), 1.01)) {
            return Standing::Hidden;
        }
        let bare_entry = self.lens.entry(position, bare, near);
        if bare_entry.is_some_and(|t| shows(t, 0.0)) {
            Standing::Showing
        } else {
            Standing::Between
        }
    }

    /// The depth of the point at parameter `t` of a ray.
    pub fn depth_at(&self, t: f64) -> f64 {
        let [z, z_t, w, w_t] = self.frame.depth_along_ray.map(f64::from);
        (z + z_t * t) / (w + w_t * t)
    }

    /// The tolerance of the depth at parameter `t` of a ray that enters a box there, but for the share of the map's value.
    pub fn tolerance(&self, b: [DVec3; 2], t: f64) -> f64 {
        let frame = self.frame;
        let [_, _, w, w_t] = frame.depth_along_ray.map(f64::from);
        let nearest = extreme(self.lens.forward, b, false) - self.lens.rounding(b);
        let forward = self.lens.forward.truncate().abs();
        let reach = forward.dot(b[0].abs().max(b[1].abs()));
        f64::from(frame.depth_tolerance)
            + f64::from(frame.depth_tolerance_over_nearest) / nearest.max(frame.near.into())
            + (f64::from(frame.depth_tolerance_over_w)
                + f64::from(frame.depth_tolerance_reach_over_w) * reach)
                / (w + w_t * t).max(1e-9)
    }

    /// Where the ray enters bare bounds, in front of the near plane.
    pub fn entry(&self, position: DVec2, bare: [DVec3; 2]) -> Option<f64> {
        self.lens.entry(position, bare, f64::from(self.frame.near))
    }

    /// The point at parameter `t` of the ray through `position`.
    pub fn point(&self, position: DVec2, t: f64) -> DVec3 {
        let at = |[o, dx, dy]: [DVec3; 3]| o + position.x * dx + position.y * dy;
        at(self.lens.eye) + t * at(self.lens.direction)
    }
}

/// Where every object's bounds stand, given the occlusion map of that frame.
pub fn standings(
    baked: &ArchivedScene,
    frame: &FrameUniform,
    depth: DepthConvention,
    map: &[f32],
) -> Vec<Standing> {
    // Room for the shader's own rounding on either side.
    let rays = RayOracle::new(frame, depth, 1.01);
    let lens = &rays.lens;
    baked
        .object_bounds
        .iter()
        .map(|bounds| {
            let bare = corners(frame, bounds);
            let loose = lens.padded(bare, 1.01);
            if lens
                .planes
                .iter()
                .any(|plane| extreme(*plane, loose, true) < 0.0)
            {
                return Standing::Hidden;
            }
            let outer = lens.rasterized(loose);
            // Within rounding of the padding that the shader compares with.
            if extreme(lens.planes[4], outer, false) <= 1.01 * lens.rounding(outer)
                || farthest_ndc(frame, outer) > 0.99 * f64::from(LARGEST_NDC)
            {
                return Standing::Between;
            }
            let mut standing = Standing::Hidden;
            let width = frame.size[0];
            let [columns, rows] = footprint(frame, loose);
            for y in rows {
                for x in columns.clone() {
                    let position = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let there = f64::from(map[(y * width + x) as usize]);
                    match rays.standing(position, bare, there) {
                        Standing::Hidden => {}
                        Standing::Between => standing = Standing::Between,
                        Standing::Showing => return Standing::Showing,
                    }
                }
            }
            standing
        })
        .collect()
}

/// The eight corners in clip space.
fn clip_corners(frame: &FrameUniform, [lo, hi]: [DVec3; 2]) -> [DVec4; 8] {
    let matrix = DMat4::from_cols_array_2d(&frame.clip_from_relative.map(|c| c.map(f64::from)));
    std::array::from_fn(|corner| {
        let pick = |axis| {
            if corner >> axis & 1 == 1 {
                hi[axis]
            } else {
                lo[axis]
            }
        };
        matrix * DVec4::new(pick(0), pick(1), pick(2), 1.0)
    })
}

/// Distance of the farthest corner from the middle of the image, in its half widths or heights.
fn farthest_ndc(frame: &FrameUniform, bounds: [DVec3; 2]) -> f64 {
    clip_corners(frame, bounds)
        .map(|clip| (clip.x / clip.w).abs().max((clip.y / clip.w).abs()))
        .into_iter()
        .fold(0.0, f64::max)
}

/// Columns and rows of pixels whose rays may meet a box in front of the near plane.
fn footprint(frame: &FrameUniform, bounds: [DVec3; 2]) -> [Range<u32>; 2] {
    let mut extent = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for clip in clip_corners(frame, bounds) {
        for (axis, sign) in [(0, 1.0), (1, -1.0)] {
            let at = (0.5 + 0.5 * sign * clip[axis] / clip.w) * f64::from(frame.size[axis]);
            // Where it cannot be told, the whole image.
            let [first, last] = if at.is_finite() && clip.w > 0.0 {
                [at; 2]
            } else {
                [f64::NEG_INFINITY, f64::INFINITY]
            };
            extent[axis] = [extent[axis][0].min(first), extent[axis][1].max(last)];
        }
    }
    [0, 1].map(|axis| {
        // A pixel more on either side; `as` stays within u32.
        let end = frame.size[axis];
        ((extent[axis][0] - 1.0) as u32).min(end)..((extent[axis][1] + 2.0) as u32).min(end)
    })
}
