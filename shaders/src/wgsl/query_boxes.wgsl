//!import common/types
//!import common/raster_box
// query: the bounds of BVH nodes within occlusion queries: the fragments that the depth buffer does not hide are
// counted by the query.

@group(0) @binding(1) var<storage, read> nodes: array<BvhNode>;
@group(0) @binding(2) var<storage, read> boxes: array<u32>;
@group(1) @binding(0) var occlusion_map: texture_depth_2d;

fn node_box(n: u32) -> Box {
    return padded_node(nodes[n]);
}

@vertex
fn box_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> BoxVertex {
    let n = boxes[instance];
    return raster_box(node_box(n), vertex, n);
}

// Writes no storage, so the depth test may well come first; what it lets pass is compared here.
@fragment
fn query(fragment: BoxVertex) {
    let depth = textureLoad(occlusion_map, vec2u(fragment.position.xy), 0);
    let box = node_box(fragment.subject);
    let t = entry(pixel_ray(fragment.position.xy), box, frame.near);
    if (t < 0.0 || !may_show(box, t, depth)) {
        discard;
    }
}
