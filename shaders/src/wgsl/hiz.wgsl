//!import object
// render_occluders: depth of the last frame's visible objects into the small depth buffer of Hi-Z.

@group(0) @binding(1) var<storage, read> objects: array<Object>;

@vertex
fn occluder_vertex(@location(0) p: vec3f, @builtin(instance_index) id: u32) -> @builtin(position) vec4f {
    if ((objects[id].flags & OBJECT_MASKED) != 0u) {
        // It has holes, which the depth of its triangles does not: outside the clip volume.
        return vec4f(2.0, 2.0, 2.0, 1.0);
    }
    return hroc_clip_position(hroc_relative_position(objects[id], p));
}
