//!import common/types
// pack: from a set of objects (one bit each) to a tight list of draw commands in object order.
//
// The order is that of the object ids, by prefix sum and never by atomic append, because draws of equal
// depth must keep their order from frame to frame. Twin: runtime/src/twin/pack.rs.

struct PackCount {
    // Number of commands: the count buffer of the indirect draw.
    count: u32,
}

// The list is made of the members that are also in the class: of what is there to be drawn, the opaque or
// the blended objects.
@group(0) @binding(0) var<storage, read> members: array<u32>;
@group(0) @binding(1) var<storage, read> object_class: array<u32>;
@group(0) @binding(2) var<storage, read_write> packed: array<u32>;
@group(0) @binding(3) var<storage, read_write> bases: array<u32>;
@group(0) @binding(4) var<storage, read_write> pack_count: PackCount;
@group(0) @binding(5) var<storage, read_write> commands: array<DrawCommand>;
@group(0) @binding(6) var<storage, read> objects: array<Object>;
@group(0) @binding(7) var<storage, read> meshes: array<Mesh>;
// x: number of words in `members`.
@group(0) @binding(8) var<uniform> words: vec4u;

const WIDTH: u32 = 256u;
var<workgroup> sums: array<u32, 256>;

// One workgroup: each invocation counts a run of words, the runs are scanned in workgroup memory, then
// each word gets the number of members before it. Reads 2 bits and writes 1 per object.
@compute @workgroup_size(256)
fn pack_scan(@builtin(local_invocation_index) lane: u32) {
    let per_lane = (words.x + WIDTH - 1u) / WIDTH;
    let begin = min(lane * per_lane, words.x);
    let end = min(begin + per_lane, words.x);
    var sum = 0u;
    for (var w = begin; w < end; w++) {
        let word = members[w] & object_class[w];
        packed[w] = word;
        sum += countOneBits(word);
    }
    sums[lane] = sum;
    workgroupBarrier();
    for (var stride = 1u; stride < WIDTH; stride *= 2u) {
        var below = 0u;
        if (lane >= stride) {
            below = sums[lane - stride];
        }
        workgroupBarrier();
        sums[lane] += below;
        workgroupBarrier();
    }
    var base = sums[lane] - sum;
    for (var w = begin; w < end; w++) {
        bases[w] = base;
        base += countOneBits(packed[w]);
    }
    if (lane == WIDTH - 1u) {
        pack_count.count = sums[lane];
    }
}

// One invocation per word writes its members' commands.
@compute @workgroup_size(64)
fn pack_emit(@builtin(global_invocation_id) id: vec3u) {
    let w = id.x;
    if (w >= words.x) {
        return;
    }
    var bits = packed[w];
    var at = bases[w];
    while (bits != 0u) {
        let object = w * 32u + firstTrailingBit(bits);
        bits &= bits - 1u;
        let mesh = objects[object].mesh;
        commands[at] = DrawCommand(
            meshes[mesh].index_count,
            1u,
            meshes[mesh].first_index,
            i32(meshes[mesh].first_vertex),
            object,
        );
        at++;
    }
}
