//! SVG by hand: small files whose legends stand beside the data and never on it.

mod axis;
mod legend;
mod style;
mod svg;

pub use axis::{Axis, Scale};
pub use legend::{Entry, Mark, legend, legend_height};
pub use style::{Fill, Marker, Style};
pub use svg::{Anchor, Rect, Svg, escape, text_width};

/// Size of ordinary text, pixels.
pub const TEXT: f64 = 12.0;
/// Ink of axes and text.
pub const INK: &str = "#222";
const GRID: &str = "#ddd";

/// Draws frame, grid and labels of a plot in `rect`, which is the data's.
pub fn panel(svg: &mut Svg, rect: Rect, x: &Axis, y: &Axis, title: &str) {
    svg.rect(rect, "fill=\"#fff\"");
    if let Some(zero) = y.break_at() {
        // What is below the first decade is zero.
        let top = rect.y(zero);
        let band = Rect {
            top,
            height: rect.bottom() - top,
            ..rect
        };
        svg.rect(band, "fill=\"#f1f4f7\"");
    }
    let mut free_from = f64::NEG_INFINITY;
    for (place, label) in x.ticks() {
        let at = rect.x(place);
        svg.line([at, rect.top], [at, rect.bottom()], GRID, 1.0, "");
        // A label that would run into the last one is left out; its line stays.
        let half = 0.5 * text_width(&label, TEXT);
        if at - half > free_from {
            svg.text([at, rect.bottom() + 16.0], TEXT, Anchor::Middle, &label);
            free_from = at + half + 2.0;
        }
    }
    for (place, label) in y.ticks() {
        let at = rect.y(place);
        svg.line([rect.left, at], [rect.right(), at], GRID, 1.0, "");
        svg.text([rect.left - 6.0, at + 4.0], TEXT, Anchor::End, &label);
    }
    svg.rect(
        rect,
        &format!("fill=\"none\" stroke=\"{INK}\" stroke-width=\"1\""),
    );
    let middle = rect.left + 0.5 * rect.width;
    svg.text(
        [middle, rect.bottom() + 34.0],
        TEXT,
        Anchor::Middle,
        &x.label,
    );
    svg.rotated(
        [rect.left - 50.0, rect.top + 0.5 * rect.height],
        TEXT,
        &y.label,
    );
    if !title.is_empty() {
        svg.bold([rect.left, rect.top - 8.0], TEXT, title);
    }
}
