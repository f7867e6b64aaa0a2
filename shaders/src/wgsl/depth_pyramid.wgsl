//!import common/pyramid
// depth_pyramid: from a depth buffer to the farthest depth of ever larger squares of it.

@group(0) @binding(0) var<storage, read> levels: array<PyramidLevel>;
@group(0) @binding(1) var<storage, read_write> pyramid: array<f32>;
// x: the level to make.
@group(0) @binding(2) var<uniform> made: vec4u;
@group(1) @binding(0) var depth_buffer: texture_depth_2d;

// Level 0 is the depth buffer itself.
@compute @workgroup_size(8, 8)
fn copy_depth(@builtin(global_invocation_id) id: vec3u) {
    let level = levels[0];
    if (id.x < level.width && id.y < level.height) {
        pyramid[level.first + id.y * level.width + id.x] = textureLoad(depth_buffer, id.xy, 0);
    }
}

@compute @workgroup_size(8, 8)
fn reduce(@builtin(global_invocation_id) id: vec3u) {
    let level = levels[made.x];
    if (id.x >= level.width || id.y >= level.height) {
        return;
    }
    let finer = levels[made.x - 1u];
    let lo = id.xy * 2u;
    let hi = min(lo + 1u, vec2u(finer.width, finer.height) - 1u);
    let row_0 = finer.first + lo.y * finer.width;
    let row_1 = finer.first + hi.y * finer.width;
    let a = farther(pyramid[row_0 + lo.x], pyramid[row_0 + hi.x]);
    let b = farther(pyramid[row_1 + lo.x], pyramid[row_1 + hi.x]);
    pyramid[level.first + id.y * level.width + id.x] = farther(a, b);
}
