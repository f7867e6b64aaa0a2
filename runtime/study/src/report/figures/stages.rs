//! What each stage costs.

use hroc_runtime::Stage;

use super::WIDTH;
use crate::compare::unique;
use crate::metrics::mean_over;
use crate::report::numbers::number;
use crate::report::plot::{
    Anchor, Axis, Entry, Fill, Mark, Rect, Svg, TEXT, legend, legend_height, panel, text_width,
};
use crate::results::RunResults;

const BAR: f64 = 18.0;
const GAP: f64 = 8.0;

/// A bar for each of `runs`, of its stages' mean times. `None` where no stage was timed.
pub fn stages(runs: &[&RunResults]) -> Option<String> {
    let names = names(runs);
    let mean = |run: &RunResults, name: &str| {
        mean_over(run, |frame| {
            Some(frame.stages_ms.get(name).copied().unwrap_or(0.0))
        })
        .unwrap_or(0.0)
    };
    let total = |run: &RunResults| names.iter().map(|name| mean(run, name)).sum::<f64>();
    let runs = runs
        .iter()
        .filter(|run| total(run) > 0.0)
        .collect::<Vec<_>>();
    let most = runs.iter().map(|run| total(run)).fold(0.0, f64::max);
    if runs.is_empty() {
        return None;
    }
    let entries = names.iter().zip(0..).map(|(name, i)| Entry {
        label: (*name).to_owned(),
        mark: Mark::Area(Fill::of(i)),
    });
    let entries = entries.collect::<Vec<_>>();
    let label_width = runs
        .iter()
        .map(|run| text_width(&run.label(), TEXT))
        .fold(60.0, f64::max)
        + 14.0;
    let rect = Rect {
        left: label_width,
        top: 12.0,
        width: WIDTH - label_width - 20.0,
        height: runs.len() as f64 * (BAR + GAP) + GAP,
    };
    let bottom = rect.bottom() + 48.0;
    let mut svg = Svg::new(WIDTH, bottom + legend_height(&entries, WIDTH - 40.0));
    // Room for the sum behind the longest bar.
    let x = Axis::span("mean time of the stages per frame (ms)", 0.0, 1.08 * most);
    panel(&mut svg, rect, &x, &Axis::none(), "");
    for (run, place) in runs.iter().zip(0..) {
        let top = rect.top + GAP + f64::from(place) * (BAR + GAP);
        let mut left = rect.x(x.place(0.0));
        for (i, name) in names.iter().enumerate() {
            let ms = mean(run, name);
            let width = rect.x(x.place(ms)) - rect.x(x.place(0.0));
            if width > 0.05 {
                let part = Rect {
                    left,
                    top,
                    width,
                    height: BAR,
                };
                Fill::of(i).draw(
                    &mut svg,
                    part,
                    &format!("{}, {name}: {} ms", run.label(), number(ms)),
                );
            }
            left += width;
        }
        svg.text(
            [rect.left - 8.0, top + 13.0],
            TEXT,
            Anchor::End,
            &run.label(),
        );
        svg.text(
            [left + 5.0, top + 13.0],
            TEXT,
            Anchor::Start,
            &number(total(run)),
        );
    }
    legend(&mut svg, [20.0, bottom], WIDTH - 40.0, &entries);
    Some(svg.finish())
}

/// The stages in the order of a frame; a method's own ones between the first draw and the last ones.
fn names<'a>(runs: &[&'a RunResults]) -> Vec<&'a str> {
    const FIRST: [Stage; 6] = [
        Stage::PACK,
        Stage::DRAW_ALL,
        Stage::OCCLUSION_MAP,
        Stage::FILTER_OCCLUDERS,
        Stage::EXTRACT_GROUPS,
        Stage::BATCH_OCCLUSION_TEST,
    ];
    const LAST: [Stage; 2] = [Stage::RENDER_OCCLUDEES, Stage::RENDER_BLENDED];
    let frames = runs.iter().flat_map(|run| &run.per_frame);
    let mut names = unique(
        frames
            .flat_map(|frame| frame.stages_ms.keys())
            .map(String::as_str),
    );
    let place = |stages: &[Stage], name: &str| stages.iter().position(|stage| stage.name() == name);
    // Stable: the rest keep the order in which contenders bring them.
    names.sort_by_key(|name| match (place(&FIRST, name), place(&LAST, name)) {
        (Some(place), _) => place,
        (None, None) => FIRST.len(),
        (None, Some(place)) => FIRST.len() + 1 + place,
    });
    names
}

#[cfg(test)]
mod tests {
    use crate::compare::tests::two_scenes;

    #[test]
    fn a_bar_for_each_run() {
        let comparison = two_scenes();
        let course = &comparison.courses()[0];
        let svg = super::stages(&course.runs).unwrap();
        assert_eq!(svg.matches("pack: 0.250 ms").count(), 3);
        assert_eq!(super::stages(&[]), None);
    }
}
