//! The bytes that other programs and the shaders rely on: sizes and offsets of every stored struct, as
//! README.md documents them.

use std::mem::{align_of, offset_of, size_of};

use hroc_format::*;

macro_rules! layout {
    ($name:ident: $size:literal, align $align:literal { $($field:ident: $offset:literal,)* }) => {
        assert_eq!(size_of::<$name>(), $size, stringify!($name));
        assert_eq!(align_of::<$name>(), $align, stringify!($name));
        $(assert_eq!(offset_of!($name, $field), $offset, concat!(stringify!($name), "::", stringify!($field)));)*
    };
}

#[test]
fn stored_structs() {
    layout!(ArchivedObject: 64, align 4 { world_from_object: 0, mesh: 48, base_color: 52, flags: 56, cell: 60, });
    layout!(ArchivedObjectBounds: 32, align 4 { min: 0, cell: 12, max: 16, reserved: 28, });
    layout!(ArchivedBounds: 24, align 4 { min: 0, max: 12, });
    layout!(ArchivedMesh: 48, align 4 {
        min: 0, first_index: 12, max: 16, index_count: 28, first_vertex: 32, vertex_count: 36, reserved: 40,
    });
    layout!(ArchivedBvhNode: 32, align 4 { min: 0, skip: 12, max: 16, cell_and_object: 28, });
    layout!(ArchivedBvhStats: 32, align 8 { depth: 0, reserved: 4, mean_leaf_depth: 8, sah_cost: 16, overlap: 24, });
    layout!(ArchivedObjectSource: 12, align 4 { file: 0, node: 4, primitive: 8, });
    layout!(ArchivedBvh: 96, align 8 { split: 0, nodes: 16, parents: 32, leaf_of_object: 48, stats: 64, });
    layout!(ArchivedSourceFile: 24, align 8 { name: 0, hash: 16, });
    layout!(ArchivedReferencedFile: 32, align 8 { name: 0, hash: 16, by: 24, });
    layout!(ArchivedCamera: 88, align 8 {
        name: 0, position: 16, orientation: 40, fov_y_rad: 72, half_height: 76, near: 80, far: 84,
    });
    layout!(ArchivedScene: 352, align 8 {
        name: 0, generator: 16, settings: 32, source_files: 48, referenced_files: 64, origin: 80, cells: 104,
        bounds: 120, objects: 144, object_bounds: 160, object_sources: 176, name_ends: 192, names: 208, meshes: 224,
        positions: 240, quantized_positions: 256, indices: 272, normals: 288, uvs: 304, bvhs: 320, cameras: 336,
    });
}

#[test]
fn header() {
    let bytes = Header {
        payload_len: 0x0102,
        checksum: 0x0304,
        file_len: 0x0506,
        section_count: 7,
        directory_checksum: 0x0809,
    }
    .to_bytes();
    assert_eq!(bytes[..8], *b"HROCBAKE");
    assert_eq!(bytes[8..16], [3, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(bytes[16..24], SCHEMA_HASH.to_le_bytes());
    assert_eq!(
        bytes[24..40],
        [2, 1, 0, 0, 0, 0, 0, 0, 4, 3, 0, 0, 0, 0, 0, 0]
    );
    assert_eq!(
        bytes[40..56],
        [6, 5, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 9, 8, 0, 0]
    );
    assert_eq!(
        bytes[56..],
        xxhash_rust::xxh3::xxh3_64(&bytes[..56]).to_le_bytes()
    );
}

/// The array a relative pointer leads to is the array of the file: found by its values alone.
#[test]
fn arrays_are_plain_bytes() {
    let scene = Scene {
        indices: vec![0xABCD_EF01, 2],
        positions: vec![[1.5, -2.0, 0.25]],
        ..Scene::default()
    };
    let file = to_bytes(&scene).unwrap();
    let contains = |bytes: &[u8]| file.windows(bytes.len()).any(|window| window == bytes);
    assert!(contains(&[0x01, 0xEF, 0xCD, 0xAB, 2, 0, 0, 0]));
    assert!(contains(
        &[1.5_f32, -2.0, 0.25].map(f32::to_le_bytes).concat()
    ));
}
