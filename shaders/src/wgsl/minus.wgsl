// minus: members of one set that another set lacks, one bit each.

@group(0) @binding(0) var<storage, read> members: array<u32>;
@group(0) @binding(1) var<storage, read> other: array<u32>;
@group(0) @binding(2) var<storage, read_write> rest: array<u32>;

@compute @workgroup_size(64)
fn minus(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let word = id.x + id.y * grid.x * 64u;
    if (word < arrayLength(&rest)) {
        rest[word] = members[word] & ~other[word];
    }
}
