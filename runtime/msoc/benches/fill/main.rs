//! The figures of `assets/results/msoc`: `cargo bench -p hroc-msoc -- [--out FOLDER]`.
//!
//! Fig. 11 of the paper (32,768 random right triangles, back to front, one thread, 1920x1080), queries, the
//! passes of its Table 1 against software Hi-Z, and what both modes miss. Times are thread CPU time, so that
//! other work on the machine distorts them less, and the least of several rounds: the work is the same in each, and what
//! else the machine does only adds. Fill rates and queries are measured in passes over all of them, so that a slow spell
//! spoils fewer rows; one as long as the run spoils them all.
#![allow(missing_docs, clippy::print_stdout)]

mod accuracy;
mod plot;
mod scene;

use std::fmt::Write;
use std::path::PathBuf;

use hroc_msoc::hiz::SoftwareHiZ;
use hroc_msoc::{Isa, Mode, Msoc, Options, Rect, Visibility, generate};
use rustix::time::{ClockId, clock_gettime};

const SIZE: [u32; 2] = [1920, 1080];
const TRIANGLES: usize = 32_768;
const LEGS_PX: [u32; 10] = [5, 10, 15, 25, 35, 50, 70, 100, 140, 200];
const PASSES: usize = 5;
/// Of a pass.
const ROUNDS: usize = 7;
const MODES: [(&str, Mode); 2] = [("paper", Mode::Paper), ("inner", Mode::INNER)];

/// CPU time of this thread, seconds.
fn now() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Least seconds of `work`, after a warm-up round.
fn least(rounds: usize, mut work: impl FnMut()) -> f64 {
    work();
    let round = |_| {
        let start = now();
        work();
        now() - start
    };
    (0..rounds).map(round).fold(f64::INFINITY, f64::min)
}

/// Keeps the least seconds of each row of a table that was measured again.
fn keep_least<T>(rows: &mut [T], again: Vec<T>, seconds: impl Fn(&mut T) -> &mut [f64]) {
    for (row, mut again) in rows.iter_mut().zip(again) {
        for (best, again) in seconds(row).iter_mut().zip(seconds(&mut again)) {
            *best = best.min(*again);
        }
    }
}

/// One row of the fill data.
struct Fill {
    rasterizer: String,
    legs_px: u32,
    seconds: f64,
}

fn options(isa: Isa, mode: Mode) -> Options {
    Options {
        mode,
        near: 1.0,
        isa: Some(isa),
        ..Options::default()
    }
}

fn fill() -> Vec<Fill> {
    let mut rows = Vec::new();
    for legs_px in LEGS_PX {
        let triangles = generate::right_triangles(1, TRIANGLES, legs_px as f32, SIZE);
        for isa in Isa::available() {
            for (name, mode) in MODES {
                let mut msoc = Msoc::new(SIZE, options(isa, mode)).expect("a size within bounds");
                let seconds = least(ROUNDS, || {
                    msoc.clear();
                    msoc.rasterize_clip(&triangles);
                });
                let rasterizer = format!("{} {name}", isa.name().name());
                rows.push(Fill {
                    rasterizer,
                    legs_px,
                    seconds,
                });
            }
            let mut hiz =
                SoftwareHiZ::new(SIZE, &options(isa, Mode::Paper)).expect("a size within bounds");
            let seconds = least(2, || {
                hiz.clear();
                hiz.rasterize_clip(&triangles);
                hiz.reduce();
            });
            let rasterizer = format!("{} full-resolution Hi-Z", isa.name().name());
            rows.push(Fill {
                rasterizer,
                legs_px,
                seconds,
            });
        }
    }
    rows
}

/// One row of the queries.
struct Queries {
    isa: &'static str,
    side_px: u32,
    /// Of all rectangles, per mode asked one by one and together.
    seconds: [f64; 2 * MODES.len()],
    /// In the first mode.
    occluded: usize,
}

const RECTANGLES: usize = 4096;

fn queries() -> Vec<Queries> {
    let triangles = generate::right_triangles(1, TRIANGLES, 50.0, SIZE);
    let mut rows = Vec::new();
    for isa in Isa::available() {
        for side_px in [8, 32, 100] {
            let mut random = fastrand::Rng::with_seed(7);
            let rect = |_| {
                let min: [f32; 2] = std::array::from_fn(|_| random.f32() * 1.9 - 1.0);
                let max = std::array::from_fn(|axis| {
                    min[axis] + 2.0 * side_px as f32 / SIZE[axis] as f32
                });
                Rect {
                    min,
                    max,
                    nearest_w: 5.0 + 110.0 * random.f32(),
                }
            };
            let rects = (0..RECTANGLES).map(rect).collect::<Vec<_>>();
            let mut row = Queries {
                isa: isa.name().name(),
                side_px,
                seconds: [0.0; 2 * MODES.len()],
                occluded: 0,
            };
            let mut answers = Vec::new();
            for ((_, mode), seconds) in MODES.into_iter().zip(row.seconds.chunks_mut(2)).rev() {
                let mut msoc = Msoc::new(SIZE, options(isa, mode)).expect("a size within bounds");
                msoc.rasterize_clip(&triangles);
                let hidden = |answer: &Visibility| *answer == Visibility::Occluded;
                seconds[0] = least(10 * ROUNDS, || {
                    let answers = rects.iter().map(|rect| msoc.query_rect(rect));
                    row.occluded = std::hint::black_box(answers.filter(hidden).count());
                });
                seconds[1] = least(10 * ROUNDS, || {
                    msoc.query_rects(&rects, &mut answers);
                    std::hint::black_box(&answers);
                });
                assert_eq!(answers.iter().filter(|a| hidden(a)).count(), row.occluded);
            }
            rows.push(row);
        }
    }
    rows
}

/// Nanoseconds per rectangle query, by size of the rectangle, and the share answered "occluded".
fn query_table(report: &mut String, rows: Vec<Queries>) {
    let _ = writeln!(
        report,
        "\n## Rectangle queries\n\nNanoseconds each, of {RECTANGLES} random rectangles over the buffer of 50 px triangles, asked one by one \
         (`query_rect`) and together (`query_rects`).\n"
    );
    let _ = writeln!(
        report,
        "| instruction set | rectangle | paper, one by one | together | inner, one by one | together | occluded (paper) |\n\
         |---|---|---|---|---|---|---|"
    );
    for row in rows {
        let Queries { isa, side_px, .. } = row;
        let each = |seconds: f64| format!("{:.1}", seconds * 1e9 / RECTANGLES as f64);
        let times = row.seconds.map(each).join(" | ");
        let occluded = 100.0 * row.occluded as f64 / RECTANGLES as f64;
        let _ = writeln!(
            report,
            "| {isa} | {side_px}x{side_px} px | {times} | {occluded:.0} % |"
        );
    }
}

fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let family = cpu
        .lines()
        .find_map(|line| line.strip_prefix("cpu family")?.split_once(": "));
    let (model, family) = (
        model.map_or("unknown", |m| m.1),
        family.map_or("unknown", |m| m.1),
    );
    format!(
        "{model} (family {family}), {} {}, {} cores visible",
        std::env::consts::ARCH,
        std::env::consts::OS,
        rayon::current_num_threads()
    )
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments = std::env::args().collect::<Vec<_>>();
    if !arguments.iter().any(|argument| argument == "--bench") {
        // Run as a test: nothing is measured without `cargo bench`.
        let mut msoc = Msoc::new(SIZE, Options::default())?;
        msoc.rasterize_clip(&generate::right_triangles(1, 100, 50.0, SIZE));
        return Ok(());
    }
    let out = arguments.iter().position(|argument| argument == "--out");
    let out = out
        .and_then(|index| arguments.get(index + 1))
        .map(PathBuf::from);

    let mut report = format!(
        "Machine: {}. One thread, 1920x1080, thread CPU time, least of {PASSES} passes of {ROUNDS} rounds or more.\n",
        machine()
    );
    let (mut rows, mut of_queries) = (fill(), queries());
    for _ in 1..PASSES {
        keep_least(&mut rows, fill(), |row| {
            std::slice::from_mut(&mut row.seconds)
        });
        keep_least(&mut of_queries, queries(), |row| &mut row.seconds);
    }
    let mut csv =
        "rasterizer,legs_px,triangles,ms,million_triangles_per_second,ns_per_pixel\n".to_owned();
    for Fill {
        rasterizer,
        legs_px,
        seconds,
    } in &rows
    {
        let pixels = f64::from(legs_px * legs_px) / 2.0 * TRIANGLES as f64;
        let (ms, rate) = (seconds * 1e3, TRIANGLES as f64 / seconds * 1e-6);
        let _ = writeln!(
            csv,
            "{rasterizer},{legs_px},{TRIANGLES},{ms:.3},{rate:.2},{:.4}",
            seconds * 1e9 / pixels
        );
    }
    let _ = writeln!(
        report,
        "\n## Fig. 11: million triangles per second\n\n32,768 right triangles, back to front, by length of their legs. Hi-Z includes the reduction.\n"
    );
    let _ = writeln!(
        report,
        "| rasterizer | {} |\n|---|{}",
        LEGS_PX.map(|legs| format!("{legs} px")).join(" | "),
        "---|".repeat(LEGS_PX.len())
    );
    let mut names = rows
        .iter()
        .map(|row| row.rasterizer.as_str())
        .collect::<Vec<_>>();
    names.sort_unstable();
    names.dedup();
    for name in &names {
        let of_name = rows.iter().filter(|row| row.rasterizer == *name);
        let cells = of_name
            .map(|row| format!("{:.2}", TRIANGLES as f64 / row.seconds * 1e-6))
            .collect::<Vec<_>>();
        let _ = writeln!(report, "| {name} | {} |", cells.join(" | "));
    }
    query_table(&mut report, of_queries);
    scene::table(&mut report)?;
    accuracy::table(&mut report)?;
    println!("{report}");
    if let Some(out) = out {
        std::fs::create_dir_all(&out)?;
        std::fs::write(out.join("fill.csv"), csv)?;
        std::fs::write(out.join("tables.md"), &report)?;
        plot::fill(&out.join("fill.svg"), &rows)?;
    }
    Ok(())
}
