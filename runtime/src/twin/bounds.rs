//! Twin of common/bounds.wgsl.

use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};

use crate::frame_uniform::FrameUniform;

/// As in the shader.
pub const SLAB_WIDENING: f32 = 1.000_002_9;
const SMALLEST_DIRECTION: f32 = 1e-12;
/// As in the shader.
pub const KEPT_PADDING: f32 = 0.8;
/// As in the shader.
pub const KEPT_TOLERANCE: f32 = 0.5;
/// As in the shader.
pub const LARGEST_NDC: f32 = 32.0;

/// An axis-aligned box, world.
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
    /// World.
    pub origin: Vec3,
    /// Per unit of view depth.
    pub inverse_direction: Vec3,
}

fn grown(frame: &FrameUniform, b: Box3, everywhere: f32, per_depth: f32) -> Box3 {
    let forward = Vec4::from(frame.forward);
    let farthest = forward.xyz().max(Vec3::ZERO).dot(b.max)
        + forward.xyz().min(Vec3::ZERO).dot(b.min)
        + forward.w;
    let padding = everywhere + per_depth * farthest.max(0.0);
    Box3 {
        min: b.min - padding,
        max: b.max + padding,
    }
}

/// Grows bounds by all that rasterization and rounding can move geometry: what rays are tested against.
pub fn padded(frame: &FrameUniform, lo: [f32; 3], hi: [f32; 3]) -> Box3 {
    let b = Box3 {
        min: lo.into(),
        max: hi.into(),
    };
    grown(frame, b, frame.padding_world, frame.padding_per_depth)
}

/// What is rasterized for a padded box.
pub fn rasterized(frame: &FrameUniform, b: Box3) -> Box3 {
    grown(
        frame,
        b,
        frame.box_padding_world,
        frame.box_padding_per_depth,
    )
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
    nearest_along(Vec4::from(frame.planes[4]), b) <= frame.padding_world
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
    let columns = frame.clip_from_world.map(Vec4::from);
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

/// The depth of what starts at ray parameter `t`, rounded toward visible within a share of the tolerance, but for
/// what the map's depth adds.
pub fn earliest_depth(frame: &FrameUniform, reversed: bool, t: f32, share: f32) -> f32 {
    let nearer = t / SLAB_WIDENING;
    let along = Vec4::from(frame.depth_along_ray);
    let w = along.z + along.w * nearer;
    let entry_depth = (along.x + along.y * nearer) / w;
    let tolerance = share * (frame.depth_tolerance + frame.depth_tolerance_over_w / w);
    if reversed {
        entry_depth + tolerance
    } else {
        entry_depth - tolerance
    }
}

/// Whether a surface that starts at ray parameter `t` can be at or in front of `depth`.
pub fn may_show(frame: &FrameUniform, reversed: bool, t: f32, depth: f32) -> bool {
    shows_within(frame, reversed, t, depth, 1.0)
}

fn shows_within(frame: &FrameUniform, reversed: bool, t: f32, depth: f32, share: f32) -> bool {
    let tolerance = share * frame.depth_tolerance_relative * depth.abs();
    let earliest = earliest_depth(frame, reversed, t, share);
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
    lo: [f32; 3],
    hi: [f32; 3],
    position: Vec2,
    depth: f32,
) -> bool {
    if !depth.is_finite() {
        return false;
    }
    let bare = Box3 {
        min: lo.into(),
        max: hi.into(),
    };
    let b = grown(
        frame,
        bare,
        KEPT_PADDING * frame.padding_world,
        KEPT_PADDING * frame.padding_per_depth,
    );
    let t = entry_widened(pixel_ray(frame, position), b, frame.near, 1.0);
    t >= 0.0 && shows_within(frame, reversed, t, depth.clamp(0.0, 1.0), KEPT_TOLERANCE)
}
