//!import common/bounds
//!import common/pyramid
// warp: last frame's depth as it would look from this frame's camera, by backward warping (Lee, Kim, Eisemann 2018).
//
// A pixel p of the last frame lands at W(p) in this one; its motion is m(p) = W(p) - p. What shows at a pixel q
// now came from a p with p + m(p) = q, which is a fixed point of p <- q - m(p).

struct Warp {
    // From last frame's clip space to this one's.
    clip_from_last: mat4x4f,
    size: vec2u,
    // Starts per pixel, and steps from each.
    seeds: u32,
    steps: u32,
    // There is a last frame of this size.
    has_last: u32,
    // The farthest of the two by two pixels that a place lies between, and not the nearest pixel.
    neighborhood: u32,
    tile_levels: u32,
    reserved: u32,
}

// Where a pixel landed: its motion in pixels, its depth in this frame; a depth below zero where it is behind the eye.
struct Landing {
    motion: vec2f,
    depth: f32,
    reserved: f32,
}

@group(0) @binding(1) var<uniform> warp: Warp;
@group(0) @binding(2) var<storage, read_write> last_depth: array<f32>;
@group(0) @binding(3) var<storage, read_write> landings: array<Landing>;
// Bounds of the motion in ever larger squares: least x and y, greatest x and y.
@group(0) @binding(4) var<storage, read_write> tiles: array<vec4f>;
@group(0) @binding(5) var<storage, read> tile_levels: array<PyramidLevel>;
@group(0) @binding(6) var<uniform> made: vec4u;
@group(0) @binding(7) var<storage, read_write> warped: array<f32>;
@group(1) @binding(0) var depth_buffer: texture_depth_2d;

const TILE: u32 = 8u;
const NOWHERE: f32 = -1.0;
const NO_MOTION: vec4f = vec4f(1e30, 1e30, -1e30, -1e30);

fn far_depth() -> f32 {
    return select(1.0, 0.0, REVERSED_DEPTH);
}

fn index(p: vec2u) -> u32 {
    return p.y * warp.size.x + p.x;
}

// At a frame's end: its depth is kept for the next.
@compute @workgroup_size(8, 8)
fn keep_depth(@builtin(global_invocation_id) id: vec3u) {
    if (all(id.xy < warp.size)) {
        last_depth[index(id.xy)] = textureLoad(depth_buffer, id.xy, 0);
    }
}

var<workgroup> tile_motions: array<vec4f, 64>;

// One invocation per pixel of the last frame, a workgroup per tile.
@compute @workgroup_size(8, 8)
fn land(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    var bounds = NO_MOTION;
    if (all(id.xy < warp.size)) {
        let size = vec2f(warp.size);
        let at = (vec2f(id.xy) + 0.5) / size;
        let depth = last_depth[index(id.xy)];
        let clip = warp.clip_from_last * vec4f(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, depth, 1.0);
        var landing = Landing(vec2f(0.0), NOWHERE, 0.0);
        if (clip.w > 0.0) {
            let ndc = clip.xyz / clip.w;
            let place = vec2f(ndc.x * 0.5 + 0.5, 0.5 - ndc.y * 0.5) * size - 0.5;
            landing = Landing(place - vec2f(id.xy), clamp(ndc.z, 0.0, 1.0), 0.0);
            // What leaves the image by far says nothing about what shows, and would blow the bounds up.
            let limit = 2.0 * size;
            if (all(abs(landing.motion) < limit)) {
                bounds = vec4f(landing.motion, landing.motion);
            }
        }
        landings[index(id.xy)] = landing;
    }
    tile_motions[lane] = bounds;
    workgroupBarrier();
    for (var stride = 32u; stride > 0u; stride /= 2u) {
        if (lane < stride) {
            let other = tile_motions[lane + stride];
            let own = tile_motions[lane];
            tile_motions[lane] = vec4f(min(own.xy, other.xy), max(own.zw, other.zw));
        }
        workgroupBarrier();
    }
    if (lane == 0u) {
        tiles[tile.y * tile_levels[0].width + tile.x] = tile_motions[0];
    }
}

@compute @workgroup_size(8, 8)
fn bound_motion(@builtin(global_invocation_id) id: vec3u) {
    let level = tile_levels[made.x];
    if (id.x >= level.width || id.y >= level.height) {
        return;
    }
    let finer = tile_levels[made.x - 1u];
    let lo = id.xy * 2u;
    let hi = min(lo + 1u, vec2u(finer.width, finer.height) - 1u);
    tiles[level.first + id.y * level.width + id.x] = bounds_within(finer, lo, hi);
}

fn bounds_within(level: PyramidLevel, lo: vec2u, hi: vec2u) -> vec4f {
    let a = tiles[level.first + lo.y * level.width + lo.x];
    let b = tiles[level.first + lo.y * level.width + hi.x];
    let c = tiles[level.first + hi.y * level.width + lo.x];
    let d = tiles[level.first + hi.y * level.width + hi.x];
    return vec4f(min(min(a.xy, b.xy), min(c.xy, d.xy)), max(max(a.zw, b.zw), max(c.zw, d.zw)));
}

// Bounds of the motion of all pixels in a rectangle: at the level where two by two tiles cover it.
fn motion_bounds(from_px: vec2f, to_px: vec2f) -> vec4f {
    let last = vec2f(warp.size) - 1.0;
    let lo = vec2u(clamp(from_px, vec2f(0.0), last)) / TILE;
    let hi = vec2u(clamp(to_px, vec2f(0.0), last)) / TILE;
    var number = 0u;
    while (number + 1u < warp.tile_levels && any((hi >> vec2u(number)) - (lo >> vec2u(number)) > vec2u(1u))) {
        number++;
    }
    return bounds_within(tile_levels[number], lo >> vec2u(number), hi >> vec2u(number));
}

// Halton's sequence in base 2 or 3, in [0, 1).
fn halton(index: u32, base: u32) -> f32 {
    var i = index;
    var share = 1.0;
    var sum = 0.0;
    while (i > 0u) {
        share /= f32(base);
        sum += share * f32(i % base);
        i /= base;
    }
    return sum;
}

fn landing_at(p: vec2f) -> Landing {
    return landings[index(vec2u(clamp(round(p), vec2f(0.0), vec2f(warp.size) - 1.0)))];
}

// The depth at a place of the last frame between pixels, in this one.
fn depth_at(p: vec2f) -> f32 {
    if (warp.neighborhood == 0u) {
        return landing_at(p).depth;
    }
    var depth = landing_at(floor(p)).depth;
    for (var i = 1u; i < 4u; i++) {
        let other = landing_at(floor(p) + vec2f(f32(i & 1u), f32(i >> 1u))).depth;
        depth = farther(depth, other);
    }
    return depth;
}

// One invocation per pixel of this frame.
@compute @workgroup_size(8, 8)
fn warp_back(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= warp.size)) {
        return;
    }
    let far = far_depth();
    if (warp.has_last == 0u) {
        warped[index(id.xy)] = far;
        return;
    }
    let q = vec2f(id.xy);
    // Sources of q lie in q - motion; bounds of the motion there bound them again, more tightly.
    var from_px = vec2f(0.0);
    var to_px = vec2f(warp.size) - 1.0;
    for (var i = 0u; i < 3u; i++) {
        let bounds = motion_bounds(from_px, to_px);
        from_px = max(from_px, q - bounds.zw - 1.0);
        to_px = min(to_px, q - bounds.xy + 1.0);
    }
    var nearest = far;
    var found = false;
    if (all(from_px <= to_px)) {
        for (var seed = 0u; seed < warp.seeds; seed++) {
            var p = q - landing_at(q).motion;
            if (seed > 0u) {
                p = mix(from_px, to_px, vec2f(halton(seed, 2u), halton(seed, 3u)));
            }
            for (var step = 0u; step < warp.steps; step++) {
                let landing = landing_at(p);
                if (landing.depth < 0.0) {
                    break;
                }
                let miss = p + landing.motion - q;
                if (all(abs(miss) < vec2f(0.5))) {
                    let depth = depth_at(p);
                    if (depth >= 0.0 && (!found || (depth > nearest) == REVERSED_DEPTH)) {
                        nearest = depth;
                        found = true;
                    }
                    break;
                }
                p = q - landing.motion;
            }
        }
    }
    // A hole hides nothing.
    warped[index(id.xy)] = nearest;
}
