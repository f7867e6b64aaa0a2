//! `hroc compare`, `hroc study` and `hroc report` from outside. No test asserts a time.
//!
//! Tests that draw need an adapter; `HROC_SKIP_GPU=1` leaves them out and says so.

mod support;

use std::fs;
use std::path::Path;
use std::process::Output;

use hroc_study::compare::{Comparison, Kind};
use hroc_study::unculled::{Fault, FaultKind};
use support::{House, refused, text, without_gpu};

const SMALL: [&str; 8] = [
    "--size",
    "96x54",
    "--frames",
    "6",
    "--repeat",
    "2",
    "--sampling",
    "spread",
];

/// `hroc compare` or `hroc study` in a small size, into `out`, which must end with `code`.
fn run(house: &House, command: &[&str], code: i32) -> Output {
    let output = house.hroc(&[command, &["-o", "out"], &SMALL].concat());
    assert_eq!(output.status.code(), Some(code), "{}", text(&output.stderr));
    output
}

fn results(house: &House) -> Comparison {
    Comparison::load(&house.path("out/results.json")).unwrap()
}

/// Files in a folder, without their contents.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned());
    let mut names = names.collect::<Vec<_>>();
    names.sort();
    names
}

/// A page that loads nothing: no element that could, and no address but pictures within the page.
#[track_caller]
fn needs_nothing_else(page: &str) {
    for part in [
        "http:", "https:", "<script", "<link", "<iframe", "@import", "url(",
    ] {
        assert!(!page.contains(part), "{part}");
    }
    for attribute in [" src=\"", " href=\""] {
        for (at, _) in page.match_indices(attribute) {
            let value = &page[at + attribute.len()..];
            let value = &value[..value.len().min(40)];
            assert!(
                value.starts_with("data:image/png;base64,") || value.starts_with('#'),
                "{value}"
            );
        }
    }
}

#[test]
fn wrong_options_exit_with_2() {
    let house = House::new(1);
    let compare =
        |more: &[&str]| house.hroc(&[&["compare", "rooms.hroc", "-o", "out"], more].concat());
    refused(
        &compare(&["--methods", "noc,hrok"]),
        2,
        &["'hrok'", "noc, "],
    );
    refused(&compare(&["--modes", "fo"]), 2, &["'fo'", "of, ", "all"]);
    refused(
        &compare(&["--methods", "noc", "--modes", "of"]),
        2,
        &["leave it out"],
    );
    refused(
        &compare(&["--groupings", "fine"]),
        2,
        &["fine", "published"],
    );
    refused(
        &compare(&["--frames", "9", "--overdraw-frame", "9"]),
        2,
        &["9 frames, from 0"],
    );
    refused(&compare(&["--repeat", "0"]), 2, &["--repeat"]);
    refused(&compare(&["--methods", ","]), 2, &["--methods"]);
    refused(&compare(&["--split", ""]), 2, &["--split"]);
    refused(&compare(&["rooms.hroc"]), 2, &["rooms.hroc", "twice"]);
    refused(
        &compare(&["--path", "orbit", "--path", "orbit"]),
        2,
        &["orbit", "twice"],
    );
    refused(&house.hroc(&["compare", "rooms.hroc"]), 2, &["--output"]);
    refused(&house.hroc(&["compare", "-o", "out"]), 2, &["SCENE"]);
    refused(
        &house.hroc(&["compare", "rooms.hroc", "-o", "rooms.hroc"]),
        2,
        &["rooms.hroc", "another place"],
    );
    refused(
        &house.hroc(&["compare", "rooms.hroc", "-o", "rooms.hroc/out"]),
        2,
        &["rooms.hroc/out"],
    );
    refused(
        &house.hroc(&["study", "rooms.hroc", "-o", "out", "--modes", "fo"]),
        2,
        &["'fo'"],
    );
    // Nothing was made for commands that were refused.
    assert!(!house.path("out").exists());
}

#[test]
fn bad_inputs_exit_with_3() {
    let house = House::new(1);
    fs::write(house.path("scene.glb"), b"glTF\x02\x00\x00\x00").unwrap();
    let compare = |scenes: &[&str]| house.hroc(&[&["compare", "-o", "out"], scenes].concat());
    refused(
        &compare(&["rooms.hroc", "scene.glb"]),
        3,
        &["hroc-bake bake scene.glb"],
    );
    refused(&compare(&["missing.hroc"]), 3, &["missing.hroc"]);
    refused(
        &compare(&["rooms.hroc", "--path", "nowhere.json"]),
        3,
        &["nowhere.json"],
    );
    fs::write(house.path("old.json"), "{\"schema\": 7}").unwrap();
    refused(
        &house.hroc(&["report", "old.json", "-o", "out"]),
        3,
        &["old.json", "schema 7"],
    );
    refused(
        &house.hroc(&["report", "none.json", "-o", "out"]),
        3,
        &["none.json", "hroc compare"],
    );
    let mut one_tree = support::rooms(1);
    one_tree.bvhs.retain(|bvh| bvh.split == "middle");
    hroc_format::write(&house.path("one.hroc"), &one_tree).unwrap();
    let study = house.hroc(&["study", "one.hroc", "-o", "out"]);
    refused(
        &study,
        3,
        &["one.hroc", "it has: middle", "--split sah,middle"],
    );
    assert!(!house.path("out").exists());
}

#[test]
fn a_comparison_writes_its_data_and_every_rendering_of_it() {
    if without_gpu() {
        return;
    }
    let house = House::new(3);
    let command = [
        "compare",
        "rooms.hroc",
        "--methods",
        "noc,ref,hroc",
        "--modes",
        "of,cr-late",
        "--groupings",
        "published,adaptive",
        "--sweep",
        "--path",
        "walk-in",
        "--path",
        "orbit",
        "--split",
        "all",
    ];
    let output = run(&house, &command, 0);
    assert!(
        text(&output.stdout).contains("rooms, walk-in")
            && text(&output.stdout).contains("out/report.html")
    );
    let comparison = results(&house);
    assert_eq!(comparison.kind, Kind::Compare);
    assert!(
        comparison
            .command
            .starts_with("hroc compare rooms.hroc --methods noc,ref,hroc")
    );
    // Two paths; NOC and REF; two groupings, three trees, two modes and four more margins.
    let contenders = 2 + 2 * 3 * (2 + 4);
    assert_eq!(
        (comparison.runs.len(), comparison.skipped.len()),
        (2 * contenders, 0)
    );
    assert_eq!(comparison.trees[0].trees.len(), 3);
    for run in &comparison.runs {
        assert_eq!(
            (run.per_frame.len(), run.repeats, run.size),
            (6, 2, [96, 54])
        );
        assert_eq!(
            run.overdraw.is_some(),
            run.knobs.is_empty(),
            "{}",
            run.label()
        );
        if run.is_exact() {
            assert_eq!(run.errors(), Some([0, 0]), "{}", run.label());
        }
        for frame in &run.per_frame {
            assert_eq!(frame.frame_samples_ms.len(), 2);
            assert!(!frame.stages_ms.is_empty() && frame.pvs.is_some());
        }
    }
    let noc = comparison.runs[0].overdraw.as_ref().unwrap();
    assert!(noc.frame == 3 && noc.fragments >= noc.covered_pixels && noc.covered_pixels > 0);

    assert_eq!(
        names(&house.path("out")),
        [
            "figures",
            "report.html",
            "report.md",
            "results.csv",
            "results.json"
        ]
    );
    let figures = names(&house.path("out/figures"));
    for figure in [
        "speed-error-rooms-orbit.svg",
        "frame-time-rooms-walk-in-hroc.svg",
        "stages-rooms-orbit.svg",
        "overdraw-rooms-orbit-noc.png",
    ] {
        assert!(
            figures.iter().any(|name| name == figure),
            "{figure} in {figures:?}"
        );
    }
    let csv = fs::read_to_string(house.path("out/results.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * contenders * 6);
    let page = fs::read_to_string(house.path("out/report.html")).unwrap();
    needs_nothing_else(&page);
    let markdown = fs::read_to_string(house.path("out/report.md")).unwrap();
    for label in comparison.labels() {
        assert!(
            page.contains(&label) && markdown.contains(&label),
            "{label}"
        );
    }
    for chapter in [
        "Speed against error",
        "Table 1",
        "Table 3",
        "Table 4",
        "Frame time over the path",
        "Stages",
        "Overdraw",
        "Memory",
        "Machine",
    ] {
        assert!(
            page.contains(chapter) && markdown.contains(chapter),
            "{chapter}"
        );
    }

    // The same again, from the data alone.
    let again = house.hroc(&["report", "out/results.json", "-o", "again"]);
    assert_eq!(again.status.code(), Some(0), "{}", text(&again.stderr));
    for file in ["report.html", "report.md", "results.csv"] {
        let [first, again] = ["out", "again"].map(|folder| fs::read(house.path(folder).join(file)));
        assert!(first.unwrap() == again.unwrap(), "{file}");
    }
    // An exact contender that is wrong is a failed check, whenever it is reported.
    let mut wrong = comparison.clone();
    wrong.runs[0].per_frame[2].wrong_pixels = Some(1);
    fs::write(
        house.path("wrong.json"),
        serde_json::to_string(&wrong).unwrap(),
    )
    .unwrap();
    assert_eq!(
        house
            .hroc(&["report", "wrong.json", "-o", "again"])
            .status
            .code(),
        Some(1)
    );
    a_fault_of_no_culling_fails(&house, &comparison);
}

/// Whatever the contender claims, and named by frame, pixel and object.
fn a_fault_of_no_culling_fails(house: &House, comparison: &Comparison) {
    let mut wrong = comparison.clone();
    assert!(wrong.runs.iter().all(|run| run.no_culling.is_some()));
    wrong.runs[0].exactness = "approximate".into();
    wrong.runs[0].per_frame[2].fault = Some(Fault {
        kind: FaultKind::TrueRemoved,
        pixel: [11, 12],
        object: 13,
    });
    fs::write(
        house.path("wrong.json"),
        serde_json::to_string(&wrong).unwrap(),
    )
    .unwrap();
    let output = house.hroc(&["report", "wrong.json", "-o", "again"]);
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    assert!(
        message.contains("frame 2, pixel (11, 12), object 13: `hroc_keeps` removes"),
        "{message}"
    );
}

#[test]
fn who_cannot_run_is_listed_and_the_others_go_on() {
    if without_gpu() {
        return;
    }
    let house = House::new(2);
    let output = run(
        &house,
        &[
            "compare",
            "rooms.hroc",
            "--methods",
            "hroc,noc",
            "--split",
            "sah,nice",
        ],
        0,
    );
    let comparison = results(&house);
    assert_eq!(comparison.labels(), ["hroc of", "noc"]);
    assert_eq!(comparison.skipped.len(), 1);
    let skipped = &comparison.skipped[0];
    assert_eq!(
        (skipped.contender.as_str(), skipped.path.as_str()),
        ("hroc of nice", "walk-in")
    );
    assert!(skipped.reason.contains("'nice'") && text(&output.stdout).contains(&skipped.reason));
    let page = fs::read_to_string(house.path("out/report.html")).unwrap();
    assert!(page.contains("hroc of nice") && page.contains("bake it with --split nice"));
    // Where nobody can, the exit code is that of the first one's reason.
    run(
        &house,
        &[
            "compare",
            "rooms.hroc",
            "--methods",
            "hroc",
            "--split",
            "nice",
        ],
        3,
    );
    assert_eq!(results(&house).runs, []);
    let huge = house.hroc(&["compare", "rooms.hroc", "-o", "out", "--size", "1000000x1"]);
    refused(&huge, 4, &["1000000x1"]);
}

#[test]
fn an_interrupted_comparison_goes_on_where_it_was() {
    if without_gpu() {
        return;
    }
    let house = House::new(2);
    let compare = [
        "compare",
        "rooms.hroc",
        "--methods",
        "noc,hroc",
        "--no-check",
    ];
    run(&house, &compare, 0);
    let first = results(&house);
    assert!(first.runs.iter().all(|run| run.errors().is_none()));
    let resumed = |more: &[&str]| {
        run(&house, &[&compare[..], &["--resume"], more].concat(), 0);
        results(&house)
    };
    let second = resumed(&["--path", "orbit", "--path", "walk-in"]);
    assert_eq!((second.runs.len(), second.courses().len()), (4, 2));
    // To the last digit of every time.
    assert_eq!(second.runs[..2], first.runs[..]);
    // Neither what another machine found is taken over nor what was found of another scene or path.
    let found_elsewhere: [fn(&mut Comparison); 3] = [
        |earlier| earlier.host.cpu.push('2'),
        |earlier| earlier.runs[0].scene.hash = None,
        |earlier| earlier.runs[1].path_hash = Some("0".into()),
    ];
    for change in found_elsewhere {
        let mut earlier = first.clone();
        change(&mut earlier);
        let json = serde_json::to_string(&earlier).unwrap();
        fs::write(house.path("out/results.json"), json).unwrap();
        let again = resumed(&[]);
        assert_eq!(again.labels(), first.labels());
        assert_ne!(again.runs[0].per_frame, first.runs[0].per_frame);
    }
    // Other contenders are another comparison.
    let third = resumed(&["--modes", "na"]);
    assert_eq!(third.labels(), ["noc", "hroc na"]);
    // And a study is not a comparison.
    run(
        &house,
        &[
            "study",
            "rooms.hroc",
            "--resume",
            "--modes",
            "of",
            "--groupings",
            "adaptive",
        ],
        0,
    );
    assert_eq!(
        results(&house).labels(),
        ["hroc of", "hroc of middle", "hroc of equal-count"]
    );
}

#[test]
fn scenes_without_objects_and_of_one_name_are_compared_too() {
    if without_gpu() {
        return;
    }
    let house = House::new(0);
    fs::create_dir(house.path("other")).unwrap();
    hroc_format::write(&house.path("other/rooms.hroc"), &support::rooms(1)).unwrap();
    run(
        &house,
        &[
            "compare",
            "rooms.hroc",
            "other/rooms.hroc",
            "--methods",
            "noc,ref,hroc",
        ],
        0,
    );
    let comparison = results(&house);
    let titles = comparison
        .courses()
        .iter()
        .map(|course| course.title())
        .collect::<Vec<_>>();
    assert_eq!(titles, ["rooms.hroc, walk-in", "other/rooms.hroc, walk-in"]);
    assert!(
        comparison.runs[..3]
            .iter()
            .any(|run| run.per_frame.iter().all(|frame| frame.pvs == Some(0)))
    );
    needs_nothing_else(&fs::read_to_string(house.path("out/report.html")).unwrap());
    run(&house, &["study", "rooms.hroc"], 0);
}

#[test]
fn a_study_gives_a_verdict_on_every_pair() {
    if without_gpu() {
        return;
    }
    let house = House::new(3);
    let output = run(&house, &["study", "rooms.hroc", "--modes", "na,of"], 0);
    let stdout = text(&output.stdout);
    for grouping in ["published", "adaptive"] {
        // Two frames after the warm-up decide nothing.
        let claim = format!(
            "With {grouping} grouping, that the split rule changes the frame time by little"
        );
        assert!(
            stdout.contains(&claim) && stdout.contains("undecided"),
            "{stdout}"
        );
    }
    let comparison = results(&house);
    assert_eq!(
        (comparison.kind, comparison.runs.len()),
        (Kind::Study, 2 * 2 * 3)
    );
    let verdicts = fs::read_to_string(house.path("out/verdicts.csv")).unwrap();
    let lines = verdicts.lines().skip(1).collect::<Vec<_>>();
    for (grouping, mode, split) in [
        ("published", "na", "middle"),
        ("adaptive", "of", "equal-count"),
    ] {
        let pair = format!("rooms,walk-in,{mode},{grouping},{split},frame time,");
        assert!(
            lines
                .iter()
                .any(|line| line.starts_with(&pair) && line.ends_with(",undecided")),
            "{verdicts}"
        );
    }
    let page = fs::read_to_string(house.path("out/report.html")).unwrap();
    needs_nothing_else(&page);
    for label in comparison.labels() {
        assert!(page.contains(&label), "{label}");
    }
    for chapter in [
        "Does the split rule matter?",
        "Mean frame times",
        "Trees",
        "SAH cost",
        "Counters",
        "Memory",
    ] {
        assert!(page.contains(chapter), "{chapter}");
    }
}
