//!import common/types
// For the host's own vertex and fragment shaders: position and item buffer.
//
// The bounds are padded for exactly this arithmetic: world = world_from_object * p, then
// clip = clip_from_world * world, both in f32. A host's shader must use it (or one at most as inexact).

// World position of an object-space point.
fn hroc_world_position(object: Object, p: vec3f) -> vec3f {
    let q = vec4f(p, 1.0);
    return vec3f(
        dot(object.world_from_object_x, q),
        dot(object.world_from_object_y, q),
        dot(object.world_from_object_z, q),
    );
}

// Clip position of a world point.
fn hroc_clip_position(clip_from_world: mat4x4f, world: vec3f) -> vec4f {
    return clip_from_world * vec4f(world, 1.0);
}
