// What is drawn to measure a device: triangles about a pixel in size, or as large as the image. See
// hroc_methods::HardwareTimes.

struct Placed {
    // Half the side of what is drawn, in half images.
    size: f32,
    depth: f32,
    reserved_0: f32,
    reserved_1: f32,
}

@group(0) @binding(0) var<uniform> placed: Placed;

@vertex
fn placed_vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let corner = vertex % 3u;
    let at = vec2f(select(-1.0, 3.0, corner == 1u), select(-1.0, 3.0, corner == 2u));
    return vec4f(at * placed.size, placed.depth, 1.0);
}

@fragment
fn placed_fragment() -> @location(0) u32 {
    return 1u;
}
