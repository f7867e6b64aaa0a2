//! What must hold for any bytes: used by `cargo fuzz` and, on stable Rust, by
//! `preprocess/tests/mutations.rs`. A violation is a panic.

use hroc_format::{ArchivedScene, BakedScene, Check, HEADER_LEN, Header, MAGIC, to_bytes};
use hroc_preprocess::bake::{BakeOptions, bake};
use hroc_preprocess::import::{ImportOptions, import_bytes};
use hroc_preprocess::progress::Silent;
use std::num::NonZeroU32;
use std::path::Path;

/// Any content of a scene file is refused in one line, or bakes to a file that passes every check. The last byte
/// chooses the options.
pub fn import(data: &[u8]) {
    let choice = data.last().copied().unwrap_or_default();
    let options = ImportOptions {
        normals: choice & 1 != 0,
        uvs: choice & 2 != 0,
        ..Default::default()
    };
    // A folder without files: what the scene refers to is not there.
    let source = match import_bytes(Path::new("/nonexistent/scene.obj"), data, &options) {
        Ok(source) => source,
        Err(error) => {
            assert!(!error.to_string().contains('\n'), "{error}");
            return;
        }
    };
    let options = BakeOptions {
        optimize: choice & 4 != 0,
        normals: choice & 1 != 0,
        uvs: choice & 2 != 0,
        quantize: choice & 8 != 0,
        split_objects: NonZeroU32::new(u32::from(choice >> 4)),
        ..Default::default()
    };
    let Ok((scene, _)) = bake(source, &options, &Silent) else {
        return;
    };
    let file = to_bytes(&scene).expect("memory suffices");
    let baked = BakedScene::from_aligned(file, Check::Everything).expect("a bake is consistent");
    follow(baked.scene());
}

/// Any payload under a header that fits it is refused at some depth, or following it stays within it.
pub fn open(data: &[u8]) {
    let _ = BakedScene::from_bytes(data, Check::Everything).is_ok();
    // With a checksum that is right: a forger knows how to compute it.
    let payload = match data.strip_prefix(&MAGIC) {
        Some(_) => data.get(HEADER_LEN..).unwrap_or_default(),
        None => data,
    };
    let header = Header::of_payload(payload);
    let file = [header.to_bytes().as_slice(), payload].concat();
    if let Ok(baked) = BakedScene::from_bytes(&file, Check::Objects) {
        follow(baked.scene());
    }
}

/// Follows what the CPU and the GPU follow: every index leads into its array, and every walk ends.
fn follow(scene: &ArchivedScene) {
    let objects = scene.objects.len();
    for (id, object) in scene.objects.iter().enumerate() {
        let mesh = &scene.meshes[object.mesh.to_native() as usize];
        let vertices = mesh.vertex_range();
        assert!(vertices.end <= scene.vertex_count());
        let count = vertices.len() as u32;
        assert!(
            scene.indices()[mesh.index_range()]
                .iter()
                .all(|&index| index < count)
        );
        let _ = scene.position(vertices.start);
        assert!(scene.object_name(id as u32).len() <= scene.names.len());
        let source = &scene.object_sources[id];
        let _ = &scene.source_files[source.file.to_native() as usize];
    }
    for file in scene.referenced_files.iter() {
        let _ = &scene.source_files[file.by.to_native() as usize];
    }
    for bvh in scene.bvhs.iter() {
        let mut leaves = 0;
        for (i, node) in bvh.nodes.iter().enumerate() {
            let node = node.to_native();
            assert!(i < node.skip as usize && node.skip as usize <= bvh.nodes.len());
            assert!(bvh.parents()[i] as usize <= i);
            if let Some(object) = node.object() {
                assert_eq!(bvh.leaf_of_object()[object as usize] as usize, i);
                leaves += 1;
            }
        }
        assert_eq!(leaves, objects);
    }
}
