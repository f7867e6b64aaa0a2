//! The `hroc` command from outside: exit codes, files, what goes where.
//!
//! Tests that draw need an adapter; `HROC_SKIP_GPU=1` leaves them out and says so.

mod support;

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use hroc_study::hard_cases::CASES;
use hroc_study::hard_cases::run::HardCaseResults;
use hroc_study::registry::METHODS;
use hroc_study::results::RunResults;
use serde_json::Value;
use tempfile::TempDir;

use support::{House, refused, text, without_gpu};

#[test]
fn wrong_options_exit_with_2_and_name_what_there_is() {
    let house = House::new(1);
    refused(
        &house.hroc(&["run", "rooms.hroc", "--size", "0x0"]),
        2,
        &["0x0", "1280x720"],
    );
    refused(
        &house.hroc(&["run", "rooms.hroc", "--frames", "0"]),
        2,
        &["--frames"],
    );
    refused(
        &house.hroc(&["run", "rooms.hroc", "--method", "hrok"]),
        2,
        &["'hrok'", "noc, ", "hroc"],
    );
    refused(
        &house.hroc(&["run", "rooms.hroc", "--mode", "x"]),
        2,
        &["mode 'x'", "of"],
    );
    refused(
        &house.hroc(&["run", "rooms.hroc", "--method", "noc", "--mode", "of"]),
        2,
        &["no modes"],
    );
    refused(
        &house.hroc(&["run", "rooms.hroc", "--png", "a.png", "--png-frame", "100"]),
        2,
        &["100 frames"],
    );
    refused(
        &house.hroc(&["run", "rooms.hroc", "--json", "none/x.json"]),
        2,
        &["none/x.json"],
    );
    refused(
        &house.hroc(&["run", "rooms.hroc", "--dump", "rooms.hroc"]),
        2,
        &["rooms.hroc"],
    );
    refused(
        &house.hroc(&["run", "rooms.hroc", "--knob", "box-cost=1e39"]),
        2,
        &["box-cost=1e39"],
    );
    #[cfg(unix)]
    {
        // By a link: if the device were replaced, it would be missed.
        std::os::unix::fs::symlink("/dev/null", house.path("null")).unwrap();
        for option in ["--json", "--png"] {
            refused(
                &house.hroc(&["run", "rooms.hroc", option, "null"]),
                2,
                &["null", "device or a pipe"],
            );
        }
    }
    refused(&house.hroc(&["fly"]), 2, &["fly"]);
}

#[test]
fn bad_inputs_exit_with_3_and_say_what_to_do() {
    let house = House::new(1);
    fs::write(house.path("scene.glb"), b"glTF\x02\x00\x00\x00").unwrap();
    refused(
        &house.hroc(&["run", "scene.glb"]),
        3,
        &["hroc-bake bake scene.glb -o scene.hroc"],
    );
    refused(&house.hroc(&["run", "missing.hroc"]), 3, &["missing.hroc"]);
    let path = |json: &str| {
        fs::write(house.path("path.json"), json).unwrap();
        house.hroc(&["run", "rooms.hroc", "--path", "path.json"])
    };
    refused(&path("{}"), 3, &["path.json", "version"]);
    refused(&path(r#"{"version":2}"#), 3, &["path.json", "version 2"]);
    let empty = r#"{"version":1,"projection":"perspective","near":0.1,"far":null,"keys":[]}"#;
    refused(&path(empty), 3, &["path.json", "keys is empty"]);
    refused(
        &house.hroc(&["run", "rooms.hroc", "--path", "walkin"]),
        3,
        &["walkin", "walk-in"],
    );
}

#[test]
fn without_an_adapter_it_exits_with_4() {
    let house = House::new(1);
    let run = |adapter| house.hroc(&["run", "rooms.hroc", "--adapter", adapter]);
    // Either there is no adapter at all, or none of this name.
    refused(&run("no adapter is called this"), 4, &["adapter"]);
    let mut command = Command::cargo_bin("hroc").unwrap();
    command.args(["run", house.scene().to_str().unwrap()]);
    for variable in ["VK_ICD_FILENAMES", "VK_DRIVER_FILES"] {
        command.env(variable, "/nonexistent.json");
    }
    if cfg!(target_os = "linux") {
        refused(
            &command.output().unwrap(),
            4,
            &["apt-get install mesa-vulkan-drivers"],
        );
    }
}

#[test]
fn methods_and_paths_are_data_on_stdout() {
    let house = House::new(2);
    let methods = house.hroc(&["methods"]);
    assert_eq!(methods.status.code(), Some(0));
    assert!(text(&methods.stdout).contains("| hroc"));
    assert_eq!(text(&methods.stderr), "");

    let printed = house.hroc(&["path", "rooms.hroc", "walk-in"]);
    let path: Value = serde_json::from_slice(&printed.stdout).unwrap();
    assert_eq!(
        (path["version"].as_u64(), path["far"].is_null()),
        (Some(1), true)
    );
    // Positions are the source's, not relative to the baked origin.
    assert!(path["keys"][1]["position"][0].as_f64().unwrap() > 4e5);
    assert_eq!(
        house
            .hroc(&["path", "rooms.hroc", "walk-in", "-o", "p.json"])
            .status
            .code(),
        Some(0)
    );
    assert_eq!(fs::read(house.path("p.json")).unwrap(), printed.stdout);
}

#[test]
fn hroc_draws_what_no_culling_draws() {
    if without_gpu() {
        return;
    }
    let house = House::new(6);
    house.hroc(&["path", "rooms.hroc", "walk-in", "-o", "p.json"]);
    for split in ["sah", "middle", "equal-count"] {
        for depth in ["standard", "reversed"] {
            for path in ["walk-in", "orbit"] {
                let output = house.run(
                    &[
                        "--check", "--json", "-", "--split", split, "--depth", depth, "--path",
                        path,
                    ],
                    0,
                );
                let results: RunResults = serde_json::from_slice(&output.stdout).unwrap();
                assert_eq!(results.errors(), Some([0, 0]));
                assert_eq!((results.per_frame.len(), results.scene.objects), (6, 54));
                assert_eq!(
                    (results.split.as_deref(), results.depth.as_str()),
                    (Some(split), depth)
                );
                for frame in &results.per_frame {
                    let sets = frame.sets;
                    // V and U are disjoint, so together they are what is drawn.
                    assert_eq!(frame.pvs, Some(sets.v.unwrap() + sets.u.unwrap()));
                    assert!(sets.o <= sets.v && sets.d <= sets.u);
                    assert!(frame.visible <= frame.in_frustum && frame.in_frustum <= Some(54));
                    assert_eq!(
                        frame.counters.triangles,
                        frame.counters.draws.map(|draws| 12 * draws)
                    );
                }
                // From outside the small cubes are hidden in their rooms, once there is a history.
                assert!(results.per_frame[1].pvs < Some(54));
            }
        }
    }
    // A written standard path and the built-in one are the same.
    let visible = |path| {
        let output = house.run(&["--check", "--json", "-", "--path", path], 0);
        let results: RunResults = serde_json::from_slice(&output.stdout).unwrap();
        results
            .per_frame
            .iter()
            .map(|frame| frame.visible)
            .collect::<Vec<_>>()
    };
    assert_eq!(visible("p.json"), visible("walk-in"));
}

#[test]
fn results_and_images_are_written() {
    if without_gpu() {
        return;
    }
    let house = House::new(2);
    let output = house.run(
        &[
            "--method", "noc", "--json", "r.json", "--png", "f.png", "--dump", "d",
        ],
        0,
    );
    assert!(
        text(&output.stdout).contains("frame time, median"),
        "the summary"
    );
    let results: Value = serde_json::from_slice(&fs::read(house.path("r.json")).unwrap()).unwrap();
    assert_eq!(results["schema"], 1);
    assert_eq!(results["per_frame"][5]["pvs"], 18);
    for absent in [
        "visible",
        "in_frustum",
        "wrong_pixels",
        "false_negatives",
        "depth_ties",
    ] {
        assert!(results["per_frame"][5][absent].is_null(), "{absent}");
    }
    for absent in ["O", "G", "U", "D"] {
        assert!(
            results["per_frame"][5]["sets"][absent].is_null(),
            "{absent}"
        );
    }
    assert!(results["mode"].is_null() && results["split"].is_null());
    assert!(
        fs::read(house.path("f.png"))
            .unwrap()
            .starts_with(b"\x89PNG")
    );

    assert_eq!(fs::read_dir(house.path("d")).unwrap().count(), 12);
    let item = fs::read(house.path("d/00000_item.npy")).unwrap();
    assert!(text(&item[..128]).contains("'<u4'") && text(&item[..128]).contains("(54, 96)"));
    let ids = item[128..]
        .chunks_exact(4)
        .map(|id| u32::from_le_bytes(id.try_into().unwrap()))
        .collect::<Vec<_>>();
    assert_eq!(ids.len(), 96 * 54);
    // The overview: background in the corner, a room's shell in the middle.
    assert_eq!(ids[0], u32::MAX);
    assert!(ids.iter().any(|&id| id % 9 == 0) && ids.iter().all(|&id| id == u32::MAX || id < 18));
    let depth = fs::read(house.path("d/00000_depth.npy")).unwrap();
    let depth =
        |pixel: usize| f32::from_le_bytes(depth[128 + 4 * pixel..][..4].try_into().unwrap());
    for (pixel, id) in ids.iter().enumerate() {
        assert_eq!(depth(pixel) == 0.0, *id == u32::MAX, "pixel {pixel}");
    }
}

#[test]
fn stages_are_timed_by_either_clock() {
    if without_gpu() {
        return;
    }
    let house = House::new(2);
    for clock in ["wall", "gpu", "auto"] {
        let output = house.hroc(&[
            "run",
            "rooms.hroc",
            "--size",
            "96x54",
            "--json",
            "-",
            "--clock",
            clock,
        ]);
        // Not every device has timestamps.
        if output.status.code() == Some(4) && clock == "gpu" {
            refused(&output, 4, &["--clock wall"]);
            continue;
        }
        let results: RunResults = serde_json::from_slice(&output.stdout).unwrap();
        assert!(clock == "auto" || results.paths.clock == clock);
        for frame in &results.per_frame {
            let stages = frame
                .stages_ms
                .keys()
                .map(String::as_str)
                .collect::<Vec<_>>();
            let expected = [
                "batch_occlusion_test",
                "extract_groups",
                "filter_occluders",
                "occlusion_map",
                "pack",
                "render_occludees",
            ];
            assert_eq!(stages, expected);
            assert!(
                frame.stages_ms.values().all(|&ms| (0.0..1e5).contains(&ms)),
                "{:?}",
                frame.stages_ms
            );
            assert_eq!(frame.gpu_ms.is_some(), results.paths.clock == "gpu");
        }
    }
}

#[test]
fn the_truth_is_cached_and_a_cache_that_cannot_be_written_is_a_warning() {
    if without_gpu() {
        return;
    }
    let house = House::new(2);
    let entries = |folder: &Path| fs::read_dir(folder).map_or(0, Iterator::count);
    house.run(&["--check", "--truth-cache", "truth"], 0);
    // The turn ends where it began: the six frames have five cameras.
    assert_eq!(entries(&house.path("truth")), 5);
    house.run(
        &["--check", "--truth-cache", "truth", "--split", "middle"],
        0,
    );
    assert_eq!(entries(&house.path("truth")), 5);
    house.run(&["--check", "--no-truth-cache"], 0);
    assert_eq!(entries(&house.path("cache/hroc")), 0);
    let output = house.run(
        &["--check", "--truth-cache", "rooms.hroc/x", "--json", "-"],
        0,
    );
    let results: Value = serde_json::from_slice(&output.stdout).unwrap();
    let kinds = results["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|warning| &warning["kind"]);
    assert!(kinds.into_iter().any(|kind| kind == "truth_not_cached"));
}

#[test]
fn degenerate_scenes_and_sizes_run() {
    if without_gpu() {
        return;
    }
    let empty = House::new(0);
    for method in ["noc", "hroc"] {
        let output = empty.run(&["--check", "--method", method, "--json", "-"], 0);
        let results: RunResults = serde_json::from_slice(&output.stdout).unwrap();
        assert!(
            results
                .per_frame
                .iter()
                .all(|frame| frame.pvs == Some(0) && frame.visible == Some(0))
        );
    }
    let house = House::new(1);
    for size in ["1x1", "1x300", "257x1"] {
        let output = house.hroc(&[
            "run",
            "rooms.hroc",
            "--frames",
            "2",
            "--check",
            "--size",
            size,
        ]);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{size}: {}",
            text(&output.stderr)
        );
    }
    refused(
        &house.hroc(&["run", "rooms.hroc", "--size", "1000000x1"]),
        4,
        &["1000000x1", "--size"],
    );
    refused(
        &house.hroc(&["run", "rooms.hroc", "--split", "none"]),
        3,
        &["'none'", "sah", "--split"],
    );
}

#[test]
fn hard_cases_are_run_and_reported() {
    if without_gpu() {
        return;
    }
    let house = House::new(1);
    let arguments = [
        "hard-cases",
        "--case",
        "two-views",
        "--case",
        "empty",
        "--json",
        "-",
    ];
    let output = house.hroc(&arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let results: HardCaseResults = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (results.schema, results.scale.as_str(), results.size),
        (1, "small", [128, 72])
    );
    let names = results.cases.iter().map(|case| case.case.as_str());
    assert_eq!(names.collect::<Vec<_>>(), ["two-views", "empty"]);
    let views = &results.cases[0];
    assert_eq!((views.views, views.objects), (2, 350));
    for method in METHODS {
        let runs = views.runs.iter().filter(|run| run.method == method.name);
        let modes = method.modes.len().max(1);
        let trees = if method.uses_tree { 3 } else { 1 };
        assert_eq!(
            runs.count(),
            2 * modes * trees,
            "{}: both depths, all modes and trees",
            method.name
        );
    }
    for run in &views.runs {
        assert_eq!((run.frames, run.failed()), (12, false), "{}", run.label());
        assert!(run.visible > 0 && run.drawn >= run.visible && run.ms > 0.0);
    }
    let table = text(&output.stderr);
    assert!(
        table.contains("two-views") && table.contains("hroc of middle"),
        "{table}"
    );
    refused(
        &house.hroc(&["hard-cases", "--case", "empty", "--size", "100000x100000"]),
        4,
        &["100000x100000"],
    );
}

#[test]
fn hard_cases_are_listed_and_unknown_ones_told() {
    let house = House::new(1);
    let list = house.hroc(&["hard-cases", "--list"]);
    assert_eq!(list.status.code(), Some(0));
    assert!(
        CASES
            .iter()
            .all(|case| text(&list.stdout).contains(case.failure))
    );
    let unknown = house.hroc(&["hard-cases", "--case", "easy"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(text(&unknown.stderr).contains("around-the-eye"));
}

/// A replay file in a folder of its own.
fn replay() -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.moc");
    let mut bytes = Vec::new();
    let frame = hroc_msoc::replay::Replay::random(1, [160, 90], 50, 21);
    frame.write(&mut bytes).unwrap();
    fs::write(&path, bytes).unwrap();
    (folder, path.to_str().unwrap().into())
}

fn msoc(arguments: &[&str]) -> Output {
    let mut command = Command::cargo_bin("hroc").unwrap();
    command.arg("msoc").args(arguments).output().unwrap()
}

#[test]
fn msoc_plays_a_recorded_frame() {
    let (_folder, file) = replay();
    for isa in ["portable", "avx2", "avx512"] {
        let known = hroc_msoc::IsaName::from_name(isa).unwrap();
        let output = msoc(&[
            &file,
            "--isa",
            isa,
            "--threads",
            "2",
            "--repeat",
            "3",
            "--check",
            "--json",
        ]);
        if hroc_msoc::Isa::new(known).is_none() {
            assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
            continue;
        }
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(report["isa"], isa);
        assert_eq!(report["raster_ms_all"].as_array().unwrap().len(), 3);
        assert_eq!(report["visible_bits"].as_str().unwrap().len(), 6);
        assert!(report["check"]["reference_occluded"].as_u64().unwrap() > 0);
    }
    let output = msoc(&[&file, "--mode", "inner", "--check"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(
        text(&output.stdout).contains("falsely occluded    0\n"),
        "{}",
        text(&output.stdout)
    );
}

#[test]
fn msoc_refuses_what_is_no_replay() {
    let (folder, file) = replay();
    fs::write(&file, b"glTF").unwrap();
    let output = msoc(&[&file]);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        text(&output.stderr).contains("frame.moc: byte 0"),
        "{}",
        text(&output.stderr)
    );
    let missing = folder.path().join("none.moc");
    assert_eq!(msoc(&[missing.to_str().unwrap()]).status.code(), Some(3));
    assert_eq!(msoc(&[&file, "--isa", "mmx"]).status.code(), Some(2));
    assert_eq!(msoc(&[&file, "--threads", "0"]).status.code(), Some(2));
}

/// No output of `hroc` may be one of its inputs, whatever name leads to it, and no two may be one file.
#[test]
fn inputs_are_not_written_over() {
    let house = House::new(2);
    let output = house.hroc(&["path", "rooms.hroc", "orbit", "-o", "fly.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let (_folder, moc) = replay();
    fs::copy(moc, house.path("frame.moc")).unwrap();
    fs::create_dir_all(house.path("out/figures")).unwrap();
    fs::create_dir(house.path("dump")).unwrap();
    let sources = ["rooms.hroc", "fly.json", "frame.moc"];
    for (at, source) in sources.iter().enumerate() {
        fs::hard_link(house.path(source), house.path(&format!("hard{at}"))).unwrap();
    }
    // A report and a dump write files whose names nobody gave.
    for link in [
        "dump/00000_item.npy",
        "out/report.html",
        "out/figures/x.svg",
    ] {
        fs::hard_link(house.path("fly.json"), house.path(link)).unwrap();
    }
    let before: Vec<_> = sources
        .map(|name| fs::read(house.path(name)).unwrap())
        .into();
    let run = ["run", "rooms.hroc", "--path", "fly.json"];
    let mut refused = vec![
        vec!["path", "rooms.hroc", "orbit", "-o", "rooms.hroc"],
        vec!["path", "rooms.hroc", "orbit", "-o", "hard0"],
        vec!["msoc", "frame.moc", "--json=frame.moc"],
        vec!["msoc", "frame.moc", "--json=hard2"],
        [&run[..], &["--dump", "dump"]].concat(),
        [&run[..], &["--json", "x.json", "--png", "out/../x.json"]].concat(),
        vec!["compare", "rooms.hroc", "--path", "fly.json", "-o", "out"],
        vec!["study", "rooms.hroc", "--path", "fly.json", "-o", "out"],
    ];
    for target in [
        "rooms.hroc",
        "fly.json",
        "hard0",
        "hard1",
        "out/../fly.json",
    ] {
        for option in ["--json", "--png"] {
            refused.push([&run[..], &[option, target]].concat());
        }
    }
    for arguments in refused {
        let output = house.hroc(&arguments);
        let err = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {err}");
        let is_told = err.contains("is an input") || err.contains("is written too");
        assert!(is_told && err.contains("; name another file"), "{err}");
        let after: Vec<_> = sources
            .map(|name| fs::read(house.path(name)).unwrap())
            .into();
        assert!(after == before, "{arguments:?}");
        assert!(!house.path("x.json").exists());
    }
}

/// Mesa's device selection complains where there is no Wayland server to ask.
#[test]
fn nothing_is_printed_for_want_of_a_window_system() {
    if without_gpu() {
        return;
    }
    let house = House::new(2);
    let mut command = Command::cargo_bin("hroc").unwrap();
    let arguments = [
        "run",
        "rooms.hroc",
        "--size",
        "96x54",
        "--frames",
        "1",
        "--no-truth-cache",
    ];
    let output = command
        .current_dir(house.folder.path())
        .args(arguments)
        .env_remove("XDG_RUNTIME_DIR")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(text(&output.stderr), "");
}
