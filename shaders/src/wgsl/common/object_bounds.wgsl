//!import common/types
//!import common/bounds
// The bounds of single objects, for stages that bind them.

fn padded_bounds(bounds: Bounds) -> Box {
    return padded(vec3f(bounds.min[0], bounds.min[1], bounds.min[2]), vec3f(bounds.max[0], bounds.max[1], bounds.max[2]));
}

// A place for an object that moves, with none in it, has its bounds inside out.
fn is_empty(bounds: Bounds) -> bool {
    return bounds.min[0] > bounds.max[0];
}
