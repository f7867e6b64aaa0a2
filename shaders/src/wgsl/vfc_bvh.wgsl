//!import common/object_bounds
// frustum_test: view frustum culling down a BVH.
//
// The nodes stand in depth-first order, so any run of them can be walked by itself: from the topmost ancestor of
// its first node that lies outside, if there is one, else from that node.

@group(0) @binding(1) var<storage, read> object_bounds: array<ObjectBounds>;
@group(0) @binding(2) var<storage, read_write> members: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> nodes: array<BvhNode>;
@group(0) @binding(4) var<storage, read> parents: array<u32>;

// Nodes per invocation: the climb of some twenty ancestors is shared by so many.
const RUN: u32 = 64u;

fn add(object: u32) {
    atomicOr(&members[object >> 5u], 1u << (object & 31u));
}

// All of the box lies within the frustum, and so does all that is in it.
fn is_inside(box: Box) -> bool {
    var inside = true;
    for (var i = 0u; i < 6u; i++) {
        inside = inside && nearest_along(frame.planes[i], box) >= 0.0;
    }
    return inside;
}

// One invocation per run of nodes, then one per object that moves.
@compute @workgroup_size(64)
fn frustum_test(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let i = id.x + id.y * grid.x * 64u;
    let runs = (frame.node_count + RUN - 1u) / RUN;
    if (i >= runs) {
        let object = frame.static_count + i - runs;
        if (object < frame.object_count) {
            let bounds = object_bounds[object];
            if (!is_empty(bounds) && in_frustum(padded_bounds(bounds))) {
                add(object);
            }
        }
        return;
    }
    var n = i * RUN;
    let end = min(n + RUN, frame.node_count);
    // Ends of the subtrees that hold the rest of the run's beginning.
    var all_inside_to = 0u;
    var ancestor = n;
    while (ancestor != 0u) {
        ancestor = parents[ancestor];
        let node = nodes[ancestor];
        let box = padded_node(node);
        if (!in_frustum(box)) {
            n = max(n, node.skip);
        } else if (is_inside(box)) {
            all_inside_to = max(all_inside_to, node.skip);
        }
    }
    while (n < end) {
        let node = nodes[n];
        if (n >= all_inside_to) {
            let box = padded_node(node);
            if (!in_frustum(box)) {
                n = node.skip;
                continue;
            }
            if (is_inside(box)) {
                all_inside_to = node.skip;
            }
        }
        if (is_leaf(node)) {
            add(node_object(node));
        }
        n++;
    }
}
