// filter_occluders: the objects whose ids stand in the item buffer, as a set (paper, section 4.2).

@group(0) @binding(0) var item_buffer: texture_2d<u32>;
@group(0) @binding(1) var<storage, read_write> visible: array<atomic<u32>>;
// x: number of objects; larger ids belong to the host or to the background.
@group(0) @binding(2) var<uniform> limits: vec4u;

@compute @workgroup_size(8, 8)
fn filter_occluders(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(item_buffer);
    if (any(id.xy >= size)) {
        return;
    }
    let object = textureLoad(item_buffer, id.xy, 0).x;
    if (object >= limits.x) {
        return;
    }
    let bit = 1u << (object & 31u);
    // Look before writing: most pixels repeat what another has set.
    if ((atomicLoad(&visible[object >> 5u]) & bit) == 0u) {
        atomicOr(&visible[object >> 5u], bit);
    }
}
