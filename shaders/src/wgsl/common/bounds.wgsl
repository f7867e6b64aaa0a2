//!import common/frame
//!import common/depth
// Conservative tests of padded bounds, against the `frame` of the importing stage. Twin: runtime/src/twin/bounds.rs.

// Leaves out one safeguard, to show that tests notice (hroc_runtime::Mutant). 0: none.
override BROKEN: u32 = 0;
const BROKEN_COVERAGE: u32 = 1;
const BROKEN_DEPTH: u32 = 2;
const BROKEN_SLAB: u32 = 3;
const BROKEN_NEAR: u32 = 4;
const BROKEN_PRUNING: u32 = 5;
const BROKEN_FINITE: u32 = 6;

// Widens the interval of the slab test: 24 * 2^-23 covers the rounding of both its ends, here and where the same
// was asked before (frame_uniform.rs, "Two pipelines").
const SLAB_WIDENING: f32 = 1.0000029;
// The share of padding and tolerance within which a host's fragment is kept (object.wgsl). The rest is for tests
// that ask the same of the same ray and round differently.
const KEPT_PADDING: f32 = 0.8;
const KEPT_TOLERANCE: f32 = 0.5;
// Corners farther out than this many half widths of the image lose too much of their place to rounding.
const LARGEST_NDC: f32 = 32.0;
// Directions are kept this far from zero so that no 0 * inf can arise.
const SMALLEST_DIRECTION: f32 = 1e-12;

struct Box {
    min: vec3f,
    max: vec3f,
}

struct Ray {
    origin: vec3f,
    inverse_direction: vec3f,
}

fn grown(box: Box, everywhere: f32, per_depth: f32) -> Box {
    let forward = frame.forward;
    let farthest = dot(max(forward.xyz, vec3f(0.0)), box.max) + dot(min(forward.xyz, vec3f(0.0)), box.min) + forward.w;
    let padding = select(everywhere + per_depth * max(farthest, 0.0), 0.0, BROKEN == BROKEN_COVERAGE);
    return Box(box.min - padding, box.max + padding);
}

// Grows bounds by all that rasterization and rounding can move geometry, see frame_uniform.rs: what rays are
// tested against.
fn padded(lo: vec3f, hi: vec3f) -> Box {
    return grown(Box(lo, hi), frame.padding_world, frame.padding_per_depth);
}

// What is rasterized for a padded box: it covers the centre of every pixel whose ray meets the box.
fn rasterized(box: Box) -> Box {
    return grown(box, frame.box_padding_world, frame.box_padding_per_depth);
}

// Signed distance from a plane to the box's corner farthest along the plane's normal.
fn farthest_along(plane: vec4f, box: Box) -> f32 {
    return dot(max(plane.xyz, vec3f(0.0)), box.max) + dot(min(plane.xyz, vec3f(0.0)), box.min) + plane.w;
}

// Signed distance from a plane to the box's corner nearest against the plane's normal.
fn nearest_along(plane: vec4f, box: Box) -> f32 {
    return dot(max(plane.xyz, vec3f(0.0)), box.min) + dot(min(plane.xyz, vec3f(0.0)), box.max) + plane.w;
}

fn in_frustum(box: Box) -> bool {
    var inside = true;
    for (var i = 0u; i < 6u; i++) {
        inside = inside && farthest_along(frame.planes[i], box) >= 0.0;
    }
    return inside;
}

// Part of the box lies in front of the near plane, on it, or as near as rounding could carry it: its faces cannot
// be relied on to leave fragments there.
fn touches_near(box: Box) -> bool {
    return nearest_along(frame.planes[4], box) <= frame.padding_world && BROKEN != BROKEN_NEAR;
}

// Where a box that does not touch the near plane (so w > 0 at every corner) falls in the image.
struct Footprint {
    // Pixels of the screen rectangle round it. But for rounding no smaller for a box than for one inside it.
    area_px: f32,
    // Distance of its farthest corner from the middle, in half widths or heights of the image.
    farthest_ndc: f32,
}

fn footprint(box: Box) -> Footprint {
    let size = box.max - box.min;
    let base = frame.clip_from_world * vec4f(box.min, 1.0);
    let x = frame.clip_from_world[0] * size.x;
    let y = frame.clip_from_world[1] * size.y;
    let z = frame.clip_from_world[2] * size.z;
    var lo = vec2f(LARGEST_NDC * 2.0);
    var hi = vec2f(LARGEST_NDC * -2.0);
    for (var corner = 0u; corner < 8u; corner++) {
        let clip = base
            + select(vec4f(0.0), x, (corner & 1u) != 0u)
            + select(vec4f(0.0), y, (corner & 2u) != 0u)
            + select(vec4f(0.0), z, (corner & 4u) != 0u);
        let ndc = clip.xy / clip.w;
        lo = min(lo, ndc);
        hi = max(hi, ndc);
    }
    let extent = max(min(hi, vec2f(1.0)) - max(lo, vec2f(-1.0)), vec2f(0.0)) * 0.5 * vec2f(frame.size);
    let farthest = max(abs(lo), abs(hi));
    return Footprint(extent.x * extent.y, max(farthest.x, farthest.y));
}

// The ray through a fragment's position (pixels, centre of the pixel, y down).
fn pixel_ray(position: vec2f) -> Ray {
    let origin = frame.ray_origin + position.x * frame.ray_origin_dx + position.y * frame.ray_origin_dy;
    let direction = frame.ray_direction + position.x * frame.ray_direction_dx + position.y * frame.ray_direction_dy;
    let away_from_zero = select(vec3f(-SMALLEST_DIRECTION), vec3f(SMALLEST_DIRECTION), direction >= vec3f(0.0));
    let guarded = select(direction, away_from_zero, abs(direction) < vec3f(SMALLEST_DIRECTION));
    return Ray(origin, 1.0 / guarded);
}

// The ray parameter (view depth) where the ray enters the box, at least `near`; negative on a miss. A ray
// within the plane of a face may be missed: boxes are padded, so nothing is there.
fn entry(ray: Ray, box: Box, near: f32) -> f32 {
    return entry_widened(ray, box, near, select(SLAB_WIDENING, 1.0, BROKEN == BROKEN_SLAB));
}

fn entry_widened(ray: Ray, box: Box, near: f32, widening: f32) -> f32 {
    let a = (box.min - ray.origin) * ray.inverse_direction;
    let b = (box.max - ray.origin) * ray.inverse_direction;
    let enter = min(a, b);
    let leave = max(a, b);
    let first = max(max(enter.x, enter.y), max(enter.z, near));
    let last = min(min(leave.x, leave.y), leave.z);
    return select(-1.0, first, first <= last * widening);
}

// The depth of what starts at ray parameter `t`, before and after rounding toward visible, within a share of the
// tolerance. What the map's own depth adds is left to the caller.
fn earliest_depth(t: f32, share: f32) -> f32 {
    let nearer = t / SLAB_WIDENING;
    let along = frame.depth_along_ray;
    let w = along.z + along.w * nearer;
    let entry_depth = (along.x + along.y * nearer) / w;
    let tolerance = select(share * (frame.depth_tolerance + frame.depth_tolerance_over_w / w), 0.0, BROKEN == BROKEN_DEPTH);
    return select(entry_depth - tolerance, entry_depth + tolerance, REVERSED_DEPTH);
}

// Whether a surface that starts at ray parameter `t` can be at or in front of `depth` (the value in the
// depth buffer): compared in clip depth, rounded toward visible.
fn may_show(t: f32, depth: f32) -> bool {
    return shows_within(t, depth, 1.0);
}

fn shows_within(t: f32, depth: f32, share: f32) -> bool {
    let tolerance = select(share * frame.depth_tolerance_relative * abs(depth), 0.0, BROKEN == BROKEN_DEPTH);
    if (REVERSED_DEPTH) {
        return earliest_depth(t, share) + tolerance >= depth;
    }
    return earliest_depth(t, share) - tolerance <= depth;
}

// Whether `x` is neither infinite nor NaN. It goes by the bits, because a compiler may assume that every float is
// finite and drop a comparison such as `x == x`.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

// Whether a host's fragment at `position` lies within its object's bounds: what every test of the same ray finds.
fn is_kept(lo: vec3f, hi: vec3f, position: vec4f) -> bool {
    // A rasterizer may give a triangle without area a depth that is no number. `clamp` would turn it into 0 or 1, which
    // lies in front of every bounds in one of the two conventions, or behind, and the depth buffer may hold the other.
    if (!is_finite(position.z) && BROKEN != BROKEN_FINITE) {
        return false;
    }
    let box = grown(Box(lo, hi), KEPT_PADDING * frame.padding_world, KEPT_PADDING * frame.padding_per_depth);
    let t = entry_widened(pixel_ray(position.xy), box, frame.near, 1.0);
    // The depth buffer holds the clamped value; a triangle clipped at the near plane can come out beyond it.
    return t >= 0.0 && shows_within(t, clamp(position.z, 0.0, 1.0), KEPT_TOLERANCE);
}
