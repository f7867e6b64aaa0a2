//! Which frames are drawn and counted, by `--sampling`. No test asserts a time.
//!
//! Tests that draw need an adapter; `HROC_SKIP_GPU=1` leaves them out and says so.

mod support;

use std::fs;

use hroc_format::{BakedScene, Check, to_bytes};
use hroc_runtime::DepthConvention;
use hroc_study::camera_path::{CameraPath, walk_in};
use hroc_study::error::StudyError;
use hroc_study::gpu::{Gpu, GpuOptions};
use hroc_study::gpu_clock::ClockChoice;
use hroc_study::registry::{METHODS, method};
use hroc_study::results::{Counters, Frame, RunResults, SetSizes};
use hroc_study::run::{Contender, Course, run_all};
use hroc_study::sampling::{FILL_FRAMES, Sampling};
use indicatif::ProgressBar;
use serde_json::Value;
use support::{House, refused, text, without_gpu};

/// A counted frame as it was shown: its number and the bits of its depth buffer.
type Shown = (u32, Vec<u32>);

const fn windows(windows: u32, frames_per_window: u32, fill_frames: u32) -> Sampling {
    Sampling::Windows {
        fps: 60.0,
        windows,
        frames_per_window,
        fill_frames,
    }
}

const CUTS: Sampling = Sampling::Cuts {
    fps: 60.0,
    fill_frames: 3,
};

struct Rooms {
    gpu: Gpu,
    baked: BakedScene,
    path: CameraPath,
}

impl Rooms {
    fn new() -> Self {
        let features = METHODS.iter().map(|method| method.features);
        let gpu = Gpu::open(&GpuOptions {
            features: features.fold(wgpu::Features::empty(), |all, some| all | some),
            ..Default::default()
        });
        let file = to_bytes(&support::rooms(6)).unwrap();
        let baked = BakedScene::from_aligned(file, Check::Everything).unwrap();
        Self {
            gpu: gpu.expect("HROC_SKIP_GPU=1 skips this"),
            path: walk_in(baked.scene()),
            baked,
        }
    }

    fn run(
        &self,
        names: &[&str],
        sampling: Sampling,
        frames: u32,
    ) -> Result<(Vec<RunResults>, Vec<Shown>), StudyError> {
        let course = Course {
            scene_name: "rooms".into(),
            path_name: "walk-in".into(),
            path: self.path.clone(),
            sampling,
            frames,
            size: [96, 54],
            depth: DepthConvention::default(),
            profile: self.gpu.profile.clone(),
            clock: ClockChoice::Wall,
            check: true,
            repeats: 1,
            overdraw_frame: Some(frames / 2),
            truth_cache: None,
        };
        let contenders = names.iter().map(|name| {
            let method = method(name).unwrap();
            Contender::new(method, &method.modes[0])
        });
        let contenders = contenders.collect::<Vec<_>>();
        let mut shown = Vec::new();
        let progress = ProgressBar::hidden();
        let outcomes = run_all(
            &self.gpu,
            &self.baked,
            &course,
            &contenders,
            &progress,
            &mut |view| {
                shown.push((view.frame, view.image.depth_bits.clone()));
                Ok(())
            },
        )?;
        assert_eq!(progress.position(), progress.length().unwrap());
        let results = outcomes.into_iter().map(Result::unwrap);
        Ok((results.collect(), shown))
    }
}

/// Objects drawn beyond those that are visible, over all frames.
fn drawn_in_vain(run: &RunResults) -> usize {
    let frames = run.per_frame.iter();
    frames
        .map(|frame| frame.pvs.unwrap() - frame.visible.unwrap())
        .sum()
}

/// The part of a frame's results that a method decides without a clock.
fn work(frame: &Frame) -> (Option<usize>, SetSizes, Counters) {
    let counters = Counters {
        // Subtrees are pruned in a race, so these vary a little.
        rays: None,
        ray_box_tests: None,
        ..frame.counters
    };
    (frame.pvs, frame.sets, counters)
}

#[test]
fn only_the_frames_of_windows_are_reported_and_all_of_them_are_right() {
    if without_gpu() {
        return;
    }
    let rooms = Rooms::new();
    let names = ["noc", "ref", "hroc", "roc-hiz"];
    let (results, shown) = rooms.run(&names, windows(3, 4, 2), 12).unwrap();
    assert_eq!(shown.len(), names.len() * 12);
    assert!(shown.iter().all(|(number, _)| *number < 12));
    for run in &results {
        assert_eq!(run.errors(), Some([0, 0]), "{}", run.method);
        assert_eq!((run.per_frame.len(), run.steady_frames().len()), (12, 12));
        assert_eq!(run.overdraw.as_ref().unwrap().frame, 6);
        for (number, frame) in run.per_frame.iter().enumerate() {
            assert_eq!(frame.window, Some(number as u32 / 4));
            assert!(frame.frame_ms > 0.0 && !frame.stages_ms.is_empty());
            assert!(frame.visible.is_some());
            if run.method == "hroc" {
                assert!(frame.counters.rays.is_some());
            }
            if run.method == "ref" {
                assert_eq!(frame.pvs, frame.visible, "told of its own frame");
            }
        }
        for pair in run.per_frame.windows(2) {
            let step = pair[1].t_s.unwrap() - pair[0].t_s.unwrap();
            let consecutive = (step - 1.0 / 60.0).abs() < 1e-9;
            assert_eq!(consecutive, pair[0].window == pair[1].window, "{step}");
        }
    }
}

#[test]
fn a_moment_has_the_same_image_in_every_sampling() {
    if without_gpu() {
        return;
    }
    let rooms = Rooms::new();
    let (spread, spread_shown) = rooms.run(&["hroc"], Sampling::Spread, 5).unwrap();
    let (cuts, cut_shown) = rooms.run(&["hroc"], CUTS, 5).unwrap();
    let times = |run: &RunResults| run.per_frame.iter().map(|f| f.t_s).collect::<Vec<_>>();
    assert_eq!(times(&spread[0]), times(&cuts[0]));
    assert_eq!(spread_shown, cut_shown);
    assert!(cuts[0].per_frame.iter().all(|frame| frame.window.is_none()));
    // The frames are distinct, so the numbers are not mixed up.
    assert_ne!(spread_shown[0].1, spread_shown[2].1);
    // The last window of any number of windows ends where the path does, as spread frames do.
    let (_, window) = rooms.run(&["hroc"], windows(2, 3, 2), 6).unwrap();
    assert_eq!(window[5].1, spread_shown[4].1);
}

#[test]
fn a_window_has_nothing_from_the_windows_before_it() {
    if without_gpu() {
        return;
    }
    let rooms = Rooms::new();
    // These decide by times that are measured, or draw lots.
    let varying = ["nohc", "nohc-optimum", "auto", "chc++"];
    let names = METHODS.iter().map(|method| method.name);
    let names = names.filter(|name| !varying.contains(name));
    let names = names.collect::<Vec<_>>();
    let last = |sampling, frames: u32| {
        let (results, _) = rooms.run(&names, sampling, frames).unwrap();
        let last_frames = |run: &RunResults| {
            let frames = run.per_frame[frames as usize - 4..].iter();
            frames.map(work).collect::<Vec<_>>()
        };
        results.iter().map(last_frames).collect::<Vec<_>>()
    };
    // The last window is the same stretch of the path; two or three other ones come before it.
    let two = last(windows(2, 4, 2), 8);
    let three = last(windows(3, 4, 2), 12);
    for ((name, two), three) in names.iter().zip(two).zip(three) {
        assert_eq!(two, three, "{name}");
    }
}

#[test]
fn the_fill_frames_fill_every_history() {
    if without_gpu() {
        return;
    }
    let rooms = Rooms::new();
    let varying = ["nohc", "nohc-optimum", "auto", "chc++"];
    let names = METHODS.iter().map(|method| method.name);
    let names = names.filter(|name| !varying.contains(name));
    let names = names.collect::<Vec<_>>();
    let last = |fill: u32| {
        let (results, _) = rooms.run(&names, windows(2, 2, fill), 4).unwrap();
        let works = |run: &RunResults| run.per_frame[2..].iter().map(work).collect::<Vec<_>>();
        results.iter().map(works).collect::<Vec<_>>()
    };
    let [none, fill, twice] = [0, FILL_FRAMES, 2 * FILL_FRAMES].map(last);
    for ((name, fill), twice) in names.iter().zip(&fill).zip(&twice) {
        assert_eq!(fill, twice, "{name}: a longer fill changes nothing");
    }
    let hroc = names.iter().position(|name| *name == "hroc").unwrap();
    assert_ne!(
        none[hroc], fill[hroc],
        "without a fill the history is missing"
    );
}

#[test]
fn cuts_cost_more_drawn_objects_than_windows() {
    if without_gpu() {
        return;
    }
    let rooms = Rooms::new();
    let names = ["hroc", "roc-hiz"];
    let (windows, _) = rooms.run(&names, windows(6, 2, 3), 12).unwrap();
    let (cuts, _) = rooms.run(&names, CUTS, 12).unwrap();
    for (windows, cuts) in windows.iter().zip(&cuts) {
        assert_eq!(cuts.errors(), Some([0, 0]));
        let [windows, cuts] = [windows, cuts].map(drawn_in_vain);
        assert!(windows < cuts, "{windows} {cuts}");
    }
}

#[test]
fn a_path_without_another_place_has_no_cuts() {
    if without_gpu() {
        return;
    }
    let mut rooms = Rooms::new();
    let key = rooms.path.keys()[0];
    rooms.path = CameraPath::new(rooms.path.projection(), 0.1, None, vec![key]).unwrap();
    let error = rooms.run(&["noc"], CUTS, 2).unwrap_err();
    assert!(error.to_string().contains("same place"), "{error}");
    assert_eq!(error.exit_code(), 2);
    let (results, shown) = rooms.run(&["noc"], windows(1, 3, 2), 3).unwrap();
    assert!(shown[0].1 == shown[2].1, "the camera rests");
    let json = results[0].to_json();
    assert!(
        !json.contains("short_path"),
        "a still camera is meant to be still"
    );
    let (results, _) = rooms.run(&["noc"], windows(3, 1, 2), 3).unwrap();
    assert!(results[0].to_json().contains("short_path"));
}

#[test]
fn the_command_line_takes_windows_and_refuses_contradictions() {
    let house = House::new(1);
    for command in [
        &["run", "rooms.hroc"][..],
        &["compare", "rooms.hroc", "-o", "out"],
        &["study", "rooms.hroc", "-o", "out"],
        &["hard-cases"],
    ] {
        let with = |more: &[&str]| house.hroc(&[command, more].concat());
        let windows = ["--sampling", "windows"];
        refused(
            &with(&[&windows[..], &["--frames", "10", "--windows", "3"]].concat()),
            2,
            &["--frames 10", "3 windows"],
        );
        refused(
            &with(&["--sampling", "spread", "--frames-per-window", "3"]),
            2,
            &["--frames-per-window", "--sampling windows"],
        );
        refused(&with(&["--fps", "0"]), 2, &["--fps", "as in 60"]);
        refused(
            &with(&["--sampling", "some"]),
            2,
            &["some", "windows, spread, cuts"],
        );
    }
    refused(
        &house.hroc(&["hard-cases", "--frames", "3"]),
        2,
        &["--frames", "own frames"],
    );
}

#[test]
fn a_run_is_in_windows_by_default_and_says_so() {
    if without_gpu() {
        return;
    }
    let house = House::new(2);
    let run = |more: &[&str]| {
        let run = [
            "run",
            "rooms.hroc",
            "--size",
            "32x18",
            "--untimed",
            "--json",
            "-",
        ];
        let output = house.hroc(&[&run[..], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let results: Value = serde_json::from_slice(&output.stdout).unwrap();
        (results, text(&output.stderr))
    };
    let (results, summary) = run(&[]);
    let sampling = serde_json::json!({
        "kind": "windows", "fps": 60.0, "windows": 6, "frames_per_window": 10, "fill_frames": FILL_FRAMES
    });
    assert_eq!(
        (&results["sampling"], &results["frames"]),
        (&sampling, &60.into())
    );
    assert_eq!(results["per_frame"][59]["window"], 5);
    assert!(
        summary.contains("6 windows of 10 consecutive frames"),
        "{summary}"
    );
    let (results, _) = run(&["--sampling", "cuts", "--frames", "2", "--fps", "30"]);
    assert_eq!(
        (&results["sampling"]["kind"], &results["sampling"]["fps"]),
        (&"cuts".into(), &30.0.into())
    );
    let (results, _) = run(&["--sampling", "spread", "--frames", "2"]);
    assert_eq!(results["sampling"], serde_json::json!({ "kind": "spread" }));
}

#[test]
fn a_report_shows_the_windows() {
    if without_gpu() {
        return;
    }
    let house = House::new(2);
    let compare = "compare rooms.hroc -o out --size 32x18 --repeat 1 --methods noc,hroc --windows 2 --frames-per-window 3";
    let arguments = compare.split(' ').collect::<Vec<_>>();
    let output = house.hroc(&arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let figure =
        fs::read_to_string(house.path("out/figures/frame-time-rooms-walk-in.svg")).unwrap();
    assert!(figure.contains("1/60 s apart"));
    let report = fs::read_to_string(house.path("out/report.md")).unwrap();
    assert!(report.contains("6 frames in 2 windows of 3 consecutive frames at 60 frames a second"));
    let table = fs::read_to_string(house.path("out/results.csv")).unwrap();
    let rows = table
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let rows = rows.collect::<Vec<_>>();
    let column = |name| rows[0].iter().position(|head| *head == name).unwrap();
    assert_eq!(rows[6][column("sampling")], "windows");
    assert_eq!(rows[6][column("window")], "1");
    assert!(rows[6][column("t_s")].parse::<f64>().unwrap() > 9.9);
    // Other frames are run again, not taken over, and are not joined with these.
    fs::copy(house.path("out/results.json"), house.path("windows.json")).unwrap();
    let again = [
        &arguments[..10],
        &["--resume", "--sampling", "cuts", "--frames", "6"],
    ]
    .concat();
    assert_eq!(house.hroc(&again).status.code(), Some(0));
    let cuts = fs::read_to_string(house.path("out/results.json")).unwrap();
    assert!(cuts.contains("\"kind\":\"cuts\"") && !cuts.contains("\"kind\":\"windows\""));
    refused(
        &house.hroc(&["report", "windows.json", "out/results.json", "-o", "both"]),
        3,
        &["out/results.json", "--sampling"],
    );
}

#[test]
fn where_nothing_is_visible_culling_has_no_rate() {
    if without_gpu() {
        return;
    }
    let house = House::new(2);
    let key = |x: &str| {
        format!(
            r#"{{"version":1,"projection":"perspective","near":0.1,"far":null,
            "keys":[{{"t_s":0,"position":[{x},0,0],"orientation":[0,0,0,1],"fov_y_rad":1}}]}}"#
        )
    };
    fs::write(house.path("far.json"), key("1e300")).unwrap();
    fs::write(house.path("away.json"), key("0")).unwrap();
    for path in ["far.json", "away.json"] {
        for check in [&["--check"][..], &[]] {
            let arguments = [
                "run",
                "rooms.hroc",
                "--size",
                "32x18",
                "--frames",
                "2",
                "--path",
                path,
            ];
            let output = house.hroc(&[&arguments[..], &["--json", "-"], check].concat());
            let message = text(&output.stderr);
            assert_eq!(output.status.code(), Some(0), "{message}");
            assert!(
                message.contains("warning: no object is visible in 2 of 2 frames"),
                "{message}"
            );
            let results: Value = serde_json::from_slice(&output.stdout).unwrap();
            let kinds = results["warnings"].as_array().unwrap().iter();
            let told = kinds.filter(|warning| warning["kind"] == "nothing_visible");
            assert_eq!(told.count(), 1, "{path}");
            assert!(results["per_frame"][0]["cull_rate"].is_null());
            let rate = message.lines().find(|line| line.contains("C/R (culled"));
            assert_eq!(rate.is_some(), !check.is_empty(), "{message}");
            assert!(rate.is_none_or(|line| line.contains("| - ")), "{message}");
        }
    }
    let compare = "compare rooms.hroc -o out --size 32x18 --frames 4 --repeat 1 --methods noc,hroc --path away.json";
    let output = house.hroc(&compare.split(' ').collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report = fs::read_to_string(house.path("out/report.md")).unwrap();
    assert!(report.contains("no object is visible in 4 of 4 frames"));
    let table = report.split("Table 4").nth(1).unwrap();
    let row = table
        .lines()
        .find(|line| line.starts_with("| noc"))
        .unwrap();
    assert!(!row.contains("100.00 %"), "{row}");
}

#[test]
fn hard_cases_can_be_sampled_in_windows_and_at_cuts() {
    if without_gpu() {
        return;
    }
    let house = House::new(1);
    let run = |more: &str| {
        let cases = "hard-cases --case two-views --case taken-apart --method roc-hiz --method ref --json - ";
        let arguments = format!("{cases}{more}");
        let output = house.hroc(&arguments.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let results: Value = serde_json::from_slice(&output.stdout).unwrap();
        let frames = |case: usize| {
            let runs = results["cases"][case]["runs"].as_array().unwrap();
            let frames = runs.iter().map(|run| run["frames"].as_u64().unwrap());
            frames.max().unwrap()
        };
        let kind = results["sampling"]["kind"].as_str().unwrap().to_owned();
        (kind, frames(0), frames(1))
    };
    // Two views of 2 x 3 frames; objects that move keep their 16 steps.
    let windows = run("--sampling windows --windows 2 --frames-per-window 3");
    assert_eq!(windows, ("windows".into(), 12, 16));
    assert_eq!(run("--sampling cuts"), ("cuts".into(), 12, 16));
}
