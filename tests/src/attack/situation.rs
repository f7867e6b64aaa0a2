//! What the attacker chooses: a camera, an image, a box or a triangle in front of it, and how everything rounds.

use glam::{DQuat, DVec2, DVec3};
use hroc_runtime::{Camera, DepthConvention, FrameUniform, Projection, SceneShape};

use super::arithmetic::{Dice, U};
use super::shaders::{Box3, KEPT, Lens, Shares, corners, covered_by};
use hroc_study::hard_cases::builder::looking;

/// Numbers of a choice, each in 0..1.
pub const NUMBERS: usize = 60;
/// Words of roundings.
pub const WORDS: usize = 20;

/// A choice.
#[derive(Clone, Debug, PartialEq)]
pub struct Genome {
    /// Continuous choices, in 0..1.
    pub numbers: [f64; NUMBERS],
    /// Which way operations round.
    pub bits: [u64; WORDS],
}

/// The range of cameras that a search is held to.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// Name in reports.
    pub name: &'static str,
    /// Coordinates of the eye, world.
    pub coordinates: [f64; 2],
    /// How far the camera turns from the axes, 1 for every way.
    pub turn: f64,
    /// From the eye to the box, world.
    pub distance: [f64; 2],
    /// Half the extent of the box, distances.
    pub extent: [f64; 2],
    /// Pixels of a side.
    pub sides: [f64; 2],
    /// Of the near plane, world.
    pub near: [f64; 2],
    /// The rasterizer's grid, pixels.
    pub step_px: f64,
    /// Perspective only.
    pub perspective: bool,
}

/// Reads a genome's numbers in turn.
struct Reader<'a>(std::slice::Iter<'a, f64>);

impl Reader<'_> {
    fn unit(&mut self) -> f64 {
        *self.0.next().expect("NUMBERS suffices")
    }

    fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }

    fn magnitude(&mut self, [lo, hi]: [f64; 2]) -> f64 {
        self.within(lo.ln(), hi.ln()).exp()
    }

    fn flag(&mut self) -> bool {
        self.unit() < 0.5
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| self.within(-1.0, 1.0)))
    }
}

/// A camera before a box.
#[derive(Clone, Debug)]
pub struct Situation {
    /// The frame as the shaders see it.
    pub lens: Lens,
    /// Bounds of an object.
    pub bounds: Box3,
    /// Bounds of a node that holds the object.
    ancestor: Box3,
    /// Where in `bounds` a triangle's vertices lie, in 0..1; one of them touches each face where it can.
    triangle: [DVec3; 3],
    /// Shares of the triangle's vertices in a fragment.
    weights: [f64; 3],
    /// Where snapping moves them, steps.
    snapped: [DVec2; 3],
    /// Which point of a silhouette a ray is aimed at.
    aimed: [f64; 4],
    clip_from_relative: glam::DMat4,
    size: DVec2,
}

impl Situation {
    /// What `genome` chooses; `None` where that is no camera or the box lies behind it.
    pub fn new(genome: &Genome, range: &Range) -> Option<Self> {
        let mut g = Reader(genome.numbers.iter());
        let scale = g.magnitude(range.coordinates);
        let position = f32s(g.vector() * scale);
        let orientation = DQuat::from_euler(
            glam::EulerRot::YXZ,
            g.within(-3.2, 3.2) * range.turn,
            g.within(-1.6, 1.6) * range.turn,
            g.within(-3.2, 3.2) * range.turn,
        );
        let size = [(); 2].map(|()| g.magnitude([range.sides[0], range.sides[1] + 1.0]) as u32);
        let distance = g.magnitude(range.distance);
        let fov_y_rad = g.within(1.0, 179.0).to_radians();
        let half_height = g.magnitude([1e-2, 2.0]) * distance;
        let perspective = g.unit() < 0.7 || range.perspective;
        let near = g.magnitude(range.near);
        let far_by = g.magnitude([1.5, 1e4]);
        let far = g.flag().then_some(near.max(distance) * far_by);
        let reversed = g.flag();
        let camera = Camera {
            orientation,
            projection: if perspective {
                Projection::Perspective { fov_y_rad }
            } else {
                Projection::Orthographic { half_height }
            },
            near,
            far,
            ..looking(position, position + DVec3::X)
        };
        // The box about a point of the image.
        let (x, y) = (g.within(-1.05, 1.05), g.within(-1.05, 1.05));
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let tangent = if perspective {
            (0.5 * fov_y_rad).tan() * distance
        } else {
            half_height
        };
        let at = position + orientation * DVec3::new(x * tangent * aspect, y * tangent, -distance);
        let largest = distance * g.magnitude(range.extent);
        let half = DVec3::from_array([(); 3].map(|()| {
            let kind = g.unit();
            let share = g.magnitude([1e-4, 1.0]);
            largest
                * match kind {
                    ..0.2 => 0.0,
                    0.8.. => 1.0,
                    _ => share,
                }
        }));
        let triangle = [(); 3].map(|()| DVec3::from_array([(); 3].map(|()| g.unit())));
        // Anywhere in the triangle; at a vertex or on a side as likely as inside.
        let [a, b] = [(); 2].map(|()| (1.5 * g.unit() - 0.25).clamp(0.0, 1.0));
        let weights = [a, (1.0 - a) * b, (1.0 - a) * (1.0 - b)];
        let aimed = [(); 4].map(|()| g.unit());
        // Farthest displacements are the likeliest.
        let mut push = || (2.0 * g.unit() - 1.0).clamp(-0.7, 0.7) / 0.7;
        let snapped = [(); 3].map(|()| DVec2::new(push(), push()));
        // By how much the bounds of an ancestor reach farther: often not at all.
        let mut beyond = || distance * g.magnitude([1e-6, 1e3]) * (4.0 * g.unit() - 3.0).max(0.0);
        let [below, above] = [(); 2].map(|()| DVec3::from_array([(); 3].map(|()| beyond())));

        let bounds = [f32s(at - half), f32s(at + half)];
        let ancestor = [f32s(bounds[0] - below), f32s(bounds[1] + above)];
        let reach = bounds[0].abs().max(bounds[1].abs());
        let shape = SceneShape {
            origin: DVec3::ZERO,
            cells: [DVec3::ZERO].into(),
            radius: reach.length(),
            reach: reach.element_sum(),
            object_count: 1,
            static_count: 1,
            subpixel_step_px: range.step_px,
        };
        let depth = if reversed {
            DepthConvention::Reversed
        } else {
            DepthConvention::Standard
        };
        let frame = FrameUniform::new(&camera, depth, size, &shape).ok()?;
        let lens = Lens::new(&frame, reversed, range.step_px);
        Some(Self {
            clip_from_relative: lens.matrix(),
            lens,
            bounds,
            ancestor,
            triangle,
            weights,
            snapped,
            aimed,
            size: DVec2::from_array(size.map(f64::from)),
        })
    }

    fn in_image(&self, p: DVec2) -> bool {
        p.cmpge(DVec2::splat(0.5)).all() && p.cmple(self.size - 0.5).all()
    }

    /// Where an eye-relative point falls, pixels.
    fn project(&self, point: DVec3) -> Option<DVec2> {
        let clip = self.clip_from_relative * point.extend(1.0);
        let at = DVec2::new(1.0 + clip.x / clip.w, 1.0 - clip.y / clip.w) * self.size / 2.0;
        (clip.w > 0.0 && at.is_finite()).then_some(at)
    }

    /// The distance at which the rasterized box of the bounds is taken to touch the near plane.
    pub fn near_margin(&self, dice: &mut Dice<'_>) -> f64 {
        let padded = self.lens.padded(dice, self.bounds, &Shares::ALL);
        self.lens.rounding(dice, padded)
    }

    /// A fragment of the object's triangle as some rasterizer may leave it: where, and how deep.
    pub fn fragment(&self, dice: &mut Dice<'_>) -> Option<(DVec2, f64)> {
        let clips = self.locals().map(|local| {
            let position = self.lens.position(dice, self.bounds[0], local);
            self.lens.clip(dice, position)
        });
        let behind = clips.map(|clip| self.lens.beyond_near(clip) >= 0.0);
        let inside = behind.iter().position(|&behind| behind)?;
        let (mut at, mut depth, mut deepest) = (DVec2::ZERO, 0.0, 0.0f64);
        for i in 0..3 {
            let clip = if behind[i] {
                clips[i]
            } else {
                self.lens.clip_near(dice, clips[inside], clips[i])
            };
            // Nothing is said of a corner on the near plane whose w is rounding for the most part.
            if clip.w < 0.5 * self.lens.near {
                return None;
            }
            let vertex = self.lens.on_screen(dice, clip);
            at += self.weights[i] * (vertex.at + self.snapped[i] * self.lens.step_px);
            depth += self.weights[i] * vertex.depth;
            deepest = deepest.max(vertex.depth.abs());
        }
        let error = if self.snapped[0].x > 0.0 { 1.0 } else { -1.0 };
        // What lies behind the far plane is clipped, but for what rounding lets pass.
        if !(-16.0 * U..=1.0 + 16.0 * U).contains(&depth) {
            return None;
        }
        let depth = dice
            .round(depth + error * 2.0 * U * deepest)
            .clamp(0.0, 1.0);
        let at = DVec2::new(f64::from(at.x as f32), f64::from(at.y as f32));
        self.in_image(at).then_some((at, depth))
    }

    /// The triangle's vertices in object space, whose zero is placed at the lower corner of the bounds.
    fn locals(&self) -> [DVec3; 3] {
        let [lo, hi] = self.bounds;
        self.triangle.map(|at| {
            // A third of the numbers stand for either face.
            let at = ((at - 0.5) * 3.0 + 0.5).clamp(DVec3::ZERO, DVec3::ONE);
            let local = f32s(at * (hi - lo));
            let down = |x: f64| f64::from((x as f32).next_down()).max(0.0);
            DVec3::select(local.cmpgt(hi - lo), local.map(down), local)
        })
    }

    /// Bounds of just the triangle, rounded outward.
    pub fn triangle_bounds(&self) -> Box3 {
        let [a, b, c] = self.locals().map(|local| self.bounds[0] + local);
        let round = |exact: DVec3, up: bool| {
            exact.map(|x| {
                let rounded = x as f32;
                let off = f64::from(rounded) - x;
                let outward = match up {
                    true if off < 0.0 => rounded.next_up(),
                    false if off > 0.0 => rounded.next_down(),
                    _ => rounded,
                };
                f64::from(outward)
            })
        };
        [round(a.min(b).min(c), false), round(a.max(b).max(c), true)]
    }

    /// Whether `hroc_keeps` keeps a fragment of the triangle, with these shares of what the tests use.
    pub fn keeps(&self, dice: &mut Dice<'_>, (p, depth): (DVec2, f64), shares: &Shares) -> bool {
        let found = self.earliest_kept(dice, self.triangle_bounds(), p, shares);
        found.is_some_and(|earliest| self.lens.shows_by(dice, earliest, depth, shares) >= 0.0)
    }

    /// The earliest depth at `p` of anything in bounds that `is_kept` lets pass.
    fn earliest_kept(
        &self,
        dice: &mut Dice<'_>,
        b: Box3,
        p: DVec2,
        shares: &Shares,
    ) -> Option<f64> {
        let b = self.lens.padded(dice, b, shares);
        let [t, meets] = self.lens.entry(dice, p, b, shares);
        let nearest = self.lens.nearest_kept(dice, b);
        let tolerance = self.lens.depth_tolerance(dice, b, nearest);
        (meets >= 0.0).then(|| self.lens.earliest_depth(dice, t, tolerance, shares))
    }

    /// Whether the ray through `p` meets padded bounds in front of `depth`: the test of common/bounds.wgsl.
    fn meets(
        &self,
        dice: &mut Dice<'_>,
        b: Box3,
        (p, depth): (DVec2, f64),
        shares: &Shares,
    ) -> bool {
        let b = self.lens.padded(dice, b, shares);
        let [t, meets] = self.lens.entry(dice, p, b, shares);
        let nearest = self.lens.nearest(dice, b);
        let tolerance = self.lens.depth_tolerance(dice, b, nearest);
        let earliest = self.lens.earliest_depth(dice, t, tolerance, shares);
        meets >= 0.0 && self.lens.shows_by(dice, earliest, depth, shares) >= 0.0
    }

    /// Whether the frustum holds the padded bounds of the triangle.
    pub fn in_frustum(&self, dice: &mut Dice<'_>, shares: &Shares) -> bool {
        let b = self.lens.padded(dice, self.triangle_bounds(), shares);
        self.lens.inside_by(dice, b) >= 0.0
    }

    /// A position and the farthest depth there that `hroc_keeps` keeps.
    pub fn grazed(&self, dice: &mut Dice<'_>) -> Option<(DVec2, f64)> {
        let p = self.aimed_position(dice)?;
        let earliest = self.earliest_kept(dice, self.bounds, p, &KEPT)?;
        let depth = self.lens.limit(earliest, &KEPT);
        let passes = self.lens.shows_by(dice, earliest, depth, &KEPT) >= 0.0;
        passes.then_some((p, depth))
    }

    /// A position whose ray meets the padded bounds in the batch occlusion test.
    pub fn met(&self, dice: &mut Dice<'_>) -> Option<DVec2> {
        let p = self.aimed_position(dice)?;
        let b = self.lens.padded(dice, self.bounds, &Shares::ALL);
        let [_, meets] = self.lens.entry(dice, p, b, &Shares::ALL);
        (meets >= 0.0).then_some(p)
    }

    /// Whether another pipeline lets the same ray pass, with other roundings.
    pub fn passes(&self, dice: &mut Dice<'_>, at: (DVec2, f64), shares: &Shares) -> bool {
        self.meets(dice, self.bounds, at, shares)
    }

    /// Whether a node that holds the object lets it pass.
    pub fn ancestor_passes(&self, dice: &mut Dice<'_>, at: (DVec2, f64), shares: &Shares) -> bool {
        self.meets(dice, self.ancestor, at, shares)
    }

    /// Whether the tests before the ray let a fragment of the bounds' box through to it: by the nearest point of
    /// the box in the shader, and by the early depth test.
    pub fn reaches_the_ray(&self, dice: &mut Dice<'_>, depth: f64) -> bool {
        let b = self.lens.padded(dice, self.bounds, &Shares::ALL);
        let nearest = self.lens.nearest(dice, b);
        let tolerance = self.lens.depth_tolerance(dice, b, nearest);
        let all = &Shares::ALL;
        let earliest = self.lens.earliest_depth(dice, nearest, tolerance, all);
        self.lens.shows_by(dice, earliest, depth, all) >= 0.0
            && self.lens.passes_early_by(dice, earliest, depth) >= 0.0
    }

    /// A pixel position whose ray meets the padded bounds, as close to their silhouette as the attacker likes.
    pub fn aimed_position(&self, dice: &mut Dice<'_>) -> Option<DVec2> {
        let b = self.lens.padded(dice, self.bounds, &Shares::ALL);
        let corners = corners(b);
        let [a, b_, along, out] = self.aimed;
        let pick = |x: f64| corners[((x * 8.0) as usize).min(7)];
        let from = pick(a);
        let to = pick(b_);
        let along = (along * 1.5).min(1.0);
        let on = from.lerp(to, along);
        let middle = (corners[0] + corners[7]) / 2.0;
        let at = self.project(on)?;
        let outward = (at - self.project(middle)?).normalize_or_zero();
        // Beyond the silhouette only roundings let the ray meet the bounds.
        let at = at + outward * (out - 0.5) * 8.0 * U * self.size.max_element() * 8.0;
        let at = DVec2::new(f64::from(at.x as f32), f64::from(at.y as f32));
        self.in_image(at).then_some(at)
    }

    /// By how many pixels the rasterized box of the bounds covers `p` in the worst case, and the smallest w of its
    /// corners; `None` where the bounds are not rasterized.
    pub fn covers_by(&self, dice: &mut Dice<'_>, p: DVec2, shares: &Shares) -> Option<[f64; 2]> {
        let padded = self.lens.padded(dice, self.bounds, &Shares::ALL);
        let outer = self.lens.rasterized(dice, padded, shares);
        let (mut corners, least_w) = self.lens.box_on_screen(dice, outer, shares)?;
        Some([covered_by(&mut corners, p, self.lens.step_px), least_w])
    }
}

/// The nearest that f32 can hold.
fn f32s(v: DVec3) -> DVec3 {
    v.as_vec3().as_dvec3()
}
