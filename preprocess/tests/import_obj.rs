//! What the OBJ importer makes of small files written here, and what is refused as no scene at all.

use glam::DVec3;
use hroc_preprocess::import::{ImportError, ImportOptions, import};
use hroc_preprocess::progress::Silent;
use hroc_preprocess::scene::{AlphaMode, SourceScene};
use std::fmt::Write;
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
                (o.node, o.primitive),
                scene.meshes[o.mesh].indices.len() / 3,
            )
        })
        .collect();
    assert_eq!(
        found,
        [
            ("", (0, 0), 1),
            ("a", (1, 0), 1),
            ("a/b", (2, 0), 1),
            ("a/b", (2, 1), 3),
            ("a/b", (2, 2), 1),
            ("c", (3, 0), 1),
            ("c", (4, 0), 1)
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
        ("vn 1 2 \\\n3\n\nv 1", &["line 8", "position parse error"]),
        (
            "v nan 0 0\nf 1 2 5",
            &["line 6", "position 5 of line 5", "not finite"],
        ),
        ("v 0 -nan(ind) 0\nf 1 2 5", &["line 6", "not finite"]),
        ("v 0 0 1.#INF\nf 1 2 5", &["line 6", "not finite"]),
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

fn warnings_of(text: &[u8]) -> Vec<String> {
    let options = ImportOptions {
        uvs: true,
        ..Default::default()
    };
    import_files(&[("a.obj", text)], &options).unwrap().warnings
}

#[test]
fn a_byte_order_mark_and_any_line_end_change_nothing() {
    let text = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\no first\nusemtl red\nf 1 2 3\no second\nf 3 2 1\n";
    let library = "newmtl red\nKd 1 0 0\n";
    for end in ["\n", "\r", "\r\n"] {
        for bom in ["", "\u{FEFF}"] {
            let [text, library] = [text, library].map(|t| format!("{bom}{}", t.replace('\n', end)));
            let files = [("a.obj", text.as_bytes()), ("m.mtl", library.as_bytes())];
            let scene = import_files(&files, &ImportOptions::default()).unwrap();
            let names: Vec<_> = scene.objects.iter().map(|o| o.name.as_str()).collect();
            assert_eq!(names, ["first", "second"], "{end:?} {bom:?}");
            assert_eq!(scene.objects[0].base_color, [1.0, 0.0, 0.0, 1.0]);
            assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
            // Content decides, whatever the name is.
            let files = [("a.txt", text.as_bytes()), ("m.mtl", library.as_bytes())];
            assert!(import_files(&files, &ImportOptions::default()).is_ok());
        }
    }
    let error = error(
        "a.obj",
        format!("{QUAD}v 1 2\n").replace('\n', "\r\n").as_bytes(),
    );
    assert!(error.contains("line 5"), "{error}");
    let error = self::error(
        "a.obj",
        format!("{QUAD}v 1 2\n").replace('\n', "\r").as_bytes(),
    );
    assert!(error.contains("line 5"), "{error}");
}

#[test]
fn a_comment_is_never_continued() {
    for comment in ["# D:\\plant\\", "  # D:\\", "v 9 9 9 # D:\\", "#\\"] {
        let scene = obj(&format!("{QUAD}{comment}\nf 1 2 3\nf 1 3 4\n"));
        assert_eq!(scene.meshes[0].indices.len(), 6, "{comment}");
    }
    // A name may hold the sign.
    let scene = obj(&format!("{QUAD}o wall #3 \\\nnorth\nf 1 2 3\n"));
    assert_eq!(scene.objects[0].name, "wall #3 north");
}

#[test]
fn a_file_without_any_statement_is_refused() {
    for text in [
        "# nothing\n",
        "hello world\n",
        "\u{FEFF}",
        "V 0 0 0\rF 1 2 3\r",
    ] {
        let error = error("a.obj", text.as_bytes());
        assert!(error.contains("holds no OBJ statement"), "{error}");
    }
    assert_eq!(obj("v 0 0 0\n").warnings, ["the scene has no triangles"]);
}

#[test]
fn a_bad_normal_or_texture_coordinate_costs_that_attribute_only() {
    let bad = [
        "-nan(ind) -nan(ind) -nan(ind)",
        "1.#QNAN 0 1",
        "0 1.#INF 0",
        "nan 0 0",
        "inf 0 0",
        "1e999 0 0",
        "1",
        "",
        "0,5 1 0",
        "\u{FFFD} 0 0",
    ];
    for numbers in bad {
        let faces = "f 1/1/1 2/2/2 3/1/1\no good\nf 1/1/1 2/1/1 3/1/1\n";
        let text = format!("{QUAD}vn 0 0 1\nvn {numbers}\nvt 0 1\nvt 1 2\no bad\n{faces}");
        let scene = obj(&text);
        assert!(scene.meshes[0].normals.is_empty() && !scene.meshes[1].normals.is_empty());
        assert!(!scene.meshes[0].uvs.is_empty());
        let counted = "a.obj: normals that are not three numbers; objects that use them get computed normals: 1";
        assert_eq!(scene.warnings[0], counted, "{numbers}");
        if numbers == "1" {
            continue;
        }
        let text = format!("{QUAD}vn 0 0 1\nvn 0 0 1\nvt 0 1\nvt {numbers}\no bad\n{faces}");
        let scene = obj(&text);
        assert!(scene.meshes[0].uvs.is_empty());
        assert!(!scene.meshes[1].uvs.is_empty() && !scene.meshes[0].normals.is_empty());
        assert!(scene.warnings[0].starts_with("a.obj: texture coordinates that are not numbers"));
    }
    // Attributes that nobody wants are not looked at.
    let text = format!("{QUAD}vn nan 0 0\nvt x\nf 1/1/1 2/1/1 3/1/1\n");
    let options = ImportOptions {
        normals: false,
        ..Default::default()
    };
    let scene = import_files(&[("a.obj", text.as_bytes())], &options).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn an_o_line_begins_an_object_whatever_its_name() {
    let chairs: String = (0..400)
        .map(|i| format!("o chair\nv {i} 0 0\nv {i} 1 0\nv {i} 1 .5\nf -3 -2 -1\n"))
        .collect();
    let scene = obj(&chairs);
    assert_eq!(scene.objects.len(), 400);
    assert!(scene.objects.iter().all(|object| object.name == "chair"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    // The materials of one object are its primitives, also where the names come again.
    let scene = obj(&format!(
        "{QUAD}o a\nusemtl x\nf 1 2 3\nusemtl y\nf 1 2 3\nusemtl x\nf 1 2 4\no a\nf 1 2 3\n"
    ));
    let ids: Vec<_> = scene
        .objects
        .iter()
        .map(|o| (o.node, o.primitive))
        .collect();
    assert_eq!(ids, [(0, 0), (0, 1), (1, 0)]);
}

#[test]
fn a_group_name_that_is_used_far_apart_is_warned_about() {
    // Squares of 1 x 1 in the xy plane, at these places, of groups that take turns.
    let text = |places: &[f32]| {
        let mut text = String::new();
        for (i, x) in places.iter().enumerate() {
            let _ = write!(
                text,
                "v {x} 0 0\nv {} 0 0\nv {} 1 0\nv {x} 1 0\n",
                x + 1.0,
                x + 1.0
            );
            let _ = write!(
                text,
                "g wall\nf -4 -3 -2\nf -4 -2 -1\ng other{i}\nf -4 -3 -2\n"
            );
        }
        text
    };
    let warned = |text: &str| {
        warnings_of(text.as_bytes())
            .iter()
            .any(|w| w.contains("used again far away"))
    };
    assert!(warned(&text(&[0.0, 100.0])));
    assert!(warned(&text(&[0.0, 1.0, 30.0])));
    assert!(
        !warned(&text(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0])),
        "one wall, bay by bay"
    );
    assert!(!warned(&text(&[7.0])));
    let scene = obj(&text(&[0.0, 100.0]));
    assert_eq!(
        scene.meshes[0].indices.len(),
        12,
        "groups merge nevertheless"
    );
    // Materials that take turns within a group make no second run.
    let text = format!(
        "{QUAD}v 90 0 0\nv 90 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3 4\nusemtl a\nf 3 5 6\n"
    );
    assert!(!warned(&text));
}

#[test]
#[cfg(unix)]
fn names_are_bytes_and_so_are_names_of_files() {
    use std::os::unix::ffi::OsStrExt;
    // GBK: "\xB2\xC4\xD6\xCA". Shift-JIS: "\x95\x5C", whose second byte is a backslash.
    for [first, second] in [[&b"\xB2\xC4"[..], b"\xD6\xCA"], [b"\x95\x5C", b"\x83\x5C"]] {
        let [library, text] = [
            ["newmtl |", "\nKd 1 0 0\nnewmtl ~\nKd 0 1 0\n"].concat(),
            format!(
                "mtllib |.mtl\n{QUAD}o |\nusemtl |\nf 1 2 3\ng ~\nusemtl ~\nf 1 2 3\ng |\nf 1 2 3\n"
            ),
        ]
        .map(|text| {
            let bytes = text.bytes().flat_map(|byte| match byte {
                b'|' => first.to_vec(),
                b'~' => second.to_vec(),
                byte => vec![byte],
            });
            bytes.collect::<Vec<u8>>()
        });
        let folder = tempfile::tempdir().unwrap();
        let name = [first, b".mtl"].concat();
        fs::write(
            folder.path().join(std::ffi::OsStr::from_bytes(&name)),
            library,
        )
        .unwrap();
        let path = folder.path().join("a.obj");
        fs::write(&path, text).unwrap();
        let scene = import(&[path.clone()], &ImportOptions::default(), &Silent).unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let colors: Vec<_> = scene.objects.iter().map(|o| o.base_color[0]).collect();
        assert_eq!(colors, [1.0, 0.0, 0.0], "three groups, two materials");
        let [referenced] = scene.referenced_files.as_slice() else {
            panic!("{:?}", scene.referenced_files);
        };
        assert!(referenced.path.exists() && referenced.hash != 0);
        let again = hroc_preprocess::import::hash_referenced(&path, &referenced.name);
        assert_eq!(again, referenced.hash, "as --if-changed finds it");
    }
}

#[test]
fn long_names_and_many_libraries_stay_cheap() {
    let name = "n".repeat(1 << 20);
    let mut text = format!("{QUAD}mtllib gone.mtl\no {name}\n");
    for i in 0..20_000 {
        let _ = write!(text, "mtllib gone.mtl\nusemtl {}\nf 1 2 3\n", i % 500);
    }
    let start = std::time::Instant::now();
    let scene = obj(&text);
    assert!(start.elapsed().as_secs() < 5, "{:?}", start.elapsed());
    assert_eq!(scene.objects.len(), 500);
    assert_eq!(scene.objects[0].name.len(), 255);
    assert_eq!(scene.warnings.len(), 2, "{:?}", scene.warnings);
    assert!(scene.warnings[1].contains("names cut after 255 bytes: 1"));
}

#[test]
fn opacity_that_contradicts_itself_or_hides_nothing_is_warned_about() {
    let text = format!("mtllib m.mtl\n{QUAD}usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    let files = [
        ("a.obj", text.as_bytes()),
        ("m.mtl", b"newmtl a\nTr 1\nd 1\nnewmtl b\nd 0\n"),
    ];
    let scene = import_files(&files, &ImportOptions::default()).unwrap();
    let alphas: Vec<_> = scene.objects.iter().map(|o| o.alpha).collect();
    assert_eq!(alphas, [AlphaMode::Opaque, AlphaMode::Blended]);
    let [contradiction, invisible] = scene.warnings.as_slice() else {
        panic!("{:?}", scene.warnings);
    };
    assert!(contradiction.ends_with("contradict each other; `d` is used: 1"));
    assert!(invisible.ends_with("opacity 0; they hide nothing: 1"));
}

/// The positions of an object's vertices in world.
fn world(scene: &SourceScene, object: usize) -> Vec<DVec3> {
    let object = &scene.objects[object];
    let positions = scene.meshes[object.mesh].positions.iter();
    let to_world = |p: &[f32; 3]| {
        object
            .world_from_object
            .transform_point3(DVec3::from(p.map(f64::from)))
    };
    positions.map(to_world).collect()
}

#[test]
fn an_object_keeps_its_shape_wherever_others_lie() {
    let wall =
        "v 500118.125 10 5800456.365\nv 500128.125 10 5800456.365\nv 500118.125 15 5800456.385\n";
    let wall = format!("{wall}o wall\nf -3 -2 -1\nusemtl back\nf -1 -2 -3\n");
    let far = "v 0 0 0\nv 1 0 0\nv 0 1 0\no marker\nf -3 -2 -1\n";
    let antipode = "v -6000000.3 0 0\nv -6000001.3 0 0\nv -6000001.3 1 0\no antipode\nf -3 -2 -1\n";
    for text in [
        wall.clone(),
        format!("{wall}{far}"),
        format!("{far}{wall}"),
        format!("{far}{wall}{antipode}"),
        format!("v 1e30 0 0\nv nan 0 0\n{wall}"),
    ] {
        let scene = obj(&text);
        let walls = scene
            .objects
            .iter()
            .enumerate()
            .filter(|(_, o)| o.name == "wall");
        let walls: Vec<_> = walls.collect();
        assert_eq!(walls.len(), 2);
        assert_eq!(
            walls[0].1.world_from_object, walls[1].1.world_from_object,
            "parts share an origin"
        );
        for (index, _) in walls {
            for point in world(&scene, index) {
                let near =
                    |value: f64, choices: &[f64]| choices.iter().any(|c| (value - c).abs() < 1e-5);
                assert!(near(point.x, &[500118.125, 500128.125]) && near(point.y, &[10.0, 15.0]));
                assert!(near(point.z, &[5800456.365, 5800456.385]), "{point}");
            }
        }
    }
}

#[test]
fn objects_share_an_origin_while_that_is_exact_enough() {
    // Tiles of 10 x 10 that share edges, far away, and markers at zero and at the antipode.
    let mut text = String::new();
    for i in 0..8 {
        let (x, z) = (4e6 + 10.1 * f64::from(i), 5e6 + 0.3);
        let far = x + 10.1;
        let _ = write!(
            text,
            "o tile\nv {x} 0 {z}\nv {far} 0 {z}\nv {far} 10 {z}\nf -3 -2 -1\n"
        );
    }
    let tiles = obj(&text);
    text += "o zero\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n";
    text += "o antipode\nv -4000000.3 0 0\nv -4000001.3 0 0\nv -4000001.3 1 0\nf -3 -2 -1\n";
    let all = obj(&text);
    for scene in [&tiles, &all] {
        for pair in [[0, 1], [3, 4], [6, 7]] {
            let [a, b] = pair.map(|object| scene.objects[object].world_from_object);
            assert_eq!(a, b);
            let bits = |object| {
                world(scene, object)
                    .into_iter()
                    .map(|p| p.to_array().map(f64::to_bits))
            };
            let shared = bits(pair[0])
                .filter(|p| bits(pair[1]).any(|q| *p == q))
                .count();
            assert_eq!(shared, 1, "the shared corner is one point");
        }
    }
    let moved = tiles.objects[0].world_from_object.translation
        - all.objects[0].world_from_object.translation;
    assert!(
        moved.length() < 100.0,
        "the markers move the origin to a neighbour: {moved}"
    );
    // What is exact about zero stays as it is.
    let scene = obj(&format!(
        "{QUAD}v 100000.5 0 0\nv 100001 0 0\nv 100001 1 0\no a\nf 1 2 3\no b\nf 5 6 7\n"
    ));
    let zero =
        |o: &hroc_preprocess::scene::SourceObject| o.world_from_object.translation == DVec3::ZERO;
    assert!(scene.objects.iter().all(zero));
}
