//! Each consistency rule, broken on purpose: the error names the thing, and the depth that promises
//! the rule is the one that finds it.

mod support;

use hroc_format::*;
use support::{file, open, scene};

/// Breaks a scene of 50 objects (3 meshes, 2 trees, 2 cameras) and expects `depth` to say `expected`, and
/// the depth before to say nothing.
#[track_caller]
fn refused(depth: Check, expected: &str, spoil: impl FnOnce(&mut Scene)) {
    let mut scene = scene(50);
    spoil(&mut scene);
    let bytes = file(&scene);
    for deeper in [depth, Check::Everything] {
        match open(&bytes, deeper) {
            Err(OpenError::Invalid { source, .. }) => assert_eq!(source.to_string(), expected),
            other => panic!("{deeper:?}: should say {expected:?}, not {other:?}"),
        }
    }
    let before = match depth {
        Check::Ranges => return,
        Check::Objects => Check::Ranges,
        Check::Everything => Check::Objects,
    };
    open(&bytes, before).unwrap_or_else(|error| panic!("{before:?} looks too deep: {error}"));
}

#[test]
fn mesh_ranges() {
    let check = |expected: &str, spoil: fn(&mut Scene)| refused(Check::Ranges, expected, spoil);
    check("mesh 1: first index 13, should be 12", |s| {
        s.meshes[1].first_index = 13
    });
    check("mesh 1: first index 4294967295, should be 12", |s| {
        s.meshes[1].first_index = u32::MAX
    });
    check("mesh 2: first vertex 0, should be 8", |s| {
        s.meshes[2].first_vertex = 0
    });
    check("mesh 0: 11 indices, no multiple of three", |s| {
        s.meshes[0].index_count = 11
    });
    check("mesh 0: 0 indices, no multiple of three", |s| {
        s.meshes[0].index_count = 0
    });
    check("mesh 0: no vertices", |s| s.meshes[0].vertex_count = 0);
    check("mesh 2: indices up to 39 of 36", |s| {
        s.meshes[2].index_count = 15
    });
    check("mesh 2: indices up to 4294967319 of 36", |s| {
        s.meshes[2].index_count = u32::MAX
    });
    check("mesh 2: vertices up to 13 of 12", |s| {
        s.meshes[2].vertex_count = 5
    });
    check("mesh 1: reserved bytes in use", |s| {
        s.meshes[1].reserved[1] = 1
    });
    check("indices: 39 entries, should be 36", |s| {
        s.indices.extend([0, 1, 2])
    });
    check("positions: 13 entries, should be 12", |s| {
        s.positions.push([0.0; 3])
    });
    check("normals: 11 entries, should be 12", |s| _ = s.normals.pop());
    check("uvs: 1 entries, should be 12", |s| s.uvs.truncate(1));
}

#[test]
fn objects() {
    let check = |expected: &str, spoil: fn(&mut Scene)| refused(Check::Objects, expected, spoil);
    check("object 17: mesh 40 of 3", |s| s.objects[17].mesh = 40);
    check("object 0: unknown flags 0x8", |s| s.objects[0].flags = 8);
    check("object 4: its transform is not finite", |s| {
        s.objects[4].world_from_object[2][3] = f32::NAN
    });
    check("object 5: source file 1 of 1", |s| {
        s.object_sources[5].file = 1
    });
    check("object bounds: 49 entries, should be 50", |s| {
        _ = s.object_bounds.pop()
    });
    check("object sources: 49 entries, should be 50", |s| {
        _ = s.object_sources.pop()
    });
    check("name ends: 49 entries, should be 50", |s| {
        _ = s.name_ends.pop()
    });
    check("object 8: bounds [NaN, 0.0, 4.0] to [7.0, 3.0, 7.0]", |s| {
        s.object_bounds[8].min[0] = f32::NAN
    });
    check("object 8: bounds [8.0, 0.0, 4.0] to [7.0, 3.0, 7.0]", |s| {
        s.object_bounds[8].min[0] = 8.0
    });
    check("object 8: bounds [4.0, 0.0, 4.0] to [inf, 3.0, 7.0]", |s| {
        s.object_bounds[8].max[0] = f32::INFINITY
    });
    check("mesh 1: bounds [0.0, 0.0, 0.0] to [2.0, -1.0, 2.0]", |s| {
        s.meshes[1].max[1] = -1.0
    });
}

#[test]
fn scene_bounds_and_origin() {
    let check = |expected: &str, spoil: fn(&mut Scene)| refused(Check::Objects, expected, spoil);
    check("scene: the origin is not finite", |s| {
        s.origin[1] = f64::NEG_INFINITY
    });
    check("object 1: its bounds reach beyond the scene's", |s| {
        s.bounds.max[0] = 1.0
    });
    let mut empty = scene(0);
    empty.bounds.max = [1.0; 3];
    let error = open(&file(&empty), Check::Objects).unwrap_err().to_string();
    assert!(
        error.contains("bounds [0.0, 0.0, 0.0] to [1.0, 1.0, 1.0] without objects"),
        "{error}"
    );
}

#[test]
fn names() {
    let check = |expected: &str, spoil: fn(&mut Scene)| refused(Check::Objects, expected, spoil);
    // "Gehäuse 0" is 10 bytes, with the ä at 3 and 4.
    check("object 1: its name is at bytes 40 to 20 of 540", |s| {
        s.name_ends[0] = 40
    });
    check("object 0: its name is at bytes 0 to 4 of 540", |s| {
        s.name_ends[0] = 4
    });
    check(
        "object 49: its name is at bytes 529 to 4294967295 of 540",
        |s| s.name_ends[49] = u32::MAX,
    );
    check("object names: 541 entries, should be 540", |s| {
        s.names.push(b'x')
    });
    check("object names: not UTF-8 at byte 3", |s| s.names[3] = 0xFF);
}

#[test]
fn cameras() {
    let check = |expected: &str, spoil: fn(&mut Scene)| refused(Check::Objects, expected, spoil);
    check("camera 0: position [NaN, 1.7, 5.0]", |s| {
        s.cameras[0].position[0] = f64::NAN
    });
    check("camera 0: orientation [0.0, 0.0, 0.0, 2.0]", |s| {
        s.cameras[0].orientation[3] = 2.0
    });
    check("camera 0: field of view 3.5", |s| {
        s.cameras[0].fov_y_rad = 3.5
    });
    check("camera 1: half height inf", |s| {
        s.cameras[1].half_height = f32::INFINITY
    });
    check(
        "camera 0: neither perspective nor orthographic, or both",
        |s| s.cameras[0].fov_y_rad = 0.0,
    );
    check(
        "camera 0: neither perspective nor orthographic, or both",
        |s| s.cameras[0].half_height = 1.0,
    );
    check("camera 0: near NaN, far inf", |s| {
        s.cameras[0].near = f32::NAN
    });
    check("camera 1: near -1, far -1", |s| s.cameras[1].far = -1.0);
}

#[test]
fn tree_sizes_and_names() {
    let check = |expected: &str, spoil: fn(&mut Scene)| refused(Check::Objects, expected, spoil);
    check("tree median, nodes: 98 entries, should be 99", |s| {
        _ = s.bvhs[0].nodes.pop()
    });
    check("tree reversed, parents: 98 entries, should be 99", |s| {
        _ = s.bvhs[1].parents.pop()
    });
    check(
        "tree median, leaf of object: 51 entries, should be 50",
        |s| s.bvhs[0].leaf_of_object.push(0),
    );
    check("tree median: its name is used twice", |s| {
        s.bvhs[1].split = "median".into()
    });
    check("tree 1: has no name", |s| s.bvhs[1].split.clear());

    let mut empty = scene(0);
    empty.bvhs.push(Bvh {
        split: "sah".into(),
        ..Bvh::default()
    });
    let error = open(&file(&empty), Check::Objects).unwrap_err().to_string();
    assert!(error.contains("tree sah: is over no objects"), "{error}");
}

/// The tree "median" begins: node 4 has the children 5, the leaf of object 0, and 6, whose children are 7
/// and 8, the leaves of objects 1 and 2. Node 4 is the left child of 3, that of 2, that of 1, that of 0.
#[test]
fn tree_structure() {
    let check = |expected: &str, spoil: fn(&mut [BvhNode])| {
        let expected = format!("tree median, node {expected}");
        refused(Check::Objects, &expected, |s| spoil(&mut s.bvhs[0].nodes));
    };
    check("0: ends at 98 of 99", |n| n[0].skip = 98);
    check("0: ends at 4294967295 of 99", |n| n[0].skip = u32::MAX);
    check("4: right child 9, its end is 9", |n| n[5].skip = 9);
    check("4: right child 4, its end is 9", |n| n[5].skip = 4);
    check("4: right child 4294967295, its end is 9", |n| {
        n[5].skip = u32::MAX
    });
    check("4: ends at 9, its right child at 8", |n| n[6].skip = 8);
    check("1: ends at 50, its right child at 25", |n| n[2].skip = 14);
    check("3: ends at 14, its right child at 3", |n| n[9].skip = 3);
    check("7: an interior node without children", |n| {
        n[7].cell_and_object = BvhNode::INTERIOR
    });
    check("6: a leaf that ends at 9", |n| n[6].cell_and_object = 3);
    check("7: object 50 of 50", |n| n[7].cell_and_object = 50);
    check("7: object 2, whose leaf is node 8", |n| {
        n[7].cell_and_object = 2
    });
}

#[test]
fn tree_links() {
    let check = |expected: &str, spoil: fn(&mut Bvh)| {
        refused(
            Check::Objects,
            &format!("tree median, node {expected}"),
            |s| spoil(&mut s.bvhs[0]),
        );
    };
    check("0: parent 1, should be itself", |t| t.parents[0] = 1);
    check("7: parent 5, should be 6", |t| t.parents[7] = 5);
    check("98: parent 4294967295, should be 96", |t| {
        t.parents[98] = u32::MAX
    });
    check("7: object 1, whose leaf is node 8", |t| {
        t.leaf_of_object[1] = 8
    });
    check("7: object 1, whose leaf is node 4294967295", |t| {
        t.leaf_of_object[1] = u32::MAX
    });
}

#[test]
fn tree_bounds() {
    let check = |expected: &str, spoil: fn(&mut [BvhNode])| {
        let expected = format!("tree median, node {expected}");
        refused(Check::Objects, &expected, |s| spoil(&mut s.bvhs[0].nodes));
    };
    check("0: bounds [0.0, 0.0, 0.0] to [27.0, NaN, 30.0]", |n| {
        n[0].max[1] = f32::NAN
    });
    check("0: bounds [0.0, 0.0, -inf] to [27.0, 3.0, 30.0]", |n| {
        n[0].min[2] = f32::NEG_INFINITY
    });
    check("6: bounds [4.0, 3.0, 0.0] to [11.0, 2.0, 3.0]", |n| {
        (n[6].min[1], n[6].max[1]) = (3.0, 2.0)
    });
    check("6: does not contain its child 8", |n| n[6].max[0] = 10.5);
    check("4: does not contain its child 6", |n| {
        n[6].max[0] = f32::NAN
    });
    check("5: its bounds are not those of object 0", |n| {
        n[5].min[0] = -0.0
    });
    check("8: its bounds are not those of object 2", |n| {
        n[8].max[0] = 10.5
    });
}

#[test]
fn cells() {
    let check = |expected: &str, spoil: fn(&mut Scene)| refused(Check::Objects, expected, spoil);
    check("cells: none, although there are objects", |s| {
        s.cells.clear()
    });
    check("cells: 241, more than 240", |s| {
        s.cells = vec![s.origin; 241]
    });
    check("cell 1: its origin [NaN, 0.0, -2.5] is not finite", |s| {
        s.cells[1][0] = f64::NAN
    });
    check(
        "cell 0: its origin [0.0, 0.0, -2.5] is not the scene's, [1000000.0, 0.0, -2.5]",
        |s| s.cells[0][0] = 0.0,
    );
    check("object 3: cell 2 of 2", |s| s.objects[3].cell = 2);
    check("object 3: its bounds are in cell 1, it is in 0", |s| {
        s.object_bounds[3].cell = 1
    });
    check("object 3: reserved bytes in use", |s| {
        s.object_bounds[3].reserved = 1
    });
    // The same corners in the other cell are elsewhere.
    check("object 0: its bounds reach beyond the scene's", |s| {
        (s.objects[0].cell, s.object_bounds[0].cell) = (1, 1);
        s.cells[1] = [1e9, 0.0, 0.0];
    });
    let node = |expected: &str, spoil: fn(&mut [BvhNode])| {
        let expected = format!("tree median, node {expected}");
        refused(Check::Objects, &expected, |s| spoil(&mut s.bvhs[0].nodes));
    };
    node("0: cell 255 of 2", |n| {
        n[0].cell_and_object = BvhNode::pack(255, None)
    });
    node("0: does not contain its child 1", |n| {
        n[1].cell_and_object = BvhNode::pack(2, None)
    });
    node("5: its bounds are not those of object 0", |n| {
        n[5].cell_and_object = BvhNode::pack(1, Some(0));
        (n[5].min[0], n[5].max[0]) = (n[5].min[0] - 64.0, n[5].max[0] - 64.0);
    });
    // Node 0 contains its child 1 in whichever cell it stands, by the same comparison.
    let mut moved = scene(50);
    let root = &mut moved.bvhs[0].nodes[0];
    root.cell_and_object = BvhNode::pack(1, None);
    (root.min[0], root.max[0]) = (root.min[0] - 64.0, root.max[0] - 64.0);
    open(&file(&moved), Check::Objects).unwrap();
    moved.bvhs[0].nodes[0].max[0] -= 0.5;
    let error = open(&file(&moved), Check::Objects).unwrap_err().to_string();
    assert!(
        error.contains("node 0: does not contain its child"),
        "{error}"
    );
}

#[test]
fn tree_statistics() {
    let check = |expected: &str, spoil: fn(&mut BvhStats)| {
        let expected = format!("tree median, statistics: {expected}");
        refused(Check::Objects, &expected, |s| spoil(&mut s.bvhs[0].stats));
    };
    check("depth 5, should be 6", |stats| stats.depth = 5);
    check("reserved bytes in use", |stats| stats.reserved = 1);
    check("mean leaf depth NaN", |stats| {
        stats.mean_leaf_depth = f64::NAN
    });
    check("SAH cost inf", |stats| stats.sah_cost = f64::INFINITY);
    check("overlap -1", |stats| stats.overlap = -1.0);
}

#[test]
fn indices() {
    let check = |expected: &str, spoil: fn(&mut Scene)| refused(Check::Objects, expected, spoil);
    check("mesh 1: index 4 of 4 vertices", |s| s.indices[12] = 4);
    check("mesh 2: index 4294967295 of 4 vertices", |s| {
        s.indices[35] = u32::MAX
    });
}

#[test]
fn referenced_files() {
    refused(
        Check::Objects,
        "referenced file 0: source file 1 of 1",
        |s| s.referenced_files[0].by = 1,
    );
}

/// The scene of 50 objects with its positions as 16-bit numbers.
fn quantize(scene: &mut Scene) {
    let stored = |p: &[f32; 3]| {
        let [x, y, z] = p.map(|lane| (lane / 3.0 * 65535.0).round() as u16);
        [x, y, z, 0]
    };
    scene.quantized_positions = scene.positions.iter().map(stored).collect();
    scene.positions.clear();
    for mesh in &mut scene.meshes {
        mesh.max = mesh.max.map(|lane| lane / 3.0);
    }
}

#[test]
fn quantized_positions() {
    let mut good = scene(50);
    quantize(&mut good);
    let bytes = file(&good);
    let baked = open(&bytes, Check::Everything).unwrap();
    assert_eq!(baked.scene().vertex_count(), 12);
    assert_eq!(baked.scene().position(1), [1.0 / 3.0, 0.0, 0.0]);
    refused(Check::Ranges, "positions: both plain and quantized", |s| {
        s.quantized_positions = vec![[0; 4]; s.positions.len()]
    });
    let check = |expected: &str, spoil: fn(&mut Scene)| {
        refused(Check::Everything, expected, |s| {
            quantize(s);
            spoil(s);
        })
    };
    check("mesh 2: reserved bytes in use", |s| {
        s.quantized_positions[10][3] = 1
    });
    check(
        "mesh 0, vertex 2: position [1.0, 0.33333334, 0.0] outside the bounds [0.0, 0.0, 0.0] to \
         [0.33333334, 0.33333334, 0.33333334]",
        |s| s.quantized_positions[2][0] = u16::MAX,
    );
}

#[test]
fn vertices() {
    let check = |expected: &str, spoil: fn(&mut Scene)| refused(Check::Everything, expected, spoil);
    check(
        "mesh 0, vertex 1: position [1.5, 0.0, 0.0] outside the bounds [0.0, 0.0, 0.0] to [1.0, 1.0, 1.0]",
        |s| {
            s.positions[1][0] = 1.5;
        },
    );
    check(
        "mesh 2, vertex 3: position [0.0, NaN, 3.0] outside the bounds [0.0, 0.0, 0.0] to [3.0, 3.0, 3.0]",
        |s| {
            s.positions[11][1] = f32::NAN;
        },
    );
    check("uvs: a texture coordinate is not finite", |s| {
        s.uvs[7][1] = f32::INFINITY
    });
}

/// The check goes through vertices in blocks: the culprit may be anywhere in one, or behind the last.
#[test]
fn a_single_wrong_vertex_is_found_wherever_it_is() {
    for count in 1..=11 {
        for (wrong, k) in (0..count).flat_map(|vertex| (0..3).map(move |k| (vertex, k))) {
            let mut scene = Scene {
                meshes: vec![Mesh {
                    max: [1.0; 3],
                    index_count: 3,
                    vertex_count: count as u32,
                    ..Mesh::default()
                }],
                positions: vec![[0.5; 3]; count],
                indices: vec![0; 3],
                ..Scene::default()
            };
            open(&file(&scene), Check::Everything).unwrap();
            scene.positions[wrong][k] = if wrong % 2 == 0 { -0.5 } else { f32::NAN };
            let error = open(&file(&scene), Check::Everything)
                .unwrap_err()
                .to_string();
            assert!(
                error.contains(&format!("mesh 0, vertex {wrong}: position")),
                "{error}"
            );
        }
    }
}

/// A tree as deep as it has objects: checked without recursion, on a small stack.
#[test]
fn the_deepest_tree_there_can_be() {
    const COUNT: u32 = 100_000;
    let mut scene = scene(COUNT);
    let all = scene.bounds;
    let chain = Bvh {
        split: "chain".into(),
        nodes: (0..COUNT)
            .flat_map(|object| {
                let ObjectBounds { min, max, cell, .. } = scene.object_bounds[object as usize];
                let spine = BvhNode {
                    min: all.min,
                    skip: 2 * COUNT - 1,
                    max: all.max,
                    cell_and_object: BvhNode::INTERIOR,
                };
                let leaf = |node: u32| BvhNode {
                    min,
                    skip: node + 1,
                    max,
                    cell_and_object: BvhNode::pack(cell, Some(object)),
                };
                // Every object but the last hangs off the spine to the left.
                if object + 1 < COUNT {
                    vec![spine, leaf(2 * object + 1)]
                } else {
                    vec![leaf(2 * object)]
                }
            })
            .collect(),
        parents: (0..2 * COUNT - 1)
            .map(|node| node.saturating_sub(1) & !1)
            .collect(),
        leaf_of_object: (0..COUNT)
            .map(|object| (2 * object + 1).min(2 * COUNT - 2))
            .collect(),
        stats: BvhStats {
            depth: COUNT - 1,
            ..BvhStats::default()
        },
    };
    scene.bvhs = vec![chain];
    let bytes = file(&scene);
    let opened = std::thread::Builder::new()
        .stack_size(64 << 10)
        .spawn(move || open(&bytes, Check::Objects));
    opened.unwrap().join().unwrap().unwrap();
}
