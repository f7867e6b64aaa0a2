//!import common/object_bounds
//!import common/raster_box
// iterative_test, the boxes of one level: a fragment that the occlusion map does not hide flags its node.

@group(0) @binding(1) var<storage, read> nodes: array<BvhNode>;
@group(0) @binding(2) var<storage, read> boxes: array<u32>;
@group(0) @binding(3) var<storage, read_write> flagged: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> object_bounds: array<ObjectBounds>;
@group(1) @binding(0) var occlusion_map: texture_depth_2d;

fn node_box(n: u32) -> Box {
    if (n < frame.node_count) {
        return padded_node(nodes[n]);
    }
    return padded_bounds(object_bounds[frame.static_count + n - frame.node_count]);
}

@vertex
fn box_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> BoxVertex {
    let n = boxes[instance];
    return raster_box(node_box(n), vertex, n);
}

fn test_fragment(fragment: BoxVertex) {
    let depth = textureLoad(occlusion_map, vec2u(fragment.position.xy), 0);
    if (!shows(fragment.earliest, depth)) {
        return;
    }
    let box = node_box(fragment.subject);
    let t = entry(pixel_ray(fragment.position.xy), box, frame.near);
    if (t >= 0.0 && may_show(box, t, depth)) {
        let word = fragment.subject >> 5u;
        let bit = 1u << (fragment.subject & 31u);
        if ((atomicLoad(&flagged[word]) & bit) == 0u) {
            atomicOr(&flagged[word], bit);
        }
    }
}

// The occlusion map is sampled only: every fragment of every box comes here.
@fragment
fn iterative_test(fragment: BoxVertex) {
    test_fragment(fragment);
}
