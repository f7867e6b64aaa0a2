//!import common/types
//!import common/bounds
// For the host's own vertex and fragment shaders: position, and which fragments to keep.
//
// The host's uniform at group 0 binding 0 is hroc_runtime::FrameUniform of the same camera.

// World position of an object-space point. The baked bounds contain it for exactly this arithmetic.
fn hroc_world_position(object: Object, p: vec3f) -> vec3f {
    let q = vec4f(p, 1.0);
    return vec3f(
        dot(object.world_from_object_x, q),
        dot(object.world_from_object_y, q),
        dot(object.world_from_object_z, q),
    );
}

// Clip position of a world point. The padding is derived for exactly this arithmetic.
fn hroc_clip_position(world: vec3f) -> vec4f {
    return frame.clip_from_world * vec4f(world, 1.0);
}

// Whether a fragment lies within its object's padded bounds; a fragment shader discards it otherwise.
//
// A rasterizer may place the fragments of a sliver anywhere: where it snaps vertices for coverage but
// interpolates depth from the unsnapped ones, the depth of a triangle seen edge-on is extrapolated over
// many times its width. Such a fragment can show through a wall, and no test of bounds could foresee it.
// Asking here what the batch occlusion test asks, within less, makes the two agree on every driver, however
// their compilers round: a fragment that is kept and shows was found by the test.
fn hroc_keeps(bounds: Bounds, position: vec4f) -> bool {
    let lo = vec3f(bounds.min[0], bounds.min[1], bounds.min[2]);
    let hi = vec3f(bounds.max[0], bounds.max[1], bounds.max[2]);
    return is_kept(lo, hi, position);
}
