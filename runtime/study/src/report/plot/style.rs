//! Colours, markers and dashes that tell contenders apart, also for the colour-blind and in print.

use super::{Rect, Svg};

/// Okabe and Ito 2008, without the yellow, which is too pale for lines.
const LINES: [&str; 7] = [
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#E69F00", "#56B4E9",
];
/// The same with the yellow, for areas.
const AREAS: [&str; 8] = [
    "#56B4E9", "#E69F00", "#009E73", "#CC79A7", "#0072B2", "#F0E442", "#D55E00", "#999999",
];
const DASHES: [&str; 4] = ["", "7 3", "2 2", "9 3 2 3"];

/// A sign for a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Marker {
    Circle,
    Square,
    TriangleUp,
    Diamond,
    TriangleDown,
    Plus,
    Pentagon,
    Cross,
}

const MARKERS: [Marker; 8] = [
    Marker::Circle,
    Marker::Square,
    Marker::TriangleUp,
    Marker::Diamond,
    Marker::TriangleDown,
    Marker::Plus,
    Marker::Pentagon,
    Marker::Cross,
];

/// How a contender is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Style {
    pub color: &'static str,
    pub marker: Marker,
    /// SVG's `stroke-dasharray`; empty for a solid line.
    pub dash: &'static str,
}

impl Style {
    /// The `index`th of a plot. The first 56 differ in colour and marker together, the first 28 in colour and dash.
    pub const fn of(index: usize) -> Self {
        Self {
            color: LINES[index % LINES.len()],
            marker: MARKERS[index % MARKERS.len()],
            dash: DASHES[index / LINES.len() % DASHES.len()],
        }
    }

    /// Draws the marker; `tip` is shown to a pointer that rests on it.
    pub fn mark(&self, svg: &mut Svg, at: [f64; 2], radius: f64, tip: &str) {
        let points = |corners: &[[f64; 2]]| {
            let corner =
                |[x, y]: &[f64; 2]| format!("{:.1},{:.1}", at[0] + radius * x, at[1] + radius * y);
            corners.iter().map(corner).collect::<Vec<_>>().join(" ")
        };
        let polygon = |corners: &[[f64; 2]]| format!("<polygon points=\"{}\"", points(corners));
        // A bar of a third of the width, twice; turned by 45 degrees for the cross.
        const T: f64 = 0.36;
        const PLUS: [[f64; 2]; 12] = [
            [-T, -1.1],
            [T, -1.1],
            [T, -T],
            [1.1, -T],
            [1.1, T],
            [T, T],
            [T, 1.1],
            [-T, 1.1],
            [-T, T],
            [-1.1, T],
            [-1.1, -T],
            [-T, -T],
        ];
        let shape = match self.marker {
            Marker::Circle => format!(
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\"",
                at[0], at[1]
            ),
            Marker::Square => polygon(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]]),
            Marker::TriangleUp => polygon(&[[0.0, -1.2], [1.1, 0.8], [-1.1, 0.8]]),
            Marker::TriangleDown => polygon(&[[0.0, 1.2], [1.1, -0.8], [-1.1, -0.8]]),
            Marker::Diamond => polygon(&[[0.0, -1.25], [1.25, 0.0], [0.0, 1.25], [-1.25, 0.0]]),
            Marker::Pentagon => {
                let corner = |i: u32| (f64::from(i) * std::f64::consts::TAU / 5.0).sin_cos();
                polygon(
                    &[0, 1, 2, 3, 4]
                        .map(corner)
                        .map(|(sin, cos)| [1.15 * sin, -1.15 * cos]),
                )
            }
            Marker::Plus => polygon(&PLUS),
            Marker::Cross => {
                let half = std::f64::consts::FRAC_1_SQRT_2;
                polygon(&PLUS.map(|[x, y]| [half * (x - y), half * (x + y)]))
            }
        };
        let tip = if tip.is_empty() {
            String::new()
        } else {
            format!("<title>{}</title>", super::escape(tip))
        };
        let color = self.color;
        svg.raw(&format!(
            "{shape} fill=\"{color}\" stroke=\"#fff\" stroke-width=\"0.8\">{tip}</{}>\n",
            match self.marker {
                Marker::Circle => "circle",
                _ => "polygon",
            }
        ));
    }
}

/// How a part of a bar is drawn: by colour, and by hatching where colours run out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fill(usize);

impl Fill {
    /// The `index`th of a plot. The first 24 differ.
    pub const fn of(index: usize) -> Self {
        Self(index)
    }

    /// Fills `rect`.
    pub fn draw(&self, svg: &mut Svg, rect: Rect, tip: &str) {
        let color = AREAS[self.0 % AREAS.len()];
        let tip = super::escape(tip);
        svg.raw(&format!("<g><title>{tip}</title>\n"));
        svg.rect(
            rect,
            &format!("fill=\"{color}\" stroke=\"#fff\" stroke-width=\"0.6\""),
        );
        // Strokes every 6 pixels, cut at the edges.
        let hatch = self.0 / AREAS.len() % 3;
        let mut at = 3.0;
        while hatch > 0 && at < rect.width {
            let x = rect.left + at;
            let lean = if hatch == 1 {
                0.0
            } else {
                f64::min(4.0, rect.right() - x)
            };
            svg.line([x, rect.bottom()], [x + lean, rect.top], "#222", 1.0, "");
            at += 6.0;
        }
        svg.raw("</g>\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contenders_can_be_told_apart() {
        let styles = (0..28).map(Style::of).collect::<Vec<_>>();
        for (i, style) in styles.iter().enumerate() {
            for other in &styles[..i] {
                assert_ne!((style.color, style.marker), (other.color, other.marker));
                assert_ne!((style.color, style.dash), (other.color, other.dash));
            }
        }
    }
}
