//!import common/bounds
// For the host's fragment shader in modes without occluder filtering: marks the objects that pass the depth
// test at the moment they are drawn, as early-Z does in the paper (section 3.1).
//
// A forced early depth test would write the depth of fragments that are discarded later, be it by
// `hroc_keeps` or by an alpha test. So the test is repeated here, by an atomic maximum per pixel over the
// fragments that are kept. What shows in the end has the largest value of its pixel, so it is marked
// whatever the order of fragments; beside it, what passed before it was covered.

// Depth per pixel, as an integer that is larger for what is nearer; zeroed at the start of each frame.
@group(3) @binding(0) var<storage, read_write> hroc_nearest: array<atomic<u32>>;
// One bit per object.
@group(3) @binding(1) var<storage, read_write> hroc_marks: array<atomic<u32>>;

// Call it last, for fragments that are not discarded.
fn hroc_mark(object: u32, position: vec4f) {
    let pixel = u32(position.y) * frame.size.x + u32(position.x);
    // Bits of floats from 0 up are in the order of their values.
    let bits = bitcast<u32>(abs(clamp(position.z, 0.0, 1.0)));
    let nearness = select(0xffffffffu - bits, bits, REVERSED_DEPTH);
    if (nearness < atomicLoad(&hroc_nearest[pixel]) || nearness < atomicMax(&hroc_nearest[pixel], nearness)) {
        return;
    }
    let bit = 1u << (object & 31u);
    if ((atomicLoad(&hroc_marks[object >> 5u]) & bit) == 0u) {
        atomicOr(&hroc_marks[object >> 5u], bit);
    }
}
