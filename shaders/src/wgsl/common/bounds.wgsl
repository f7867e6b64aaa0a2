//!import common/types
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
// The part of the depth tolerance that is a share of the depth itself: 24 * 2^-23.
const DEPTH_TOLERANCE_RELATIVE: f32 = 2.8610229e-6;
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

// The largest sum of absolute coordinates of a corner.
fn reach(box: Box) -> f32 {
    let farthest = max(abs(box.min), abs(box.max));
    return farthest.x + farthest.y + farthest.z;
}

fn grown(box: Box, everywhere: f32, per_reach: f32, per_depth: f32) -> Box {
    let forward = frame.forward;
    let farthest = dot(max(forward.xyz, vec3f(0.0)), box.max) + dot(min(forward.xyz, vec3f(0.0)), box.min) + forward.w;
    let padding = select(
        everywhere + per_reach * reach(box) + per_depth * max(farthest, 0.0),
        0.0,
        BROKEN == BROKEN_COVERAGE,
    );
    return Box(box.min - padding, box.max + padding);
}

// A box in the space of a cell, eye-relative.
fn relative(cell: u32, lo: vec3f, hi: vec3f) -> Box {
    let zero = frame.cells[cell].xyz;
    return Box(lo + zero, hi + zero);
}

// Grows bounds by all that rasterization and rounding can move geometry, see frame_uniform.rs: what rays are
// tested against.
fn padded(box: Box) -> Box {
    return grown(box, frame.padding_everywhere, frame.padding_per_reach, frame.padding_per_depth);
}

// The padded bounds of a node.
fn padded_node(node: BvhNode) -> Box {
    return padded(relative(node_cell(node), node.min, node.max));
}

// By how much rounding can move a part of the box along the view.
fn rounding(box: Box) -> f32 {
    return frame.padding_everywhere + frame.padding_per_reach * reach(box);
}

// What is rasterized for a padded box: it covers the centre of every pixel whose ray meets the box.
fn rasterized(box: Box) -> Box {
    return grown(box, frame.box_padding_everywhere, frame.box_padding_per_reach, frame.box_padding_per_depth);
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
    return nearest_along(frame.planes[4], box) <= rounding(box) && BROKEN != BROKEN_NEAR;
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
    let base = frame.clip_from_relative * vec4f(box.min, 1.0);
    let x = frame.clip_from_relative[0] * size.x;
    let y = frame.clip_from_relative[1] * size.y;
    let z = frame.clip_from_relative[2] * size.z;
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

// No ray enters the box at a smaller parameter (view depth). Rounding of the distance is far below the padding.
fn nearest_entry(box: Box) -> f32 {
    return max(nearest_along(frame.forward, box) - rounding(box), frame.near);
}

// By how much the depths of surfaces in a padded box may err that has nothing before view depth `nearest`: what does not
// depend on where they are entered, and what is divided by clip w there.
fn depth_tolerance(box: Box, nearest: f32) -> vec2f {
    let reach = dot(abs(frame.forward.xyz), max(abs(box.min), abs(box.max)));
    return vec2f(
        frame.depth_tolerance + frame.depth_tolerance_over_nearest / nearest,
        frame.depth_tolerance_over_w + frame.depth_tolerance_reach_over_w * reach,
    );
}

// The depth of what starts at ray parameter `t`, rounded toward visible by `tolerance`. What the depth buffer's own
// value adds is left to `shows`.
fn earliest_depth(t: f32, tolerance: vec2f) -> f32 {
    let nearer = t / SLAB_WIDENING;
    let along = frame.depth_along_ray;
    let w = along.z + along.w * nearer;
    let depth = (along.x + along.y * nearer) / w;
    let error = select(tolerance.x + tolerance.y / w, 0.0, BROKEN == BROKEN_DEPTH);
    return select(depth - error, depth + error, REVERSED_DEPTH);
}

// Whether a surface that starts at ray parameter `t` in a padded box can be at or in front of `depth` (the value in the
// depth buffer): compared in clip depth, rounded toward visible.
fn may_show(box: Box, t: f32, depth: f32) -> bool {
    return shows(earliest_depth(t, depth_tolerance(box, nearest_entry(box))), depth);
}

// The same of an earliest depth.
fn shows(earliest: f32, depth: f32) -> bool {
    return shows_within(earliest, depth, DEPTH_TOLERANCE_RELATIVE);
}

fn shows_within(earliest: f32, depth: f32, relative: f32) -> bool {
    let tolerance = select(relative * abs(depth), 0.0, BROKEN == BROKEN_DEPTH);
    return select(earliest - tolerance <= depth, earliest + tolerance >= depth, REVERSED_DEPTH);
}

// Whether `x` is neither infinite nor NaN. This goes by the bits, because a compiler may assume that every float is
// finite and drop a comparison such as `x == x`.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

// Whether a host's fragment at `position` lies within its object's bounds: what every test of the same ray finds.
fn is_kept(bounds: Box, position: vec4f) -> bool {
    // A rasterizer may give a triangle of no area a depth that is NaN. `clamp` turns it into 0 or 1, one of which lies
    // within every bounds, while the depth buffer may hold the other.
    if (!is_finite(position.z) && BROKEN != BROKEN_FINITE) {
        return false;
    }
    let box = grown(
        bounds,
        KEPT_PADDING * frame.padding_everywhere,
        KEPT_PADDING * frame.padding_per_reach,
        KEPT_PADDING * frame.padding_per_depth,
    );
    let t = entry_widened(pixel_ray(position.xy), box, frame.near, 1.0);
    // The padding alone reaches in front of all corners, and the tests subtract more.
    let tolerance = depth_tolerance(box, max(nearest_along(frame.forward, box), frame.near));
    let earliest = earliest_depth(t, KEPT_TOLERANCE * tolerance);
    // The depth buffer holds the clamped value; a triangle clipped at the near plane can come out beyond it.
    let depth = clamp(position.z, 0.0, 1.0);
    return t >= 0.0 && shows_within(earliest, depth, KEPT_TOLERANCE * DEPTH_TOLERANCE_RELATIVE);
}
