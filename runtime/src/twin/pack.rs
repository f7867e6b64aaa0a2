//! Twin of pack.wgsl.

use hroc_format::{ArchivedMesh, ArchivedObject};

/// The draw commands of the members of a set (one bit per object), in object order: index count, instance
/// count, first index, base vertex, first instance.
pub fn pack(members: &[u32], objects: &[ArchivedObject], meshes: &[ArchivedMesh]) -> Vec<[u32; 5]> {
    crate::readback::members_of(members)
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
