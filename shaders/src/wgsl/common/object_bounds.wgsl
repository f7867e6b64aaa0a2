//!import common/types
//!import common/bounds
// The bounds of single objects, for stages that bind them.

fn padded_bounds(bounds: ObjectBounds) -> Box {
    return padded(relative(bounds.cell, bounds.min, bounds.max));
}

// A place for an object that moves, with none in it, has its bounds inside out.
fn is_empty(bounds: ObjectBounds) -> bool {
    return bounds.min.x > bounds.max.x;
}
