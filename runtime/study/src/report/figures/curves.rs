//! Frame times over a path.

use super::WIDTH;
use crate::report::plot::{
    Anchor, Axis, Entry, Mark, Rect, Style, Svg, legend, legend_height, panel,
};
use crate::results::{RunResults, WARM_UP_FRAMES};

const RECT: Rect = Rect {
    left: 66.0,
    top: 30.0,
    width: WIDTH - 86.0,
    height: 300.0,
};

/// A line for each run of `runs` by the host's clock; `series` gives the styles their order. `None` where nothing was
/// timed.
pub fn curves(runs: &[&RunResults], series: &[String]) -> Option<String> {
    let runs = runs
        .iter()
        .filter(|run| run.repeats > 0 && run.per_frame.len() > 1);
    let runs = runs.collect::<Vec<_>>();
    let frames = runs.iter().map(|run| run.per_frame.len()).max()?;
    let style = |run: &RunResults| {
        Style::of(
            series
                .iter()
                .position(|name| *name == run.series())
                .unwrap_or(0),
        )
    };
    let entries = runs.iter().map(|run| Entry {
        label: run.label(),
        mark: Mark::Line(style(run)),
    });
    let entries = entries.collect::<Vec<_>>();
    let bottom = RECT.bottom() + 48.0;
    let mut svg = Svg::new(WIDTH, bottom + legend_height(&entries, WIDTH - 40.0));
    let x = Axis::span("frame of the path", 0.0, (frames - 1) as f64);
    let y = Axis::fit(
        "frame time (ms)",
        runs.iter()
            .flat_map(|run| &run.per_frame)
            .map(|frame| frame.frame_ms),
    );
    panel(&mut svg, RECT, &x, &y, "");
    if frames > WARM_UP_FRAMES {
        let right = RECT.x(x.place(WARM_UP_FRAMES as f64 - 0.5));
        let band = Rect {
            width: right - RECT.left,
            ..RECT
        };
        svg.rect(band, "fill=\"#000\" fill-opacity=\"0.06\"");
        svg.text(
            [RECT.left, RECT.top - 8.0],
            11.0,
            Anchor::Start,
            "warm-up, left out of averages",
        );
    }
    for (place, run) in runs.iter().enumerate() {
        let style = style(run);
        let points = run.per_frame.iter().zip(0..).map(|(frame, number)| {
            [
                RECT.x(x.place(f64::from(number))),
                RECT.y(y.place(frame.frame_ms)),
            ]
        });
        let points = points.collect::<Vec<_>>();
        svg.polyline(&points, style.color, 1.5, style.dash);
        // A few markers, at other frames for each line.
        let every = (frames / 6).max(2);
        for point in points.iter().skip(place * 3 % every).step_by(every) {
            style.mark(&mut svg, *point, 3.6, &run.label());
        }
    }
    legend(&mut svg, [20.0, bottom], WIDTH - 40.0, &entries);
    Some(svg.finish())
}
