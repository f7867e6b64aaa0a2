//! What a bake says about its own error holds: measured here vertex by vertex.

use assert_cmd::Command;
use glam::{DAffine3, DMat3, DVec3};
use hroc_format::Scene;
use hroc_preprocess::bake::{Accuracy, BakeOptions, BakeReport, bake};
use hroc_preprocess::import::{ImportOptions, import_bytes};
use hroc_preprocess::progress::Silent;
use hroc_preprocess::scene::{AlphaMode, SourceFile, SourceMesh, SourceObject, SourceScene};
use proptest::prelude::*;
use std::path::Path;

fn scene(meshes: Vec<SourceMesh>, places: &[(usize, DAffine3)]) -> SourceScene {
    let object = |(id, &(mesh, world_from_object)): (usize, &(usize, DAffine3))| SourceObject {
        mesh,
        world_from_object,
        base_color: [1.0; 4],
        alpha: AlphaMode::Opaque,
        double_sided: false,
        name: format!("object {id}"),
        file: 0,
        node: id,
        primitive: 0,
    };
    SourceScene {
        files: vec![SourceFile {
            name: "test.glb".into(),
            hash: 1,
        }],
        objects: places.iter().enumerate().map(object).collect(),
        meshes,
        ..Default::default()
    }
}

fn mesh(positions: Vec<[f32; 3]>) -> SourceMesh {
    SourceMesh {
        indices: (0..positions.len() as u32 / 3 * 3).collect(),
        positions,
        ..Default::default()
    }
}

fn baked(source: &SourceScene, quantize: bool) -> (Scene, BakeReport) {
    // Without optimization the vertices stay in order.
    let options = BakeOptions {
        optimize: false,
        quantize,
        ..Default::default()
    };
    bake(source.clone(), &options, &Silent).unwrap()
}

/// The largest displacement of a vertex of an object, from the stored numbers.
fn displacement(scene: &Scene, source: &SourceScene, object: usize) -> f64 {
    let (stored, from) = (&scene.objects[object], &source.objects[object]);
    let origin = DVec3::from(cell_origin(scene, object));
    let first = scene.meshes[stored.mesh as usize].first_vertex as usize;
    let of_vertex = |(vertex, position): (usize, &[f32; 3])| {
        let place = match scene.quantized_positions.get(first + vertex) {
            Some(&lanes) => hroc_format::dequantize(lanes),
            None => scene.positions[first + vertex],
        };
        let row = |row: [f32; 4]| {
            let row = row.map(f64::from);
            let place = place.map(f64::from);
            row[0] * place[0] + row[1] * place[1] + row[2] * place[2] + row[3]
        };
        let found = origin + DVec3::from(stored.world_from_object.map(row));
        let right = from
            .world_from_object
            .transform_point3(DVec3::from(position.map(f64::from)));
        found.distance(right)
    };
    let mesh = &source.meshes[from.mesh];
    // Vertices that no triangle uses are left out; here they are the last ones.
    let used = mesh.positions.iter().take(mesh.indices.len());
    used.enumerate().map(of_vertex).fold(0.0, f64::max)
}

fn cell_origin(scene: &Scene, object: usize) -> [f64; 3] {
    scene.cells[scene.objects[object].cell as usize]
}

fn point(size: f64) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-size..size).prop_map(DVec3::from)
}

proptest! {
    #[test]
    fn the_displacement_is_a_bound_and_a_close_one(
        points in prop::collection::vec(prop::array::uniform3(-5_f32..5.0), 6..40),
        places in prop::collection::vec((point(3.0), point(3.0), point(3.0), point(1e4)), 1..6),
        far in prop::bool::ANY,
        quantize in prop::bool::ANY,
    ) {
        let shift = if far { DVec3::new(5.8e6, -3e5, 7.1) } else { DVec3::ZERO };
        let places: Vec<_> = places.into_iter().map(|(x, y, z, translation)| (0, DAffine3 {
            matrix3: DMat3::from_cols(x, y, z),
            translation: translation + shift,
        })).collect();
        let source = scene(vec![mesh(points)], &places);
        let (scene, report) = baked(&source, quantize);
        // The vertices of triangles that are left out go with them, and the others move up.
        prop_assume!(report.coincident_triangles == 0);
        let accuracy = report.accuracy.unwrap();
        let found = accuracy.farthest.unwrap();
        let right: Vec<f64> = (0..places.len()).map(|id| displacement(&scene, &source, id)).collect();
        let largest = right.iter().copied().fold(0.0, f64::max);
        // f64 itself is good to this, so far from the origin.
        let slack = 1e-8;
        prop_assert!(right.iter().all(|&right| right <= found.displacement + slack), "{right:?} {found:?}");
        let looseness = if quantize { 6.0 } else { 3.5 };
        prop_assert!(found.displacement <= looseness * largest + slack, "{largest} {found:?}");
        let share = found.share_of_size.unwrap();
        prop_assert!(accuracy.farthest_by_size.unwrap().share_of_size.unwrap() >= share);
    }
}

#[test]
fn nothing_moves_where_all_numbers_are_in_f32() {
    let source = scene(
        vec![mesh(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.5, 0.25]])],
        &[(0, DAffine3::from_translation(DVec3::new(3.0, -8.0, 1e6)))],
    );
    let (_, report) = baked(&source, false);
    let accuracy = report.accuracy.unwrap();
    assert_eq!(accuracy.farthest.as_ref().unwrap().displacement, 0.0);
    assert_eq!(accuracy.farthest.unwrap().size, 1.0);
    assert_eq!(accuracy.area.source, accuracy.area.baked);
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    let (_, report) = baked(&scene(Vec::new(), &[]), false);
    assert_eq!(report.accuracy.unwrap().farthest, None);
}

/// The grid of a mesh of 1 km flattens a triangle of a millimetre.
#[test]
fn flattened_triangles_and_lost_area_are_told() {
    let mut points = vec![[0.0; 3], [1000.0, 0.0, 0.0], [0.0, 1000.0, 0.0]];
    points.extend([[7.0, 7.0, 0.0], [7.001, 7.0, 0.0], [7.0, 7.001, 0.0]]);
    let source = scene(vec![mesh(points.clone())], &[(0, DAffine3::IDENTITY)]);
    let (_, report) = baked(&source, true);
    let accuracy = report.accuracy.as_ref().unwrap();
    assert_eq!(accuracy.triangles.source, 2);
    assert_eq!(accuracy.triangles.flattened, 1);
    assert!((accuracy.area.source - 5e5).abs() < 1.0);
    assert!(
        report
            .warnings
            .iter()
            .any(|w| w.contains("no area as stored"))
    );
    // The small triangle alone loses all of its area where it cannot be told from a point.
    let far = scene(
        vec![mesh(vec![
            [1e6, 0.0, 0.0],
            [1e6, 1e-3, 0.0],
            [1e6, 0.0, 1e-3],
        ])],
        &[(0, DAffine3::IDENTITY)],
    );
    let (_, report) = baked(&far, false);
    assert!(report.accuracy.unwrap().area.largest_change < 1e-6);
}

#[test]
fn an_obj_is_measured_against_the_numbers_in_the_file() {
    let text = "v 0 0 0\nv 0.1 0 0\nv 0 0.3 0\nv 1 1 1\nf 1 2 3\nf 2 3 4\n";
    let path = Path::new("a.obj");
    let source = import_bytes(path, text.as_bytes(), &ImportOptions::default()).unwrap();
    let (_, report) = baked(&source, false);
    let found = report.accuracy.unwrap().farthest.unwrap().displacement;
    let largest = (f64::from(0.3_f32) - 0.3).abs();
    assert!(
        found >= largest && found <= 2.0 * largest,
        "{found} {largest}"
    );
}

#[test]
fn bake_and_inspect_tell_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 0.1 0 0\nv 0 0.3 0\nf 1 2 3\n";
    std::fs::write(folder.path().join("a.obj"), text).unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::cargo_bin("hroc-bake").unwrap();
        let output = command
            .current_dir(folder.path())
            .args(arguments)
            .output()
            .unwrap();
        assert!(output.status.success());
        output
    };
    let json = |output: std::process::Output| -> serde_json::Value {
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let bake = run(&["bake", "a.obj", "-o", "a.hroc", "--json", "-"]);
    let log = String::from_utf8(bake.stderr.clone()).unwrap();
    assert!(log.contains("largest displacement: at most"), "{log}");
    let bake = json(bake);
    let first = std::fs::read(folder.path().join("a.hroc")).unwrap();
    let inspect = json(run(&["inspect", "a.hroc", "--json"]));
    assert_eq!(bake["accuracy"], inspect["accuracy"]);
    assert_eq!(inspect["sections"][0]["name"], "accuracy");
    assert!(
        bake["accuracy"]["farthest"]["displacement"]
            .as_f64()
            .unwrap()
            > 0.0
    );
    let unchanged = json(run(&[
        "bake",
        "a.obj",
        "-o",
        "a.hroc",
        "--if-changed",
        "--json",
        "-",
    ]));
    assert_eq!(unchanged["unchanged"], true);
    assert_eq!(unchanged["accuracy"], bake["accuracy"]);
    let text = String::from_utf8(run(&["inspect", "a.hroc"]).stdout).unwrap();
    assert!(text.contains("largest displacement: at most"), "{text}");
    run(&["bake", "a.obj", "-o", "a.hroc", "--jobs", "1"]);
    assert_eq!(std::fs::read(folder.path().join("a.hroc")).unwrap(), first);
    let accuracy: Accuracy = serde_json::from_value(bake["accuracy"].clone()).unwrap();
    assert_eq!(accuracy.schema, 1);
}

#[test]
fn small_objects_far_away_are_warned_about() {
    let bolt = mesh(vec![[0.0; 3], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]]);
    let places = [
        (
            0,
            DAffine3::from_translation(DVec3::new(1234.567, 0.1, 0.0)),
        ),
        (
            0,
            DAffine3::from_translation(DVec3::new(-1234.567, 0.1, 0.0)),
        ),
    ];
    let (_, report) = baked(&scene(vec![bolt], &places), false);
    let accuracy = report.accuracy.as_ref().unwrap();
    let warned = report
        .warnings
        .iter()
        .any(|warning| warning.contains("of its size"));
    let share = accuracy
        .farthest_by_size
        .as_ref()
        .unwrap()
        .share_of_size
        .unwrap();
    assert_eq!(warned, share > 1e-4);
}

#[test]
fn inspect_tells_looks_materials_and_readers() {
    let folder = tempfile::tempdir().unwrap();
    let text = "mtllib a.mtl\nv 0 0 0\nv 0.1 0 0\nv 0 0.3 0\nv 1 1 1\nf 1 2 3\nusemtl red\nf 1 2 3\nf 2 3 4\n";
    std::fs::write(folder.path().join("a.obj"), text).unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl red\nKd 1 0 0\nd 0.2\n").unwrap();
    let gltf = serde_json::json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "materials": [{ "name": "glass", "doubleSided": true }, {}],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0 }, "material": 1 },
            { "attributes": { "POSITION": 0 }, "material": 0 },
            { "attributes": { "POSITION": 0 } } ] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }],
    });
    std::fs::write(folder.path().join("b.gltf"), gltf.to_string()).unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::cargo_bin("hroc-bake").unwrap();
        let output = command
            .current_dir(folder.path())
            .args(arguments)
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        output.stdout
    };
    for split in [&[][..], &["--split-objects", "1"]] {
        run(&[&["bake", "a.obj", "b.gltf", "-o", "a.hroc"], split].concat());
        let found = run(&["inspect", "a.hroc", "--json"]);
        let found: serde_json::Value = serde_json::from_slice(&found).unwrap();
        let objects = found["objects"].as_array().unwrap();
        let materials: Vec<_> = objects
            .iter()
            .map(|object| object["material"].as_str())
            .collect();
        let expected = [
            None,
            Some("red"),
            Some("red"),
            Some("material 1"),
            Some("glass"),
            None,
        ];
        match split {
            [] => assert_eq!(materials, [&expected[..1], &expected[2..]].concat()),
            _ => assert_eq!(materials, expected),
        }
        assert_eq!(objects[1]["color"][0], 1.0);
        assert!((objects[1]["color"][3].as_f64().unwrap() - 0.2).abs() < 1e-6);
        let sides: Vec<_> = objects
            .iter()
            .rev()
            .take(3)
            .map(|object| &object["double_sided"])
            .collect();
        assert_eq!(sides, [false, true, false]);
        // The versions are those that were built in.
        let lock =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.lock")).unwrap();
        for (file, library) in [(0, "tobj"), (1, "gltf")] {
            let at = lock
                .find(&format!("name = \"{library}\"\nversion = \""))
                .unwrap();
            let version = lock[at..].split('"').nth(3).unwrap();
            assert_eq!(
                found["source_files"][file]["loader"],
                format!("{library} {version}")
            );
        }
    }
}
