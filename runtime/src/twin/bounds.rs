//! Twin of common/bounds.wgsl.

use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};
use hroc_format::{ArchivedBvhNode, BvhNode, ObjectBounds};

use crate::frame_uniform::FrameUniform;

/// As in the shader.
pub const SLAB_WIDENING: f32 = 1.000_002_9;
const SMALLEST_DIRECTION: f32 = 1e-12;
/// As in the shader.
pub const KEPT_PADDING: f32 = 0.8;
/// As in the shader.
pub const KEPT_TOLERANCE: f32 = 0.5;
/// As in the shader.
pub const DEPTH_TOLERANCE_RELATIVE: f32 = 24.0 * f32::EPSILON;
/// As in the shader.
pub const LARGEST_NDC: f32 = 32.0;

/// An axis-aligned box, eye-relative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Box3 {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

/// A ray with its direction inverted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Eye-relative.
    pub origin: Vec3,
    /// Per unit of view depth.
    pub inverse_direction: Vec3,
}

/// The largest sum of absolute coordinates of a corner.
fn reach(b: Box3) -> f32 {
    let farthest = b.min.abs().max(b.max.abs());
    farthest.x + farthest.y + farthest.z
}

/// A box in the space of a cell, eye-relative.
pub fn relative(frame: &FrameUniform, cell: u32, lo: [f32; 3], hi: [f32; 3]) -> Box3 {
    let zero = Vec4::from(frame.cells[cell as usize]).xyz();
    Box3 {
        min: Vec3::from(lo) + zero,
        max: Vec3::from(hi) + zero,
    }
}

/// The padded bounds of a node.
pub fn padded_node(frame: &FrameUniform, node: &ArchivedBvhNode) -> Box3 {
    let BvhNode { min, max, .. } = node.to_native();
    padded(frame, relative(frame, node.cell(), min, max))
}

/// The padded bounds of an object.
pub fn padded_bounds(frame: &FrameUniform, bounds: &ObjectBounds) -> Box3 {
    padded(frame, relative(frame, bounds.cell, bounds.min, bounds.max))
}

/// By how much rounding can move a part of the box along the view.
pub fn rounding(frame: &FrameUniform, b: Box3) -> f32 {
    frame.padding_everywhere + frame.padding_per_reach * reach(b)
}

fn grown(frame: &FrameUniform, b: Box3, [everywhere, per_reach, per_depth]: [f32; 3]) -> Box3 {
    let forward = Vec4::from(frame.forward);
    let farthest = forward.xyz().max(Vec3::ZERO).dot(b.max)
        + forward.xyz().min(Vec3::ZERO).dot(b.min)
        + forward.w;
    let padding = everywhere + per_reach * reach(b) + per_depth * farthest.max(0.0);
    Box3 {
        min: b.min - padding,
        max: b.max + padding,
    }
}

/// Grows bounds by all that rasterization and rounding can move geometry: what rays are tested against.
pub fn padded(frame: &FrameUniform, b: Box3) -> Box3 {
    grown(frame, b, padding(frame))
}

/// Everywhere, per reach, per depth.
fn padding(frame: &FrameUniform) -> [f32; 3] {
    [
        frame.padding_everywhere,
        frame.padding_per_reach,
        frame.padding_per_depth,
    ]
}

/// What is rasterized for a padded box.
pub fn rasterized(frame: &FrameUniform, b: Box3) -> Box3 {
    let padding = [
        frame.box_padding_everywhere,
        frame.box_padding_per_reach,
        frame.box_padding_per_depth,
    ];
    grown(frame, b, padding)
}

/// Signed distance from a plane to the box's corner farthest along the plane's normal.
pub fn farthest_along(plane: Vec4, b: Box3) -> f32 {
    plane.xyz().max(Vec3::ZERO).dot(b.max) + plane.xyz().min(Vec3::ZERO).dot(b.min) + plane.w
}

/// Signed distance from a plane to the box's corner nearest against the plane's normal.
pub fn nearest_along(plane: Vec4, b: Box3) -> f32 {
    plane.xyz().max(Vec3::ZERO).dot(b.min) + plane.xyz().min(Vec3::ZERO).dot(b.max) + plane.w
}

/// Whether any of the box may lie in the view volume.
pub fn in_frustum(frame: &FrameUniform, b: Box3) -> bool {
    frame
        .planes
        .iter()
        .all(|plane| farthest_along(Vec4::from(*plane), b) >= 0.0)
}

/// Whether part of the box lies in front of the near plane, on it, or as near as rounding could carry it.
pub fn touches_near(frame: &FrameUniform, b: Box3) -> bool {
    nearest_along(Vec4::from(frame.planes[4]), b) <= rounding(frame, b)
}

/// Where a box that does not touch the near plane falls in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Pixels of the screen rectangle round it.
    pub area_px: f32,
    /// Distance of its farthest corner from the middle, in half widths or heights of the image.
    pub farthest_ndc: f32,
}

/// The footprint of a box that does not touch the near plane.
pub fn footprint(frame: &FrameUniform, b: Box3) -> Footprint {
    let columns = frame.clip_from_relative.map(Vec4::from);
    let size = b.max - b.min;
    let base = columns[0] * b.min.x + columns[1] * b.min.y + columns[2] * b.min.z + columns[3];
    let edges = [
        columns[0] * size.x,
        columns[1] * size.y,
        columns[2] * size.z,
    ];
    let (mut lo, mut hi) = (
        Vec2::splat(LARGEST_NDC * 2.0),
        Vec2::splat(LARGEST_NDC * -2.0),
    );
    for corner in 0..8 {
        let mut clip = base;
        for (axis, edge) in edges.into_iter().enumerate() {
            clip += if corner >> axis & 1 == 1 {
                edge
            } else {
                Vec4::ZERO
            };
        }
        let ndc = clip.xy() / clip.w;
        lo = lo.min(ndc);
        hi = hi.max(ndc);
    }
    let pixels = Vec2::new(frame.size[0] as f32, frame.size[1] as f32);
    let extent = (hi.min(Vec2::ONE) - lo.max(Vec2::NEG_ONE)).max(Vec2::ZERO) * 0.5 * pixels;
    Footprint {
        area_px: extent.x * extent.y,
        farthest_ndc: lo.abs().max(hi.abs()).max_element(),
    }
}

/// The ray through a fragment's position (pixels, y down).
pub fn pixel_ray(frame: &FrameUniform, position: Vec2) -> Ray {
    let v = Vec3::from;
    let origin = v(frame.ray_origin)
        + position.x * v(frame.ray_origin_dx)
        + position.y * v(frame.ray_origin_dy);
    let direction = v(frame.ray_direction)
        + position.x * v(frame.ray_direction_dx)
        + position.y * v(frame.ray_direction_dy);
    let guard = |d: f32| {
        let away_from_zero = if d >= 0.0 {
            SMALLEST_DIRECTION
        } else {
            -SMALLEST_DIRECTION
        };
        if d.abs() < SMALLEST_DIRECTION {
            away_from_zero
        } else {
            d
        }
    };
    Ray {
        origin,
        inverse_direction: 1.0
            / Vec3::new(guard(direction.x), guard(direction.y), guard(direction.z)),
    }
}

/// The ray parameter (view depth) where the ray enters the box, at least `near`; negative on a miss.
pub fn entry(ray: Ray, b: Box3, near: f32) -> f32 {
    entry_widened(ray, b, near, SLAB_WIDENING)
}

fn entry_widened(ray: Ray, b: Box3, near: f32, widening: f32) -> f32 {
    let x = (b.min - ray.origin) * ray.inverse_direction;
    let y = (b.max - ray.origin) * ray.inverse_direction;
    let (enter, leave) = (x.min(y), x.max(y));
    let first = enter.x.max(enter.y).max(enter.z.max(near));
    let last = leave.x.min(leave.y).min(leave.z);
    if first <= last * widening {
        first
    } else {
        -1.0
    }
}

/// No ray enters the box at a smaller parameter (view depth).
pub fn nearest_entry(frame: &FrameUniform, b: Box3) -> f32 {
    let nearest = nearest_along(Vec4::from(frame.forward), b) - rounding(frame, b);
    nearest.max(frame.near)
}

/// By how much the depths of surfaces in a padded box may err that has nothing before view depth `nearest`: what does
/// not depend on where they are entered, and what is divided by clip w there.
pub fn depth_tolerance(frame: &FrameUniform, b: Box3, nearest: f32) -> Vec2 {
    let forward = Vec4::from(frame.forward).xyz().abs();
    let reach = forward.dot(b.min.abs().max(b.max.abs()));
    Vec2::new(
        frame.depth_tolerance + frame.depth_tolerance_over_nearest / nearest,
        frame.depth_tolerance_over_w + frame.depth_tolerance_reach_over_w * reach,
    )
}

/// The depth of what starts at ray parameter `t`, rounded toward visible by `tolerance`, but for what the depth buffer's
/// own value adds.
pub fn earliest_depth(frame: &FrameUniform, reversed: bool, t: f32, tolerance: Vec2) -> f32 {
    let nearer = t / SLAB_WIDENING;
    let along = Vec4::from(frame.depth_along_ray);
    let w = along.z + along.w * nearer;
    let depth = (along.x + along.y * nearer) / w;
    let error = tolerance.x + tolerance.y / w;
    if reversed {
        depth + error
    } else {
        depth - error
    }
}

/// The depth of a padded box's nearest point, rounded toward visible.
pub fn earliest_in(frame: &FrameUniform, reversed: bool, b: Box3) -> f32 {
    let nearest = nearest_entry(frame, b);
    earliest_depth(frame, reversed, nearest, depth_tolerance(frame, b, nearest))
}

/// Whether a surface that starts at ray parameter `t` in a padded box can be at or in front of `depth`.
pub fn may_show(frame: &FrameUniform, reversed: bool, b: Box3, t: f32, depth: f32) -> bool {
    let tolerance = depth_tolerance(frame, b, nearest_entry(frame, b));
    shows(
        reversed,
        earliest_depth(frame, reversed, t, tolerance),
        depth,
    )
}

/// The same of an earliest depth.
pub fn shows(reversed: bool, earliest: f32, depth: f32) -> bool {
    shows_within(reversed, earliest, depth, DEPTH_TOLERANCE_RELATIVE)
}

fn shows_within(reversed: bool, earliest: f32, depth: f32, relative: f32) -> bool {
    let tolerance = relative * depth.abs();
    if reversed {
        earliest + tolerance >= depth
    } else {
        earliest - tolerance <= depth
    }
}

/// Whether a host's fragment at a pixel `position` with this depth lies within its object's bounds.
pub fn is_kept(
    frame: &FrameUniform,
    reversed: bool,
    bounds: Box3,
    position: Vec2,
    depth: f32,
) -> bool {
    if !depth.is_finite() {
        return false;
    }
    let b = grown(
        frame,
        bounds,
        padding(frame).map(|part| KEPT_PADDING * part),
    );
    let t = entry_widened(pixel_ray(frame, position), b, frame.near, 1.0);
    let nearest = nearest_along(Vec4::from(frame.forward), b).max(frame.near);
    let tolerance = depth_tolerance(frame, b, nearest);
    let earliest = earliest_depth(frame, reversed, t, KEPT_TOLERANCE * tolerance);
    let relative = KEPT_TOLERANCE * DEPTH_TOLERANCE_RELATIVE;
    t >= 0.0 && shows_within(reversed, earliest, depth.clamp(0.0, 1.0), relative)
}
