//!import common/object_bounds
//!import common/raster_box
//!import common/grouping
// extract_groups: from the effective occluders to the occludee groups (paper, section 3.2), in the
// order-free form. First every ancestor of an effective occluder becomes visible; then
//   group(n) = unknown(n) and not refine(n) and (n is the root or visible(parent) or refine(parent)),
// where refine(n) holds for interior nodes that no rasterized box can stand for, as they touch the near plane
// or reach far out of the image, and, in adaptive grouping, for those that cover more of the screen than
// pays: all are replaced by their children (the paper's "adaptive grouping", left there as future work).
// Walking down from the topmost unknown ancestor of any leaf, the first node that is not refined is a group,
// so every leaf that was not drawn lies in one. Objects that move are in no tree: each is a group of one.
// Twin: runtime/src/twin/extract_groups.rs.

struct GroupDraw {
    // Arguments of the indirect draw of the groups' boxes.
    vertex_count: u32,
    instance_count: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
}

@group(0) @binding(1) var<storage, read> nodes: array<BvhNode>;
@group(0) @binding(2) var<storage, read> parents: array<u32>;
@group(0) @binding(3) var<storage, read> leaf_of_object: array<u32>;
@group(0) @binding(4) var<storage, read> potential_occluders: array<u32>;
@group(0) @binding(5) var<storage, read> effective_occluders: array<u32>;
@group(0) @binding(6) var<storage, read_write> visible_nodes: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> potentially_visible: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> groups: array<u32>;
@group(0) @binding(9) var<storage, read_write> group_draw: GroupDraw;
@group(0) @binding(10) var<storage, read_write> grouping: Grouping;
@group(0) @binding(11) var<storage, read> object_bounds: array<ObjectBounds>;

// Adaptive grouping: the cost of rasterizing one more box, in ray-box tests. 0: the paper's grouping.
override BOX_COST: f32 = 256.0;
const SMALLEST_THRESHOLD_PX: f32 = 16.0;
const LARGEST_THRESHOLD_PX: f32 = 1e9;

// One invocation: the threshold that balances boxes against rays. Splitting a group costs one more box and
// saves, of its A pixels, the two child tests of the share p that survives: it pays where A > b / (2 p).
// p is last frame's share; the threshold moves halfway (in ratio), and not at all for small differences,
// so that it comes to rest under a still camera.
@compute @workgroup_size(1)
fn choose_threshold() {
    let fragments = atomicExchange(&grouping.fragments, 0u);
    let survivors = atomicExchange(&grouping.survivors, 0u);
    var threshold = grouping.largest_group_px;
    if (BOX_COST == 0.0) {
        threshold = LARGEST_THRESHOLD_PX;
    } else if (fragments > 0u) {
        let share = (f32(survivors) + 0.5) / f32(fragments);
        let wanted = clamp(BOX_COST / (2.0 * share), SMALLEST_THRESHOLD_PX, LARGEST_THRESHOLD_PX);
        let before = select(threshold, wanted, threshold == 0.0);
        let ratio = wanted / before;
        threshold = select(before, sqrt(before * wanted), ratio > 2.0 || ratio < 0.5);
    } else if (threshold == 0.0) {
        threshold = 16.0 * BOX_COST;
    }
    grouping.largest_group_px = threshold;
}

// One invocation per object of the tree: climb until an ancestor was already visible.
@compute @workgroup_size(64)
fn climb(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let object = id.x + id.y * grid.x * 64u;
    if (object >= frame.static_count) {
        return;
    }
    if ((effective_occluders[object >> 5u] & (1u << (object & 31u))) == 0u) {
        return;
    }
    var n = leaf_of_object[object];
    loop {
        let bit = 1u << (n & 31u);
        if ((atomicOr(&visible_nodes[n >> 5u], bit) & bit) != 0u || n == 0u) {
            break;
        }
        n = parents[n];
    }
}

fn is_visible(n: u32) -> bool {
    return (atomicLoad(&visible_nodes[n >> 5u]) & (1u << (n & 31u))) != 0u;
}

// An interior node that is replaced by its children.
fn refine(area_px: f32) -> bool {
    return area_px < 0.0 || area_px > grouping.largest_group_px;
}

// Puts a leaf, or an object that moves, to the test. `n` is what stands for it in the groups.
fn test_object(object: u32, n: u32, area_px: f32) {
    if (area_px >= 0.0) {
        groups[atomicAdd(&group_draw.instance_count, 1u)] = n;
        return;
    }
    // It is drawn untested, unless it was drawn already.
    let bit = 1u << (object & 31u);
    if ((potential_occluders[object >> 5u] & bit) == 0u) {
        atomicOr(&potentially_visible[object >> 5u], bit);
    }
}

// One invocation per node, then one per object that moves.
@compute @workgroup_size(64)
fn collect(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let n = id.x + id.y * grid.x * 64u;
    if (n >= frame.node_count) {
        collect_moving(n);
        return;
    }
    if (is_visible(n)) {
        return;
    }
    // The frustum first: neighbours in the array are neighbours in space, so that whole groups of invocations end here.
    let node = nodes[n];
    let box = padded_node(node);
    if (!in_frustum(box)) {
        return;
    }
    let parent = parents[n];
    if (n != 0u && !is_visible(parent)) {
        if (!refine(rasterized_area(padded_node(nodes[parent])))) {
            return;
        }
    }
    let area_px = rasterized_area(box);
    if (is_leaf(node)) {
        test_object(node_object(node), n, area_px);
    } else if (!refine(area_px)) {
        groups[atomicAdd(&group_draw.instance_count, 1u)] = n;
    }
}

fn collect_moving(n: u32) {
    let object = frame.static_count + n - frame.node_count;
    if (object >= frame.object_count) {
        return;
    }
    let bounds = object_bounds[object];
    // What was drawn needs no test.
    if (is_empty(bounds) || (potential_occluders[object >> 5u] & (1u << (object & 31u))) != 0u) {
        return;
    }
    let box = padded_bounds(bounds);
    if (in_frustum(box)) {
        test_object(object, n, rasterized_area(box));
    }
}
