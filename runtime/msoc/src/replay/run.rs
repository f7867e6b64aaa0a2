//! Playing a replay: times, answers, and how they compare with the reference.

use std::fmt::Write;
use std::time::Instant;

use serde::Serialize;

use super::{Queries, Replay};
use crate::footprint::Visibility;
use crate::msoc::Msoc;
use crate::options::{Mode, Options, OptionsError};
use crate::reference::Reference;
use crate::simd::{Isa, IsaName};

/// Most pixels of an image that is compared with the reference: half a GiB of f64.
const MOST_CHECKED_PIXELS: u64 = 1 << 26;

/// How to play it.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// How occluders are rasterized.
    pub mode: Mode,
    /// The instruction set; the best there is if not given.
    pub isa: Option<IsaName>,
    /// Threads to rasterize with, at least 1.
    pub threads: usize,
    /// How often to rasterize and ask, at least once; times are medians.
    pub repeat: usize,
    /// Compare with the reference.
    pub check: bool,
}

/// Why it could not be played.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The CPU lacks it.
    #[error("this CPU has no {}; leave --isa out to use the best it has", .0.name())]
    Isa(IsaName),
    /// Out of range.
    #[error(transparent)]
    Options(#[from] OptionsError),
    /// The reference would take too much memory.
    #[error("the reference takes 8 bytes per pixel, too much for {}x{}; leave --check out", .0[0], .0[1])]
    TooLargeToCheck([u32; 2]),
    /// The system gave no threads.
    #[error("cannot start the threads: {0}; ask for fewer")]
    Threads(String),
}

/// What came of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Of this structure.
    pub schema: u32,
    /// `paper` or `inner`.
    pub mode: &'static str,
    /// The instruction set.
    pub isa: &'static str,
    /// Threads that rasterized.
    pub threads: usize,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Occluder triangles.
    pub triangles: usize,
    /// Queries.
    pub queries: usize,
    /// Rounds measured.
    pub repeat: usize,
    /// Clearing and rasterizing everything, median, milliseconds.
    pub raster_ms: f64,
    /// The rounds of it.
    pub raster_ms_all: Vec<f64>,
    /// One query on one thread, median over rounds of the mean, nanoseconds; rectangles are asked about together,
    /// boxes one by one. Null without queries.
    pub query_ns: Option<f64>,
    /// Queries answered "visible".
    pub visible: usize,
    /// One bit per query, 1 for visible, the first in the least significant bit of the first byte.
    pub visible_bits: String,
    /// The comparison; null if not asked for.
    pub check: Option<Check>,
}

/// Answers against the scalar full-resolution reference of the same mode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Check {
    /// Queries that the reference hides.
    pub reference_occluded: usize,
    /// Queries hidden that the reference sees: errors.
    pub false_occluded: usize,
    /// Queries seen that the reference hides: lost culling.
    pub leaks: usize,
    /// `leaks / reference_occluded`; null if that is 0.
    pub leak_rate: Option<f64>,
}

impl Report {
    /// Whether `inner` broke its promise. `paper` promises nothing.
    pub fn failed(&self) -> bool {
        self.mode == "inner" && self.check.is_some_and(|check| check.false_occluded > 0)
    }

    /// For people.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let [width, height] = self.size;
        let mut line = |name: &str, value: String| {
            let _ = writeln!(text, "{name:<20}{value}");
        };
        line("image", format!("{width}x{height}"));
        line("mode", self.mode.into());
        line(
            "instruction set",
            format!("{}, {} thread(s)", self.isa, self.threads),
        );
        line(
            "rasterization",
            format!("{:.3} ms for {} triangles", self.raster_ms, self.triangles),
        );
        if let Some(query_ns) = self.query_ns {
            line(
                "query",
                format!("{query_ns:.1} ns each, {} queries", self.queries),
            );
        }
        line("visible", format!("{} of {}", self.visible, self.queries));
        line("visible bits", self.visible_bits.clone());
        if let Some(check) = self.check {
            line("reference hides", check.reference_occluded.to_string());
            line("falsely occluded", check.false_occluded.to_string());
            let rate = check
                .leak_rate
                .map_or(String::new(), |rate| format!(" ({:.2} %)", 100.0 * rate));
            line("leaked", format!("{}{rate}", check.leaks));
        }
        text
    }
}

/// Plays a replay.
///
/// # Errors
/// If the CPU or the system cannot do it as asked.
pub fn run(replay: &Replay, options: &RunOptions) -> Result<Report, RunError> {
    let isa = match options.isa {
        None => Isa::best(),
        Some(name) => Isa::new(name).ok_or(RunError::Isa(name))?,
    };
    let settings = Options {
        mode: options.mode,
        near: replay.near,
        parallel: options.threads > 1,
        isa: Some(isa),
        ..Options::default()
    };
    let pixels = replay.size.map(u64::from).iter().product::<u64>();
    if options.check && pixels > MOST_CHECKED_PIXELS {
        return Err(RunError::TooLargeToCheck(replay.size));
    }
    let mut msoc = Msoc::new(replay.size, settings)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads.max(1))
        .build();
    let pool = pool.map_err(|error| RunError::Threads(error.to_string()))?;
    let repeat = options.repeat.max(1);
    let mut raster_ms = Vec::new();
    let mut query_ns = Vec::new();
    let mut answers = Vec::new();
    for _ in 0..repeat {
        let start = Instant::now();
        pool.install(|| {
            msoc.clear();
            msoc.rasterize_clip(&replay.triangles);
        });
        raster_ms.push(start.elapsed().as_secs_f64() * 1e3);
        let start = Instant::now();
        match &replay.queries {
            Queries::Rects(rects) => msoc.query_rects(rects, &mut answers),
            Queries::Boxes(boxes) => {
                let each = boxes.iter().map(|corners| msoc.query_box_clip(corners));
                answers.clear();
                answers.extend(each);
            }
        }
        if !answers.is_empty() {
            query_ns.push(start.elapsed().as_secs_f64() * 1e9 / answers.len() as f64);
        }
    }
    let check = options
        .check
        .then(|| check(replay, &settings, &answers))
        .transpose()?;
    let mut bytes = vec![0_u8; answers.len().div_ceil(8)];
    let visible = answers.iter().map(|answer| *answer == Visibility::Visible);
    for (index, visible) in visible.clone().enumerate() {
        bytes[index / 8] |= u8::from(visible) << (index % 8);
    }
    Ok(Report {
        schema: 1,
        mode: match options.mode {
            Mode::Paper => "paper",
            Mode::Inner { .. } => "inner",
        },
        isa: isa.name().name(),
        threads: options.threads.max(1),
        size: replay.size,
        triangles: replay.triangles.len(),
        queries: answers.len(),
        repeat,
        raster_ms: median(&raster_ms).unwrap_or(0.0),
        query_ns: median(&query_ns),
        raster_ms_all: raster_ms,
        visible: visible.filter(|visible| *visible).count(),
        visible_bits: bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        check,
    })
}

fn check(
    replay: &Replay,
    settings: &Options,
    answers: &[Visibility],
) -> Result<Check, OptionsError> {
    let mut reference = Reference::new(replay.size, settings)?;
    reference.rasterize_clip(&replay.triangles);
    let mut check = Check::default();
    let mut count = |ours: Visibility, truth: Visibility| {
        let ours_visible = ours == Visibility::Visible;
        match truth {
            Visibility::Visible => check.false_occluded += usize::from(!ours_visible),
            Visibility::Occluded => {
                check.reference_occluded += 1;
                check.leaks += usize::from(ours_visible);
            }
            Visibility::Outside => {}
        }
    };
    match &replay.queries {
        Queries::Rects(rects) => {
            for (&ours, rect) in answers.iter().zip(rects) {
                count(ours, reference.query_rect(rect));
            }
        }
        Queries::Boxes(boxes) => {
            for (&ours, corners) in answers.iter().zip(boxes) {
                count(ours, reference.query_box_clip(corners));
            }
        }
    }
    if check.reference_occluded > 0 {
        check.leak_rate = Some(check.leaks as f64 / check.reference_occluded as f64);
    }
    Ok(check)
}

/// The middle one, or `None` of none.
fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}
