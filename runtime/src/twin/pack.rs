//! Twin of pack.wgsl.

use hroc_format::{ArchivedMesh, ArchivedObject};

/// The draw commands of those members of a set (one bit per object) that are in a class, in object order:
/// index count, instance count, first index, base vertex, first instance.
pub fn pack(
    members: &[u32],
    object_class: &[u32],
    objects: &[ArchivedObject],
    meshes: &[ArchivedMesh],
) -> Vec<[u32; 5]> {
    let packed = members.iter().zip(object_class).map(|(a, b)| a & b);
    crate::readback::members_of(&packed.collect::<Vec<_>>())
        .map(|object| {
            let mesh = &meshes[objects[object as usize].mesh.to_native() as usize];
            [
                mesh.index_count.to_native(),
                1,
                mesh.first_index.to_native(),
                mesh.first_vertex.to_native(),
                object,
            ]
        })
        .collect()
}
