//! A run in a few lines for people.

use crate::metrics;
use crate::results::{Frame, NoCulling, RunResults};
use crate::statistics::percentile;
use crate::table::markdown;

/// Markdown: what ran, a table of averages and percentiles over the steady frames, the warnings.
pub fn markdown_summary(results: &RunResults) -> String {
    let [width, height] = results.size;
    let options = [&results.mode, &results.grouping, &results.split]
        .into_iter()
        .flatten()
        .map(|option| format!(" {option}"));
    let mut text = format!(
        "{}{} on {}: {} objects, {} triangles, {width}x{height}, {} depth, {}\n{}\n\n",
        results.method,
        options.collect::<String>(),
        if results.scene.name.is_empty() {
            "(unnamed)"
        } else {
            &results.scene.name
        },
        results.scene.objects,
        results.scene.triangles,
        results.depth,
        results.adapter.name,
        results.sampling.describe(results.frames),
    );
    text += &markdown(["per frame", "value"], rows(results));
    for warning in &results.warnings {
        text += &format!("\nwarning: {warning}\n");
    }
    text
}

fn rows(results: &RunResults) -> Vec<[String; 2]> {
    let frames = results.steady_frames();
    let mean = |value: &dyn Fn(&Frame) -> Option<f64>| metrics::mean_over(results, value);
    let count = |value: fn(&Frame) -> Option<usize>| {
        number(mean(&|frame| value(frame).map(|count| count as f64)))
    };
    let work = |value: fn(&Frame) -> Option<u64>| {
        number(mean(&|frame| value(frame).map(|count| count as f64)))
    };
    let times = frames
        .iter()
        .map(|frame| frame.frame_ms)
        .collect::<Vec<_>>();

    // A dash where the check ran and there is nothing to say.
    let of_hidden = |rate| match (rate, results.errors()) {
        (None, Some(_)) => crate::table::ABSENT.to_owned(),
        _ => share(rate),
    };

    let mut rows = vec![
        (
            "frame time, median (ms)".to_owned(),
            milliseconds(percentile(&times, 0.5)),
        ),
        (
            "frame time, 99th percentile (ms)".to_owned(),
            milliseconds(percentile(&times, 0.99)),
        ),
    ];
    let gpu = frames
        .iter()
        .filter_map(|frame| frame.gpu_ms)
        .collect::<Vec<_>>();
    rows.push((
        "GPU time, median (ms)".to_owned(),
        milliseconds(percentile(&gpu, 0.5)),
    ));
    let stages = frames.iter().flat_map(|frame| frame.stages_ms.keys());
    for stage in stages.collect::<std::collections::BTreeSet<_>>() {
        let ms = frames
            .iter()
            .map(|frame| frame.stages_ms.get(stage).copied().unwrap_or(0.0))
            .collect::<Vec<_>>();
        rows.push((
            format!("{stage}, median (ms)"),
            milliseconds(percentile(&ms, 0.5)),
        ));
    }
    rows.extend([
        ("objects drawn".to_owned(), count(|frame| frame.pvs)),
        (
            "triangles drawn".to_owned(),
            work(|frame| frame.counters.triangles),
        ),
        ("groups".to_owned(), work(|frame| frame.counters.groups)),
        ("rays".to_owned(), work(|frame| frame.counters.rays)),
        (
            "ray-box tests".to_owned(),
            work(|frame| frame.counters.ray_box_tests),
        ),
        (
            "occlusion queries".to_owned(),
            work(|frame| frame.counters.queries),
        ),
        ("objects visible".to_owned(), count(|frame| frame.visible)),
        (
            "objects in the frustum".to_owned(),
            count(|frame| frame.in_frustum),
        ),
        (
            "C/N (culled / all)".to_owned(),
            share(metrics::culled_of_all(results)),
        ),
        (
            "C/R (culled / hidden)".to_owned(),
            of_hidden(metrics::culled_of_hidden(results)),
        ),
        (
            "culled / hidden, in the frustum".to_owned(),
            of_hidden(metrics::cull_rate_in_frustum(results)),
        ),
    ]);
    if let Some([wrong_pixels, false_negatives]) = results.errors() {
        let ties = results
            .per_frame
            .iter()
            .filter_map(|frame| frame.depth_ties)
            .sum::<usize>();
        rows.extend([
            (
                "wrong pixels, all frames".to_owned(),
                wrong_pixels.to_string(),
            ),
            (
                "false negatives, all frames".to_owned(),
                false_negatives.to_string(),
            ),
            (
                "depth ties, all frames (pixels)".to_owned(),
                ties.to_string(),
            ),
        ]);
    }
    if let Some(NoCulling {
        removed,
        strays,
        kept_strays,
        ..
    }) = results.no_culling
    {
        rows.extend([
            (
                "removed by hroc_keeps: strays, not finite, true (pixels)".to_owned(),
                format!(
                    "{}, {}, {}",
                    removed.stray, removed.not_finite, removed.true_
                ),
            ),
            (
                "strays without hroc_keeps, and with it (pixels)".to_owned(),
                format!("{strays}, {kept_strays}"),
            ),
        ]);
    }
    rows.retain(|(_, value)| value != ABSENT);
    rows.into_iter()
        .map(|(name, value)| [name, value])
        .collect()
}

/// Rows without a value are left out.
const ABSENT: &str = "";

fn milliseconds(value: Option<f64>) -> String {
    value.map_or(ABSENT.to_owned(), |value| format!("{value:.3}"))
}

fn number(value: Option<f64>) -> String {
    value.map_or(ABSENT.to_owned(), |value| format!("{value:.1}"))
}

fn share(value: Option<f64>) -> String {
    value.map_or(ABSENT.to_owned(), |value| format!("{:.2} %", 100.0 * value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::tests::sample;

    #[test]
    fn the_summary_holds_the_figures_of_the_steady_frames() {
        let text = markdown_summary(&sample());
        let value = |row: &str| {
            let line = text
                .lines()
                .find(|line| line.contains(row))
                .unwrap_or_else(|| panic!("{row} in {text}"));
            line.split('|').nth(2).unwrap().trim().to_owned()
        };
        assert_eq!(value("frame time, median"), "2.000");
        assert_eq!(value("99th"), "4.000");
        assert_eq!(value("C/N"), "50.00 %");
        assert_eq!(value("C/R"), "83.33 %");
        assert_eq!(value("culled / hidden, in"), "75.00 %");
        assert_eq!(value("pack, median"), "0.250");
        assert_eq!(value("depth ties"), "6");
        assert_eq!(value("removed by"), "12, 0, 0");
        assert_eq!(value("strays without"), "18, 0");
        assert!(!text.contains("| rays") && !text.contains("| ray-box"));
        assert!(text.contains("6 frames spread evenly"));
        let mut empty = sample();
        for frame in &mut empty.per_frame {
            (frame.visible, frame.cull_rate) = (Some(0), None);
        }
        let empty = markdown_summary(&empty);
        let rates = empty.lines().filter(|line| line.contains("/ hidden"));
        assert!(
            rates.clone().count() == 2 && rates.clone().all(|line| line.contains("| - ")),
            "{empty}"
        );
        assert!(text.contains("warning: the scene has no objects"));
    }
}
