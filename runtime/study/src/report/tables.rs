//! The tables of a report.

use crate::compare::{Comparison, CourseRuns, unique};
use crate::metrics::{self, FrameClock, FrameTimes};
use crate::report::numbers::{count, number, or_absent, share, signed_share};
use crate::results::{Frame, RunResults, SetSizes};
use crate::statistics::{Interval, relative_difference};
use crate::table::{ABSENT, Table};

/// A median and its spread.
fn times_cell(times: Option<FrameTimes>) -> String {
    times.map_or_else(
        || ABSENT.to_owned(),
        |times| format!("{} ± {}", number(times.median), number(times.spread)),
    )
}

/// Contenders by scenes. Table 1 of the paper.
pub(super) fn overview(comparison: &Comparison) -> Option<Table> {
    let courses = comparison.courses();
    let clocks = [(FrameClock::Wall, ""), (FrameClock::Gpu, ", GPU")];
    let mut head = vec!["contender (ms)".to_owned()];
    for course in &courses {
        head.extend(clocks.map(|(_, clock)| course.title() + clock));
    }
    let mut table = Table::new(head);
    // The settings of knobs are in the tables of each scene.
    let unturned = |label: &String| comparison.series().contains(label);
    for label in comparison.labels().into_iter().filter(unturned) {
        let mut row = vec![label.clone()];
        for course in &courses {
            let run = course.runs.iter().find(|run| run.label() == label);
            row.extend(
                clocks
                    .map(|(clock, _)| times_cell(run.and_then(|run| metrics::summary(run, clock)))),
            );
        }
        table.rows.push(row);
    }
    let table = table.without_empty_columns();
    (table.head.len() > 1).then_some(table)
}

/// Frame times in full.
pub(super) fn times(course: &CourseRuns<'_>) -> Option<Table> {
    let median = |run: &RunResults| Some(metrics::summary(run, FrameClock::Wall)?.median);
    let median_of = |wanted: &dyn Fn(&RunResults) -> bool| {
        course
            .runs
            .iter()
            .find(|run| wanted(run))
            .and_then(|run| median(run))
    };
    let noc = median_of(&|run| run.method == "noc");
    let hroc = median_of(&|run| run.label() == "hroc of");
    let mut table = Table::new([
        "contender",
        "image",
        "median ± spread (ms)",
        "p99 (ms)",
        "noise",
        "/NOC",
        "/HROC",
        "GPU median ± spread (ms)",
        "GPU p99 (ms)",
    ]);
    for run in &course.runs {
        let wall = metrics::summary(run, FrameClock::Wall);
        let gpu = metrics::summary(run, FrameClock::Gpu);
        let to = |base: Option<f64>| {
            or_absent(
                median(run)
                    .zip(base)
                    .and_then(|(a, b)| metrics::ratio(a, b)),
            )
        };
        table.rows.push(vec![
            run.label(),
            run.exactness.clone(),
            times_cell(wall),
            or_absent(wall.map(|times| times.p99)),
            share(wall.and_then(|times| times.noise)),
            to(noc),
            to(hroc),
            times_cell(gpu),
            or_absent(gpu.map(|times| times.p99)),
        ]);
    }
    (noc.is_some() || course.runs.iter().any(|run| median(run).is_some()))
        .then(|| table.without_empty_columns())
}

/// The settings of HROC. Table 3 of the paper, with the counters that explain the times.
pub(crate) fn modes(course: &CourseRuns<'_>) -> Option<Table> {
    let mut table = Table::new([
        "HROC",
        "median ± spread (ms)",
        "/NA",
        "V",
        "U",
        "boxes",
        "rays",
        "ray-box tests",
        "C/R",
        "wrong pixels",
        "false negatives",
    ]);
    let unturned = |run: &&&RunResults| run.method == "hroc" && run.knobs.is_empty();
    let runs = course.runs.iter().filter(unturned).collect::<Vec<_>>();
    let median = |run: &RunResults| Some(metrics::summary(run, FrameClock::Wall)?.median);
    for run in &runs {
        let is_na = |other: &&&&RunResults| {
            other.mode.as_deref() == Some("na")
                && (&other.grouping, &other.split) == (&run.grouping, &run.split)
        };
        let na = runs.iter().find(is_na).and_then(|run| median(run));
        let set = |pick: fn(&SetSizes) -> Option<usize>| {
            or_absent(metrics::mean_over(run, |frame| {
                Some(pick(&frame.sets)? as f64)
            }))
        };
        let work = |pick: fn(&Frame) -> Option<u64>| {
            or_absent(metrics::mean_over(run, |frame| Some(pick(frame)? as f64)))
        };
        table.rows.push(vec![
            run.label(),
            times_cell(metrics::summary(run, FrameClock::Wall)),
            or_absent(median(run).zip(na).and_then(|(a, b)| metrics::ratio(a, b))),
            set(|sets| sets.v),
            set(|sets| sets.u),
            work(|frame| frame.counters.boxes_rasterized),
            work(|frame| frame.counters.rays),
            work(|frame| frame.counters.ray_box_tests),
            share(metrics::culled_of_hidden(run)),
            or_absent(metrics::wrong_pixels(run)),
            or_absent(metrics::false_negatives(run)),
        ]);
    }
    (runs.len() > 1).then(|| table.without_empty_columns())
}

/// What is culled, and what is wrong. Table 4 of the paper.
pub(super) fn culling(course: &CourseRuns<'_>) -> Option<Table> {
    let mut table = Table::new([
        "contender",
        "C/N",
        "C/R",
        "in the frustum",
        "wrong pixels",
        "false negatives",
        "removed",
        "strays",
        "drawn",
        "visible",
        "triangles",
        "overdraw",
        "boxes",
        "ray-box tests",
        "queries",
        "wasted",
        "waits",
    ]);
    for run in &course.runs {
        let objects = |pick: fn(&Frame) -> Option<usize>| {
            or_absent(metrics::mean_over(run, |frame| Some(pick(frame)? as f64)))
        };
        let work = |pick: fn(&Frame) -> Option<u64>| {
            or_absent(metrics::mean_over(run, |frame| Some(pick(frame)? as f64)))
        };
        let overdraw = run.overdraw.as_ref();
        let overdraw = overdraw
            .and_then(|map| metrics::ratio(map.fragments as f64, map.covered_pixels as f64));
        table.rows.push(vec![
            run.label(),
            share(metrics::culled_of_all(run)),
            share(metrics::culled_of_hidden(run)),
            share(metrics::cull_rate_in_frustum(run)),
            or_absent(metrics::wrong_pixels(run)),
            or_absent(metrics::false_negatives(run)),
            or_absent(metrics::removed(run)),
            or_absent(metrics::strays(run)),
            objects(|frame| frame.pvs),
            objects(|frame| frame.visible),
            work(|frame| frame.counters.triangles),
            or_absent(overdraw),
            work(|frame| frame.counters.boxes_rasterized),
            work(|frame| frame.counters.ray_box_tests),
            work(|frame| frame.counters.queries),
            work(|frame| frame.counters.wasted_queries),
            work(|frame| frame.counters.waits),
        ]);
    }
    Some(table.without_empty_columns())
}

/// GPU memory.
pub(super) fn memory(course: &CourseRuns<'_>) -> Option<Table> {
    let mut table = Table::new([
        "contender",
        "geometry",
        "objects",
        "tree",
        "method",
        "beyond the scene",
        "sum",
    ]);
    for run in course.runs.iter().filter(|run| run.knobs.is_empty()) {
        let memory = run.memory_bytes;
        let megabytes = |bytes: u64| number(bytes as f64 / 1e6);
        let beyond = memory.tree + memory.method;
        table.rows.push(vec![
            run.label(),
            megabytes(memory.geometry),
            megabytes(memory.objects),
            megabytes(memory.tree),
            megabytes(memory.method),
            megabytes(beyond),
            megabytes(memory.geometry + memory.objects + beyond),
        ]);
    }
    Some(table)
}

/// The methods that `auto` chooses from, as labels and methods.
const CHOICES: [(&str, &str); 3] = [("vfc", "vfc"), ("hroc of", "hroc"), ("roc-hiz", "roc-hiz")];

/// What `auto` lost against always taking one of its choices, the best of a path and each.
pub(super) fn regret(comparison: &Comparison) -> Option<Table> {
    let mut head = vec!["scene, path".to_owned(), "auto, mean ms".to_owned()];
    head.push("best choice".to_owned());
    head.push("regret over it (90 % interval)".to_owned());
    head.extend(CHOICES.map(|(label, _)| format!("over {label}")));
    head.extend(CHOICES.map(|(_, method)| format!("frames by {method}")));
    let mut table = Table::new(head);
    for course in comparison.courses() {
        let times = |wanted: &str| {
            let run = course.runs.iter().find(|run| run.label() == wanted)?;
            metrics::mean_frame_times(run)
        };
        let auto = course.runs.iter().find(|run| run.label() == "auto");
        let (Some(auto_run), Some(base)) = (auto, times("auto")) else {
            continue;
        };
        let fixed = CHOICES.map(|(label, _)| times(label));
        let windows = metrics::window_lengths(auto_run);
        let over = |other: &Option<Vec<f64>>| relative_difference(other.as_ref()?, &base, &windows);
        let sum = |times: &Option<Vec<f64>>| {
            (times.as_ref()).map_or(f64::INFINITY, |times| times.iter().sum::<f64>())
        };
        let best = (0..CHOICES.len())
            .filter(|&i| fixed[i].is_some())
            .min_by(|&a, &b| sum(&fixed[a]).total_cmp(&sum(&fixed[b])));
        let interval = |found: Option<Interval>| {
            found.map_or_else(
                || ABSENT.to_owned(),
                |Interval {
                     estimate,
                     low,
                     high,
                 }| {
                    let [estimate, low, high] = [estimate, low, high].map(signed_share);
                    format!("{estimate} ({low} to {high})")
                },
            )
        };
        let mut row = vec![course.title()];
        row.push(number(base.iter().sum::<f64>() / base.len() as f64));
        row.push(best.map_or(ABSENT, |i| CHOICES[i].0).to_owned());
        row.push(interval(best.and_then(|i| over(&fixed[i]))));
        row.extend(fixed.iter().map(|times| interval(over(times))));
        row.extend(CHOICES.map(|(_, method)| {
            let frames = auto_run.steady_frames().iter();
            let chosen = frames.filter(|frame| frame.choice.as_deref() == Some(method));
            chosen.count().to_string()
        }));
        table.rows.push(row);
    }
    (!table.rows.is_empty()).then_some(table)
}

/// Where and how all this was measured.
pub(super) fn machine(comparison: &Comparison) -> Table {
    let host = &comparison.host;
    let mut table = Table::new(["what", "value"]);
    let mut add = |what: &str, values: &mut dyn Iterator<Item = String>| {
        let found = unique(values.filter(|value| !value.is_empty()));
        if !found.is_empty() {
            table.rows.push(vec![what.to_owned(), found.join("; ")]);
        }
    };
    let runs = &comparison.runs;
    let mut of_runs =
        |what: &str, value: fn(&RunResults) -> String| add(what, &mut runs.iter().map(value));
    of_runs("adapter", |run| {
        format!(
            "{} ({}, {})",
            run.adapter.name, run.adapter.driver, run.adapter.backend
        )
    });
    of_runs("draws", |run| run.paths.submission.clone());
    of_runs("hidden fragments of bounds", |run| {
        format!(
            "turned away {}",
            match run.paths.early_z.as_str() {
                "forced" => "before the shader (forced)",
                "sampled" => "in the shader (sampled)",
                other => other,
            }
        )
    });
    of_runs("subpixel step (px)", |run| {
        run.paths.subpixel_step_px.to_string()
    });
    of_runs("cost of a box (ray-box tests)", |run| {
        run.box_cost.map_or_else(String::new, number)
    });
    of_runs("times of the device", |run| {
        run.hardware.map_or_else(String::new, |times| {
            let us = |ms: f64| format!("{} us", number(1e3 * ms));
            format!(
                "draw {}, triangle {}, fragment {}, query {}, fragment in a query {}, latency {}, query round a draw {}",
                us(times.draw_ms),
                us(times.triangle_ms),
                us(times.fragment_ms),
                us(times.query_ms),
                us(times.query_fragment_ms),
                us(times.query_latency_ms),
                us(times.query_overhead_ms)
            )
        })
    });
    of_runs("clock of the stages", |run| {
        match run.paths.clock.as_str() {
            "gpu" => "the device's, which passed the test".to_owned(),
            "wall" => "the host's: the device's is wrong or missing".to_owned(),
            other => other.to_owned(),
        }
    });
    of_runs("image", |run| {
        format!("{}x{}, {} depth", run.size[0], run.size[1], run.depth)
    });
    of_runs("frames", |run| {
        format!(
            "{}; each timed {} times",
            run.sampling.describe(run.frames),
            run.repeats
        )
    });
    of_runs("camera path", |run| run.path.clone());
    of_runs("scenes", |run| {
        let scene = &run.scene;
        format!(
            "{} ({} objects, {} triangles, {} bytes)",
            scene.name,
            count(scene.objects as u64),
            count(scene.triangles),
            count(scene.file_bytes)
        )
    });
    let commit = host
        .commit
        .as_ref()
        .map(|commit| format!(", commit {commit}"));
    let once =
        |what: &str, value: String, add: &mut dyn FnMut(&str, &mut dyn Iterator<Item = String>)| {
            add(what, &mut std::iter::once(value));
        };
    once("processor", host.cpu.clone(), &mut add);
    once("cores", host.cores.to_string(), &mut add);
    once("system", host.os.clone(), &mut add);
    once(
        "hroc",
        format!("{}{}", host.hroc, commit.unwrap_or_default()),
        &mut add,
    );
    once("command", comparison.command.clone(), &mut add);
    table
}

/// Contenders without results.
pub(super) fn skipped(comparison: &Comparison) -> Option<Table> {
    let mut table = Table::new(["scene", "path", "contender", "reason"]);
    for skipped in &comparison.skipped {
        let crate::compare::Skipped {
            scene,
            path,
            contender,
            reason,
        } = skipped.clone();
        table.rows.push(vec![scene, path, contender, reason]);
    }
    (!table.rows.is_empty()).then_some(table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::tests::two_scenes;

    #[test]
    fn tables_hold_the_numbers_of_the_runs() {
        let mut comparison = two_scenes();
        comparison.runs[0].per_frame[4].frame_ms = 12.0;
        comparison.runs[0].per_frame[5].frame_ms = 18.0;
        (comparison.runs[1].grouping, comparison.runs[1].split) =
            (Some("adaptive".into()), Some("sah".into()));
        let overview = overview(&comparison).unwrap();
        assert_eq!(
            overview.head,
            ["contender (ms)", "house, walk-in", "town, walk-in"]
        );
        assert_eq!(overview.rows[0], ["noc", "15.0 ± 1.50", "3.00 ± 0.500"]);
        let house = &comparison.courses()[0];
        let times = times(house).unwrap();
        let cell = |table: &Table, row: usize, name: &str| {
            let column = table.head.iter().position(|head| head == name).unwrap();
            table.rows[row][column].clone()
        };
        assert_eq!(
            [cell(&times, 1, "/NOC"), cell(&times, 0, "/HROC")],
            ["0.200", "5.00"]
        );
        assert!(!times.head.iter().any(|head| head.contains("GPU")));
        let culling = culling(house).unwrap();
        assert_eq!(
            [cell(&culling, 0, "C/N"), cell(&culling, 0, "C/R")],
            ["50.00 %", "83.33 %"]
        );
        assert_eq!(
            modes(house),
            None,
            "one mode and a knob make no table of modes"
        );
        assert_eq!(
            memory(house).unwrap().rows.len(),
            2,
            "knobs change no memory"
        );
        comparison.runs[2].knobs.clear();
        comparison.runs[2].mode = Some("na".into());
        let modes = modes(&comparison.courses()[0]).unwrap();
        assert_eq!(
            (modes.rows.len(), modes.rows[1][0].as_str()),
            (2, "hroc na")
        );
    }
}
