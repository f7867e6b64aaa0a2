//!import common/types
//!import common/bounds
// For the host's own vertex and fragment shaders: position, and which fragments to keep.
//
// The host's uniform at group 0 binding 0 is hroc_runtime::FrameUniform of the same camera. Positions are eye-relative:
// in the axes of the source's world, with their zero at the eye or very near it, so that they are exact close to the
// camera however far from the source's zero that is.
//
// The depth buffer is Depth32Float, and depth gets there as the projection gives it: the viewport has the depth range 0
// to 1, and pipelines have neither a depth bias nor unclipped depth. The tolerances are derived for that.

// The eye-relative position of an object-space point. The bounds contain it for exactly this arithmetic.
fn hroc_relative_position(object: Object, p: vec3f) -> vec3f {
    let zero = frame.cells[object.cell];
    let place = vec3f(
        object.world_from_object_x.w + zero.x,
        object.world_from_object_y.w + zero.y,
        object.world_from_object_z.w + zero.z,
    );
    return vec3f(
        dot(object.world_from_object_x.xyz, p),
        dot(object.world_from_object_y.xyz, p),
        dot(object.world_from_object_z.xyz, p),
    ) + place;
}

// The position in the source's coordinates, to the precision of f32: for what must not move with the camera, such as a
// pattern in space.
fn hroc_world_position(relative: vec3f) -> vec3f {
    return frame.eye_high + (frame.eye_low + relative);
}

// The clip position of an eye-relative point. The padding is derived for exactly this arithmetic.
fn hroc_clip_position(relative: vec3f) -> vec4f {
    return frame.clip_from_relative * vec4f(relative, 1.0);
}

// Whether a fragment lies within its object's padded bounds; a fragment shader discards it otherwise.
//
// A rasterizer may place the fragments of a sliver anywhere: where it snaps vertices for coverage but
// interpolates depth from the unsnapped ones, the depth of a triangle seen edge-on is extrapolated over
// many times its width. Such a fragment can show through a wall, and no test of bounds could foresee it.
// Asking here what the batch occlusion test asks, within less, makes the two agree on every driver, however
// their compilers round: a fragment that is kept and shows was found by the test.
fn hroc_keeps(bounds: ObjectBounds, position: vec4f) -> bool {
    return is_kept(relative(bounds.cell, bounds.min, bounds.max), position);
}
