//! The functions of common/bounds.wgsl and object.wgsl, the box of batch_occlusion_test.wgsl and the fixed
//! functions behind them, in the attacker's arithmetic.

use glam::{DMat4, DVec2, DVec3, DVec4, Vec4Swizzles};
use hroc_runtime::FrameUniform;
use hroc_runtime::twin::bounds::{
    DEPTH_TOLERANCE_RELATIVE, KEPT_PADDING, KEPT_TOLERANCE, LARGEST_NDC, SLAB_WIDENING,
};

use super::arithmetic::Dice;

/// Shares of what a frame's uniform grants; 1 for what the shaders use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares {
    /// Of `padding_everywhere` and `padding_per_reach`.
    pub world: f64,
    /// Of `padding_per_depth`.
    pub per_depth: f64,
    /// Of `box_padding_everywhere` and `box_padding_per_reach`.
    pub box_world: f64,
    /// Of `box_padding_per_depth`.
    pub box_per_depth: f64,
    /// Of the distance at which a box is taken to touch the near plane.
    pub near: f64,
    /// Of the widening of the slab test.
    pub slab: f64,
    /// Of all depth tolerances.
    pub depth: f64,
    /// Of the depth tolerance that goes by the largest depth in a box.
    pub deepest: f64,
}

impl Shares {
    /// What the shaders use.
    pub const ALL: Self = Self {
        world: 1.0,
        per_depth: 1.0,
        box_world: 1.0,
        box_per_depth: 1.0,
        near: 1.0,
        slab: 1.0,
        depth: 1.0,
        deepest: 1.0,
    };

    /// These shares of `others`.
    pub fn of(&self, others: &Self) -> Self {
        Self {
            world: self.world * others.world,
            per_depth: self.per_depth * others.per_depth,
            box_world: self.box_world * others.box_world,
            box_per_depth: self.box_per_depth * others.box_per_depth,
            near: self.near * others.near,
            slab: self.slab * others.slab,
            depth: self.depth * others.depth,
            deepest: self.deepest * others.deepest,
        }
    }
}

/// What `hroc_keeps` uses.
pub const KEPT: Shares = Shares {
    world: KEPT_PADDING as f64,
    per_depth: KEPT_PADDING as f64,
    slab: 0.0,
    depth: KEPT_TOLERANCE as f64,
    ..Shares::ALL
};

/// A frame's uniform as the shaders see it, in f64 that f32 can hold.
#[derive(Clone, Debug)]
pub struct Lens {
    rows: [DVec4; 4],
    /// Left, right, bottom, top, near, far.
    pub planes: [DVec4; 6],
    /// View depth of a point.
    pub forward: DVec4,
    origin: [DVec3; 3],
    direction: [DVec3; 3],
    along: DVec4,
    size: DVec2,
    /// The ray parameter at the near plane.
    pub near: f64,
    /// From the zero of eye-relative positions to that of the cell.
    zero: DVec3,
    /// Everywhere, per reach, per depth: of what rays are tested against and of what is rasterized.
    paddings: [[f64; 3]; 2],
    /// Everywhere, over the nearest view depth, over w, reach over w.
    tolerances: [f64; 4],
    reversed: bool,
    /// The rasterizer's, pixels.
    pub step_px: f64,
}

/// Lower and upper corner.
pub type Box3 = [DVec3; 2];

/// A vertex behind the fixed functions.
#[derive(Clone, Copy, Debug)]
pub struct OnScreen {
    /// Pixels, before snapping.
    pub at: DVec2,
    /// As interpolated.
    pub depth: f64,
}

impl Lens {
    /// Of a frame whose depth is stored `reversed`, on a rasterizer with this subpixel step.
    pub fn new(frame: &FrameUniform, reversed: bool, step_px: f64) -> Self {
        let v = |x: [f32; 3]| DVec3::from_array(x.map(f64::from));
        let w = |x: [f32; 4]| DVec4::from_array(x.map(f64::from));
        let columns = frame.clip_from_relative.map(w);
        Self {
            rows: [0, 1, 2, 3].map(|row| DVec4::from_array(columns.map(|column| column[row]))),
            planes: frame.planes.map(w),
            forward: w(frame.forward),
            origin: [
                v(frame.ray_origin),
                v(frame.ray_origin_dx),
                v(frame.ray_origin_dy),
            ],
            direction: [
                v(frame.ray_direction),
                v(frame.ray_direction_dx),
                v(frame.ray_direction_dy),
            ],
            along: w(frame.depth_along_ray),
            size: DVec2::from_array(frame.size.map(f64::from)),
            near: frame.near.into(),
            zero: w(frame.cells[0]).xyz(),
            paddings: [
                [
                    frame.padding_everywhere,
                    frame.padding_per_reach,
                    frame.padding_per_depth,
                ],
                [
                    frame.box_padding_everywhere,
                    frame.box_padding_per_reach,
                    frame.box_padding_per_depth,
                ],
            ]
            .map(|padding| padding.map(f64::from)),
            tolerances: [
                frame.depth_tolerance,
                frame.depth_tolerance_over_nearest,
                frame.depth_tolerance_over_w,
                frame.depth_tolerance_reach_over_w,
            ]
            .map(f64::from),
            reversed,
            step_px,
        }
    }

    /// `farthest_along` or `nearest_along`.
    pub fn extreme(&self, dice: &mut Dice<'_>, plane: DVec4, [lo, hi]: Box3, far: bool) -> f64 {
        let normal = plane.xyz();
        let (toward, against) = if far { (hi, lo) } else { (lo, hi) };
        let a = dice.dot(normal.max(DVec3::ZERO), toward);
        let b = dice.dot(normal.min(DVec3::ZERO), against);
        let sum = dice.add(a, b);
        dice.add(sum, plane.w)
    }

    /// `reach`.
    fn reach(&self, dice: &mut Dice<'_>, [lo, hi]: Box3) -> f64 {
        let farthest = lo.abs().max(hi.abs());
        let sum = dice.add(farthest.x, farthest.y);
        dice.add(sum, farthest.z)
    }

    /// `relative`, of the first cell.
    fn relative(&self, dice: &mut Dice<'_>, b: Box3) -> Box3 {
        b.map(|corner| self.moved(dice, corner))
    }

    fn moved(&self, dice: &mut Dice<'_>, point: DVec3) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| dice.add(point[axis], self.zero[axis])))
    }

    /// `hroc_relative_position` of a vertex of an object without rotation, whose place is `place`.
    pub fn position(&self, dice: &mut Dice<'_>, place: DVec3, local: DVec3) -> DVec3 {
        let place = self.moved(dice, place);
        DVec3::from_array([0, 1, 2].map(|axis| dice.add(local[axis], place[axis])))
    }

    fn grown(
        &self,
        dice: &mut Dice<'_>,
        b: Box3,
        [everywhere, per_reach, per_depth]: [f64; 3],
    ) -> Box3 {
        let farthest = self.extreme(dice, self.forward, b, true).max(0.0);
        let reach = self.reach(dice, b);
        let nearby = dice.mul_add(per_reach, reach, everywhere);
        let padding = dice.mul_add(per_depth, farthest, nearby);
        [
            DVec3::from_array(b[0].to_array().map(|x| dice.add(x, -padding))),
            DVec3::from_array(b[1].to_array().map(|x| dice.add(x, padding))),
        ]
    }

    /// `padded`, of bounds in the space of the first cell.
    pub fn padded(&self, dice: &mut Dice<'_>, b: Box3, shares: &Shares) -> Box3 {
        let [[everywhere, per_reach, per_depth], _] = self.paddings;
        let padding = [
            everywhere * shares.world,
            per_reach * shares.world,
            per_depth * shares.per_depth,
        ];
        let b = self.relative(dice, b);
        self.grown(dice, b, padding)
    }

    /// `rasterized`.
    pub fn rasterized(&self, dice: &mut Dice<'_>, b: Box3, shares: &Shares) -> Box3 {
        let [_, [everywhere, per_reach, per_depth]] = self.paddings;
        let padding = [
            everywhere * shares.box_world,
            per_reach * shares.box_world,
            per_depth * shares.box_per_depth,
        ];
        self.grown(dice, b, padding)
    }

    /// `rounding`: the distance at which a box is taken to touch the near plane.
    pub fn rounding(&self, dice: &mut Dice<'_>, b: Box3) -> f64 {
        let [[everywhere, per_reach, _], _] = self.paddings;
        let reach = self.reach(dice, b);
        dice.mul_add(per_reach, reach, everywhere)
    }

    /// `touches_near`.
    fn touches_near(&self, dice: &mut Dice<'_>, b: Box3, shares: &Shares) -> bool {
        let margin = self.rounding(dice, b);
        self.extreme(dice, self.planes[4], b, false) <= shares.near * margin
    }

    /// `in_frustum`: the smallest of the six distances.
    pub fn inside_by(&self, dice: &mut Dice<'_>, b: Box3) -> f64 {
        let distances = self.planes.map(|plane| self.extreme(dice, plane, b, true));
        distances.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// `entry` with the distance, in ray parameters, by which the ray meets the box: negative on a miss.
    pub fn entry(&self, dice: &mut Dice<'_>, p: DVec2, b: Box3, shares: &Shares) -> [f64; 2] {
        let (mut first, mut last) = (self.near, f64::INFINITY);
        for axis in 0..3 {
            let mut at = |[start, dx, dy]: [DVec3; 3]| {
                let across = dice.mul_add(p.x, dx[axis], start[axis]);
                let down = dice.mul(p.y, dy[axis]);
                dice.add(across, down)
            };
            let (origin, mut direction) = (at(self.origin), at(self.direction));
            if direction.abs() < 1e-12 {
                direction = if direction >= 0.0 { 1e-12 } else { -1e-12 };
            }
            let inverse = dice.div(1.0, direction);
            let mut meets = |plane: f64| {
                let offset = dice.add(plane, -origin);
                dice.mul(offset, inverse)
            };
            let (x, y) = (meets(b[0][axis]), meets(b[1][axis]));
            first = first.max(x.min(y));
            last = last.min(x.max(y));
        }
        let widening = 1.0 + shares.slab * (f64::from(SLAB_WIDENING) - 1.0);
        [first, dice.mul(last, widening) - first]
    }

    /// `nearest_entry`.
    pub fn nearest(&self, dice: &mut Dice<'_>, padded: Box3) -> f64 {
        let nearest = self.extreme(dice, self.forward, padded, false);
        let rounding = self.rounding(dice, padded);
        dice.add(nearest, -rounding).max(self.near)
    }

    /// The nearest view depth of a box as `is_kept` takes it.
    pub fn nearest_kept(&self, dice: &mut Dice<'_>, padded: Box3) -> f64 {
        let nearest = self.extreme(dice, self.forward, padded, false);
        nearest.max(self.near)
    }

    /// `depth_tolerance`.
    pub fn depth_tolerance(&self, dice: &mut Dice<'_>, [lo, hi]: Box3, nearest: f64) -> [f64; 2] {
        let reach = dice.dot(self.forward.xyz().abs(), lo.abs().max(hi.abs()));
        let [everywhere, over_nearest, over_w, reach_over_w] = self.tolerances;
        let deepest = dice.div(over_nearest, nearest);
        [
            dice.add(everywhere, deepest),
            dice.mul_add(reach_over_w, reach, over_w),
        ]
    }

    /// The depth at which `raster_box` draws a box of which `shows` is asked with `earliest`, and by how much it passes
    /// the early test against `depth`.
    pub fn passes_early_by(&self, dice: &mut Dice<'_>, earliest: f64, depth: f64) -> f64 {
        let margin = dice.mul(2.0, DEPTH_TOLERANCE_RELATIVE.into());
        let sign = self.toward_visible();
        let factor = dice.add(1.0, sign * margin);
        let early = dice.mul(earliest, factor);
        sign * (early.clamp(0.0, 1.0) - depth)
    }

    /// The farthest depth that shows.
    pub fn limit(&self, earliest: f64, shares: &Shares) -> f64 {
        let relative = f64::from(DEPTH_TOLERANCE_RELATIVE) * shares.depth;
        let limit = f64::from((earliest / (1.0 - self.toward_visible() * relative)) as f32);
        limit.clamp(0.0, 1.0)
    }

    fn toward_visible(&self) -> f64 {
        if self.reversed { 1.0 } else { -1.0 }
    }

    /// `earliest_depth`, with a share of the tolerance.
    pub fn earliest_depth(
        &self,
        dice: &mut Dice<'_>,
        t: f64,
        tolerance: [f64; 2],
        shares: &Shares,
    ) -> f64 {
        let nearer = dice.div(t, f64::from(SLAB_WIDENING));
        let w = dice.mul_add(self.along.w, nearer, self.along.z);
        let z = dice.mul_add(self.along.y, nearer, self.along.x);
        let here = dice.div(z, w);
        let [deepest, over_w] = tolerance.map(|x| x * shares.depth);
        let everywhere = deepest * shares.deepest;
        let by_w = dice.div(over_w, w);
        let error = dice.add(everywhere, by_w);
        dice.add(here, self.toward_visible() * error)
    }

    /// `shows`: by how much `depth` stays within the tolerance; negative where it is hidden.
    pub fn shows_by(&self, dice: &mut Dice<'_>, earliest: f64, depth: f64, shares: &Shares) -> f64 {
        let share = f64::from(DEPTH_TOLERANCE_RELATIVE) * shares.depth;
        let relative = dice.mul(share, depth.abs());
        let sign = self.toward_visible();
        let limit = dice.add(earliest, sign * relative);
        sign * (limit - depth)
    }

    /// Takes eye-relative positions to clip space, without rounding.
    pub fn matrix(&self) -> DMat4 {
        DMat4::from_cols_array_2d(&self.rows.map(|row| row.to_array())).transpose()
    }

    /// `hroc_clip_position`.
    pub fn clip(&self, dice: &mut Dice<'_>, p: DVec3) -> DVec4 {
        let row = |dice: &mut Dice<'_>, row: DVec4| {
            let sum = dice.dot(row.xyz(), p);
            dice.add(sum, row.w)
        };
        DVec4::from_array(self.rows.map(|r| row(dice, r)))
    }

    /// Where the near plane cuts a triangle's side whose second end lies before it, as a clipper computes it.
    pub fn clip_near(&self, dice: &mut Dice<'_>, inside: DVec4, outside: DVec4) -> DVec4 {
        let a = self.beyond_near(inside);
        let between = dice.add(a, -self.beyond_near(outside));
        let share = dice.div(a, between);
        let lerp = |dice: &mut Dice<'_>, i: usize| {
            let step = dice.add(outside[i], -inside[i]);
            dice.mul_add(share, step, inside[i])
        };
        DVec4::from_array([0, 1, 2, 3].map(|i| lerp(dice, i)))
    }

    /// Not negative: behind the near plane, as clippers see it.
    pub fn beyond_near(&self, clip: DVec4) -> f64 {
        if self.reversed {
            clip.w - clip.z
        } else {
            clip.z
        }
    }

    /// Perspective division and viewport transform.
    pub fn on_screen(&self, dice: &mut Dice<'_>, clip: DVec4) -> OnScreen {
        let ndc = [0, 1, 2].map(|i| dice.div(clip[i], clip.w));
        OnScreen {
            at: self.viewport(dice, ndc[0], ndc[1]),
            depth: ndc[2],
        }
    }

    fn viewport(&self, dice: &mut Dice<'_>, x: f64, y: f64) -> DVec2 {
        let half = self.size / 2.0;
        DVec2::new(
            dice.mul_add(x, half.x, half.x),
            dice.mul_add(-y, half.y, half.y),
        )
    }

    /// Where a rasterized box falls: its corners before snapping, and the smallest w among them. `None`: the box
    /// is opened or drawn untested instead.
    pub fn box_on_screen(
        &self,
        dice: &mut Dice<'_>,
        outer: Box3,
        shares: &Shares,
    ) -> Option<([DVec2; 8], f64)> {
        if self.touches_near(dice, outer, shares)
            || self.farthest_ndc(dice, outer) > f64::from(LARGEST_NDC)
        {
            return None;
        }
        let mut least_w = f64::INFINITY;
        // As the vertex shader does it: w = 1 afterwards, and the hardware's division by it is exact.
        let at = corners(outer).map(|corner| {
            let clip = self.clip(dice, corner);
            let (x, y) = (dice.div(clip.x, clip.w), dice.div(clip.y, clip.w));
            least_w = least_w.min(clip.w);
            self.viewport(dice, x, y)
        });
        Some((at, least_w))
    }

    /// `footprint(box).farthest_ndc`.
    fn farthest_ndc(&self, dice: &mut Dice<'_>, [lo, hi]: Box3) -> f64 {
        let size = [0, 1, 2].map(|axis| dice.add(hi[axis], -lo[axis]));
        let base = self.clip(dice, lo);
        let mut edge = |axis: usize| self.rows.map(|row| dice.mul(row[axis], size[axis]));
        let edges = [edge(0), edge(1), edge(2)];
        let mut farthest = 0.0f64;
        for corner in 0..8 {
            let mut clip = base;
            for (axis, edge) in edges.iter().enumerate() {
                if corner >> axis & 1 == 1 {
                    clip = DVec4::from_array([0, 1, 2, 3].map(|i| dice.add(clip[i], edge[i])));
                }
            }
            let (x, y) = (dice.div(clip.x, clip.w), dice.div(clip.y, clip.w));
            farthest = farthest.max(x.abs()).max(y.abs());
        }
        farthest
    }
}

/// The corners of a box; bit i of the index chooses along axis i.
pub fn corners([lo, hi]: Box3) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        DVec3::from_array([0, 1, 2].map(|axis| {
            if i >> axis & 1 == 1 {
                hi[axis]
            } else {
                lo[axis]
            }
        }))
    })
}

/// Distance of `p` from the border of the convex hull of `points`, less what snapping by `step` can take away:
/// negative where a rasterizer may leave `p` out. Orders the points.
pub fn covered_by(points: &mut [DVec2; 8], p: DVec2, step: f64) -> f64 {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut hull = [DVec2::ZERO; 17];
    let mut len = 0;
    let mut chain = |points: &mut dyn Iterator<Item = &DVec2>, start: usize, len: &mut usize| {
        for &point in points {
            while *len >= start + 2
                && (hull[*len - 1] - hull[*len - 2]).perp_dot(point - hull[*len - 2]) <= 0.0
            {
                *len -= 1;
            }
            hull[*len] = point;
            *len += 1;
        }
    };
    chain(&mut points.iter(), 0, &mut len);
    let upper = len - 1;
    chain(&mut points.iter().rev().skip(1), upper, &mut len);
    let mut least = f64::INFINITY;
    for side in hull[..len].windows(2) {
        let along = side[1] - side[0];
        let length = along.length();
        if length == 0.0 {
            continue;
        }
        let inward = along.perp() / length;
        // Snapping moves both ends of a side alike in the worst case.
        let snapped = step * (inward.x.abs() + inward.y.abs());
        least = least.min(inward.dot(p - side[0]) - snapped);
    }
    if least.is_finite() { least } else { -step }
}
