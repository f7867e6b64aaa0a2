//! What a build system relies on: nothing done twice, dependencies told, the same bytes every time, and no torn or
//! forgotten file however a bake ends.

use hroc_format::{BakedScene, TEMPORARY_PREFIX};
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

struct Folder(tempfile::TempDir);

impl Folder {
    /// A triangle in a glTF file with a buffer beside it, and an OBJ file whose material library is missing.
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        folder.write(
            "a b.gltf",
            r#"{ "asset": { "version": "2.0" }, "scene": 0,
                "scenes": [{ "nodes": [0] }, { "name": "other", "nodes": [0, 1] }],
                "nodes": [{ "mesh": 0 }, { "mesh": 0 }],
                "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
                "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 }],
                "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
                "buffers": [{ "byteLength": 36, "uri": "bin/a%20b.bin" }] }"#,
        );
        fs::create_dir(folder.path("bin")).unwrap();
        let positions = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let bytes: Vec<u8> = positions.iter().flat_map(|x| x.to_le_bytes()).collect();
        fs::write(folder.path("bin/a b.bin"), bytes).unwrap();
        folder.write(
            "b.obj",
            "mtllib b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        );
        folder
    }

    /// One with a scene that takes a while: `objects` grids of triangles.
    fn large(objects: usize) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        let mut text = String::new();
        for object in 0..objects {
            text += &format!("o {object}\n");
            for i in 0..300 {
                let (x, y) = (i % 20, i / 20);
                text += &format!(
                    "v {x} {y} {object}\nv {}.5 {y} 0.25\nv {x} {y}.7 1\nf -1 -2 -3\n",
                    x
                );
            }
        }
        folder.write("large.obj", &text);
        folder
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hroc-bake"));
        command
            .current_dir(self.0.path())
            .args(arguments)
            .stdin(Stdio::null());
        command
    }

    /// Exit code and stderr.
    fn run(&self, arguments: &[&str]) -> (i32, String) {
        let output = self.command(arguments).output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        (output.status.code().unwrap(), text)
    }

    /// Names of temporary files, including those of the bake's helpers.
    fn temporary_files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.starts_with(TEMPORARY_PREFIX))
            .collect()
    }
}

#[test]
fn nothing_is_done_where_nothing_changed() {
    let folder = Folder::new();
    let bake = |extra: &[&str]| {
        let base = ["bake", "a b.gltf", "b.obj", "-o", "x.hroc", "--if-changed"];
        let (code, err) = folder.run(&[&base, extra].concat());
        assert_eq!(code, 0, "{err}");
        err.contains("x.hroc: unchanged")
    };
    let identity = || {
        #[cfg(unix)]
        return std::os::unix::fs::MetadataExt::ino(&fs::metadata(folder.path("x.hroc")).unwrap());
        #[cfg(not(unix))]
        return fs::metadata(folder.path("x.hroc"))
            .unwrap()
            .modified()
            .unwrap();
    };
    assert!(!bake(&[]), "there is nothing yet");
    let first = identity();
    assert!(bake(&[]) && identity() == first);
    assert!(bake(&["--jobs", "3"]), "threads change nothing");

    // Each option that decides bytes.
    for options in [
        &["--split", "sah"][..],
        &["--no-optimize"],
        &["--no-normals"],
        &["--uvs"],
        &["--quantize"],
        &["--split-objects", "7"],
        &["--scene", "0"],
    ] {
        assert!(!bake(options), "{options:?}");
        assert!(bake(options), "{options:?} again");
    }
    assert!(!bake(&[]));

    // Each file that is read, the missing one included; the same bytes under a new time are no change.
    let change = |name: &str, from: &str, to: &str| {
        let mut bytes = fs::read(folder.path(name)).unwrap_or_default();
        let at = bytes
            .windows(from.len().max(1))
            .position(|part| part == from.as_bytes());
        let at = at.unwrap_or(0);
        bytes.splice(at..at + from.len(), to.bytes());
        fs::write(folder.path(name), bytes).unwrap();
    };
    change("b.obj", "", "");
    assert!(bake(&[]), "written again, with the same content");
    for (name, from, to) in [
        ("b.obj", "v 1 0 0", "v 2 0 0"),
        ("a b.gltf", "\"scene\": 0", "\"scene\": 1"),
        ("bin/a b.bin", "\0", "\u{1}"),
        ("b.mtl", "", "newmtl red\n"),
        ("b.mtl", "red", "tan"),
    ] {
        change(name, from, to);
        assert!(!bake(&[]), "{name}");
        assert!(bake(&[]), "{name} again");
    }
    fs::remove_file(folder.path("b.mtl")).unwrap();
    assert!(!bake(&[]), "the library is gone");

    // What is there is no whole baked file.
    let bytes = fs::read(folder.path("x.hroc")).unwrap();
    fs::write(folder.path("x.hroc"), &bytes[..bytes.len() - 1]).unwrap();
    assert!(!bake(&[]), "cut short");
    assert_eq!(fs::read(folder.path("x.hroc")).unwrap(), bytes);
}

#[test]
fn a_damaged_output_is_baked_again() {
    let folder = Folder::new();
    let arguments = ["bake", "a b.gltf", "b.obj", "-o", "x.hroc", "--if-changed"];
    assert_eq!(folder.run(&arguments).0, 0);
    let good = fs::read(folder.path("x.hroc")).unwrap();
    // Every bit of the header, then bits all over the file.
    let header = 0..8 * 32;
    let step = 8 * good.len() / 97;
    for bit in header.step_by(5).chain((0..8 * good.len()).step_by(step)) {
        let mut damaged = good.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        fs::write(folder.path("x.hroc"), damaged).unwrap();
        assert_eq!(folder.run(&["verify", "x.hroc"]).0, 3, "bit {bit}");
        let (code, err) = folder.run(&arguments);
        assert!(code == 0 && !err.contains("unchanged"), "bit {bit}: {err}");
        assert!(
            fs::read(folder.path("x.hroc")).unwrap() == good,
            "bit {bit}"
        );
    }
    assert!(folder.run(&arguments).1.contains("unchanged"));
}

/// No output may be a file that is read, whatever name leads to it and however the input refers to it.
#[test]
fn no_file_that_is_read_is_written() {
    let folder = Folder::new();
    folder.write("b.mtl", "newmtl red\n");
    // A buffer and an image that no bake reads are sources all the same.
    let scene = fs::read_to_string(folder.path("a b.gltf")).unwrap();
    let scene = scene.replace(
        "\"buffers\": [",
        r#""images": [{ "uri": "wall.png" }], "cameras": [{ "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }],
           "buffers": [{ "byteLength": 36, "uri": "bin/film.bin" }, "#,
    );
    let scene = scene.replace("\"buffer\": 0", "\"buffer\": 1");
    let scene = scene.replacen("{ \"mesh\": 0 }", "{ \"mesh\": 0, \"camera\": 0 }", 1);
    folder.write("a b.gltf", &scene);
    folder.write("bin/film.bin", "film");
    folder.write("wall.png", "wall");
    let mut sources: Vec<String> = [
        "a b.gltf",
        "b.obj",
        "b.mtl",
        "bin/a b.bin",
        "bin/film.bin",
        "wall.png",
    ]
    .map(str::to_owned)
    .into();
    let contents = |names: &[String]| -> Vec<Vec<u8>> {
        let read = |name: &String| fs::read(folder.path(name)).unwrap();
        names.iter().map(read).collect()
    };
    let before = contents(&sources);
    let files = before.len();
    fs::create_dir(folder.path("sub")).unwrap();
    for at in 0..files {
        let source = sources[at].clone();
        sources.push(format!("sub/../{source}"));
        let name = format!("hard{at}");
        fs::hard_link(folder.path(&source), folder.path(&name)).unwrap();
        sources.push(name);
        #[cfg(unix)]
        {
            let name = format!("soft{at}");
            std::os::unix::fs::symlink(folder.path(&source), folder.path(&name)).unwrap();
            sources.push(name);
        }
    }
    let refused = |arguments: &[&str], target: &str| {
        let (code, err) = folder.run(arguments);
        assert_eq!(code, 2, "{arguments:?}: {err}");
        let starts = format!("error: {target}: is a");
        assert!(
            err.starts_with(&starts) && err.contains("; name another file"),
            "{err}"
        );
        assert_eq!(err.lines().count(), 1, "{err}");
        assert!(contents(&sources[..files]) == before, "{arguments:?}");
        assert!(!folder.path("x.hroc").exists() && !folder.path("x.d").exists());
    };
    let bake = ["bake", "a b.gltf", "b.obj"];
    for target in sources.iter().map(String::as_str) {
        refused(&[&bake[..], &["-o", target]].concat(), target);
        refused(
            &[
                &bake[..],
                &["-o", target, "--if-changed", "--depfile", "x.d"],
            ]
            .concat(),
            target,
        );
        refused(
            &[&bake[..], &["-o", "x.hroc", "--json", target]].concat(),
            target,
        );
        refused(
            &[&bake[..], &["-o", "x.hroc", "--depfile", target]].concat(),
            target,
        );
        if !["b.obj", "b.mtl", "hard1", "hard2", "soft1", "soft2"]
            .contains(&target.trim_start_matches("sub/../"))
        {
            refused(&["camera-path", "a b.gltf", "-o", target], target);
        }
    }
    // A library that is not there yet would be read next time.
    fs::remove_file(folder.path("b.mtl")).unwrap();
    let (code, err) = folder.run(&["bake", "b.obj", "-o", "b.mtl"]);
    assert!(code == 2 && !folder.path("b.mtl").exists(), "{err}");

    // Where nothing is baked because nothing changed, the reports are written all the same.
    let base = ["bake", "a b.gltf", "-o", "x.hroc", "--if-changed"];
    assert_eq!(folder.run(&base).0, 0);
    for option in ["--json", "--depfile"] {
        let (code, err) = folder.run(&[&base[..], &[option, "bin/a b.bin"]].concat());
        assert!(code == 2 && err.contains("an input refers to"), "{err}");
        assert!(fs::read(folder.path("bin/a b.bin")).unwrap() == before[3]);
    }
    assert_eq!(
        folder.run(&["camera-path", "a b.gltf", "-o", "x.json"]).0,
        0
    );
}

#[test]
fn no_two_outputs_are_one_file() {
    let folder = Folder::new();
    fs::create_dir(folder.path("sub")).unwrap();
    folder.write("old", "old");
    fs::hard_link(folder.path("old"), folder.path("hard")).unwrap();
    for outputs in [
        ["new", "sub/../new"],
        ["old", "old"],
        ["old", "hard"],
        ["./new", "new"],
    ] {
        for option in ["--json", "--depfile"] {
            let arguments = ["bake", "b.obj", "-o", outputs[0], option, outputs[1]];
            let (code, err) = folder.run(&arguments);
            assert!(code == 2 && err.contains("is written too"), "{err}");
        }
        let arguments = [
            "bake",
            "b.obj",
            "-o",
            "x.hroc",
            "--json",
            outputs[0],
            "--depfile",
            outputs[1],
        ];
        let (code, err) = folder.run(&arguments);
        assert!(code == 2 && err.contains("is written too"), "{err}");
    }
    assert_eq!(fs::read_to_string(folder.path("old")).unwrap(), "old");
    assert!(!folder.path("new").exists() && !folder.path("x.hroc").exists());
    #[cfg(unix)]
    {
        folder.write("city.glb", "old");
        std::os::unix::fs::symlink("city.glb", folder.path("city.path.json")).unwrap();
        let (code, err) = folder.run(&[
            "generate",
            "radial-city",
            "--scale",
            "0.001",
            "-o",
            "city.glb",
        ]);
        assert!(
            code == 2 && err.contains("city.path.json: is another name"),
            "{err}"
        );
        assert_eq!(fs::read_to_string(folder.path("city.glb")).unwrap(), "old");
    }
}

#[test]
fn dependencies_are_told_with_and_without_a_bake() {
    let folder = Folder::new();
    let bake = || {
        let options = ["--if-changed", "--depfile", "x.d", "--json", "x.json"];
        let base = ["bake", "a b.gltf", "b.obj", "b.obj", "-o", "out x.hroc"];
        let (code, err) = folder.run(&[&base[..], &options].concat());
        assert_eq!(code, 0, "{err}");
        let json = fs::read(folder.path("x.json")).unwrap();
        let report: serde_json::Value = serde_json::from_slice(&json).unwrap();
        assert_eq!(report["objects"], 3);
        assert_eq!(report["trees"][0]["split"], "sah");
        let depfile = fs::read_to_string(folder.path("x.d")).unwrap();
        (depfile, report["unchanged"] == true)
    };
    let expected = "out\\ x.hroc: \\\n  a\\ b.gltf \\\n  b.obj \\\n  bin/a\\ b.bin\n\
                    \na\\ b.gltf:\n\nb.obj:\n\nbin/a\\ b.bin:\n";
    assert_eq!(bake(), (expected.to_owned(), false));
    fs::remove_file(folder.path("x.d")).unwrap();
    assert_eq!(bake(), (expected.to_owned(), true));
    folder.write("b.mtl", "");
    assert!(bake().0.contains("  b.mtl\n"));
}

/// Asked of make itself, where there is one.
#[cfg(unix)]
#[test]
fn make_bakes_again_for_a_changed_buffer() {
    if Command::new("make").arg("--version").output().is_err() {
        eprintln!("skipped: there is no make");
        return;
    }
    let folder = Folder::new();
    let bake = env!("CARGO_BIN_EXE_hroc-bake");
    folder.write(
        "Makefile",
        &format!("x.hroc:\n\t{bake} bake 'a b.gltf' -o x.hroc --depfile x.d\n-include x.d\n"),
    );
    let make = || {
        let mut make = Command::new("make");
        let output = make
            .current_dir(folder.0.path())
            .env_remove("MAKEFLAGS")
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        !String::from_utf8(output.stdout)
            .unwrap()
            .contains("up to date")
    };
    assert!(make());
    assert!(!make());
    let later = std::time::SystemTime::now() + Duration::from_secs(60);
    let buffer = fs::File::options()
        .append(true)
        .open(folder.path("bin/a b.bin"))
        .unwrap();
    buffer.set_modified(later).unwrap();
    assert!(make());
}

#[test]
fn the_same_bytes_on_every_run_and_number_of_threads() {
    let folder = Folder::large(40);
    for options in [&[][..], &["--split-objects", "37", "--quantize"]] {
        let bake = |jobs: &str| {
            let base = ["bake", "large.obj", "-o", "x.hroc", "--jobs", jobs];
            let (code, err) = folder.run(&[&base, options].concat());
            assert_eq!(code, 0, "{err}");
            fs::read(folder.path("x.hroc")).unwrap()
        };
        let one = bake("1");
        for jobs in ["1", "2", "16"] {
            assert!(one == bake(jobs), "{jobs} threads");
        }
    }
}

#[test]
fn targets_that_must_not_be_written() {
    let folder = Folder::new();
    for (arguments, code, part) in [
        (&["--depfile", "b.obj"][..], 2, "is an input"),
        (&["--depfile", "x.hroc"], 2, "is written too"),
        (&["--depfile", "x.d", "--json", "x.d"], 2, "is written too"),
        (&["--depfile", "none/x.d"], 3, "no folder"),
        (&["--scene", "attic"], 3, "has no scene \"attic\""),
        (&["--split-objects", "0"], 2, "split-objects"),
    ] {
        let base = ["bake", "a b.gltf", "b.obj", "-o", "x.hroc"];
        let (found, err) = folder.run(&[&base, arguments].concat());
        assert_eq!(found, code, "{arguments:?}: {err}");
        assert!(err.contains(part), "{err}");
        assert!(!folder.path("x.hroc").exists());
    }
    folder.write("x.hroc", "mine");
    let mut permissions = fs::metadata(folder.path("x.hroc")).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(folder.path("x.hroc"), permissions).unwrap();
    let (code, err) = folder.run(&["bake", "b.obj", "-o", "x.hroc"]);
    assert!(
        code == 3 && err.contains("x.hroc: cannot be written: it is write-protected"),
        "{err}"
    );
    assert_eq!(fs::read_to_string(folder.path("x.hroc")).unwrap(), "mine");
}

/// Bakes `large.obj` to `x.hroc` where files may have so many blocks, after what a shell is told first.
#[cfg(unix)]
fn bake_within(folder: &Folder, blocks: u32, first: &str) -> std::process::Output {
    let bake = env!("CARGO_BIN_EXE_hroc-bake");
    let script = format!("{first}; ulimit -f {blocks}; exec {bake} bake large.obj -o x.hroc");
    Command::new("sh")
        .args(["-c", &script])
        .current_dir(folder.0.path())
        .output()
        .unwrap()
}

/// A limit on the size of files stands for a full disk: the write fails at some byte.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_old_file_and_no_other() {
    let folder = Folder::large(20);
    folder.write("x.hroc", "before");
    let output = bake_within(&folder, 40, "trap '' XFSZ");
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{err}");
    assert!(err.starts_with("error: x.hroc: writing failed: "), "{err}");
    assert_eq!(fs::read_to_string(folder.path("x.hroc")).unwrap(), "before");
    assert!(folder.temporary_files().is_empty());
}

/// Kills bakes at moments spread over the time one takes, over an older baked file.
#[cfg(unix)]
fn killed(kills: u32, signals: &[&str], after_each: impl Fn(&Folder, u32, Option<i32>)) {
    use std::os::unix::process::ExitStatusExt;
    let folder = Folder::large(60);
    let old = Folder::new();
    assert_eq!(old.run(&["bake", "b.obj", "-o", "old.hroc"]).0, 0);
    let arguments = ["bake", "large.obj", "-o", "x.hroc", "--split", "sah"];
    // The first also reads the program from the disk.
    let times = [(); 2].map(|()| {
        let start = Instant::now();
        assert_eq!(folder.run(&arguments).0, 0);
        start.elapsed()
    });
    let whole = times[0].min(times[1]);
    let new = fs::read(folder.path("x.hroc")).unwrap();
    let old = fs::read(old.path("old.hroc")).unwrap();
    let mut ended = [0, 0];
    for kill in 0..kills {
        fs::write(folder.path("x.hroc"), &old).unwrap();
        let mut child = folder
            .command(&arguments)
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(whole * kill / kills * 11 / 10);
        let signal = signals[kill as usize % signals.len()];
        // Gone already, if this fails.
        let _ = Command::new("kill")
            .args([signal, &child.id().to_string()])
            .stderr(Stdio::null())
            .status();
        let status = child.wait().unwrap();
        ended[usize::from(status.success())] += 1;
        let found = fs::read(folder.path("x.hroc")).unwrap();
        assert!(
            found == old || found == new,
            "torn after {signal} at step {kill} of {kills}"
        );
        BakedScene::verify(folder.path("x.hroc")).unwrap();
        after_each(&folder, kill, status.signal());
    }
    assert!(
        ended[0] > kills / 4,
        "only {} of {kills} were killed",
        ended[0]
    );
    assert_eq!(folder.run(&arguments).0, 0);
    assert!(
        folder.temporary_files().is_empty(),
        "the next bake tidies up"
    );
}

#[cfg(unix)]
#[test]
fn a_bake_killed_at_any_moment_leaves_the_old_file_or_the_new_one() {
    killed(200, &["-KILL"], |folder, _, _| {
        let left = folder.temporary_files().len();
        assert!(left <= 1, "{left} temporary files");
    });
}

/// Where a write passes the limit on the size of files, the kernel kills: at a known byte, on any machine.
#[cfg(unix)]
#[test]
fn a_bake_killed_while_it_writes_leaves_the_old_file_and_the_next_tidies_up() {
    use std::os::unix::process::ExitStatusExt;
    let folder = Folder::large(20);
    folder.write("x.hroc", "before");
    for blocks in [0, 1, 40] {
        let status = bake_within(&folder, blocks, "ulimit -c 0").status;
        assert!(status.signal().is_some(), "{blocks} blocks: {status}");
        assert_eq!(fs::read_to_string(folder.path("x.hroc")).unwrap(), "before");
        assert_eq!(folder.temporary_files().len(), 1, "{blocks} blocks");
    }
    assert_eq!(folder.run(&["bake", "large.obj", "-o", "x.hroc"]).0, 0);
    BakedScene::verify(folder.path("x.hroc")).unwrap();
    assert!(folder.temporary_files().is_empty());
}

#[cfg(unix)]
#[test]
fn an_interrupted_bake_leaves_nothing() {
    killed(40, &["-INT", "-TERM"], |folder, kill, signal| {
        assert_eq!(folder.temporary_files(), [""; 0]);
        // SIGINT is 2, SIGTERM 15; before it watches, and once it has ended, a bake ends as any process.
        let expected = if kill % 2 == 0 { 2 } else { 15 };
        assert!(signal.is_none_or(|signal| signal == expected), "{signal:?}");
    });
}
