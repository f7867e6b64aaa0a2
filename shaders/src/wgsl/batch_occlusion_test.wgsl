//!import common/types
//!import common/bounds
//!import common/grouping
// batch_occlusion_test: rasterize the groups' padded bounds; each fragment that the occlusion map does not
// hide casts a ray into its group and flags every object whose padded bounds the ray meets in front of
// the map (paper, section 3.3; the limit by the map's depth is ours).
//
// The depth comparison is made here, against the ray's own entry into the padded box, and not by the
// rasterizer: the depth of a face seen edge-on changes by more than any fixed bias within one subpixel
// step, the entry of the ray does not.

override COUNT_WORK: bool = false;

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
@group(1) @binding(0) var occlusion_map: texture_depth_2d;

struct BoxVertex {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat, either) node: u32,
    // No ray enters the box at a smaller parameter (view depth).
    @location(1) @interpolate(flat, either) nearest: f32,
}

// The box as one strip of 14 vertices; each mask holds one coordinate of the corners. Front faces wind
// counter-clockwise in y-up clip space.
@vertex
fn box_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> BoxVertex {
    let n = groups[instance];
    let box = padded(nodes[n].min, nodes[n].max);
    let bit = 1u << vertex;
    let corner = select(box.min, box.max, vec3<bool>((0x287au & bit) != 0u, (0x02afu & bit) != 0u, (0x31e3u & bit) != 0u));
    let clip = frame.clip_from_world * vec4f(corner, 1.0);
    // No group touches the near plane, so w > 0; the depth is not used, and this one is never clipped.
    // Rounding of the distance is far below the padding.
    let nearest = max(nearest_along(frame.forward, box) - frame.padding_world, frame.near);
    return BoxVertex(vec4f(clip.xy, 0.5 * clip.w, clip.w), n, nearest);
}

@fragment
fn cast_ray(fragment: BoxVertex) {
    let depth = textureLoad(occlusion_map, vec2u(fragment.position.xy), 0);
    var tests = 0u;
    var survived = false;
    // Most fragments are far behind the map: they need no ray.
    if (may_show(fragment.nearest, depth)) {
        let ray = pixel_ray(fragment.position.xy);
        let end = nodes[fragment.node].skip;
        var n = fragment.node;
        while (n < end) {
            let node = nodes[n];
            tests++;
            let t = entry(ray, padded(node.min, node.max), frame.near);
            if (t < 0.0 || !may_show(t, depth)) {
                n = node.skip;
                continue;
            }
            survived = true;
            if (node.object != NO_OBJECT) {
                let word = node.object >> 5u;
                let bit = 1u << (node.object & 31u);
                // What was drawn into the map need not be drawn again; and look before writing.
                if (((potential_occluders[word] | atomicLoad(&potentially_visible[word])) & bit) == 0u) {
                    atomicOr(&potentially_visible[word], bit);
                }
            }
            n++;
        }
    }
    // One pixel of 256 tells the next frame how coarse its groups should be.
    if (all((vec2u(fragment.position.xy) & vec2u(15u)) == vec2u(5u))) {
        atomicAdd(&grouping.fragments, 1u);
        if (survived) {
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
