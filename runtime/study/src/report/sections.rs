//! What a report is made of, before it becomes Markdown or HTML.

use crate::compare::{Comparison, CourseRuns, Kind, unique};
use crate::metrics;
use crate::report::heat_map::HeatScale;
use crate::report::numbers::{count, number};
use crate::report::{figures, tables};
use crate::results::{RunResults, WARM_UP_FRAMES};
use crate::sampling::Sampling;
use crate::table::Table;

/// A chapter.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct Section {
    pub title: String,
    pub blocks: Vec<Block>,
}

/// A part of a chapter.
#[derive(Clone, Debug)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// A table.
    #[allow(missing_docs)]
    Table { title: String, table: Table },
    /// A drawing; `name` is its file's, without ending.
    #[allow(missing_docs)]
    Figure {
        name: String,
        title: String,
        svg: String,
    },
    /// Pictures side by side.
    Images(Vec<Image>),
}

/// A picture.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct Image {
    /// Its file's, without ending.
    pub name: String,
    pub caption: String,
    pub png: Vec<u8>,
}

/// The report.
pub fn sections(comparison: &Comparison) -> Vec<Section> {
    let mut sections = match comparison.kind {
        Kind::Compare => compared(comparison),
        Kind::Study => crate::study::sections(comparison),
    };
    sections.push(section("Memory", vec![Block::Text(
        "GPU memory, MB (10^6 bytes): vertices and indices, objects and meshes, the tree, the method's own buffers.".into(),
    )], comparison, tables::memory));
    sections.push(machine(comparison));
    sections.retain(|section| {
        section
            .blocks
            .iter()
            .any(|block| !matches!(block, Block::Text(_)))
    });
    sections
}

fn compared(comparison: &Comparison) -> Vec<Section> {
    let series = comparison.series();
    let courses = comparison.courses();
    let mut speed_error = vec![Block::Text(
        "Lower left is best. Each row of plots has another cost, each column another error, so a point is one \
         contender in one setting. Exact ones lie together at zero. The settings of a knob are joined by a line: small markers that grow with its value, \
         a large one where it is not turned."
            .into(),
    )];
    for course in &courses {
        speed_error.extend(figure(
            course,
            "speed-error",
            "",
            figures::speed_error(course, &series),
        ));
    }
    let mut times = vec![Block::Text(format!(
        "Frame time by the host's clock, from the first command recorded until the device is idle. Median over the \
         frames ± half the distance between the quartiles. {}",
        averaged(comparison)
    ))];
    times.extend(table("", tables::overview(comparison)));
    times.push(Block::Text(
        "p99: 99th percentile of all samples. Noise: median relative deviation of a frame's samples. /NOC and \
         /HROC: ratio of medians to no culling and to HROC with occluder filtering."
            .into(),
    ));
    times.extend(per_course(comparison, tables::times));

    let modes = section("Table 3: modes of HROC", vec![], comparison, tables::modes);
    let culling = section(
        "Table 4: culling efficiency",
        vec![Block::Text(
            "C: culled objects; N: all; R: those that do not show. In the frustum: culled of those hidden, both \
             among objects whose bounds meet the view volume. Both rates leave out frames that show no object. Overdraw: fragments that passed the depth test as \
             they were drawn, per covered pixel, of one frame. Errors are means over all frames."
                .into(),
        )],
        comparison,
        tables::culling,
    );
    let mut regret = vec![Block::Text(
        "By how much the mean frame time of auto exceeds that of always taking one of what it chooses from. The \
         interval is a bootstrap over windows, or over segments of the path where frames are spread over it. Which one drew how many frames is of the last repeat: \
         auto goes by times, so it may choose otherwise in another."
            .into(),
    )];
    regret.extend(table("", tables::regret(comparison)));
    let mut over_path = Vec::new();
    let mut stages = vec![Block::Text(
        "Each stage is timed in replays of their own; without a device clock that is right they wait at every stage, \
         which adds a submission to each."
            .into(),
    )];
    let mut overdraw = vec![Block::Text(
        "Fragments of the geometry that pass the depth test as they are drawn, on one scale for all contenders. \
         Bounds that are rasterized for a test are not in them."
            .into(),
    )];
    for course in &courses {
        over_path.extend(curves(course, &series));
        let unturned = course
            .runs
            .iter()
            .copied()
            .filter(|run| run.knobs.is_empty());
        stages.extend(figure(
            course,
            "stages",
            "",
            figures::stages(&unturned.collect::<Vec<_>>()),
        ));
        overdraw.extend(heat_maps(course));
    }
    let section = |title: &str, blocks| Section {
        title: title.into(),
        blocks,
    };
    vec![
        section("Speed against error", speed_error),
        section("Table 1: frame times", times),
        modes,
        culling,
        section("Regret of auto", regret),
        section("Frame time over the path", over_path),
        section("Stages", stages),
        section("Overdraw", overdraw),
    ]
}

/// Which frames the averages of a report include.
fn averaged(comparison: &Comparison) -> String {
    let samplings = unique(comparison.runs.iter().map(|run| match run.sampling {
        Sampling::Spread => {
            format!("The first {WARM_UP_FRAMES} of the frames that are spread over the path are left out.")
        }
        Sampling::Windows { .. } => {
            "Frames are those of windows of consecutive frames; the uncounted frames before each are left out.".into()
        }
        Sampling::Cuts { .. } => "Each frame comes right after a camera cut.".into(),
    }));
    samplings.join(" ")
}

/// A section of one table for each course.
fn section(
    title: &str,
    mut blocks: Vec<Block>,
    comparison: &Comparison,
    make: fn(&CourseRuns<'_>) -> Option<Table>,
) -> Section {
    blocks.extend(per_course(comparison, make));
    Section {
        title: title.into(),
        blocks,
    }
}

/// A table for each course.
pub(crate) fn per_course(
    comparison: &Comparison,
    make: fn(&CourseRuns<'_>) -> Option<Table>,
) -> Vec<Block> {
    let courses = comparison.courses();
    let tables = courses
        .iter()
        .flat_map(|course| table(&course_title(course), make(course)));
    tables.collect()
}

fn table(title: &str, table: Option<Table>) -> Option<Block> {
    let title = title.to_owned();
    table.map(|table| Block::Table { title, table })
}

fn course_title(course: &CourseRuns<'_>) -> String {
    let scene = &course.runs[0].scene;
    format!(
        "{}: {} objects, {} triangles",
        course.title(),
        count(scene.objects as u64),
        count(scene.triangles)
    )
}

/// A figure of a course.
pub(crate) fn figure(
    course: &CourseRuns<'_>,
    kind: &str,
    which: &str,
    svg: Option<String>,
) -> Option<Block> {
    let more = if which.is_empty() {
        String::new()
    } else {
        format!(": {which}")
    };
    Some(Block::Figure {
        name: file_name(&[kind, course.scene, course.path, which]),
        title: course.title() + &more,
        svg: svg?,
    })
}

/// Parts of a file's name, of letters that no system minds.
fn file_name(parts: &[&str]) -> String {
    let parts = parts.iter().filter(|part| !part.is_empty());
    let joined = parts.copied().collect::<Vec<_>>().join("-");
    let safe = |c: char| {
        if c.is_alphanumeric() || "._+".contains(c) {
            c
        } else {
            '-'
        }
    };
    let mut name: String = joined.chars().map(safe).collect();
    while name.contains("--") {
        name = name.replace("--", "-");
    }
    name
}

/// The methods in their first settings; then for each method of several settings, these.
fn curves(course: &CourseRuns<'_>, series: &[String]) -> Vec<Block> {
    let unturned = course
        .runs
        .iter()
        .copied()
        .filter(|run| run.knobs.is_empty());
    let mut by_method: Vec<Vec<&RunResults>> = Vec::new();
    for run in unturned {
        match by_method
            .iter_mut()
            .find(|runs| runs[0].method == run.method)
        {
            Some(runs) => runs.push(run),
            None => by_method.push(vec![run]),
        }
    }
    let first = by_method.iter().map(|runs| runs[0]).collect::<Vec<_>>();
    let mut blocks = Vec::new();
    if first.len() > 1 || by_method.iter().all(|runs| runs.len() == 1) {
        blocks.extend(figure(
            course,
            "frame-time",
            "",
            figures::curves(&first, series),
        ));
    }
    for runs in by_method.iter().filter(|runs| runs.len() > 1) {
        blocks.extend(figure(
            course,
            "frame-time",
            &runs[0].method,
            figures::curves(runs, series),
        ));
    }
    blocks
}

fn heat_maps(course: &CourseRuns<'_>) -> Vec<Block> {
    let maps = || {
        course
            .runs
            .iter()
            .filter_map(|run| Some((run, run.overdraw.as_ref()?)))
    };
    let Some((_, first)) = maps().next() else {
        return Vec::new();
    };
    let scale = HeatScale::of(maps().map(|(_, map)| map));
    let mut images = Vec::new();
    for (run, map) in maps() {
        let per_pixel = metrics::ratio(map.fragments as f64, map.covered_pixels as f64);
        match scale.picture(map) {
            Ok(png) => images.push(Image {
                name: file_name(&["overdraw", course.scene, course.path, &run.label()]),
                caption: match per_pixel {
                    Some(per_pixel) => {
                        format!("{}: {} per covered pixel", run.label(), number(per_pixel))
                    }
                    None => format!("{}: no pixel is covered", run.label()),
                },
                png,
            }),
            Err(error) => {
                return vec![Block::Text(format!(
                    "The map of {} cannot be read: {error}.",
                    run.label()
                ))];
            }
        }
    }
    let title = format!("frame {}", first.frame);
    let legend = figure(course, "overdraw-scale", &title, Some(scale.legend()));
    legend.into_iter().chain([Block::Images(images)]).collect()
}

fn machine(comparison: &Comparison) -> Section {
    let mut blocks = vec![Block::Table {
        title: String::new(),
        table: tables::machine(comparison),
    }];
    let warnings = comparison.runs.iter().flat_map(|run| &run.warnings);
    let warnings = unique(warnings.map(|warning| format!("Warning: {warning}.")));
    blocks.extend(warnings.into_iter().map(Block::Text));
    blocks.extend(table("Skipped", tables::skipped(comparison)));
    Section {
        title: "Machine, settings, what was skipped".into(),
        blocks,
    }
}
