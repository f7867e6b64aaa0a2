//! Frame times over a path.

use super::WIDTH;
use crate::report::plot::{
    Anchor, Axis, Entry, Mark, Rect, Style, Svg, legend, legend_height, panel,
};
use crate::results::{RunResults, WARM_UP_FRAMES};
use crate::sampling::Sampling;

const RECT: Rect = Rect {
    left: 66.0,
    top: 30.0,
    width: WIDTH - 86.0,
    height: 300.0,
};
/// More borders of windows than this would hide the data.
const MOST_BORDERS: usize = 60;

/// Frame times by the host's clock of each run of `runs`, in the order of the frames; `series` gives the styles their
/// order. A line joins the frames of a window, or frames that are spread over the path with one history. Frames after
/// cuts have points alone. `None` where nothing was timed.
pub fn curves(runs: &[&RunResults], series: &[String]) -> Option<String> {
    let runs = runs
        .iter()
        .filter(|run| run.repeats > 0 && run.per_frame.len() > 1);
    let runs = runs.collect::<Vec<_>>();
    let longest = *runs.iter().max_by_key(|run| run.per_frame.len())?;
    let frames = longest.per_frame.len();
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
        mark: match run.sampling {
            Sampling::Cuts { .. } => Mark::Point(style(run)),
            Sampling::Spread | Sampling::Windows { .. } => Mark::Line(style(run)),
        },
    });
    let entries = entries.collect::<Vec<_>>();
    let bottom = RECT.bottom() + 48.0;
    let mut svg = Svg::new(WIDTH, bottom + legend_height(&entries, WIDTH - 40.0));
    let x = Axis::span(axis_label(&longest.sampling), 0.0, (frames - 1) as f64);
    let y = Axis::fit(
        "frame time (ms)",
        runs.iter()
            .flat_map(|run| &run.per_frame)
            .map(|frame| frame.frame_ms),
    );
    panel(&mut svg, RECT, &x, &y, "");
    if longest.sampling == Sampling::Spread && frames > WARM_UP_FRAMES {
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
    borders(&mut svg, &x, longest);
    for (place, run) in runs.iter().enumerate() {
        let style = style(run);
        let point = |number: usize| {
            let ms = run.per_frame[number].frame_ms;
            [RECT.x(x.place(number as f64)), RECT.y(y.place(ms))]
        };
        let cuts = matches!(run.sampling, Sampling::Cuts { .. });
        let mut first = 0;
        for window in run.per_frame.chunk_by(|a, b| a.window == b.window) {
            let numbers = first..first + window.len();
            first = numbers.end;
            let points = numbers.map(point).collect::<Vec<_>>();
            if !cuts && points.len() > 1 {
                svg.polyline(&points, style.color, 1.5, style.dash);
            }
            if !cuts && points.len() == 1 {
                style.mark(&mut svg, points[0], 2.4, &run.label());
            }
        }
        let (radius, every) = if cuts {
            (2.4, 1)
        } else {
            // A few markers, at other frames for each line.
            (3.6, (frames / 6).max(2))
        };
        for number in (0..run.per_frame.len())
            .skip(place * 3 % every)
            .step_by(every)
        {
            style.mark(&mut svg, point(number), radius, &run.label());
        }
    }
    legend(&mut svg, [20.0, bottom], WIDTH - 40.0, &entries);
    Some(svg.finish())
}

fn axis_label(sampling: &Sampling) -> String {
    match sampling {
        Sampling::Spread => "frame, spread evenly over the path".to_owned(),
        Sampling::Windows { fps, .. } => {
            format!(
                "frame; the frames of a window are 1/{fps} s apart, windows begin at vertical lines"
            )
        }
        Sampling::Cuts { .. } => "frame, each after a camera cut".to_owned(),
    }
}

/// A vertical line where a window begins.
fn borders(svg: &mut Svg, x: &Axis, run: &RunResults) {
    let frames = run.per_frame.windows(2).zip(1u32..);
    let starts = frames.filter(|(pair, _)| pair[0].window != pair[1].window);
    let starts = starts.map(|(_, number)| number).collect::<Vec<_>>();
    for number in starts.iter().filter(|_| starts.len() <= MOST_BORDERS) {
        let at = RECT.x(x.place(f64::from(*number) - 0.5));
        svg.line(
            [at, RECT.top],
            [at, RECT.bottom()],
            "#888",
            1.0,
            "stroke-dasharray=\"3 3\"",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::tests::sample;

    #[test]
    fn lines_end_at_the_borders_of_windows() {
        let mut run = sample();
        let draw = |run: &RunResults| {
            let svg = curves(&[run], &[run.series()]).unwrap();
            let lines = svg.matches("<polyline").count();
            (svg, lines)
        };
        let (svg, spread) = draw(&run);
        assert!(svg.contains("warm-up") && svg.contains("spread evenly"));
        run.sampling = Sampling::Windows {
            fps: 60.0,
            windows: 2,
            frames_per_window: 3,
            fill_frames: 2,
        };
        for (frame, number) in run.per_frame.iter_mut().zip(0..) {
            frame.window = Some(number / 3);
        }
        let (svg, windows) = draw(&run);
        assert_eq!(windows, spread + 1, "one line more for one window more");
        assert!(!svg.contains("warm-up") && svg.contains("1/60 s apart"));
        assert_eq!(svg.matches("stroke-dasharray=\"3 3\"").count(), 1);
        run.sampling = Sampling::Cuts {
            fps: 60.0,
            fill_frames: 2,
        };
        for frame in &mut run.per_frame {
            frame.window = None;
        }
        assert_eq!(draw(&run).1, 0, "no line at all");
    }
}
