//!import common/object_bounds
// frustum_test: view frustum culling of every object by itself.

@group(0) @binding(1) var<storage, read> object_bounds: array<ObjectBounds>;
@group(0) @binding(2) var<storage, read_write> members: array<u32>;

var<workgroup> words: array<atomic<u32>, 2>;

// One invocation per object; a workgroup writes two whole words, so nothing has to be cleared before.
@compute @workgroup_size(64)
fn frustum_test(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) grid: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = workgroup.x + workgroup.y * grid.x;
    let object = block * 64u + lane;
    if (object < frame.object_count) {
        let bounds = object_bounds[object];
        if (!is_empty(bounds) && in_frustum(padded_bounds(bounds))) {
            atomicOr(&words[lane >> 5u], 1u << (lane & 31u));
        }
    }
    workgroupBarrier();
    let word = block * 2u + lane;
    if (lane < 2u && word < arrayLength(&members)) {
        members[word] = atomicLoad(&words[lane]);
    }
}
