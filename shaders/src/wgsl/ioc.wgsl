//!import common/object_bounds
//!import common/raster_box
// iterative_test: raster occlusion culling down a range of BVH depths. The nodes of one depth are rasterized
// (ioc_test.wgsl), those that show hand their children to the next; what lies below the nodes that show at the last
// depth may show.

// The candidates and boxes of one depth, as ranges of what all append.
struct Level {
    first_candidate: u32,
    candidate_count: u32,
    first_box: u32,
    box_count: u32,
}

// Indirect arguments: a draw of its boxes, a dispatch over its candidates. A buffer of its own, as none can be
// written and give arguments in one pass.
struct LevelArguments {
    vertex_count: u32,
    box_count: u32,
    first_vertex: u32,
    first_box: u32,
    grid: array<u32, 3>,
    reserved: u32,
}

// What was appended so far, by all levels.
struct Appended {
    candidates: atomic<u32>,
    boxes: atomic<u32>,
    reserved_0: u32,
    reserved_1: u32,
}

struct LevelInfo {
    level: u32,
    first_depth: u32,
    last_depth: u32,
    reserved: u32,
}

@group(0) @binding(1) var<storage, read> nodes: array<BvhNode>;
@group(0) @binding(2) var<storage, read> parents: array<u32>;
@group(0) @binding(3) var<storage, read> leaf_of_object: array<u32>;
@group(0) @binding(4) var<uniform> info: LevelInfo;
@group(0) @binding(5) var<storage, read_write> cut_of_object: array<u32>;
@group(0) @binding(6) var<storage, read_write> depth_of_node: array<u32>;
@group(0) @binding(7) var<storage, read_write> candidates: array<u32>;
@group(0) @binding(8) var<storage, read_write> boxes: array<u32>;
@group(0) @binding(9) var<storage, read_write> appended: Appended;
@group(0) @binding(10) var<storage, read_write> levels: array<Level>;
@group(0) @binding(11) var<storage, read_write> flagged: array<atomic<u32>>;
@group(0) @binding(12) var<storage, read_write> found: array<atomic<u32>>;
@group(0) @binding(13) var<storage, read> object_bounds: array<ObjectBounds>;
@group(0) @binding(14) var<storage, read_write> arguments: array<LevelArguments>;

// Once per tree, one invocation per object: the ancestor at the last depth, or the leaf where it is above.
@compute @workgroup_size(64)
fn find_cut(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let object = id.x + id.y * grid.x * 64u;
    if (object >= frame.static_count) {
        return;
    }
    let leaf = leaf_of_object[object];
    var depth = 0u;
    var n = leaf;
    while (n != 0u) {
        n = parents[n];
        depth++;
    }
    var cut = leaf;
    while (depth > info.last_depth) {
        cut = parents[cut];
        depth--;
    }
    cut_of_object[object] = cut;
}

// Once per tree, one invocation per node: steps from the root.
@compute @workgroup_size(64)
fn find_depths(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let node = id.x + id.y * grid.x * 64u;
    if (node >= frame.node_count) {
        return;
    }
    var depth = 0u;
    var n = node;
    while (n != 0u) {
        n = parents[n];
        depth++;
    }
    depth_of_node[node] = depth;
}

fn set_flag(n: u32) {
    atomicOr(&flagged[n >> 5u], 1u << (n & 31u));
}

fn is_flagged(n: u32) -> bool {
    return (atomicLoad(&flagged[n >> 5u]) & (1u << (n & 31u))) != 0u;
}

// Puts a node to the test, if it meets the frustum.
fn test_node(n: u32) {
    let box = padded_node(nodes[n]);
    if (!in_frustum(box)) {
        return;
    }
    candidates[atomicAdd(&appended.candidates, 1u)] = n;
    if (rasterized_area(box) < 0.0) {
        set_flag(n);
    } else {
        boxes[atomicAdd(&appended.boxes, 1u)] = n;
    }
}

// One invocation per node: those of the first depth, and leaves above it, are where it begins. Then one per object that
// moves, which is put to the test as a node of its own.
@compute @workgroup_size(64)
fn seed(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let i = id.x + id.y * grid.x * 64u;
    if (i < frame.node_count) {
        let depth = depth_of_node[i];
        if (depth == info.first_depth || (depth < info.first_depth && is_leaf(nodes[i]))) {
            test_node(i);
        }
        return;
    }
    let slot = i - frame.node_count;
    let object = frame.static_count + slot;
    if (object >= frame.object_count || is_empty(object_bounds[object])) {
        return;
    }
    let box = padded_bounds(object_bounds[object]);
    if (!in_frustum(box)) {
        return;
    }
    if (rasterized_area(box) < 0.0) {
        set_flag(frame.node_count + slot);
    } else {
        boxes[atomicAdd(&appended.boxes, 1u)] = frame.node_count + slot;
    }
}

// One invocation: the ranges of a level, once the one before has appended to it.
@compute @workgroup_size(1)
fn seal() {
    var first_candidate = 0u;
    var first_box = 0u;
    if (info.level > 0u) {
        let before = levels[info.level - 1u];
        first_candidate = before.first_candidate + before.candidate_count;
        first_box = before.first_box + before.box_count;
    }
    let candidate_count = atomicLoad(&appended.candidates) - first_candidate;
    let box_count = atomicLoad(&appended.boxes) - first_box;
    let groups = (candidate_count + 63u) / 64u;
    let rows = max((groups + 65534u) / 65535u, 1u);
    levels[info.level] = Level(first_candidate, candidate_count, first_box, box_count);
    let grid = array<u32, 3>((groups + rows - 1u) / rows, rows, 1u);
    arguments[info.level] = LevelArguments(14u, box_count, 0u, first_box, grid, 0u);
}

// One invocation per candidate of a level: the children of those that show go to the next.
@compute @workgroup_size(64)
fn descend(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let i = id.x + id.y * grid.x * 64u;
    let level = levels[info.level];
    if (i >= level.candidate_count) {
        return;
    }
    let n = candidates[level.first_candidate + i];
    if (is_leaf(nodes[n]) || !is_flagged(n)) {
        return;
    }
    test_node(n + 1u);
    test_node(nodes[n + 1u].skip);
}

// One invocation per object: it may show if its ancestor at the last depth does.
@compute @workgroup_size(64)
fn spread(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let object = id.x + id.y * grid.x * 64u;
    if (object >= frame.object_count) {
        return;
    }
    var n = frame.node_count + object - frame.static_count;
    if (object < frame.static_count) {
        n = cut_of_object[object];
    }
    if (is_flagged(n)) {
        atomicOr(&found[object >> 5u], 1u << (object & 31u));
    }
}
