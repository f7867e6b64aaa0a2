//! What the shaders of one frame know of the camera, and by how much bounds must grow.
//!
//! # Why an image is exact
//!
//! Let a fragment of object `x` show at pixel `p` with depth `d`, and let `x` not be in V. The fragment was
//! kept by `hroc_keeps` (object.wgsl), so the ray through `p` meets the bounds of `x`, grown by a share of
//! their padding, and enters them at or in front of `d`; and `d` is at or in front of the
//! occlusion map. Exactly one ancestor-or-self `g` of the leaf of `x` is a group. Every node between `g` and
//! the leaf has bounds that contain the leaf's, the padding of the larger box is no smaller, and all of it is
//! more than that share by what the roundings of two tests of one ray can differ ("Two pipelines"), so the ray
//! passes them all and reaches the leaf. What remains is that the rasterizer covers `p` with the box of `g`: that is
//! what the box's own padding is for, since the ray meets the padded bounds of `g`. That `hroc_keeps` loses no
//! true fragment is what the padding of the bounds is for. Neither relies on where the rasterizer puts the
//! geometry.
//!
//! `d` is a finite number, because `hroc_keeps` refuses any other. A rasterizer that divides by the area of a triangle
//! before it snaps the corners finds infinity or NaN where they lie on one line, and snapping can give that triangle
//! pixels to cover. The argument cannot speak of such a fragment: all comparisons with NaN are false, `clamp` makes 0
//! or 1 of it, and the depth buffer holds 0 or 1 as the driver likes. No true fragment is refused: its depth lies
//! between those of the triangle's clipped corners, and they are finite.
//!
//! Roundoff unit `u = 2^-23` (Vulkan lets an operation return either neighbour); `a` is the tangent of half the larger
//! field of view, jitter included (0 for an orthographic camera); `W` is the larger side of the image in pixels. A step
//! is the rasterizer's subpixel step: 1/16 px is the coarsest that the API allows, and taken unless the device was
//! probed.
//!
//! # Eye-relative positions
//!
//! Positions have their zero at `z`, the eye on a grid of at most 2^-22 of the distance of the farthest cell
//! (`zero_near`). The offset of a cell is its origin less `z`, subtracted in f64 and rounded to f32 once; what
//! the shaders get is by definition where the cell is, in every pipeline. On that grid an offset has at most 24 bits, so
//! that it is not rounded at all, unless the cell's own grid is finer; then it is off by `u/2` of itself, and the cell's
//! objects, which are near its origin, are that far away too. The reach `S` of a box is the largest sum of
//! absolute coordinates of a corner, plus that of the eye, which is half a step of the grid at most. What rounds in
//! proportion to coordinates therefore rounds in proportion to the distance from the eye, wherever the
//! scene lies.
//!
//! # Padding of bounds: what rays are tested against
//!
//! The bounds `B` of an object contain its vertices but for what depends on the eye (the bake sees to that, see
//! `world_bounds.rs` of hroc-preprocess), so what counts is everything that moves a point between cell space and the
//! depth buffer.
//!
//! 1. *Snapping.* The rasterizer moves vertices to a subpixel grid; a triangle's hull moves by at most
//!    one step, plus the rounding of the viewport transform, `8 u W` px. Where depth
//!    is interpolated with the snapped triangle's barycentric coordinates, a fragment's depth is that of a
//!    point `X` of the triangle that projects within a step of `p`; the ray passes within a step of `X` at
//!    the depth of `X`. (Rasterizers that extrapolate from unsnapped vertices are why `hroc_keeps` exists.)
//! 2. *Clip transform.* The vertex about the eye errs by `5.1 u` of itself on each axis, which the bake leaves to
//!    this padding: `5.1 u S`. `clip = M x` in f32: each component errs by `4.5 u (sum |M_i||x_i| + |M_3|)`, four
//!    products, three sums, the entries of `M` rounded. For x and w that is, in world units at the point's
//!    depth, `4.5 u S (1 + a)`; the same for y. The error of w also moves the point along the view, by
//!    `4.5 u S`. All three at right angles: no longer than `7.8 u S (1 + a)`. A vertex that clipping makes
//!    is interpolated with `3 u S (1 + a)`.
//! 3. *Eye and ray.* The eye rounded to f32: `u S / 2`. A corner moved by its cell's offset, padded, and its distance to
//!    the eye: `3 u S`. The direction through `p`, computed as `d + x dx + y dy`: relative to view depth
//!    `3 u (1 + 3 (a_x + a_y))`.
//! 4. *Slab.* Each parameter has a relative error of at most `6 u` (two differences, a division of 2.5 ulp,
//!    a product), which Ize 2013 covers by widening the interval (`2 gamma(3)`, about `6 u`, where division is
//!    correctly rounded). As the padding makes the thinnest box thick, it covers that here.
//!
//! Points 2 and 3 sum to `19.4 u S (1 + a)`. Point 1 and the direction scale with view depth. Pixels are square,
//! so a step along both axes is `sqrt 2` of one long, 0.71 of the sum of both sides that is taken; and growing
//! a box by `r` along every axis contains every ball of radius `r` about its points.
//!
//! # Two pipelines, and nodes round their leaves
//!
//! The host's shader that keeps a fragment and the batch occlusion test ask the same of the same ray, but
//! compilers may fuse and order what they round as they like. So `hroc_keeps` asks with 0.8 of the padding, half
//! of the depth tolerance and an interval that is not widened, and a fifth of the padding is for the difference:
//! - The uniform is the same for both. A corner moved and padded errs by `2 u S`, the origin of an orthographic ray by
//!   `2 u S`, in each of two tests: `8 u S`.
//! - A node's box contains those of its leaves as they are stored: in one cell by comparison, between two by outward
//!   rounding of the bake. About the eye both are moved by offsets that each may be off by `0.51 u S`: `1.1 u S`. The
//!   reach of the larger box is no smaller but for that, so neither is its padding.
//! - Together `9.1 u S`, hence a padding of `48 u S (1 + a)`: a fifth is `9.6`, and of the rest 38 remain for the 19.4
//!   above. The attack of the tests needs less than a hundredth of it in perspective, where the part that scales with
//!   depth has as much to spare.
//! - A component of the direction errs by `u (2 + 4 (a_x + a_y))` in each: a fifth of `20 u (1 + 3 (a_x + a_y))`.
//!   Likewise the origin's part that grows with the half extents of an orthographic image.
//! - The ends of the interval, `6 u` each, in each: `24 u` (`SLAB_WIDENING` in common/bounds.wgsl).
//! - Depth along the ray: see "Depth tolerance".
//!
//! # Clipping
//!
//! A rasterizer clips by clip depth, whose rounding may let geometry pass in front of the near plane or behind the far
//! one. Where depth is linear (orthographic) it errs by `4.5 u` of its offset, which for reversed depth is `u` of the
//! far distance everywhere; in perspective with standard depth the far plane is told from what is behind it by
//! `near / far` of a depth only. `blur_planes` moves the planes that tests compare with out by twice that.
//!
//! # Padding of boxes: what is rasterized
//!
//! A ray that meets the padded bounds by the f32 slab test passes within `48 u S (1 + a)` of them (the
//! widening and what it is there for), plus point 3. The box errs by the second part of point 2 and its corners by a
//! step. The shader divides by w itself and the viewport scales the quotient: `2.5 u + 2 u` of an
//! offset of at most 32 half widths (`LARGEST_NDC`; farther boxes are opened or drawn untested), `72 u W` px.
//! The padding of boxes takes `64 u S (1 + a)` for `48 + 7.8 + 3.5`, the step and `80 u W` px scale with
//! depth. A padded silhouette lies outside the bare one by that much everywhere, and snapping
//! moves it by no more, so it covers `p`: for any displacement of its vertices a closed box covers by
//! front faces whatever it covers at all, as front and back faces over a point are equally many.
//!
//! All that needs w > 0 at its corners. A box is taken to touch the near plane from a distance of
//! `48 u S` on, which is more than the `9 u S` that the distance and w can err by: a box that reaches far beside the
//! eye may have a corner at the plane whose w comes out negative.
//!
//! # Depth tolerance
//!
//! What a fragment's depth may err by, where the depth buffer holds f32 from 0 to 1 and neither bias nor unclipped
//! depth is used ([`Drawer`](crate::Drawer) asks for that):
//!
//! 1. *Transform.* A corner has the depth `(z + e_z) / (w + e_w)`. Writing `w' = w + e_w`, this is the depth of the
//!    point moved to `w'` (the padding covers the move) plus `(e_z - z_scale e_w) / w'`. The rows of z and w go along
//!    the view, so both errors go by `R = sum |f_i| |x_i| + |f . eye|` for the view direction `f`: together
//!    `4.5 u (2 |z_scale| R + |z_offset|) / w'`. A corner that clipping makes adds `3 u` of the same. Depth and `1 / w`
//!    are both linear in the image, so a fragment inside has that bound with its own w.
//! 2. *Interpolation.* The weights of three corners err by `2 u` together, of the largest depth of the clipped
//!    triangle.
//! 3. *The value itself.* The division by w (`2.5 u`), the viewport's depth range and the buffer's rounding: `4 u`.
//!
//! The test's own depth along the ray comes from two products, two sums and a division, and from coefficients that are
//! rounded: `7 u` of the value, and `u |z_scale|` where its terms cancel.
//!
//! All of it goes by the box. The reach of the padded box along the view bounds `R`, and w where the ray enters is no
//! larger than the fragment's. For the largest depth, reversed depth in perspective gives `|z_offset| / n` or less, where
//! `n` is the view depth of the box's nearest point: every corner is in the padded box. One that clipping at the near
//! plane makes has a depth of 1, as has `n` then, or up to twice that, as `3 u R` may be half of the plane's distance.
//! (Where it is more, its depth is rounding for the most part, and nothing is said.) So an object is granted what its own
//! nearest point needs: at 60 m, with an infinite far plane, a third of a millimetre. With standard depth everything but
//! the nearest is close to 1, and nothing better than 1 can be said; likewise for an orthographic camera, where depth is
//! linear and the other terms are as large.
//!
//! | term | a fragment, and the test that keeps it, err by | granted |
//! |---|---|---|
//! | transform, over w | `(4.5 + 3 + 0.5) u (2 \|z_scale\| R + \|z_offset\|)` | `16 u` of that |
//! | largest depth, reversed in perspective | `2 * 2 u \|z_offset\| / n` | `8 u` of that |
//! | largest depth, otherwise | `2 u` | `4 u` |
//! | the value itself | `(4 + 7) u` | `24 u` |
//!
//! `hroc_keeps` asks with half of each. The other half is for a second test of the same ray, which errs by as much as
//! the first: by `12 u` of the value together, and where terms cancel by less than what goes over w. The second test may
//! be that of an ancestor. Its box contains the leaf's, so its reach is no smaller; and it is granted twice what
//! `hroc_keeps` took, far more than the few `u` by which a tolerance itself is rounded. Its nearest point is no
//! farther: either finds `n` with `6 u S` of error, corners are `1.1 u S` apart ("Two pipelines"), and `hroc_keeps` takes
//! the nearest point of its smaller box as it is, where tests subtract another `48 u S`. That smaller box still reaches
//! in front of every corner: its padding is `38 u S`, a corner's w errs by `9.6 u S` and the distance by `6 u S`.
//!
//! Boxes are rasterized at the earliest depth of their nearest point, and `24 u` nearer than what `shows` adds for the
//! map's value. So whatever the early depth test turns away `shows` would, too, if a rasterizer interpolates equal
//! depths within that.
//!
//! The attack of the tests needs 0.97 of the half that goes by the largest depth, and 0.45 of all halves together.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, DVec4};

use crate::camera::{Camera, CameraError, DepthConvention, View};
use crate::scene::SceneShape;

/// Cells that shaders know: those of the bake and those of objects that a host adds.
pub const CELL_SLOTS: usize = 256;
/// Coordinates are kept below this, so that no sum of them overflows.
const LARGEST: f64 = f32::MAX as f64 / 16.0;

/// The roundoff unit assumed of the GPU.
const U: f64 = 1.0 / (1 << 23) as f64;
/// The uniform `Frame` of common/frame.wgsl; fields are documented there.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs)]
pub struct FrameUniform {
    pub clip_from_relative: [[f32; 4]; 4],
    pub planes: [[f32; 4]; 6],
    pub forward: [f32; 4],
    pub ray_origin: [f32; 3],
    pub padding_everywhere: f32,
    pub ray_origin_dx: [f32; 3],
    pub padding_per_depth: f32,
    pub ray_origin_dy: [f32; 3],
    pub near: f32,
    pub ray_direction: [f32; 3],
    pub object_count: u32,
    pub ray_direction_dx: [f32; 3],
    pub node_count: u32,
    pub ray_direction_dy: [f32; 3],
    pub depth_tolerance: f32,
    pub depth_along_ray: [f32; 4],
    pub depth_tolerance_over_w: f32,
    pub depth_tolerance_over_nearest: f32,
    pub size: [u32; 2],
    pub box_padding_everywhere: f32,
    pub box_padding_per_depth: f32,
    pub static_count: u32,
    pub depth_tolerance_reach_over_w: f32,
    pub eye_high: [f32; 3],
    pub padding_per_reach: f32,
    pub eye_low: [f32; 3],
    pub box_padding_per_reach: f32,
    pub cells: [[f32; 4]; CELL_SLOTS],
}

impl FrameUniform {
    /// The uniform for `camera` over a scene of `shape`, into targets of `size` pixels.
    ///
    /// # Errors
    /// If the camera or the size is degenerate.
    pub fn new(
        camera: &Camera,
        depth: DepthConvention,
        size: [u32; 2],
        shape: &SceneShape,
    ) -> Result<Self, CameraError> {
        let zero = zero_near(camera.position, &shape.cells);
        // The far plane of an orthographic camera that has none goes by how far the scene reaches from the eye.
        let reach_of_scene = (camera.position - shape.origin).length() + shape.radius;
        let mut view = camera.view(depth, size, zero, reach_of_scene)?;
        let clip_from_relative = view.clip_from_world();
        blur_planes(&mut view);
        let [width, height] = size.map(f64::from);
        let right = view.right * view.half_width;
        let up = view.up * view.half_height;
        // Across the image from the centre of its top left corner, per pixel.
        let corner = up - right + view.shift();
        let dx = right * (2.0 / width);
        let dy = up * (-2.0 / height);

        // The eye itself, eye-relative: half a step of the grid at most.
        let eye_reach = view.eye.abs().element_sum();
        // World per pixel at unit depth, both axes together.
        let pixel = 2.0 * view.half_width / width + 2.0 * view.half_height / height;
        let larger_side = width.max(height);
        let coverage = (shape.subpixel_step_px + 8.0 * U * larger_side) * pixel;
        let box_coverage = (shape.subpixel_step_px + 80.0 * U * larger_side) * pixel;
        let [reach_x, reach_y] = view.reach_across();
        let direction = if view.perspective {
            20.0 * U * (1.0 + 3.0 * (reach_x + reach_y))
        } else {
            40.0 * U * (reach_x + reach_y)
        };
        let slope = if view.perspective {
            reach_x.max(reach_y)
        } else {
            0.0
        };
        // Everywhere, per reach, per depth.
        let paddings = |coverage: f64, ulps: f64| {
            let per_reach = ulps * U * (1.0 + slope);
            let everywhere = per_reach * eye_reach;
            if view.perspective {
                [everywhere, per_reach, coverage + direction]
            } else {
                [everywhere + coverage + direction, per_reach, 0.0]
            }
        };
        let padding = paddings(coverage, 48.0).map(round_up);
        let box_padding = paddings(box_coverage, 64.0).map(round_up);

        let (origin, origin_dx, origin_dy, direction, direction_dx, direction_dy, along) =
            if view.perspective {
                (
                    view.eye,
                    DVec3::ZERO,
                    DVec3::ZERO,
                    view.forward + corner,
                    dx,
                    dy,
                    DVec4::new(view.z_offset, view.z_scale, 0.0, 1.0),
                )
            } else {
                (
                    view.eye + corner,
                    dx,
                    dy,
                    view.forward,
                    DVec3::ZERO,
                    DVec3::ZERO,
                    DVec4::new(view.z_offset, view.z_scale, 1.0, 0.0),
                )
            };
        let eye_along = view.forward.dot(view.eye).abs();
        // With reversed depth nothing in a box is deeper than its nearest point; otherwise than 1.
        let deepest_is_nearest = view.perspective && depth == DepthConvention::Reversed;
        let [deepest, over_nearest] = match deepest_is_nearest {
            true => [0.0, view.z_offset.abs()],
            false => [1.0, 0.0],
        };
        Ok(Self {
            clip_from_relative: clip_from_relative.as_mat4().to_cols_array_2d(),
            planes: planes(&view).map(|plane| plane.as_vec4().to_array()),
            forward: view
                .forward
                .extend(-view.forward.dot(view.eye))
                .as_vec4()
                .to_array(),
            ray_origin: origin.as_vec3().to_array(),
            padding_everywhere: padding[0],
            ray_origin_dx: origin_dx.as_vec3().to_array(),
            padding_per_depth: padding[2],
            ray_origin_dy: origin_dy.as_vec3().to_array(),
            // Visible geometry starts at the near plane; rounded toward the eye.
            near: (view.near * (1.0 - 8.0 * U)) as f32,
            ray_direction: direction.as_vec3().to_array(),
            object_count: shape.object_count,
            ray_direction_dx: direction_dx.as_vec3().to_array(),
            node_count: shape.node_count(),
            ray_direction_dy: direction_dy.as_vec3().to_array(),
            depth_tolerance: round_up(4.0 * U * deepest),
            depth_along_ray: along.as_vec4().to_array(),
            depth_tolerance_over_w: round_up(
                16.0 * U * (2.0 * view.z_scale.abs() * eye_along + view.z_offset.abs()),
            ),
            depth_tolerance_over_nearest: round_up(8.0 * U * over_nearest),
            size,
            box_padding_everywhere: box_padding[0],
            box_padding_per_depth: box_padding[2],
            static_count: shape.static_count,
            depth_tolerance_reach_over_w: round_up(32.0 * U * view.z_scale.abs()),
            eye_high: zero.as_vec3().to_array(),
            padding_per_reach: padding[1],
            eye_low: (zero - zero.as_vec3().as_dvec3()).as_vec3().to_array(),
            box_padding_per_reach: box_padding[1],
            cells: cell_offsets(zero, &shape.cells),
        })
    }

    /// Where the zero of eye-relative positions lies in the source's coordinates, to the 48 bits that the shaders have.
    pub fn zero(&self) -> DVec3 {
        let [high, low] = [self.eye_high, self.eye_low].map(|x| DVec3::from(x.map(f64::from)));
        high + low
    }
}

/// The zero of eye-relative positions: the eye on a grid of 2^-23 to 2^-22 of its distance from the farthest cell. The
/// offset of a cell then has no more bits than f32 holds, unless the cell's own grid is finer.
fn zero_near(eye: DVec3, cells: &[DVec3]) -> DVec3 {
    let far = |cell: &DVec3| (*cell - eye).abs().max_element();
    let farthest = cells.iter().map(far).fold(0.0, f64::max);
    let step = (farthest.log2().ceil() - 23.0).exp2();
    let snapped = (eye / step).round() * step;
    if snapped.is_finite() { snapped } else { eye }
}

/// Moves the near and far planes out by what clip depth cannot tell from them: a rasterizer that clips by it may leave
/// fragments there ("Clipping" above). An orthographic eye moves back for that, so that ray parameters stay positive.
fn blur_planes(view: &mut View) {
    let [scale, offset] = [view.z_scale.abs(), view.z_offset.abs()];
    if !view.perspective {
        // Depth is linear: rounding of the offset is the same length everywhere.
        let blur = 9.0 * U * offset / scale;
        view.eye -= view.forward * blur;
        view.z_offset -= view.z_scale * blur;
        view.far += 2.0 * blur;
    } else if view.far.is_finite() {
        // A point of the image at view depth w has coordinates of no more than `spread * w` in sum.
        let [x, y] = view.reach_across();
        let spread = 3_f64.sqrt() * (1.0 + x * x + y * y).sqrt();
        // By how much clip depth changes with w there, against its own end of the range.
        let slope = match view.z_scale > 0.0 {
            true => view.z_scale - 1.0,
            false => scale,
        };
        let own = if view.z_scale > 0.0 {
            1.0 + scale
        } else {
            scale
        };
        let relative = 9.0 * U * (own * spread + offset / view.far) / slope;
        // Beyond half of the depth the plane tells nothing.
        view.far = if slope > 0.0 && relative < 0.5 {
            view.far / (1.0 - relative)
        } else {
            f64::INFINITY
        };
    }
}

/// From `zero` to each cell. What is so far that sums of coordinates could overflow is drawn in to where they cannot.
fn cell_offsets(zero: DVec3, cells: &[DVec3]) -> [[f32; 4]; CELL_SLOTS] {
    let mut offsets = [[0.0; 4]; CELL_SLOTS];
    for (offset, cell) in offsets.iter_mut().zip(cells) {
        let from_zero = (*cell - zero).clamp(DVec3::splat(-LARGEST), DVec3::splat(LARGEST));
        *offset = from_zero.extend(0.0).as_vec4().to_array();
    }
    offsets
}

/// Inward unit planes in f64: left, right, bottom, top, near, far.
fn planes(view: &View) -> [DVec4; 6] {
    // Perspective: the side planes contain the eye and lean outward by the angle to the image's border.
    let side = |axis: DVec3, reach: f64| {
        if view.perspective {
            let normal = (view.forward * reach + axis).normalize();
            normal.extend(-normal.dot(view.eye))
        } else {
            axis.extend(reach - axis.dot(view.eye))
        }
    };
    let depth = view.forward.dot(view.eye);
    let far = if view.far.is_finite() {
        (-view.forward).extend(view.far + depth)
    } else {
        DVec4::W
    };
    let [x, y] = view.middle;
    [
        side(view.right, view.half_width - x),
        side(-view.right, view.half_width + x),
        side(view.up, view.half_height - y),
        side(-view.up, view.half_height + y),
        view.forward.extend(-view.near - depth),
        far,
    ]
}

/// The smallest f32 at or above a non-negative finite `x`.
fn round_up(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x {
        rounded.next_up()
    } else {
        rounded
    }
}
