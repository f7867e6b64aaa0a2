//! Speed against error: what a contender costs, and what it gets wrong or draws in vain.

use super::WIDTH;
use crate::compare::{CourseRuns, unique};
use crate::metrics::{self, FrameClock};
use crate::registry::METHODS;
use crate::report::numbers::number;
use crate::report::plot::{
    Anchor, Axis, Entry, Mark, Rect, Style, Svg, legend, legend_height, panel,
};
use crate::results::RunResults;

/// What is on an axis.
struct Measure {
    name: &'static str,
    of: fn(&RunResults) -> Option<f64>,
    /// All exact contenders have 0.
    tells_exact: bool,
}

impl Measure {
    const fn new(name: &'static str, of: fn(&RunResults) -> Option<f64>) -> Self {
        Self {
            name,
            of,
            tells_exact: false,
        }
    }

    const fn of_error(name: &'static str, of: fn(&RunResults) -> Option<f64>) -> Self {
        Self {
            tells_exact: true,
            ..Self::new(name, of)
        }
    }
}

/// The x axes.
const COSTS: [Measure; 4] = [
    Measure::new("frame time, median (ms)", |run| {
        Some(metrics::summary(run, FrameClock::Wall)?.median)
    }),
    Measure::new("GPU time, median (ms)", |run| {
        Some(metrics::summary(run, FrameClock::Gpu)?.median)
    }),
    Measure::new("triangles drawn per frame", |run| {
        metrics::mean_over(run, |frame| Some(frame.counters.triangles? as f64))
    }),
    Measure::new("ray-box tests per frame", |run| {
        metrics::mean_over(run, |frame| Some(frame.counters.ray_box_tests? as f64))
    }),
];

/// The y axes; less is better.
const ERRORS: [Measure; 3] = [
    Measure::of_error("wrong pixels per frame", metrics::wrong_pixels),
    Measure::of_error("false negatives per frame", metrics::false_negatives),
    Measure::new("1 - C/R (hidden and drawn)", |run| {
        Some(1.0 - metrics::culled_of_hidden(run)?)
    }),
];

/// A run with its cost and its error.
type Point<'a> = (&'a RunResults, f64, f64);

const LEFT: f64 = 66.0;
const PANEL: [f64; 2] = [WIDTH / 3.0 - LEFT - 14.0, 190.0];
const ROW: f64 = PANEL[1] + 84.0;

/// A grid of scatter plots: a row for each cost, a column for each error. `series` gives the styles their order, so
/// that they are the same in every plot. `None` where nothing was checked.
pub fn speed_error(course: &CourseRuns<'_>, series: &[String]) -> Option<String> {
    let known = |measure: &Measure| {
        let values = course.runs.iter().filter_map(|run| (measure.of)(run));
        values.count()
    };
    // A cost that one contender alone has compares nothing.
    let fewest = course.runs.len().min(2);
    let costs = COSTS.into_iter().filter(|cost| known(cost) >= fewest);
    let costs = costs.collect::<Vec<_>>();
    let errors = ERRORS.into_iter().filter(|error| known(error) > 0);
    let errors = errors.collect::<Vec<_>>();
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
    let entries = entries(course, style);
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
            scatter(&mut svg, rect, course, [cost, error], style);
        }
    }
    legend(&mut svg, [20.0, height], WIDTH - 40.0, &entries);
    Some(svg.finish())
}

/// The legend: each series, with the range of the knobs that were swept.
fn entries(course: &CourseRuns<'_>, style: impl Fn(&RunResults) -> Style) -> Vec<Entry> {
    let entry = |series: String| {
        let run = course.runs.iter().find(|run| run.series() == series)?;
        let mut label = series.clone();
        for knob in swept_knobs(course, &series) {
            let values = sweep(course, &series, &knob);
            if let (Some((first, _)), Some((last, _))) = (values.first(), values.last()) {
                label += &format!(", {knob} {first} to {last}");
            }
        }
        let mark = Mark::Point(style(run));
        Some(Entry { label, mark })
    };
    let series = unique(course.runs.iter().map(|run| run.series()));
    series.into_iter().filter_map(entry).collect()
}

fn scatter(
    svg: &mut Svg,
    rect: Rect,
    course: &CourseRuns<'_>,
    [cost, error]: [&Measure; 2],
    style: impl Fn(&RunResults) -> Style,
) {
    let point = |run: &&'_ RunResults| Some(((cost.of)(run)?, (error.of)(run)?));
    let points = course.runs.iter().filter_map(|run| {
        let (cost, error) = point(run)?;
        Some((*run, cost, error))
    });
    let points: Vec<Point<'_>> = points.collect();
    let x = Axis::fit(cost.name, points.iter().map(|point| point.1));
    // Zero is on the axis even where nobody is exact.
    let y = Axis::fit(error.name, points.iter().map(|point| point.2).chain([0.0]));
    panel(svg, rect, &x, &y, "");
    let place = |point: &Point<'_>| [rect.x(x.place(point.1)), rect.y(y.place(point.2))];
    let mark = |svg: &mut Svg, point: &Point<'_>, radius: f64| {
        let [cost_value, error_value] = [point.1, point.2].map(number);
        let (cost, error) = (cost.name, error.name);
        let tip = format!(
            "{}: {cost_value} {cost}, {error_value} {error}",
            point.0.label()
        );
        style(point.0).mark(svg, place(point), radius, &tip);
    };
    let exact = |point: &&Point<'_>| point.2 == 0.0 && point.0.is_exact();
    let exact = points.iter().filter(exact).count();
    if exact > 0 && error.tells_exact {
        let at = [rect.right(), rect.top - 6.0];
        svg.text(at, 11.0, Anchor::End, &format!("{exact} exact, at 0"));
    }
    for name in &unique(course.runs.iter().map(|run| run.series())) {
        for knob in swept_knobs(course, name) {
            let line = sweep(course, name, &knob);
            let line = line
                .iter()
                .filter_map(|(_, run)| points.iter().find(|point| std::ptr::eq(point.0, *run)));
            let line = line.collect::<Vec<_>>();
            let places = line.iter().map(|point| place(point)).collect::<Vec<_>>();
            if let Some(first) = line.first() {
                svg.polyline(&places, style(first.0).color, 1.4, "");
            }
            // They grow with the knob's value.
            let steps = line.len().max(2) as f64 - 1.0;
            for (i, point) in line
                .iter()
                .enumerate()
                .filter(|(_, point)| !point.0.knobs.is_empty())
            {
                mark(svg, point, 3.0 + 1.4 * i as f64 / steps);
            }
        }
    }
    for point in points.iter().filter(|point| point.0.knobs.is_empty()) {
        mark(svg, point, 5.0);
    }
}

/// The knobs that were turned in a series.
fn swept_knobs(course: &CourseRuns<'_>, series: &str) -> Vec<String> {
    let runs = course.runs.iter().filter(|run| run.series() == series);
    unique(runs.flat_map(|run| run.knobs.keys().cloned()))
}

/// The runs in which no other knob is turned, in the order of the knob's values; one in which none is turned stands at
/// the default, if that is known.
fn sweep<'a>(course: &CourseRuns<'a>, series: &str, knob: &str) -> Vec<(f64, &'a RunResults)> {
    let known = METHODS.iter().flat_map(|method| method.knobs);
    let default = known.into_iter().find(|known| known.name == knob);
    let default = default
        .map(|knob| knob.default)
        .filter(|value| value.is_finite());
    let value = |run: &RunResults| match run.knobs.len() {
        0 => default,
        1 => run.knobs.get(knob).copied(),
        _ => None,
    };
    let runs = course.runs.iter().filter(|run| run.series() == series);
    let mut points = runs
        .filter_map(|run| Some((value(run)?, *run)))
        .collect::<Vec<_>>();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
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
            "hroc of, late-margin 0.25 to 0.5",
            "3 exact, at 0",
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
