//! A small scene in which every array is in use, and ways to spoil its file.
#![allow(dead_code)] // Each test file uses its own part.

use hroc_format::*;
use xxhash_rust::xxh3::xxh3_64;

/// A few tetrahedra drawn by `count` objects on a grid, with two trees over them.
pub fn scene(count: u32) -> Scene {
    let mut scene = Scene {
        name: "sample".into(),
        generator: "hroc-format tests".into(),
        settings: r#"{"split":["median","reversed"]}"#.into(),
        source_files: vec![SourceFile {
            name: "grid.glb".into(),
            hash: 0x1234_5678_9ABC_DEF0,
        }],
        referenced_files: vec![ReferencedFile {
            name: "buffers/grid.bin".into(),
            hash: 77,
            by: 0,
        }],
        origin: [1e6, 0.0, -2.5],
        cells: vec![[1e6, 0.0, -2.5], [1e6 + 64.0, 0.0, -2.5]],
        ..Scene::default()
    };
    for size in 1..=count.min(3) {
        add_tetrahedron(&mut scene, size as f32);
    }
    for id in 0..count {
        add_object(&mut scene, id);
    }
    if count > 0 {
        let boxes = scene.object_bounds.iter().map(in_world);
        scene.bounds = boxes.reduce(union).unwrap_or_default();
        let ids: Vec<u32> = (0..count).collect();
        let reversed: Vec<u32> = (0..count).rev().collect();
        scene.bvhs = vec![
            tree("median", &ids, &scene),
            tree("reversed", &reversed, &scene),
        ];
        scene.cameras = vec![
            Camera {
                name: "entrance".into(),
                position: [0.0, 1.7, 5.0],
                orientation: [0.0, 0.0, 0.0, 1.0],
                fov_y_rad: 1.0,
                half_height: 0.0,
                near: 0.1,
                far: f32::INFINITY,
            },
            Camera {
                name: String::new(),
                position: [0.0, 99.0, 0.0],
                orientation: [0.6, 0.0, 0.0, 0.8],
                fov_y_rad: 0.0,
                half_height: 20.0,
                near: -1.0,
                far: 100.0,
            },
        ];
    }
    scene
}

fn add_tetrahedron(scene: &mut Scene, size: f32) {
    scene.meshes.push(Mesh {
        min: [0.0; 3],
        max: [size; 3],
        first_index: scene.indices.len() as u32,
        index_count: 12,
        first_vertex: scene.positions.len() as u32,
        vertex_count: 4,
        reserved: [0; 2],
    });
    scene.positions.extend([
        [0.0; 3],
        [size, 0.0, 0.0],
        [0.0, size, 0.0],
        [0.0, 0.0, size],
    ]);
    scene.indices.extend([0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2]);
    scene
        .normals
        .extend([[0, 32767], [-32767, 5], [7, -9], [0, 0]]);
    scene
        .uvs
        .extend([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [2.5, -1.0]]);
}

fn add_object(scene: &mut Scene, id: u32) {
    let mesh = id % scene.meshes.len() as u32;
    let size = scene.meshes[mesh as usize].max[0];
    // Every fifth object is in the second cell.
    let cell = u32::from(id % 5 == 4);
    let x = (id % 7) as f32 * 4.0 - 64.0 * cell as f32;
    let z = (id / 7) as f32 * 4.0;
    scene.objects.push(Object {
        world_from_object: [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, z]],
        mesh,
        base_color: 0xFF80_4020,
        flags: id % (object_flags::ALL + 1),
        cell,
    });
    scene.object_bounds.push(ObjectBounds {
        min: [x, 0.0, z],
        cell,
        max: [x + size, size, z + size],
        reserved: 0,
    });
    scene.object_sources.push(ObjectSource {
        file: 0,
        node: id,
        primitive: 0,
    });
    scene.names.extend(format!("Gehäuse {id}").bytes());
    scene.name_ends.push(scene.names.len() as u32);
}

/// Halves the list at its middle until one object is left.
fn tree(split: &str, ids: &[u32], scene: &Scene) -> Bvh {
    let mut bvh = Bvh {
        split: split.into(),
        leaf_of_object: vec![0; ids.len()],
        ..Bvh::default()
    };
    let mut leaf_depths = Vec::new();
    add_node(&mut bvh, ids, 0, 0, scene, &mut leaf_depths);
    bvh.stats = BvhStats {
        depth: *leaf_depths.iter().max().unwrap_or(&0),
        reserved: 0,
        mean_leaf_depth: f64::from(leaf_depths.iter().sum::<u32>()) / leaf_depths.len() as f64,
        sah_cost: 12.5,
        overlap: 0.25,
    };
    bvh
}

fn add_node(
    bvh: &mut Bvh,
    ids: &[u32],
    parent: u32,
    depth: u32,
    scene: &Scene,
    leaf_depths: &mut Vec<u32>,
) {
    let node = bvh.nodes.len();
    let object = if ids.len() == 1 { Some(ids[0]) } else { None };
    let boxes = ids.iter().map(|&id| &scene.object_bounds[id as usize]);
    let (cell, bounds) = match object {
        Some(object) => {
            let ObjectBounds { cell, min, max, .. } = scene.object_bounds[object as usize];
            (cell, Bounds { min, max })
        }
        None => (0, boxes.map(in_world).reduce(union).unwrap_or_default()),
    };
    bvh.nodes.push(BvhNode {
        min: bounds.min,
        skip: 0,
        max: bounds.max,
        cell_and_object: BvhNode::pack(cell, object),
    });
    bvh.parents.push(parent);
    if let [id] = ids {
        bvh.leaf_of_object[*id as usize] = node as u32;
        leaf_depths.push(depth);
    } else {
        let (left, right) = ids.split_at(ids.len() / 2);
        add_node(bvh, left, node as u32, depth + 1, scene, leaf_depths);
        add_node(bvh, right, node as u32, depth + 1, scene, leaf_depths);
    }
    bvh.nodes[node].skip = bvh.nodes.len() as u32;
}

/// The bounds in the space of the first cell; the cells of the sample are 64 apart.
fn in_world(bounds: &ObjectBounds) -> Bounds {
    let shifted = |corner: [f32; 3]| {
        let [x, y, z] = corner;
        [x + 64.0 * bounds.cell as f32, y, z]
    };
    Bounds {
        min: shifted(bounds.min),
        max: shifted(bounds.max),
    }
}

fn union(a: Bounds, b: Bounds) -> Bounds {
    Bounds {
        min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
        max: std::array::from_fn(|k| a.max[k].max(b.max[k])),
    }
}

/// The scene's file.
pub fn file(scene: &Scene) -> Vec<u8> {
    to_bytes(scene).expect("memory does not run out").to_vec()
}

/// Two sections that no reader knows. One's length is not a multiple of the alignment, and one is empty.
pub fn sections() -> Sections {
    [
        (SectionName::new("masks"), Vec::new()),
        (SectionName::new("levels"), (0..37).collect()),
    ]
    .into()
}

/// The file of the scene with sections.
pub fn file_with(scene: &Scene, sections: &Sections) -> Vec<u8> {
    to_bytes_with(scene, sections)
        .expect("memory does not run out")
        .to_vec()
}

/// A file with any payload, under a header that fits it.
pub fn seal(payload: &[u8]) -> Vec<u8> {
    let header = Header::of_payload(payload);
    [header.to_bytes().as_slice(), payload].concat()
}

/// Corrects the header's own checksum after a change within the header.
pub fn reseal_header(file: &mut [u8]) {
    let own_checksum = xxh3_64(&file[..HEADER_LEN - 8]);
    file[HEADER_LEN - 8..HEADER_LEN].copy_from_slice(&own_checksum.to_le_bytes());
}

pub fn open(file: &[u8], check: Check) -> Result<BakedScene, OpenError> {
    BakedScene::from_bytes(file, check)
}

/// Follows everything that can be followed. On a scene that was checked it ends and does not panic.
pub fn walk(scene: &ArchivedScene) {
    let objects = scene.objects.len();
    for (id, object) in scene.objects.iter().enumerate() {
        let mesh = &scene.meshes[object.mesh.to_native() as usize];
        let indices = &scene.indices()[mesh.index_range()];
        let vertices = mesh.vertex_range();
        assert!(indices.len().is_multiple_of(3) && vertices.end <= scene.vertex_count());
        assert!(
            indices
                .iter()
                .all(|&index| (index as usize) < vertices.len())
        );
        assert!(scene.object_name(id as u32).len() <= scene.names.len());
        assert!((scene.object_sources[id].file.to_native() as usize) < scene.source_files.len());
    }
    for bvh in scene.bvhs.iter() {
        let mut leaves = 0;
        for (i, node) in bvh.nodes.iter().enumerate() {
            let node = node.to_native();
            assert!(i < node.skip as usize && bvh.parents()[i] as usize <= i);
            if let Some(object) = node.object() {
                assert_eq!(bvh.leaf_of_object()[object as usize] as usize, i);
                leaves += 1;
            }
        }
        assert_eq!(leaves, objects);
    }
}
