//! What the OBJ importer makes of small files written here, and what is refused as no scene at all.

use glam::DVec3;
use hroc_preprocess::import::{ImportError, ImportOptions, import};
use hroc_preprocess::progress::Silent;
use hroc_preprocess::scene::{AlphaMode, SourceScene};
use std::fs;
use std::path::Path;

fn import_files(
    files: &[(&str, &[u8])],
    options: &ImportOptions,
) -> Result<SourceScene, ImportError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    import(&[folder.path().join(files[0].0)], options, &Silent)
}

fn obj(text: &str) -> SourceScene {
    import_files(
        &[("a.obj", text.as_bytes())],
        &ImportOptions {
            uvs: true,
            ..Default::default()
        },
    )
    .unwrap()
}

fn error(name: &str, bytes: &[u8]) -> String {
    let error = import_files(&[(name, bytes)], &ImportOptions::default())
        .unwrap_err()
        .to_string();
    assert!(!error.contains('\n'), "{error}");
    error
}

const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn an_object_is_one_o_one_g_and_one_usemtl() {
    let scene = obj(&format!(
        "{QUAD}f 1 2 3\no a\nf 1 2 3\ng b\nf 1 2 3\nusemtl red\nf 1 2 3 4\nusemtl blue\nf 1 2 3\nusemtl red\n\
         f 3 2 1\no c\ng\nf 1 2 3\ng c\nf 1 2 3\no empty\n"
    ));
    let found: Vec<_> = scene
        .objects
        .iter()
        .map(|o| {
            (
                o.name.as_str(),
                o.node,
                scene.meshes[o.mesh].indices.len() / 3,
            )
        })
        .collect();
    assert_eq!(
        found,
        [
            ("", 0, 1),
            ("a", 1, 1),
            ("a/b", 2, 1),
            ("a/b", 3, 3),
            ("a/b", 4, 1),
            ("c", 5, 1),
            ("c", 6, 1)
        ]
    );
}

#[test]
fn polygons_are_fans_and_indices_may_be_relative() {
    let scene = obj(&format!("{QUAD}v 0 .5 0\nf -5 -4 -3 -2 -1\n"));
    assert_eq!(scene.meshes[0].indices, [0, 1, 2, 0, 2, 3, 0, 3, 4]);
    assert_eq!(scene.meshes[0].positions[4], [0.0, 0.5, 0.0]);
}

#[test]
fn a_concave_polygon_covers_itself_and_nothing_else() {
    // The notch lies at (1, 1): a fan from the first corner would cover the ground outside.
    let scene = obj("v 0 0 0\nv 4 2 0\nv 0 4 0\nv 1 2 0\nf 1 2 3 4\nf 1 2 3\n");
    let mesh = &scene.meshes[0];
    let area = |t: &[u32]| {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| glam::Vec3::from(mesh.positions[i as usize]));
        (b - a).cross(c - a).z / 2.0
    };
    let areas: Vec<f32> = mesh.indices.chunks_exact(3).map(area).collect();
    assert_eq!(areas.len(), 3);
    assert!(areas.iter().all(|&area| area > 0.0), "{areas:?}");
    assert_eq!(areas[0] + areas[1], 6.0);
    assert_eq!(areas[2], 8.0);
}

#[test]
fn continued_lines_foreign_bytes_and_line_ends_are_read() {
    let text = b"o caf\xE9\r\nv 0 0 \\\r\n 0 # corner\r\nv 1 0 0 0.5 0.5 0.5\r\nv\t0 1 0 2\r\n  f 1 \\\n2 \\\n3";
    let scene = import_files(&[("a.obj", text)], &ImportOptions::default()).unwrap();
    assert_eq!(scene.objects[0].name, "caf\u{FFFD}");
    assert_eq!(
        scene.meshes[0].positions,
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    );
}

#[test]
fn a_statement_may_go_on_for_a_million_lines() {
    let scene = obj(&format!("{QUAD}f 1 2{} 3\n", " \\\n".repeat(1_000_000)));
    assert_eq!(scene.meshes[0].indices, [0, 1, 2]);
}

#[test]
fn points_lines_and_curves_are_counted_in_warnings() {
    let scene = obj(&format!(
        "{QUAD}p 1\nl 1 2 3 4\nf 1 2\nf 1\ncurv 0 1 1 2\nf 1 2 3\n"
    ));
    assert_eq!((scene.objects.len(), scene.meshes[0].indices.len()), (1, 3));
    assert_eq!(
        scene.warnings,
        [
            "a.obj: points skipped: 2",
            "a.obj: lines skipped: 2",
            "a.obj: free-form curves and surfaces skipped: 1"
        ]
    );
    assert_eq!(obj(QUAD).warnings, ["the scene has no triangles"]);
}

#[test]
fn normals_are_kept_when_every_corner_has_one() {
    let text = format!("{QUAD}vn 0 0 5\nvn 0 0 0\nvt 0.5 0.25\n");
    let scene = obj(&format!("{text}f 1/1/1 2/1/1 3/1/2\n"));
    assert_eq!(scene.meshes[0].normals, [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(scene.meshes[0].uvs, [[0.5, 0.25]; 3]);
    for faces in ["f 1//1 2//1 3\n", "f 1//1 2//1 3//9\n"] {
        let scene = obj(&format!("{text}{faces}"));
        assert!(scene.meshes[0].normals.is_empty() && scene.meshes[0].uvs.is_empty());
        assert_eq!(
            scene.warnings,
            ["a.obj: objects with normals on some corners only, dropped: 1"]
        );
    }
}

#[test]
fn materials_come_from_beside_the_file_only() {
    let text = format!(
        "mtllib my colours.mtl\nmtllib gone.mtl\nmtllib ../up.mtl\n{QUAD}usemtl red\nf 1 2 3\nusemtl glass\nf 1 2 3\n\
         usemtl none\nf 1 2 3\n"
    );
    let library = b"newmtl red\nKd 1 0 0\nnewmtl glass\nKd 0 1 0\nd 0.5\n";
    let files = [
        ("a.obj", text.as_bytes()),
        ("my colours.mtl", library.as_slice()),
    ];
    let scene = import_files(&files, &ImportOptions::default()).unwrap();
    let looks: Vec<_> = scene
        .objects
        .iter()
        .map(|o| (o.base_color, o.alpha))
        .collect();
    assert_eq!(looks[0], ([1.0, 0.0, 0.0, 1.0], AlphaMode::Opaque));
    assert_eq!(looks[1], ([0.0, 1.0, 0.0, 0.5], AlphaMode::Blended));
    assert_eq!(looks[2], ([1.0; 4], AlphaMode::Opaque));
    assert_eq!(scene.warnings.len(), 3, "{:?}", scene.warnings);
    assert!(scene.warnings[0].contains("gone.mtl"));
    assert!(scene.warnings[1].contains("leads out of the scene's folder"));
    assert!(scene.warnings[2].contains("whose material is in no library"));
}

#[test]
fn surveyed_coordinates_keep_their_millimetres() {
    let scene = obj(
        "v 500000.001 5000000.002 10\nv 500001.001 5000000.002 10\nv 500000.001 5000001.003 10\nf 1 2 3\n",
    );
    let to_world = scene.objects[0].world_from_object;
    let world = scene.meshes[0]
        .positions
        .iter()
        .map(|p| to_world.transform_point3(DVec3::from(p.map(f64::from))));
    let expected = [
        (500000.001, 5000000.002),
        (500001.001, 5000000.002),
        (500000.001, 5000001.003),
    ];
    for (found, (x, y)) in world.zip(expected) {
        assert!(found.abs_diff_eq(DVec3::new(x, y, 10.0), 1e-6), "{found}");
    }
}

#[test]
fn faults_name_their_line() {
    for (statement, parts) in [
        (
            "f 1 2 5",
            &["line 5", "position index \"5\"", "outside the 4"][..],
        ),
        ("f 1 2 0", &["line 5", "\"0\""]),
        ("f 1 2 -5", &["line 5", "\"-5\""]),
        ("f 1 2 x", &["line 5", "\"x\"", "not a number"]),
        ("f 1 2 /1", &["line 5", "no position"]),
        ("f 1 2 99999999999999999999", &["line 5"]),
        ("v 1 2", &["line 5", "position parse error"]),
        ("v 1 2 x", &["line 5", "position parse error"]),
        (
            "vn 1 2 \\\n\nvt 1 \\\n2\nv 1",
            &["line 5", "normal parse error"],
        ),
        ("vn 1 2 \\\n3\n\nv 1", &["line 8", "position parse error"]),
        ("v nan 0 0\nf 1 2 5", &["line 6", "not finite"]),
        ("v 1e39 0 0\nf 1 2 5", &["too large for f32"]),
    ] {
        let error = error("a.obj", format!("{QUAD}{statement}\n").as_bytes());
        for part in parts {
            assert!(
                error.contains(part) && error.contains("; "),
                "{part:?} is not in {error:?}"
            );
        }
    }
}

#[test]
fn what_is_no_scene_is_refused_for_what_it_is() {
    for (name, bytes, what) in [
        ("a.glb", b"\x89PNG\r\n\x1a\n".as_slice(), "is a PNG image"),
        ("a.obj", b"", "is empty"),
        ("a.glb", b"HROCBAKE........", "is a baked scene already"),
        (
            "a.gltf",
            b"hello",
            "is neither binary glTF nor a JSON object",
        ),
        ("a.txt", b"hello", "is in no known scene format"),
        ("a.fbx", b"Kaydara FBX Binary  \0", "is an FBX scene"),
        ("a.obj", b"\xFE\xFF\0v\0 ", "is UTF-16 text"),
        ("a.gltf", b"{", "the JSON is not glTF 2.0"),
        ("a.gltf", b"{}", "the JSON is not glTF 2.0"),
        ("a.glb", b"glTF", "ends within its header"),
    ] {
        let error = error(name, bytes);
        assert!(error.contains(what) && error.contains("; "), "{error}");
    }
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().to_owned(), folder.path().join("gone.glb")];
    for (path, what) in paths.iter().zip(["is a folder", "cannot be read"]) {
        let error = import(
            std::slice::from_ref(path),
            &ImportOptions::default(),
            &Silent,
        )
        .unwrap_err();
        assert!(error.to_string().contains(what), "{error}");
        assert_eq!(&error.file, path);
    }
}

#[test]
fn content_decides_before_the_name_does() {
    let text = format!("{QUAD}f 1 2 3\n");
    for name in ["a.glb", "a", "a.OBJ"] {
        let scene = import_files(&[(name, text.as_bytes())], &ImportOptions::default()).unwrap();
        assert_eq!(scene.objects.len(), 1, "{name}");
    }
}

#[test]
fn several_files_become_one_scene_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    };
    let first = write("first.obj", &format!("{QUAD}f 1 2 3\ng x\nf 1 2 4\n"));
    let second = write("second.obj", &format!("{QUAD}f 1 2 3\n"));
    let scene = import(&[first, second], &ImportOptions::default(), &Silent).unwrap();
    assert_eq!(scene.name, "first");
    assert_eq!(
        scene
            .objects
            .iter()
            .map(|o| (o.file, o.node, o.mesh))
            .collect::<Vec<_>>(),
        [(0, 0, 0), (0, 1, 1), (1, 0, 2)]
    );
    assert_eq!(
        scene
            .files
            .iter()
            .map(|file| file.name.as_str())
            .collect::<Vec<_>>(),
        ["first.obj", "second.obj"]
    );
    assert!(
        Path::new(&scene.files[0].name).parent() == Some(Path::new("")),
        "no folders in names"
    );
    assert_ne!(scene.files[0].hash, scene.files[1].hash);
}
