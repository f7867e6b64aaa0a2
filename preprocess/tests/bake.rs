//! What a bake promises: ids and counts of the source, bounds that hold, the same bytes every time.

use glam::{DAffine3, DMat3, DVec3};
use hroc_format::{BakedScene, Check, Scene, object_flags, to_bytes};
use hroc_preprocess::bake::{BakeOptions, bake};
use hroc_preprocess::progress::Silent;
use hroc_preprocess::scene::{
    AlphaMode, SourceCamera, SourceFile, SourceMesh, SourceObject, SourceScene,
};
use hroc_preprocess::tree;

/// A small generator of numbers in 0..1, the same on every run.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        // Steele, Lea, Flood: SplitMix64.
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn point(&mut self, size: f64) -> DVec3 {
        DVec3::new(self.next() - 0.5, self.next() - 0.5, self.next() - 0.5) * size
    }
}

fn mesh(numbers: &mut Numbers, triangles: usize) -> SourceMesh {
    let vertices = triangles + 2;
    SourceMesh {
        positions: (0..vertices)
            .map(|_| numbers.point(3.0).as_vec3().into())
            .collect(),
        normals: (0..vertices)
            .map(|_| numbers.point(1.0).normalize().as_vec3().into())
            .collect(),
        uvs: (0..vertices)
            .map(|_| [numbers.next() as f32, numbers.next() as f32])
            .collect(),
        indices: (0..triangles as u32)
            .flat_map(|i| [i, i + 1, i + 2])
            .collect(),
    }
}

/// Objects with sheared, mirrored and flattened transforms around `centre`.
fn scene(objects: usize, centre: DVec3) -> SourceScene {
    let mut numbers = Numbers(7);
    let meshes: Vec<_> = (0..5).map(|i| mesh(&mut numbers, 1 + 40 * i)).collect();
    let object = |id: usize| SourceObject {
        mesh: id % 5,
        world_from_object: DAffine3 {
            matrix3: DMat3::from_cols(
                numbers.point(4.0),
                numbers.point(4.0),
                numbers.point(if id.is_multiple_of(7) { 0.0 } else { 4.0 }),
            ),
            translation: centre + numbers.point(1000.0),
        },
        base_color: [1.0, 0.5, 0.0, 0.25],
        alpha: [AlphaMode::Opaque, AlphaMode::Masked, AlphaMode::Blended][id % 3],
        double_sided: id % 2 == 1,
        name: format!("object {id}"),
        file: 0,
        node: id,
        primitive: 0,
    };
    SourceScene {
        name: "test".into(),
        files: vec![SourceFile {
            name: "test.glb".into(),
            hash: 1,
        }],
        objects: (0..objects).map(object).collect(),
        meshes,
        cameras: vec![SourceCamera {
            name: "eye".into(),
            position: centre + DVec3::X,
            orientation: glam::DQuat::IDENTITY,
            fov_y_rad: 1.0,
            half_height: 0.0,
            near: 0.1,
            far: f32::INFINITY,
        }],
        ..Default::default()
    }
}

fn baked(source: SourceScene, options: &BakeOptions) -> Scene {
    let (scene, _) = bake(source, options, &Silent).unwrap();
    let bytes = to_bytes(&scene).unwrap();
    BakedScene::from_aligned(bytes, Check::Everything).unwrap();
    scene
}

#[test]
fn counts_ids_and_looks_are_those_of_the_source() {
    let source = scene(100, DVec3::ZERO);
    for optimize in [true, false] {
        let baked = baked(
            source.clone(),
            &BakeOptions {
                optimize,
                uvs: true,
                ..Default::default()
            },
        );
        assert_eq!(baked.objects.len(), 100);
        assert_eq!(
            baked
                .bvhs
                .iter()
                .map(|bvh| bvh.split.as_str())
                .collect::<Vec<_>>(),
            ["sah", "middle", "equal-count"]
        );
        for (id, (object, from)) in baked.objects.iter().zip(&source.objects).enumerate() {
            let mesh = baked.meshes[object.mesh as usize];
            assert_eq!(
                mesh.index_count as usize,
                source.meshes[from.mesh].indices.len()
            );
            assert_eq!(baked.object_sources[id].node as usize, id);
        }
        assert_eq!(baked.normals.len(), baked.positions.len());
        assert_eq!(baked.uvs.len(), baked.positions.len());
        assert_eq!(
            baked.objects[0].base_color, 0xFF00_80FF,
            "opaque objects have no alpha"
        );
        assert_eq!(baked.objects[1].base_color, 0x4000_80FF);
        assert_eq!(
            baked.objects[1].flags,
            object_flags::MASKED | object_flags::DOUBLE_SIDED
        );
        assert_eq!(baked.objects[2].flags, object_flags::BLENDED);
        assert_eq!(&baked.names[..baked.name_ends[0] as usize], b"object 0");
    }
}

#[test]
fn bounds_hold_every_vertex_near_and_far() {
    let centres = [DVec3::ZERO, DVec3::splat(1e7), DVec3::new(-4e9, 3.0, 1e5)];
    for (centre, quantize) in centres.into_iter().flat_map(|c| [(c, false), (c, true)]) {
        let options = BakeOptions {
            quantize,
            ..Default::default()
        };
        let baked = baked(scene(50, centre), &options);
        // Decoded by any GPU: each coordinate a unit in the last place to either side.
        let decode = |stored: &[u16; 4]| hroc_format::dequantize(*stored);
        let positions: Vec<[f32; 3]> = match quantize {
            true => baked.quantized_positions.iter().map(decode).collect(),
            false => baked.positions.clone(),
        };
        assert_eq!(baked.positions.is_empty(), quantize);
        assert!((DVec3::from(baked.origin) - centre).abs().max_element() < 1000.0);
        for (object, bounds) in baked.objects.iter().zip(&baked.object_bounds) {
            let mesh = baked.meshes[object.mesh as usize];
            let first = mesh.first_vertex as usize;
            for p in &positions[first..first + mesh.vertex_count as usize] {
                for ulps in [-1, 0, 1] {
                    let off = |x: f32| match ulps {
                        -1 if quantize && x > 0.0 => x.next_down(),
                        1 if quantize && x > 0.0 => x.next_up(),
                        _ => x,
                    };
                    let p = p.map(off);
                    for (axis, row) in object.world_from_object.iter().enumerate() {
                        let value = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];
                        assert!(bounds.min[axis] <= value && value <= bounds.max[axis]);
                    }
                }
            }
        }
        let camera = DVec3::from(baked.cameras[0].position) + DVec3::from(baked.origin);
        assert!(camera.abs_diff_eq(centre + DVec3::X, 1e-5));
    }
}

#[test]
fn a_far_scene_keeps_the_shape_of_a_near_one() {
    let near = baked(scene(50, DVec3::ZERO), &BakeOptions::default());
    let far = baked(
        scene(50, DVec3::splat(f64::from(1 << 23))),
        &BakeOptions::default(),
    );
    let shift =
        DVec3::from(far.origin) - DVec3::from(near.origin) - DVec3::splat(f64::from(1 << 23));
    assert_eq!(
        shift,
        DVec3::ZERO,
        "a shift along the grid moves the origin and nothing else"
    );
    for (a, b) in near.object_bounds.iter().zip(&far.object_bounds) {
        let difference =
            |a: [f32; 3], b: [f32; 3]| (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f32::max);
        assert!(difference(a.min, b.min).max(difference(a.max, b.max)) < 1e-3);
    }
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let scene = pool.install(|| baked(scene(6000, DVec3::ZERO), &BakeOptions::default()));
        to_bytes(&scene).unwrap().to_vec()
    };
    let one = bytes(1);
    assert!(one == bytes(1), "a second run");
    for threads in [2, 16] {
        assert!(one == bytes(threads), "{threads} threads");
    }
}

#[test]
fn an_empty_scene_has_no_trees() {
    let baked = baked(SourceScene::default(), &BakeOptions::default());
    assert!(baked.objects.is_empty() && baked.bvhs.is_empty());
    assert_eq!(
        (baked.origin, baked.bounds.min, baked.bounds.max),
        ([0.0; 3], [0.0; 3], [0.0; 3])
    );
}

#[test]
fn options_leave_out_what_they_say() {
    let source = scene(10, DVec3::ZERO);
    let options = BakeOptions {
        splits: vec![tree::by_name("middle").unwrap()],
        normals: false,
        ..Default::default()
    };
    let baked = baked(source, &options);
    assert!(baked.normals.is_empty() && baked.uvs.is_empty());
    assert_eq!(baked.bvhs.len(), 1);
    let settings = r#"{"normals":false,"optimize":true,"quantize":false,"scene":null,"split_objects":null,"splits":["middle"],"uvs":false}"#;
    assert_eq!(baked.settings, settings);
}

/// Every triangle of every object in world, in f64, as sorted lists.
fn world_triangles(baked: &Scene) -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::new();
    for object in &baked.objects {
        let mesh = baked.meshes[object.mesh as usize];
        let rows = object.world_from_object.map(|row| row.map(f64::from));
        let corner = |&index: &u32| {
            let vertex = (mesh.first_vertex + index) as usize;
            let p = match baked.quantized_positions.get(vertex) {
                Some(stored) => hroc_format::dequantize(*stored),
                None => baked.positions[vertex],
            };
            let p = p.map(f64::from);
            DVec3::from(rows.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]))
        };
        let indices = &baked.indices[mesh.first_index as usize..][..mesh.index_count as usize];
        triangles.extend(
            indices
                .chunks(3)
                .map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])]),
        );
    }
    triangles
}

#[test]
fn quantized_vertices_stay_within_their_promise() {
    let source = scene(40, DVec3::splat(5e5));
    let options = |quantize| BakeOptions {
        quantize,
        optimize: false,
        ..Default::default()
    };
    let (plain, quantized) = (
        baked(source.clone(), &options(false)),
        baked(source, &options(true)),
    );
    let shift = DVec3::from(quantized.origin) - DVec3::from(plain.origin);
    // Meshes are 3 long, transforms stretch by 4 at most in each of three columns.
    let worst = 3.0 / 65534.0 * 12.0 + 1e-3;
    for (a, b) in world_triangles(&plain)
        .iter()
        .zip(world_triangles(&quantized))
    {
        for (a, b) in a.iter().zip(b) {
            assert!((*a - b - shift).abs().max_element() < worst, "{a} {b}");
        }
    }
    let bytes = |scene: &Scene| to_bytes(scene).unwrap().len();
    assert!(bytes(&quantized) < bytes(&plain));
}

#[test]
fn large_meshes_become_several_objects() {
    let source = scene(20, DVec3::ZERO);
    let whole = baked(source.clone(), &BakeOptions::default());
    let options = BakeOptions {
        split_objects: std::num::NonZeroU32::new(50),
        ..Default::default()
    };
    let parts = baked(source, &options);
    assert!(parts.objects.len() > 20 && parts.meshes.iter().all(|mesh| mesh.index_count <= 150));
    let sorted = |scene: &Scene| {
        let mut triangles: Vec<_> = world_triangles(scene)
            .iter()
            .map(|triangle| {
                let mut corners = triangle.map(|corner| corner.to_array().map(f64::to_bits));
                corners.sort_unstable();
                corners
            })
            .collect();
        triangles.sort_unstable();
        triangles
    };
    assert!(
        sorted(&whole) == sorted(&parts),
        "every triangle is where it was"
    );
    let nodes: Vec<u32> = parts
        .object_sources
        .iter()
        .map(|source| source.node)
        .collect();
    assert!(nodes.is_sorted() && nodes[nodes.len() - 1] == 19);
}

#[test]
fn missing_normals_are_computed_beside_others() {
    let mut source = scene(10, DVec3::ZERO);
    source.meshes[1].normals.clear();
    let baked = baked(source, &BakeOptions::default());
    assert_eq!(baked.normals.len(), baked.positions.len());
}

#[test]
fn faults_of_the_source_are_errors() {
    let fault = |edit: fn(&mut SourceScene)| {
        let mut source = scene(10, DVec3::ZERO);
        edit(&mut source);
        bake(source, &BakeOptions::default(), &Silent)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        fault(|source| source.objects[3].mesh = 5),
        "object 3: its mesh or file does not exist; check the importer that made it"
    );
    assert!(fault(|source| source.meshes[2].indices[0] = 1 << 30).starts_with("mesh 2: index"));
    let far = fault(|source| source.objects[4].world_from_object.matrix3.x_axis.x = 1e39);
    assert!(
        far.starts_with("object 4 \"object 4\"") && far.contains("too large"),
        "{far}"
    );
    let spread = fault(|source| source.objects[4].world_from_object.translation.x = 1e300);
    assert!(spread.contains("too large"), "{spread}");
}

/// A square of `size` x `size` quads with a hill on it, as one mesh.
fn terrain(size: u32) -> SourceMesh {
    let height = |x: u32, z: u32| (x as f32 * 0.37).sin() * (z as f32 * 0.53).cos() * 3.1;
    let side = size + 1;
    let quads = (0..size).flat_map(|z| (0..size).map(move |x| z * side + x));
    SourceMesh {
        positions: (0..side)
            .flat_map(|z| (0..side).map(move |x| (x, z)))
            .map(|(x, z)| [x as f32 * 1.013, height(x, z), z as f32 * 0.977])
            .collect(),
        indices: quads
            .flat_map(|v| [v, v + side, v + 1, v + 1, v + side, v + side + 1])
            .collect(),
        ..Default::default()
    }
}

/// Each vertex of each object in world, as the bits of its coordinates.
fn world_points(baked: &Scene) -> Vec<Vec<[u64; 3]>> {
    let object = |object: &hroc_format::Object| {
        let mesh = baked.meshes[object.mesh as usize];
        let first = mesh.first_vertex as usize;
        let points = &baked.quantized_positions[first..first + mesh.vertex_count as usize];
        let rows = object.world_from_object.map(|row| row.map(f64::from));
        let world = |stored: &[u16; 4]| {
            let p = hroc_format::dequantize(*stored).map(f64::from);
            rows.map(|row| (row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]).to_bits())
        };
        points.iter().map(world).collect()
    };
    baked.objects.iter().map(object).collect()
}

#[test]
fn quantized_parts_of_one_mesh_stay_watertight() {
    // Parts made by `--split-objects`, and primitives that the source has already.
    let mut source = scene(1, DVec3::new(1e4, -3.3, 7.7));
    source.meshes = vec![terrain(40)];
    let turn = DMat3::from_rotation_y(0.3) * 1.7;
    source.objects[0].world_from_object.matrix3 = turn;
    let split = BakeOptions {
        quantize: true,
        split_objects: std::num::NonZeroU32::new(100),
        ..Default::default()
    };
    let whole = BakeOptions {
        quantize: true,
        ..Default::default()
    };
    let mut primitives = source.clone();
    let (first, second) = source.meshes[0].indices.split_at(1200);
    primitives.meshes[0].indices = first.to_vec();
    primitives.meshes.push(SourceMesh {
        positions: source.meshes[0].positions.clone(),
        indices: second.to_vec(),
        ..Default::default()
    });
    let mut object = primitives.objects[0].clone();
    (object.mesh, object.primitive) = (1, 1);
    primitives.objects.push(object);
    for (source, options) in [
        (source.clone(), &split),
        (primitives.clone(), &whole),
        (primitives, &split),
    ] {
        let baked = baked(source.clone(), options);
        assert!(baked.objects.len() > 1);
        let mut points: Vec<_> = world_points(&baked).concat();
        points.sort_unstable();
        points.dedup();
        assert_eq!(
            points.len(),
            41 * 41,
            "each vertex is in one place, whichever part it is in"
        );
    }
}

#[test]
fn triangles_whose_corners_coincide_are_left_out_and_counted() {
    let mut source = scene(10, DVec3::ZERO);
    let triangles = |source: &SourceScene| -> usize {
        source
            .meshes
            .iter()
            .map(|mesh| mesh.indices.len() / 3)
            .sum()
    };
    let before = triangles(&source);
    // Equal indices, equal positions, and -0 beside 0. A sliver stays.
    let mesh = &mut source.meshes[1];
    let count = mesh.positions.len() as u32;
    mesh.positions
        .extend([[0.0, 1.0, 2.0], [-0.0, 1.0, 2.0], [1.0; 3], [0.5, 1.0, 1.5]]);
    mesh.normals.extend([[0.0, 0.0, 1.0]; 4]);
    mesh.uvs.extend([[0.0; 2]; 4]);
    mesh.indices.extend([0, 0, 1, 0, 1, 1, 2, 0, 2]);
    mesh.indices.extend([count, count + 1, 0]);
    mesh.indices.extend([count, count + 2, count + 3]);
    // A mesh of nothing else, which objects 0 and 5 draw, and a stray vertex.
    source.meshes[0].indices = vec![0, 0, 1, 2, 2, 2];
    source.meshes[3].positions.push([1e30; 3]);
    source.meshes[3].normals.push([0.0, 0.0, 1.0]);
    source.meshes[3].uvs.push([0.0; 2]);
    for (optimize, quantize) in [(true, false), (false, false), (true, true), (false, true)] {
        let options = BakeOptions {
            optimize,
            quantize,
            ..Default::default()
        };
        let (baked, report) = bake(source.clone(), &options, &Silent).unwrap();
        let bytes = to_bytes(&baked).unwrap();
        BakedScene::from_aligned(bytes, Check::Everything).unwrap();
        assert_eq!(
            (report.coincident_triangles, report.sliver_triangles),
            (6, 1)
        );
        // The first mesh had one triangle; the second gains a sliver.
        assert_eq!(report.stored_triangles, before - 1 + 1);
        assert_eq!((report.empty_objects, report.objects), (2, 8));
        assert_eq!(report.warnings.len(), 3, "{:?}", report.warnings);
        let nodes: Vec<u32> = baked
            .object_sources
            .iter()
            .map(|source| source.node)
            .collect();
        assert_eq!(
            nodes,
            [1, 2, 3, 4, 6, 7, 8, 9],
            "ids are dense and in order"
        );
        assert!(
            baked
                .meshes
                .iter()
                .all(|mesh| mesh.index_count > 0 && mesh.max[0] < 10.0)
        );
    }
    for mesh in &mut source.meshes {
        mesh.indices = vec![0, 0, 0];
    }
    let (baked, report) = bake(source, &BakeOptions::default(), &Silent).unwrap();
    assert!(baked.objects.is_empty() && baked.meshes.is_empty() && report.empty_objects == 10);
}

#[test]
fn triangles_that_the_grid_of_positions_closes_are_left_out() {
    let mut source = scene(1, DVec3::ZERO);
    source.meshes = vec![SourceMesh {
        positions: vec![
            [0.0; 3],
            [1000.0, 0.0, 0.0],
            [0.0, 1000.0, 0.0],
            [1e-3, 0.0, 0.0],
        ],
        indices: vec![0, 1, 2, 0, 3, 2],
        ..Default::default()
    }];
    let options = |quantize| BakeOptions {
        quantize,
        ..Default::default()
    };
    let report = |quantize| bake(source.clone(), &options(quantize), &Silent).unwrap().1;
    assert_eq!(
        (
            report(false).coincident_triangles,
            report(false).stored_triangles
        ),
        (0, 2)
    );
    assert_eq!(
        (
            report(true).coincident_triangles,
            report(true).stored_triangles
        ),
        (1, 1)
    );
}
