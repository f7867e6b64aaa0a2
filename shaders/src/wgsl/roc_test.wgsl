//!import common/object_bounds
//!import common/raster_box
// raster_test: the bounds of every object of the frustum are rasterized against the occlusion map; a fragment that
// the map does not hide flags its object.

@group(0) @binding(1) var<storage, read> object_bounds: array<ObjectBounds>;
@group(0) @binding(2) var<storage, read_write> flagged: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> boxes: array<u32>;
@group(1) @binding(0) var occlusion_map: texture_depth_2d;

@vertex
fn box_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> BoxVertex {
    let object = boxes[instance];
    return raster_box(padded_bounds(object_bounds[object]), vertex, object);
}

fn flag(object: u32) {
    let bit = 1u << (object & 31u);
    // Look before writing: most fragments repeat what another has set.
    if ((atomicLoad(&flagged[object >> 5u]) & bit) == 0u) {
        atomicOr(&flagged[object >> 5u], bit);
    }
}

fn test_fragment(fragment: BoxVertex) {
    let depth = textureLoad(occlusion_map, vec2u(fragment.position.xy), 0);
    if (shows(fragment.earliest, depth)) {
        // The depth of the box's face at this pixel, which no rasterizer gives to the last bit.
        let box = padded_bounds(object_bounds[fragment.subject]);
        let t = entry(pixel_ray(fragment.position.xy), box, frame.near);
        if (t >= 0.0 && may_show(box, t, depth)) {
            flag(fragment.subject);
        }
    }
}

// The occlusion map is sampled only: every fragment of every box comes here.
@fragment
fn raster_test(fragment: BoxVertex) {
    test_fragment(fragment);
}
