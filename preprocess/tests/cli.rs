//! The command line: exit codes, messages, what lands where.

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};

const TRIANGLE: &str = "o wall\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        folder.write("a.obj", TRIANGLE);
        folder
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, text).unwrap();
        path
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn files(&self) -> Vec<String> {
        let name = |entry: std::io::Result<fs::DirEntry>| {
            entry.unwrap().file_name().into_string().unwrap()
        };
        let mut files: Vec<_> = fs::read_dir(self.0.path()).unwrap().map(name).collect();
        files.sort();
        files
    }

    /// Runs `hroc-bake` in the folder; gives exit code, stdout, stderr.
    fn run(&self, arguments: &[&str]) -> (i32, String, String) {
        let mut command = Command::cargo_bin("hroc-bake").unwrap();
        let output = command
            .current_dir(self.0.path())
            .args(arguments)
            .output()
            .unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (
            output.status.code().unwrap(),
            text(output.stdout),
            text(output.stderr),
        )
    }

    fn json(&self, arguments: &[&str]) -> serde_json::Value {
        let (code, out, err) = self.run(arguments);
        assert_eq!(code, 0, "{err}");
        serde_json::from_str(&out).unwrap()
    }
}

#[test]
fn bake_inspect_and_verify() {
    let folder = Folder::new();
    let (code, out, err) =
        folder.run(&["bake", "a.obj", "a.obj", "-o", "a.hroc", "--json", "a.json"]);
    assert_eq!((code, out.as_str()), (0, ""), "{err}");
    assert!(err.contains("a.hroc: 2 objects, 2 triangles"), "{err}");
    assert_eq!(folder.files(), ["a.hroc", "a.json", "a.obj"]);
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path("a.json")).unwrap()).unwrap();
    assert_eq!(report["schema"], 1);
    assert_eq!(report["objects"], 2);
    assert_eq!(
        report["file_bytes"],
        fs::metadata(folder.path("a.hroc")).unwrap().len()
    );
    assert_eq!(report["trees"][2]["split"], "equal-count");

    let (code, out, err) = folder.run(&["verify", "a.hroc"]);
    assert_eq!((code, out.as_str()), (0, ""));
    assert!(err.contains("a.hroc: good, 2 objects, 3 trees"), "{err}");

    let (code, out, _) = folder.run(&["inspect", "a.hroc"]);
    assert_eq!(code, 0);
    for part in [
        "objects    2",
        "2 drawn",
        "sah",
        "middle",
        "equal-count",
        "positions",
    ] {
        assert!(out.contains(part), "{part} is not in {out}");
    }
    let details = folder.json(&["inspect", "a.hroc", "--json"]);
    let object = &details["objects"][1];
    assert_eq!(
        (&object["id"], &object["name"], &object["source_file"]),
        (&1.into(), &"wall".into(), &"a.obj".into())
    );
    assert_eq!(
        (&object["node"], &object["primitive"], &object["triangles"]),
        (&0.into(), &0.into(), &1.into())
    );
    assert!(object["bounds"]["max"][0].as_f64().unwrap() >= 0.5);
}

#[test]
fn options_reach_the_file() {
    let folder = Folder::new();
    let bake = |extra: &[&str]| {
        let (code, _, err) = folder.run(&[&["bake", "a.obj", "-o", "a.hroc"], extra].concat());
        assert_eq!(code, 0, "{err}");
        folder.json(&["inspect", "a.hroc", "--json"])["settings"].clone()
    };
    let splits = |settings: serde_json::Value| settings["splits"].to_string();
    assert_eq!(splits(bake(&[])), r#"["sah","middle","equal-count"]"#);
    assert_eq!(
        splits(bake(&["--split", "middle,sah"])),
        r#"["middle","sah"]"#
    );
    let settings = bake(&["--no-optimize", "--no-normals", "--uvs", "--jobs", "3"]);
    assert_eq!(
        (
            &settings["optimize"],
            &settings["normals"],
            &settings["uvs"]
        ),
        (&false.into(), &false.into(), &true.into())
    );
    let report = folder.json(&["bake", "a.obj", "-o", "a.hroc", "--json", "-"]);
    assert_eq!(report["output"], "a.hroc");
}

#[test]
fn the_command_line_is_checked_before_any_work() {
    let folder = Folder::new();
    fs::create_dir(folder.path("sub")).unwrap();
    for arguments in [
        &[][..],
        &["nonsense"],
        &["bake", "a.obj"],
        &["bake", "-o", "a.hroc"],
        &["bake", "a.obj", "-o", "a.hroc", "--split", "nonsense"],
        &["bake", "a.obj", "-o", "a.hroc", "--split", "sah,sah"],
        &["bake", "a.obj", "-o", "a.hroc", "--jobs", "0"],
        &["bake", "a.obj", "-o", "a.hroc", "--jobs", "100000"],
        &["bake", "a.obj", "-o", "a.obj"],
        &["bake", "a.obj", "-o", "./sub/../a.obj"],
        &["bake", "a.obj", "-o", "sub"],
        &["bake", "a.obj", "-o", "a.hroc", "--json", "a.obj"],
        &["bake", "a.obj", "-o", "a.hroc", "--json", "a.hroc"],
        &["generate", "nonsense", "-o", "a.glb"],
        &["generate", "radial-city", "--scale", "0", "-o", "a.glb"],
        &["generate", "radial-city", "--detail", "nan", "-o", "a.glb"],
    ] {
        let (code, out, err) = folder.run(arguments);
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {err}");
        assert!(!err.is_empty());
    }
    #[cfg(unix)]
    {
        fs::hard_link(folder.path("a.obj"), folder.path("b.obj")).unwrap();
        assert_eq!(folder.run(&["bake", "a.obj", "-o", "b.obj"]).0, 2);
        fs::remove_file(folder.path("b.obj")).unwrap();
    }
    assert_eq!(folder.files(), ["a.obj", "sub"]);
    assert_eq!(fs::read_to_string(folder.path("a.obj")).unwrap(), TRIANGLE);
}

#[test]
fn bad_input_is_one_line_and_leaves_nothing() {
    let folder = Folder::new();
    folder.write("bad.obj", "f 1 2 3\n");
    folder.write("empty.glb", "");
    for (arguments, parts) in [
        (
            &["bake", "gone.glb", "-o", "x.hroc"][..],
            ["gone.glb: ", "cannot be read"],
        ),
        (
            &[
                "bake", "a.obj", "bad.obj", "-o", "x.hroc", "--json", "x.json",
            ],
            ["bad.obj: line 1: ", "outside"],
        ),
        (
            &["bake", "empty.glb", "-o", "x.hroc"],
            ["empty.glb: ", "is empty"],
        ),
        (&["bake", ".", "-o", "x.hroc"], [".: ", "is a folder"]),
        (
            &["bake", "a.obj", "-o", "none/x.hroc"],
            ["none/x.hroc: ", "no folder"],
        ),
        (
            &["bake", "a.obj", "-o", "x.hroc", "--json", "none/x.json"],
            ["none/x.json: ", "no folder"],
        ),
        (&["inspect", "a.obj"], ["a.obj", ";"]),
        (&["verify", "a.obj"], ["a.obj", ";"]),
        (&["verify", "gone.hroc"], ["gone.hroc", "cannot read"]),
        (
            &[
                "generate",
                "radial-city",
                "--scale",
                "0.001",
                "-o",
                "none/x.glb",
            ],
            ["none/x.glb", "; "],
        ),
    ] {
        let (code, out, err) = folder.run(arguments);
        assert_eq!((code, out.as_str()), (3, ""), "{arguments:?}: {err}");
        assert!(
            err.starts_with("error: ") && err.lines().count() == 1,
            "{err}"
        );
        for part in parts {
            assert!(err.contains(part), "{part:?} is not in {err}");
        }
    }
    assert_eq!(folder.files(), ["a.obj", "bad.obj", "empty.glb"]);
}

#[test]
fn a_failed_bake_keeps_the_file_that_was_there() {
    let folder = Folder::new();
    folder.write("bad.obj", "f 1 2 3\n");
    folder.write("x.hroc", "before");
    assert_eq!(folder.run(&["bake", "bad.obj", "-o", "x.hroc"]).0, 3);
    assert_eq!(fs::read_to_string(folder.path("x.hroc")).unwrap(), "before");
}

#[test]
fn a_baked_file_is_told_from_a_scene_and_damage_is_found() {
    let folder = Folder::new();
    assert_eq!(folder.run(&["bake", "a.obj", "-o", "a.hroc"]).0, 0);
    let (code, _, err) = folder.run(&["bake", "a.hroc", "-o", "b.hroc"]);
    assert!(
        code == 3 && err.contains("baked scene already") && err.contains("inspect"),
        "{err}"
    );
    let mut bytes = fs::read(folder.path("a.hroc")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(folder.path("a.hroc"), bytes).unwrap();
    let (code, _, err) = folder.run(&["verify", "a.hroc"]);
    assert!(code == 3 && err.starts_with("error: a.hroc: "), "{err}");
}

#[test]
fn a_scene_without_triangles_is_a_warning() {
    let folder = Folder::new();
    folder.write("points.obj", "v 0 0 0\np 1\n");
    let (code, _, err) = folder.run(&["bake", "points.obj", "-o", "x.hroc"]);
    assert_eq!(code, 0);
    assert!(
        err.contains("warning: points.obj: points skipped: 1"),
        "{err}"
    );
    assert!(err.contains("warning: the scene has no triangles"), "{err}");
    assert_eq!(folder.run(&["verify", "x.hroc"]).0, 0);
    assert_eq!(folder.run(&["inspect", "x.hroc"]).0, 0);
}

#[test]
fn the_same_bytes_for_any_number_of_jobs() {
    let folder = Folder::new();
    let text: String = (0..6000)
        .map(|i| format!("o {i}\nv {i} 0 0\nv {i} 1 0\nv {i} 0 {i}\nf -1 -2 -3\n"))
        .collect();
    folder.write("many.obj", &text);
    let bake = |jobs: &str| {
        assert_eq!(
            folder
                .run(&["bake", "many.obj", "-o", "x.hroc", "--jobs", jobs])
                .0,
            0
        );
        fs::read(folder.path("x.hroc")).unwrap()
    };
    assert!(bake("1") == bake("8"));
}

#[test]
fn generated_scenes_can_be_baked() {
    let folder = Folder::new();
    let (code, _, err) = folder.run(&[
        "generate",
        "radial-city",
        "--scale",
        "0.01",
        "--seed",
        "3",
        "-o",
        "city.glb",
    ]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(folder.run(&["bake", "city.glb", "-o", "city.hroc"]).0, 0);
    let counts = &folder.json(&["inspect", "city.hroc", "--json"])["counts"];
    assert!(
        err.contains(&format!(
            "{} objects, {} triangles",
            counts["objects"], counts["triangles"]
        )),
        "{err}"
    );
}

#[test]
fn help_has_examples_and_a_closed_pipe_is_no_error() {
    let folder = Folder::new();
    let (code, out, _) = folder.run(&["--help"]);
    assert!(
        code == 0
            && out.contains("Examples:")
            && out.contains("hroc-bake bake town.glb -o town.hroc")
    );
    let (_, out, _) = folder.run(&["bake", "--help"]);
    assert!(
        ["sah", "middle", "equal-count"]
            .iter()
            .all(|rule| out.contains(rule)),
        "{out}"
    );
    #[cfg(unix)]
    closed_pipe(&folder);
}

/// Nobody reads stdout: the reading end is closed before the program writes.
#[cfg(unix)]
fn closed_pipe(folder: &Folder) {
    use std::process::{Command, Stdio};
    assert_eq!(folder.run(&["bake", "a.obj", "-o", "a.hroc"]).0, 0);
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let program = Path::new(env!("CARGO_BIN_EXE_hroc-bake"));
    let output = Command::new(program)
        .args(["inspect", "--json"])
        .arg(folder.path("a.hroc"))
        .stdout(writer)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn a_gltf_camera_becomes_a_path_file() {
    let folder = Folder::new();
    let gltf = r#"{ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "camera": 0, "translation": [1, 2, 3] }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.5 } }] }"#;
    folder.write("film.gltf", gltf);
    let path = folder.json(&["camera-path", "film.gltf"]);
    assert_eq!(path["version"], 1);
    assert_eq!(
        path["keys"][0]["position"],
        serde_json::json!([1.0, 2.0, 3.0])
    );

    let (code, out, err) = folder.run(&["camera-path", "film.gltf", "-o", "film.path.json"]);
    assert_eq!((code, out.as_str()), (0, ""), "{err}");
    assert!(err.contains("film.path.json: 1 keys"), "{err}");
    let written = fs::read(folder.path("film.path.json")).unwrap();
    let written: serde_json::Value = serde_json::from_slice(&written).unwrap();
    assert_eq!(written, path);

    for (arguments, expected) in [
        (&["camera-path", "a.obj"][..], "is no glTF"),
        (
            &["camera-path", "film.gltf", "--camera", "x"],
            "no camera \"x\"",
        ),
        (
            &["camera-path", "film.gltf", "-o", "no/such.json"],
            "cannot be written",
        ),
    ] {
        let (code, _, err) = folder.run(arguments);
        assert_eq!(code, 3, "{err}");
        assert!(
            err.starts_with("error: ") && err.contains(expected),
            "{err}"
        );
    }
}

#[test]
fn a_generated_scene_comes_with_its_paths() {
    let folder = Folder::new();
    let arguments = [
        "generate",
        "radial-city",
        "--scale",
        "0.001",
        "-o",
        "city.glb",
    ];
    let (code, _, err) = folder.run(&arguments);
    assert_eq!(code, 0, "{err}");
    let files = ["a.obj", "city.fast.path.json", "city.glb", "city.path.json"];
    assert_eq!(folder.files(), files);
}
