//!import object
// Marks the objects that have a fragment in front of the final opaque depth, which is sampled.

@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var<storage, read> object_bounds: array<ObjectBounds>;
@group(0) @binding(3) var<storage, read_write> shown: array<atomic<u32>>;
@group(1) @binding(0) var opaque_depth: texture_depth_2d;

struct BlendedVertex {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat, either) object: u32,
}

@vertex
fn blended_vertex(@location(0) p: vec3f, @builtin(instance_index) id: u32) -> BlendedVertex {
    return BlendedVertex(hroc_clip_position(hroc_relative_position(objects[id], p)), id);
}

@fragment
fn mark_shown(v: BlendedVertex) {
    let behind = textureLoad(opaque_depth, vec2u(v.position.xy), 0);
    let depth = clamp(v.position.z, 0.0, 1.0);
    if (hroc_keeps(object_bounds[v.object], v.position) && select((depth < behind), (depth > behind), REVERSED_DEPTH)) {
        atomicOr(&shown[v.object >> 5u], 1u << (v.object & 31u));
    }
}
