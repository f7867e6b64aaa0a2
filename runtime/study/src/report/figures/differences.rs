//! Differences with their intervals, against the margin within which they do not matter.

use super::WIDTH;
use crate::report::numbers::signed_share;
use crate::report::plot::{Anchor, Axis, INK, Rect, Svg, TEXT, panel, text_width};
use crate::statistics::{Comparison, Interval, MARGIN, Verdict};

/// A line of the plot.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct Difference {
    pub label: String,
    pub found: Comparison,
}

const ROW: f64 = 20.0;
/// Differences beyond this are drawn at the edge, with their value beside.
const MOST: f64 = 3.0;

const fn color(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Equivalent => "#009E73",
        Verdict::Different => "#D55E00",
        Verdict::Undecided => "#777777",
    }
}

/// An interval for each difference, in the colour of its verdict.
pub fn differences(lines: &[Difference], what: &str) -> String {
    let label_width = lines
        .iter()
        .map(|line| text_width(&line.label, TEXT))
        .fold(60.0, f64::max)
        + 14.0;
    let rect = Rect {
        left: label_width,
        top: 12.0,
        width: WIDTH - label_width - 230.0,
        height: lines.len() as f64 * ROW + 8.0,
    };
    let mut svg = Svg::new(WIDTH, rect.bottom() + 44.0);
    let ends =
        |pick: fn(&Interval) -> f64| lines.iter().map(move |line| pick(&line.found.difference));
    let low = ends(|difference| difference.low).fold(-2.0 * MARGIN, f64::min);
    let high = ends(|difference| difference.high).fold(2.0 * MARGIN, f64::max);
    // In per cent, as the ticks are round then.
    let x = Axis::span(
        format!("{what} (%), 90 % interval; shaded: the margin"),
        100.0 * low,
        100.0 * high.min(MOST),
    );
    panel(&mut svg, rect, &x, &Axis::none(), "");
    let at = |share: f64| rect.x(x.place(100.0 * share));
    let band = Rect {
        left: at(-MARGIN),
        width: at(MARGIN) - at(-MARGIN),
        ..rect
    };
    svg.rect(band, "fill=\"#009E73\" fill-opacity=\"0.14\"");
    svg.line([at(0.0), rect.top], [at(0.0), rect.bottom()], INK, 1.0, "");
    for (line, place) in lines.iter().zip(0..) {
        let y = rect.top + 4.0 + (f64::from(place) + 0.5) * ROW;
        let found = &line.found;
        let color = color(found.verdict);
        svg.text([rect.left - 8.0, y + 4.0], TEXT, Anchor::End, &line.label);
        svg.line(
            [at(found.difference.low), y],
            [at(found.difference.high), y],
            color,
            3.0,
            "",
        );
        svg.raw(&format!(
            "<circle cx=\"{:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{color}\"/>\n",
            at(found.difference.estimate)
        ));
        let mut verdict = format!(
            "{} {}",
            signed_share(found.difference.estimate),
            found.verdict.name()
        );
        if found.difference.high > MOST {
            verdict += &format!(" (to {})", signed_share(found.difference.high));
        }
        svg.text([rect.right() + 8.0, y + 4.0], TEXT, Anchor::Start, &verdict);
    }
    svg.finish()
}
