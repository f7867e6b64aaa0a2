//!import common/object_bounds
//!import common/raster_box
//!import common/grouping
// batch_occlusion_test: rasterize the groups' bounds; each fragment that the occlusion map does not
// hide casts a ray into its group and flags every object whose padded bounds the ray meets in front of
// the map (paper, section 3.3; the limit by the map's depth is ours). An object that moves is a group of
// one: its bounds are all there is to meet. Twin: runtime/src/twin/batch_occlusion_test.rs.
//
// The depth that decides is the ray's own entry into the padded box, and not the depth of the rasterized
// face: that of a face seen edge-on changes by more than any fixed bias within one subpixel step, the entry
// of the ray does not. What the early depth test compares (batch_occlusion_test_early.wgsl) is the depth
// of the box's nearest point, the same all over the box: it only spares fragments that would flag nothing.

override COUNT_WORK: bool = false;
// Skips subtrees all of whose objects are flagged already.
override PRUNE: bool = true;

struct WorkCounters {
    rays: atomic<u32>,
    ray_box_tests: atomic<u32>,
    fragments: atomic<u32>,
    reserved: u32,
}

@group(0) @binding(1) var<storage, read> nodes: array<BvhNode>;
@group(0) @binding(2) var<storage, read> groups: array<u32>;
@group(0) @binding(3) var<storage, read> potential_occluders: array<u32>;
@group(0) @binding(4) var<storage, read_write> potentially_visible: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> work: WorkCounters;
@group(0) @binding(6) var<storage, read_write> grouping: Grouping;
@group(0) @binding(7) var<storage, read> parents: array<u32>;
@group(0) @binding(8) var<storage, read_write> flagged_nodes: array<atomic<u32>>;
@group(0) @binding(9) var<storage, read> object_bounds: array<ObjectBounds>;
@group(1) @binding(0) var occlusion_map: texture_depth_2d;

// The padded bounds of a group: a node, or an object that moves.
fn group_box(group: u32) -> Box {
    if (group < frame.node_count) {
        return padded_node(nodes[group]);
    }
    return padded_bounds(object_bounds[frame.static_count + group - frame.node_count]);
}

@vertex
fn box_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> BoxVertex {
    let group = groups[instance];
    return raster_box(group_box(group), vertex, group);
}

// Flags an object. What was drawn into the map need not be drawn again; and look before writing.
fn flag(object: u32) {
    let word = object >> 5u;
    let bit = 1u << (object & 31u);
    if (((potential_occluders[word] | atomicLoad(&potentially_visible[word])) & bit) == 0u) {
        atomicOr(&potentially_visible[word], bit);
    }
}

// Notes that every object below a leaf is flagged or was drawn, and of its ancestors those of which that now
// holds. A node's bit is set after both its children's were seen set, so by induction over its height
// it tells the truth; that two rays may each miss the other's bit only leaves work undone.
fn note_flagged(leaf: u32) {
    var n = leaf;
    loop {
        let bit = 1u << (n & 31u);
        if ((atomicOr(&flagged_nodes[n >> 5u], bit) & bit) != 0u || n == 0u) {
            return;
        }
        let parent = parents[n];
        let sibling = select(parent + 1u, nodes[n].skip, n == parent + 1u);
        if (!is_flagged(sibling) && BROKEN != BROKEN_PRUNING) {
            return;
        }
        n = parent;
    }
}

fn is_flagged(n: u32) -> bool {
    return (atomicLoad(&flagged_nodes[n >> 5u]) & (1u << (n & 31u))) != 0u;
}

fn test_fragment(fragment: BoxVertex) {
    let depth = textureLoad(occlusion_map, vec2u(fragment.position.xy), 0);
    var tests = 0u;
    var survived = false;
    // Most fragments are far behind the map: they need no ray.
    if (shows(fragment.earliest, depth)) {
        let ray = pixel_ray(fragment.position.xy);
        if (fragment.subject < frame.node_count) {
            let end = nodes[fragment.subject].skip;
            var n = fragment.subject;
            while (n < end) {
                let node = nodes[n];
                if (PRUNE && is_flagged(n)) {
                    survived = true;
                    n = node.skip;
                    continue;
                }
                tests++;
                let box = padded_node(node);
                let t = entry(ray, box, frame.near);
                if (t < 0.0 || !may_show(box, t, depth)) {
                    n = node.skip;
                    continue;
                }
                survived = true;
                if (is_leaf(node)) {
                    flag(node_object(node));
                    if (PRUNE) {
                        note_flagged(n);
                    }
                }
                n++;
            }
        } else {
            tests = 1u;
            let box = group_box(fragment.subject);
            let t = entry(ray, box, frame.near);
            survived = t >= 0.0 && may_show(box, t, depth);
            if (survived) {
                flag(frame.static_count + fragment.subject - frame.node_count);
            }
        }
    }
    // One pixel of 256 tells the next frame how coarse its groups should be: how many rays meet their group's own
    // bounds in front of the map. Pruning depends on which ray came first, so it is not asked.
    if (all((vec2u(fragment.position.xy) & vec2u(15u)) == vec2u(5u))) {
        atomicAdd(&grouping.fragments, 1u);
        let box = group_box(fragment.subject);
        let t = entry(pixel_ray(fragment.position.xy), box, frame.near);
        if (t >= 0.0 && may_show(box, t, depth)) {
            atomicAdd(&grouping.survivors, 1u);
        }
    }
    if (COUNT_WORK) {
        atomicAdd(&work.fragments, 1u);
        atomicAdd(&work.ray_box_tests, tests);
        if (survived) {
            atomicAdd(&work.rays, 1u);
        }
    }
}

// The occlusion map is sampled only: every fragment of every box comes here.
@fragment
fn cast_ray(fragment: BoxVertex) {
    test_fragment(fragment);
}
