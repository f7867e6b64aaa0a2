//!import common/object_bounds
//!import common/raster_box
// collect_boxes: the objects of the frustum whose bounds raster_test (roc_test.wgsl) rasterizes, all or some of them.

struct BoxDraw {
    // Arguments of the indirect draw of the boxes.
    vertex_count: u32,
    instance_count: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
}

@group(0) @binding(1) var<storage, read> object_bounds: array<ObjectBounds>;
@group(0) @binding(2) var<storage, read_write> flagged: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> boxes: array<u32>;
@group(0) @binding(4) var<storage, read_write> box_draw: BoxDraw;
// Of collect_undrawn_boxes alone, one bit per object each.
@group(0) @binding(5) var<storage, read> candidates: array<u32>;
@group(0) @binding(6) var<storage, read> drawn: array<u32>;

// An object of the frustum has its bounds rasterized, or is flagged where no box can stand for it.
fn collect(object: u32) {
    let bounds = object_bounds[object];
    if (is_empty(bounds)) {
        return;
    }
    let box = padded_bounds(bounds);
    if (!in_frustum(box)) {
        return;
    }
    if (rasterized_area(box) < 0.0) {
        atomicOr(&flagged[object >> 5u], 1u << (object & 31u));
    } else {
        boxes[atomicAdd(&box_draw.instance_count, 1u)] = object;
    }
}

// One invocation per object.
@compute @workgroup_size(64)
fn collect_boxes(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let object = id.x + id.y * grid.x * 64u;
    if (object < frame.object_count) {
        collect(object);
    }
}

// The same of those candidates that are not drawn yet.
@compute @workgroup_size(64)
fn collect_undrawn_boxes(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let object = id.x + id.y * grid.x * 64u;
    if (object >= frame.object_count) {
        return;
    }
    let word = object >> 5u;
    if (((candidates[word] & ~drawn[word]) >> (object & 31u) & 1u) != 0u) {
        collect(object);
    }
}
