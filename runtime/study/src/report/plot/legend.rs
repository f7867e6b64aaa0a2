//! Legends: under the plots, in columns.

use super::{Anchor, Fill, Rect, Style, Svg, TEXT, text_width};

/// What an entry shows.
#[derive(Clone, Copy, Debug)]
pub enum Mark {
    /// A marker.
    Point(Style),
    /// A line with a marker.
    Line(Style),
    /// A box.
    Area(Fill),
}

/// An entry.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct Entry {
    pub label: String,
    pub mark: Mark,
}

const ROW: f64 = 20.0;
/// Room for the mark and the gap to the next column.
const BESIDE: f64 = 58.0;

fn columns(entries: &[Entry], width: f64) -> usize {
    let widest = entries.iter().map(|entry| text_width(&entry.label, TEXT));
    let column = widest.fold(0.0, f64::max) + BESIDE;
    ((width / column) as usize).clamp(1, entries.len().max(1))
}

/// Height of [`legend`], pixels.
pub fn legend_height(entries: &[Entry], width: f64) -> f64 {
    ROW * entries.len().div_ceil(columns(entries, width)) as f64 + 8.0
}

/// Draws a legend of `width` pixels, read column by column.
pub fn legend(svg: &mut Svg, at: [f64; 2], width: f64, entries: &[Entry]) {
    let columns = columns(entries, width);
    let rows = entries.len().div_ceil(columns);
    for (i, entry) in entries.iter().enumerate() {
        let x = at[0] + (i / rows) as f64 * width / columns as f64;
        let y = at[1] + ROW * (i % rows) as f64 + 10.0;
        match entry.mark {
            Mark::Point(style) => style.mark(svg, [x + 16.0, y], 5.0, ""),
            Mark::Line(style) => {
                svg.polyline(&[[x, y], [x + 32.0, y]], style.color, 2.0, style.dash);
                style.mark(svg, [x + 16.0, y], 4.0, "");
            }
            Mark::Area(fill) => {
                let rect = Rect {
                    left: x + 4.0,
                    top: y - 7.0,
                    width: 26.0,
                    height: 14.0,
                };
                fill.draw(svg, rect, &entry.label);
            }
        }
        svg.text([x + 40.0, y + 4.0], TEXT, Anchor::Start, &entry.label);
    }
}
