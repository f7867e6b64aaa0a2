//! Whether a fragment lies within its object's padded bounds, in f64.
//!
//! This is the question that `hroc_keeps` (object.wgsl) asks in f32: does the ray through the pixel meet the padded
//! bounds, and does it enter them at or in front of the fragment's depth? The numbers of the frame are those of the
//! uniform, but nothing is rounded on the way, so the answer does not share the shader's rounding.
//!
//! The shader's rounding decides near the border. How much it can decide is bounded in frame_uniform.rs, "Two
//! pipelines": a fifth of the padding, half of the depth tolerance and `24 u` of the interval cover the difference of
//! two roundings of one question, so half of each covers the difference of one rounding from none. Hence the three
//! `Margin`s.

use glam::{DVec2, DVec3, DVec4};
use hroc_format::ObjectBounds;
use hroc_runtime::twin::bounds::DEPTH_TOLERANCE_RELATIVE;
use hroc_runtime::{CELL_SLOTS, DepthConvention, FrameUniform};

/// The roundoff unit that the paddings are derived for.
const U: f64 = 1.0 / (1 << 23) as f64;

/// How a fragment stands to its object's padded bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Standing {
    /// So far outside that no rounding of `hroc_keeps` may keep it.
    Outside,
    /// Outside, by no more than rounding.
    JustOutside,
    /// Inside, by no more than rounding.
    JustInside,
    /// So far inside that no rounding of `hroc_keeps` may refuse it.
    Inside,
}

impl Standing {
    /// Whether the fragment lies outside.
    pub fn is_stray(self) -> bool {
        self <= Self::JustOutside
    }
}

/// Which share of paddings and tolerances counts.
#[derive(Clone, Copy, Debug)]
struct Margin {
    /// Of the padding of bounds.
    padding: f64,
    /// Of the depth tolerance.
    tolerance: f64,
    /// The ray enters the bounds earlier by this factor when depths are compared.
    earlier: f64,
    /// The ray leaves the bounds later by this factor.
    later: f64,
}

/// What every rounding of `hroc_keeps` keeps.
const INNER: Margin = Margin {
    padding: 0.7,
    tolerance: 0.25,
    earlier: 1.0 + 12.0 * U,
    later: 1.0 - 12.0 * U,
};
/// `hroc_keeps` without rounding.
const EXACT: Margin = Margin {
    padding: 0.8,
    tolerance: 0.5,
    earlier: 1.0 + 24.0 * U,
    later: 1.0,
};
/// What some rounding of `hroc_keeps` keeps. The tests of bounds find all of it.
const OUTER: Margin = Margin {
    padding: 0.9,
    tolerance: 0.75,
    earlier: 1.0 + 36.0 * U,
    later: 1.0 + 12.0 * U,
};

/// Judges the fragments of one frame.
#[derive(Clone, Copy, Debug)]
pub struct FragmentOracle {
    /// A ray's origin at pixel position 0, and its change per pixel to the right and down.
    origin: [DVec3; 3],
    /// A ray's direction, likewise, per unit of its parameter.
    direction: [DVec3; 3],
    forward: DVec4,
    near: f64,
    /// Everywhere, per reach, per depth.
    padding: [f64; 3],
    cells: [[f32; 4]; CELL_SLOTS],
    /// Clip z at parameter 0, its change per parameter; the same of clip w.
    depth_along_ray: DVec4,
    tolerance: f64,
    tolerance_over_nearest: f64,
    tolerance_over_w: f64,
    tolerance_reach_over_w: f64,
    depth: DepthConvention,
}

impl FragmentOracle {
    /// For the frame of `uniform`.
    pub fn new(uniform: &FrameUniform, depth: DepthConvention) -> Self {
        let point = |x: [f32; 3]| DVec3::from_array(x.map(f64::from));
        let vector = |x: [f32; 4]| DVec4::from_array(x.map(f64::from));
        Self {
            origin: [
                uniform.ray_origin,
                uniform.ray_origin_dx,
                uniform.ray_origin_dy,
            ]
            .map(point),
            direction: [
                uniform.ray_direction,
                uniform.ray_direction_dx,
                uniform.ray_direction_dy,
            ]
            .map(point),
            forward: vector(uniform.forward),
            near: uniform.near.into(),
            padding: [
                uniform.padding_everywhere,
                uniform.padding_per_reach,
                uniform.padding_per_depth,
            ]
            .map(f64::from),
            cells: uniform.cells,
            depth_along_ray: vector(uniform.depth_along_ray),
            tolerance: uniform.depth_tolerance.into(),
            tolerance_over_nearest: uniform.depth_tolerance_over_nearest.into(),
            tolerance_over_w: uniform.depth_tolerance_over_w.into(),
            tolerance_reach_over_w: uniform.depth_tolerance_reach_over_w.into(),
            depth,
        }
    }

    /// How a fragment at the centre of `pixel`, which left `depth` in the depth buffer, stands to the bounds of its
    /// object.
    pub fn standing(&self, pixel: [u32; 2], depth: f32, bounds: &ObjectBounds) -> Standing {
        if !depth.is_finite() {
            return Standing::Outside;
        }
        let position = DVec2::new(f64::from(pixel[0]) + 0.5, f64::from(pixel[1]) + 0.5);
        let depth = f64::from(depth).clamp(0.0, 1.0);
        let within = |margin| self.is_within(position, depth, bounds, margin);
        if within(&INNER) {
            Standing::Inside
        } else if within(&EXACT) {
            Standing::JustInside
        } else if within(&OUTER) {
            Standing::JustOutside
        } else {
            Standing::Outside
        }
    }

    fn is_within(
        &self,
        position: DVec2,
        depth: f64,
        bounds: &ObjectBounds,
        margin: &Margin,
    ) -> bool {
        let padded = self.padded(bounds, margin);
        self.entry(position, padded, margin)
            .is_some_and(|t| self.shows(padded, t / margin.earlier, depth, margin))
    }

    /// The bounds, grown by their padding. It goes by the view depth of their farthest corner.
    fn padded(&self, bounds: &ObjectBounds, margin: &Margin) -> [DVec3; 2] {
        let [x, y, z, _] = self.cells[bounds.cell as usize].map(f64::from);
        let zero = DVec3::new(x, y, z);
        let corner = |x: [f32; 3]| DVec3::from_array(x.map(f64::from)) + zero;
        let (lo, hi) = (corner(bounds.min), corner(bounds.max));
        let reach = lo.abs().max(hi.abs()).element_sum();
        let forward = self.forward.truncate();
        let farthest =
            forward.max(DVec3::ZERO).dot(hi) + forward.min(DVec3::ZERO).dot(lo) + self.forward.w;
        let [everywhere, per_reach, per_depth] = self.padding;
        let padding =
            margin.padding * (everywhere + per_reach * reach + per_depth * farthest.max(0.0));
        [lo - padding, hi + padding]
    }

    /// The parameter, no less than the near plane's, where the ray through `position` enters a box.
    fn entry(&self, position: DVec2, [lo, hi]: [DVec3; 2], margin: &Margin) -> Option<f64> {
        let at = |[start, dx, dy]: [DVec3; 3]| start + position.x * dx + position.y * dy;
        let (origin, direction) = (at(self.origin), at(self.direction));
        let (mut first, mut last) = (self.near, f64::INFINITY);
        for axis in 0..3 {
            if direction[axis] == 0.0 {
                if !(lo[axis]..=hi[axis]).contains(&origin[axis]) {
                    return None;
                }
                continue;
            }
            let a = (lo[axis] - origin[axis]) / direction[axis];
            let b = (hi[axis] - origin[axis]) / direction[axis];
            first = first.max(a.min(b));
            last = last.min(a.max(b));
        }
        (first <= last * margin.later).then_some(first)
    }

    /// Whether what starts in a padded box at parameter `t` of a ray can be at or in front of `depth`.
    fn shows(&self, [lo, hi]: [DVec3; 2], t: f64, depth: f64, margin: &Margin) -> bool {
        let [z, z_t, w, w_t] = self.depth_along_ray.to_array();
        let w = w + w_t * t;
        let entry_depth = (z + z_t * t) / w;
        let forward = self.forward.truncate();
        let nearest =
            forward.max(DVec3::ZERO).dot(lo) + forward.min(DVec3::ZERO).dot(hi) + self.forward.w;
        let reach = forward.abs().dot(lo.abs().max(hi.abs()));
        let everywhere = self.tolerance + self.tolerance_over_nearest / nearest.max(self.near);
        let over_w = self.tolerance_over_w + self.tolerance_reach_over_w * reach;
        let relative = f64::from(DEPTH_TOLERANCE_RELATIVE) * depth.abs();
        let tolerance = margin.tolerance * (everywhere + over_w / w + relative);
        match self.depth {
            DepthConvention::Standard => entry_depth - tolerance <= depth,
            DepthConvention::Reversed => entry_depth + tolerance >= depth,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat4, DQuat};
    use hroc_runtime::{Camera, Projection, SceneShape};

    const SIZE: [u32; 2] = [640, 360];
    const NEAR: f64 = 0.1;

    fn bounds(lo: DVec3, hi: DVec3) -> ObjectBounds {
        ObjectBounds {
            min: lo.as_vec3().to_array(),
            cell: 0,
            max: hi.as_vec3().to_array(),
            reserved: 0,
        }
    }

    /// A frame, and its rays and depths by the f64 matrix of its camera alone.
    struct View {
        oracle: FragmentOracle,
        uniform: FrameUniform,
        clip: DMat4,
        depth: DepthConvention,
    }

    impl View {
        /// Looks from `eye` along -z.
        fn new(
            eye: DVec3,
            projection: Projection,
            jitter_px: [f64; 2],
            depth: DepthConvention,
        ) -> Self {
            let camera = Camera {
                position: eye,
                orientation: DQuat::IDENTITY,
                projection,
                near: NEAR,
                far: Some(200.0),
                jitter_px,
            };
            let shape = SceneShape {
                origin: DVec3::ZERO,
                cells: [DVec3::ZERO].into(),
                radius: 30.0,
                reach: 50.0,
                object_count: 1,
                static_count: 1,
                subpixel_step_px: 1.0 / 256.0,
            };
            let uniform = FrameUniform::new(&camera, depth, SIZE, &shape).unwrap();
            let clip = camera.clip_from_world(depth, SIZE, shape.origin, shape.radius);
            Self {
                oracle: FragmentOracle::new(&uniform, depth),
                uniform,
                clip: clip.unwrap(),
                depth,
            }
        }

        /// The point of the ray through the centre of `pixel` at height `z`.
        fn point(&self, pixel: [u32; 2], z: f64) -> DVec3 {
            let ndc =
                |axis: usize| 2.0 * (f64::from(pixel[axis]) + 0.5) / f64::from(SIZE[axis]) - 1.0;
            let inverse = self.clip.inverse();
            let [a, b] = [0.25, 0.75].map(|depth| {
                let p = inverse * DVec4::new(ndc(0), -ndc(1), depth, 1.0);
                p.truncate() / p.w
            });
            a + (b - a) * ((z - a.z) / (b.z - a.z))
        }

        fn depth_of(&self, point: DVec3) -> f32 {
            let p = self.clip * point.extend(1.0);
            (p.z / p.w) as f32
        }

        /// The padding of bounds with these corners whose farthest point lies `farthest` in front of the eye.
        fn padding(&self, farthest: f64, [lo, hi]: [DVec3; 2]) -> f64 {
            let zero = self.uniform.zero();
            let reach = (lo - zero).abs().max((hi - zero).abs()).element_sum();
            f64::from(self.uniform.padding_everywhere)
                + f64::from(self.uniform.padding_per_reach) * reach
                + f64::from(self.uniform.padding_per_depth) * farthest
        }
    }

    /// Every projection, jitter and convention, from the middle of the scene.
    fn views(eye: DVec3) -> Vec<View> {
        let mut views = Vec::new();
        for projection in [
            Projection::Perspective { fov_y_rad: 1.0 },
            Projection::Orthographic { half_height: 6.0 },
        ] {
            for jitter in [[0.0; 2], [0.4, -0.3]] {
                for depth in DepthConvention::ALL {
                    views.push(View::new(eye, projection, jitter, depth));
                }
            }
        }
        views
    }

    const PIXELS: [[u32; 2]; 4] = [[320, 180], [0, 0], [500, 40], [639, 359]];

    /// A plate across the view that ends beside the ray: how far the ray may miss it. The ray does not lean to that side,
    /// so that the padding in depth does not bring it closer.
    #[test]
    fn beside_the_bounds_the_padding_decides_by_a_hair() {
        let sides = [
            (0, -1.0, [320, 3]),
            (0, 1.0, [320, 300]),
            (1, -1.0, [9, 180]),
            (1, 1.0, [600, 180]),
        ];
        for view in views(DVec3::new(0.3, -0.2, 10.0)) {
            for (axis, side, pixel) in sides {
                let at = view.point(pixel, 0.0);
                let standing = |share: f64| {
                    let (mut lo, mut hi) = (at - 1.0, at + 1.0);
                    (lo.z, hi.z) = (0.0, 0.0);
                    (lo[axis], hi[axis]) = if side < 0.0 {
                        (at[axis] - 1.0, at[axis])
                    } else {
                        (at[axis], at[axis] + 1.0)
                    };
                    let edge = at[axis] + side * share * view.padding(10.0, [lo, hi]);
                    (lo[axis], hi[axis]) = if side < 0.0 {
                        (edge - 1.0, edge)
                    } else {
                        (edge, edge + 1.0)
                    };
                    let bounds = bounds(lo, hi);
                    view.oracle.standing(pixel, view.depth_of(at), &bounds)
                };
                // f32 rounds the edge and the uniform by less than a twentieth of the padding together.
                assert_eq!(standing(0.0), Standing::Inside);
                assert_eq!(standing(0.65), Standing::Inside);
                assert_eq!(standing(0.75), Standing::JustInside);
                assert_eq!(standing(0.85), Standing::JustOutside);
                assert_eq!(standing(0.95), Standing::Outside);
                assert_eq!(standing(5.0), Standing::Outside);
            }
        }
    }

    /// A wall across the view: how far in front of it a fragment may lie.
    #[test]
    fn in_front_of_the_bounds_depth_decides() {
        for view in views(DVec3::new(0.3, -0.2, 10.0)) {
            let corners = [DVec3::new(-40.0, -40.0, -2.0), DVec3::new(40.0, 40.0, -1.0)];
            let wall = bounds(corners[0], corners[1]);
            for pixel in PIXELS {
                let standing = |z: f64| {
                    let depth = view.depth_of(view.point(pixel, z));
                    view.oracle.standing(pixel, depth, &wall)
                };
                // What the tolerance is worth in world: the depth of the wall moves by so much for a step of 1.
                let step = f64::from(view.depth_of(view.point(pixel, -0.9)))
                    - f64::from(view.depth_of(view.point(pixel, -1.1)));
                let tolerance = (f64::from(view.uniform.depth_tolerance)
                    + f64::from(view.uniform.depth_tolerance_over_nearest)
                    + f64::from(view.uniform.depth_tolerance_over_w)
                    + f64::from(view.uniform.depth_tolerance_reach_over_w) * 12.0
                    + f64::from(DEPTH_TOLERANCE_RELATIVE))
                    * 0.2
                    / step.abs()
                    + 24.0 * U * 11.0;
                let all = view.padding(12.0, corners) + tolerance;
                for inside in [-1.0, -1.5, -30.0] {
                    assert_eq!(standing(inside), Standing::Inside, "{:?}", view.depth);
                }
                assert_eq!(standing(-1.0 + 1.01 * all), Standing::Outside);
                assert_eq!(standing(5.0), Standing::Outside);
            }
        }
    }

    /// The eye is in the bounds: every depth up to the near plane's lies inside, and what came out beyond the near plane
    /// is clamped to it.
    #[test]
    fn bounds_round_the_near_plane_hold_every_depth() {
        for view in views(DVec3::ZERO) {
            let all = bounds(DVec3::splat(-20.0), DVec3::splat(20.0));
            let behind = bounds(DVec3::new(-20.0, -20.0, 1.0), DVec3::splat(20.0));
            let nearest = 1.0 - view.depth.clear_value();
            for pixel in PIXELS {
                for depth in [nearest, 0.5, view.depth.clear_value()] {
                    let standing = |bounds| view.oracle.standing(pixel, depth, bounds);
                    assert_eq!(standing(&all), Standing::Inside);
                    assert_eq!(standing(&behind), Standing::Outside);
                }
                let beyond = nearest + (nearest - 0.5);
                let standing = view.oracle.standing(pixel, beyond, &all);
                assert_eq!(standing, Standing::Inside);
            }
        }
    }

    #[test]
    fn a_depth_that_is_no_number_lies_outside() {
        for view in views(DVec3::ZERO) {
            let bounds = bounds(DVec3::splat(-20.0), DVec3::splat(20.0));
            for depth in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let standing = view.oracle.standing([320, 180], depth, &bounds);
                assert_eq!(standing, Standing::Outside);
            }
        }
    }
}
