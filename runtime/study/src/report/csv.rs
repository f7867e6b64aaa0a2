//! `results.csv`: a row for each run and frame, for spreadsheets and data frames.

use std::collections::BTreeSet;

use crate::compare::Comparison;
use crate::results::{Frame, RunResults};

/// The columns that every run has.
const RUN: [&str; 14] = [
    "scene",
    "path",
    "contender",
    "method",
    "mode",
    "exactness",
    "grouping",
    "split",
    "knobs",
    "width",
    "height",
    "objects",
    "sampling",
    "steady",
];
const FRAME: [&str; 32] = [
    "frame",
    "window",
    "t_s",
    "frame_ms",
    "frame_samples_ms",
    "gpu_ms",
    "gpu_samples_ms",
    "visible",
    "in_frustum",
    "pvs",
    "wrong_pixels",
    "false_negatives",
    "depth_ties",
    "removed_stray",
    "removed_not_finite",
    "removed_true",
    "strays",
    "kept_strays",
    "cull_rate",
    "V",
    "O",
    "G",
    "U",
    "D",
    "draws",
    "triangles",
    "boxes_rasterized",
    "rays",
    "ray_box_tests",
    "queries",
    "wasted_queries",
    "waits",
];

/// The file.
pub(super) fn csv(comparison: &Comparison) -> Vec<u8> {
    let frames = || comparison.runs.iter().flat_map(|run| &run.per_frame);
    let stages = frames()
        .flat_map(|frame| frame.stages_ms.keys())
        .collect::<BTreeSet<_>>();
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    let stage_columns = stages.iter().map(|stage| format!("{stage}_ms"));
    let head = RUN.iter().chain(&FRAME).map(|&name| name.to_owned());
    let in_memory = "a write into memory";
    writer
        .write_record(head.chain(stage_columns))
        .expect(in_memory);
    for run in &comparison.runs {
        let warm_up = run.per_frame.len() - run.steady_frames().len();
        for (number, frame) in run.per_frame.iter().enumerate() {
            let stages = stages
                .iter()
                .map(|&stage| optional(frame.stages_ms.get(stage)));
            let row = run_cells(run, number >= warm_up)
                .into_iter()
                .chain(frame_cells(number, frame));
            writer.write_record(row.chain(stages)).expect(in_memory);
        }
    }
    writer.into_inner().expect(in_memory)
}

fn run_cells(run: &RunResults, steady: bool) -> [String; RUN.len()] {
    let knobs = run
        .knobs
        .iter()
        .map(|(name, value)| format!("{name}={value}"));
    [
        run.scene.name.clone(),
        run.path.clone(),
        run.label(),
        run.method.clone(),
        optional(run.mode.as_ref()),
        run.exactness.clone(),
        optional(run.grouping.as_ref()),
        optional(run.split.as_ref()),
        knobs.collect::<Vec<_>>().join(" "),
        run.size[0].to_string(),
        run.size[1].to_string(),
        run.scene.objects.to_string(),
        run.sampling.name().to_owned(),
        steady.to_string(),
    ]
}

fn frame_cells(number: usize, frame: &Frame) -> [String; FRAME.len()] {
    let samples = |samples: &[f64]| {
        let samples = samples.iter().map(f64::to_string);
        samples.collect::<Vec<_>>().join(" ")
    };
    let (sets, counters) = (&frame.sets, &frame.counters);
    [
        number.to_string(),
        optional(frame.window),
        optional(frame.t_s),
        frame.frame_ms.to_string(),
        samples(&frame.frame_samples_ms),
        optional(frame.gpu_ms),
        samples(&frame.gpu_samples_ms),
        optional(frame.visible),
        optional(frame.in_frustum),
        optional(frame.pvs),
        optional(frame.wrong_pixels),
        optional(frame.false_negatives),
        optional(frame.depth_ties),
        optional(frame.removed.map(|removed| removed.stray)),
        optional(frame.removed.map(|removed| removed.not_finite)),
        optional(frame.removed.map(|removed| removed.true_)),
        optional(frame.strays),
        optional(frame.kept_strays),
        optional(frame.cull_rate),
        optional(sets.v),
        optional(sets.o),
        optional(sets.g),
        optional(sets.u),
        optional(sets.d),
        optional(counters.draws),
        optional(counters.triangles),
        optional(counters.boxes_rasterized),
        optional(counters.rays),
        optional(counters.ray_box_tests),
        optional(counters.queries),
        optional(counters.wasted_queries),
        optional(counters.waits),
    ]
}

/// An empty cell where there is no value.
fn optional(value: Option<impl ToString>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

#[cfg(test)]
mod tests {
    use crate::compare::tests::two_scenes;

    #[test]
    fn a_row_for_each_run_and_frame() {
        let mut comparison = two_scenes();
        comparison.runs[0].scene.name = "a \"big\", house".into();
        let text = super::csv(&comparison);
        let mut reader = csv::Reader::from_reader(&text[..]);
        let head = reader.headers().unwrap().clone();
        let rows = reader.records().map(Result::unwrap).collect::<Vec<_>>();
        assert_eq!(rows.len(), 6 * 6);
        let cell = |row: usize, name: &str| {
            let column = head.iter().position(|column| column == name).unwrap();
            rows[row][column].to_owned()
        };
        assert_eq!(cell(0, "scene"), "a \"big\", house");
        assert_eq!(
            (cell(3, "steady"), cell(4, "steady")),
            ("false".into(), "true".into())
        );
        assert_eq!(
            (cell(5, "frame_ms"), cell(5, "pack_ms")),
            ("4".into(), "0.25".into())
        );
        assert_eq!((cell(0, "mode"), cell(6, "mode")), ("".into(), "of".into()));
        assert_eq!(
            [cell(0, "sampling"), cell(0, "window"), cell(5, "t_s")],
            ["spread", "", "4"]
        );
        assert_eq!(cell(12, "knobs"), "late-margin=0.5");
        assert_eq!((cell(0, "V"), cell(0, "O")), ("4".into(), "".into()));
        let removed = ["removed_stray", "removed_true", "strays"].map(|name| cell(0, name));
        assert_eq!(removed, ["2", "0", "3"]);
    }
}
