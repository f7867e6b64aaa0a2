// The order of depths in a depth buffer.

// Larger depth is nearer (reversed conventions).
override REVERSED_DEPTH: bool = true;

fn farther(a: f32, b: f32) -> f32 {
    return select(max(a, b), min(a, b), REVERSED_DEPTH);
}
