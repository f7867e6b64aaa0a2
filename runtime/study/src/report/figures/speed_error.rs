//! Speed against error: what a contender costs, and what it gets wrong or draws in vain.

use super::WIDTH;
use crate::compare::CourseRuns;
use crate::metrics::{self, FrameClock};
use crate::report::numbers::number;
use crate::report::plot::{
    Anchor, Axis, Entry, Mark, Rect, Style, Svg, legend, legend_height, panel,
};
use crate::results::RunResults;

type Measure = (&'static str, fn(&RunResults) -> Option<f64>);

/// What is on the x axes.
const COSTS: [Measure; 4] = [
    ("frame time, median (ms)", |run| {
        Some(metrics::summary(run, FrameClock::Wall)?.median)
    }),
    ("GPU time, median (ms)", |run| {
        Some(metrics::summary(run, FrameClock::Gpu)?.median)
    }),
    ("triangles drawn per frame", |run| {
        metrics::mean_over(run, |frame| Some(frame.counters.triangles? as f64))
    }),
    ("ray-box tests per frame", |run| {
        metrics::mean_over(run, |frame| Some(frame.counters.ray_box_tests? as f64))
    }),
];

/// What is on the y axes; less is better.
const ERRORS: [Measure; 3] = [
    ("wrong pixels per frame", metrics::wrong_pixels),
    ("false negatives per frame", metrics::false_negatives),
    ("1 - C/R (hidden and drawn)", |run| {
        Some(1.0 - metrics::culled_of_hidden(run)?)
    }),
];

const LEFT: f64 = 66.0;
const PANEL: [f64; 2] = [WIDTH / 3.0 - LEFT - 14.0, 190.0];
const ROW: f64 = PANEL[1] + 84.0;

/// A grid of scatter plots: a row for each cost, a column for each error. `series` gives the styles their order, so
/// that they are the same in every plot. `None` where nothing was checked.
pub fn speed_error(course: &CourseRuns<'_>, series: &[String]) -> Option<String> {
    let known = |&(_, measure): &Measure| course.runs.iter().any(|run| measure(run).is_some());
    let costs = COSTS.into_iter().filter(known).collect::<Vec<_>>();
    let errors = ERRORS.into_iter().filter(known).collect::<Vec<_>>();
    if costs.is_empty() || errors.is_empty() {
        return None;
    }
    let style = |run: &RunResults| {
        Style::of(
            series
                .iter()
                .position(|name| *name == run.series())
                .unwrap_or(0),
        )
    };
    let mut entries: Vec<Entry> = Vec::new();
    for run in &course.runs {
        let label = run.series();
        if entries.iter().all(|entry| entry.label != label) {
            entries.push(Entry {
                label,
                mark: Mark::Point(style(run)),
            });
        }
    }
    let height = ROW * costs.len() as f64;
    let mut svg = Svg::new(WIDTH, height + legend_height(&entries, WIDTH - 40.0));
    for (row, cost) in costs.iter().enumerate() {
        for (column, error) in errors.iter().enumerate() {
            let rect = Rect {
                left: LEFT + column as f64 * (WIDTH / 3.0),
                top: 24.0 + row as f64 * ROW,
                width: PANEL[0],
                height: PANEL[1],
            };
            scatter(&mut svg, rect, course, cost, error, style);
        }
    }
    legend(&mut svg, [20.0, height], WIDTH - 40.0, &entries);
    Some(svg.finish())
}

fn scatter(
    svg: &mut Svg,
    rect: Rect,
    course: &CourseRuns<'_>,
    cost: &Measure,
    error: &Measure,
    style: impl Fn(&RunResults) -> Style,
) {
    let points = course
        .runs
        .iter()
        .filter_map(|&run| Some((run, cost.1(run)?, error.1(run)?)));
    let points = points.collect::<Vec<_>>();
    let x = Axis::fit(cost.0, points.iter().map(|point| point.1));
    // Zero is on the axis even where nobody is exact.
    let y = Axis::fit(error.0, points.iter().map(|point| point.2).chain([0.0]));
    panel(svg, rect, &x, &y, "");
    let place = |(_, cost, error): &(&RunResults, f64, f64)| {
        [rect.x(x.place(*cost)), rect.y(y.place(*error))]
    };
    let exact = points
        .iter()
        .filter(|point| point.2 == 0.0 && point.0.is_exact())
        .count();
    if exact > 0 {
        let text = if exact == 1 {
            "exact".to_owned()
        } else {
            format!("{exact} exact")
        };
        svg.text(
            [rect.right() - 5.0, rect.y(y.place(0.0)) - 8.0],
            11.0,
            Anchor::End,
            &text,
        );
    }
    // The settings of a sweep, in the order of the knob's values, through the point where it is not turned.
    for line in sweeps(&points) {
        let style = style(line.points[0].0);
        let places = line.points.iter().map(place).collect::<Vec<_>>();
        svg.polyline(&places, style.color, 1.4, "");
        for (end, value) in [
            (places[0], line.first),
            (places[places.len() - 1], line.last),
        ] {
            svg.text([end[0] + 7.0, end[1] - 6.0], 10.0, Anchor::Start, &value);
        }
    }
    for point in &points {
        let &(run, cost_value, error_value) = point;
        let radius = if run.knobs.is_empty() { 5.0 } else { 3.2 };
        let tip = format!(
            "{}: {} {}, {} {}",
            run.label(),
            number(cost_value),
            cost.0,
            number(error_value),
            error.0
        );
        style(run).mark(svg, place(point), radius, &tip);
    }
}

struct Sweep<'a> {
    points: Vec<(&'a RunResults, f64, f64)>,
    first: String,
    last: String,
}

/// The points of each series and knob.
fn sweeps<'a>(points: &[(&'a RunResults, f64, f64)]) -> Vec<Sweep<'a>> {
    let mut sweeps = Vec::new();
    let turned = points
        .iter()
        .filter_map(|point| Some((point.0.series(), point.0.knobs.keys().next()?)));
    let mut names = turned.collect::<Vec<_>>();
    names.dedup();
    for (series, knob) in names {
        let default = crate::registry::METHODS
            .iter()
            .flat_map(|method| method.knobs);
        let default = default
            .into_iter()
            .find(|known| known.name == knob)
            .map(|known| known.default);
        let of_series = points.iter().filter(|point| point.0.series() == series);
        let mut line = of_series
            .filter_map(|point| {
                let value = match point.0.knobs.get(knob) {
                    Some(value) => *value,
                    None if point.0.knobs.is_empty() => {
                        default.filter(|value| value.is_finite())?
                    }
                    None => return None,
                };
                Some((value, *point))
            })
            .collect::<Vec<_>>();
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (Some(first), Some(last)) = (line.first(), line.last()) else {
            continue;
        };
        let name = |value: f64| format!("{knob}={value}");
        sweeps.push(Sweep {
            first: name(first.0),
            last: last.0.to_string(),
            points: line.into_iter().map(|(_, point)| point).collect(),
        });
    }
    sweeps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::tests::two_scenes;

    #[test]
    fn every_contender_and_every_measure_is_drawn() {
        let comparison = two_scenes();
        let course = &comparison.courses()[0];
        let svg = speed_error(course, &comparison.series()).unwrap();
        for text in [
            "noc",
            "hroc of adaptive",
            "late-margin=0.25",
            "2 exact",
            "wrong pixels",
            "frame time",
        ] {
            assert!(svg.contains(text), "{text} in {svg}");
        }
        let mut unchecked = comparison.clone();
        for frame in unchecked.runs.iter_mut().flat_map(|run| &mut run.per_frame) {
            (frame.wrong_pixels, frame.visible) = (None, None);
        }
        assert_eq!(speed_error(&unchecked.courses()[0], &[]), None);
    }
}
