//! What is written is what is read, at every depth of checking.

mod support;

use hroc_format::*;
use support::{file, open, scene, walk};

const DEPTHS: [Check; 3] = [Check::Ranges, Check::Objects, Check::Everything];

#[test]
fn every_field_comes_back() {
    let scene = scene(50);
    let baked = open(&file(&scene), Check::Everything).unwrap();
    let read = baked.scene();
    walk(read);

    assert_eq!(read.name, scene.name.as_str());
    assert_eq!(read.generator, scene.generator.as_str());
    assert_eq!(read.settings, scene.settings.as_str());
    assert_eq!(read.source_files.len(), 1);
    assert_eq!(read.source_files[0].name, "grid.glb");
    assert_eq!(
        read.source_files[0].hash.to_native(),
        scene.source_files[0].hash
    );
    assert_eq!(read.origin.map(|v| v.to_native()), scene.origin);
    assert_eq!(read.bounds.to_native(), scene.bounds);
    assert_eq!(
        read.objects
            .iter()
            .map(ArchivedObject::to_native)
            .collect::<Vec<_>>(),
        scene.objects
    );
    assert_eq!(
        read.object_bounds
            .iter()
            .map(ArchivedObjectBounds::to_native)
            .collect::<Vec<_>>(),
        scene.object_bounds
    );
    assert_eq!(
        read.object_sources
            .iter()
            .map(ArchivedObjectSource::to_native)
            .collect::<Vec<_>>(),
        scene.object_sources
    );
    assert_eq!(
        read.meshes
            .iter()
            .map(ArchivedMesh::to_native)
            .collect::<Vec<_>>(),
        scene.meshes
    );
    assert_eq!(read.positions(), scene.positions);
    assert_eq!(read.indices(), scene.indices);
    assert_eq!(read.normals(), scene.normals);
    assert_eq!(read.uvs(), scene.uvs);
    for id in 0..50 {
        assert_eq!(read.object_name(id), format!("Gehäuse {id}"));
    }
    assert_eq!(read.object_name(50), "");
    assert_eq!(read.drawn_triangle_count(), 200);

    assert_eq!(read.bvhs.len(), 2);
    assert!(read.bvh("sah").is_none());
    for bvh in &scene.bvhs {
        let read = read.bvh(&bvh.split).unwrap();
        assert_eq!(
            read.nodes
                .iter()
                .map(ArchivedBvhNode::to_native)
                .collect::<Vec<_>>(),
            bvh.nodes
        );
        assert_eq!(read.parents(), bvh.parents);
        assert_eq!(read.leaf_of_object(), bvh.leaf_of_object);
        assert_eq!(read.stats.to_native(), bvh.stats);
    }
    assert_eq!(read.cameras.len(), 2);
    for (read, camera) in read.cameras.iter().zip(&scene.cameras) {
        assert_eq!(read.name, camera.name.as_str());
        assert_eq!(read.position.map(|v| v.to_native()), camera.position);
        assert_eq!(read.orientation.map(|v| v.to_native()), camera.orientation);
        let numbers =
            [read.fov_y_rad, read.half_height, read.near, read.far].map(|v| v.to_native());
        assert_eq!(
            numbers,
            [
                camera.fov_y_rad,
                camera.half_height,
                camera.near,
                camera.far
            ]
        );
    }
}

#[test]
fn scenes_of_any_size_pass_every_depth() {
    for count in [0, 1, 2, 3, 50, 333] {
        let bytes = file(&scene(count));
        for depth in DEPTHS {
            let baked = open(&bytes, depth)
                .unwrap_or_else(|error| panic!("{count} objects, {depth:?}: {error}"));
            walk(baked.scene());
            assert_eq!(baked.scene().objects.len(), count as usize);
        }
    }
}

#[test]
fn optional_arrays_may_be_empty() {
    let mut scene = scene(5);
    scene.normals.clear();
    scene.uvs.clear();
    scene.cameras.clear();
    let baked = open(&file(&scene), Check::Everything).unwrap();
    assert!(baked.scene().normals().is_empty() && baked.scene().uvs().is_empty());
}

#[test]
fn gpu_bytes_are_the_files_bytes() {
    let scene = scene(4);
    let baked = open(&file(&scene), Check::Objects).unwrap();
    let bytes = bytes_of(baked.scene().objects.as_slice());
    assert_eq!(bytes.len(), 4 * 64);
    assert_eq!(bytes[64 + 48..][..4], scene.objects[1].mesh.to_le_bytes());
    let file = baked.file_bytes().as_ptr_range();
    assert!(file.contains(&bytes.as_ptr()), "a view, not a copy");
    assert_eq!(bytes.as_ptr() as usize % 4, 0);
}

#[test]
fn mapped_and_in_memory_are_the_same() {
    let scene = scene(20);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.hroc");
    let len = write(&path, &scene).unwrap();
    let bytes = file(&scene);
    assert_eq!(len, bytes.len() as u64);
    for depth in DEPTHS {
        let baked = BakedScene::open_with(&path, depth).unwrap();
        assert_eq!(baked.file_bytes(), bytes);
        assert_eq!(baked.path(), Some(path.as_path()));
        walk(baked.scene());
    }
}
