//! The elements of a drawing.

use std::fmt::Write;

use super::INK;

/// Where text begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// At its place.
    Start,
    /// Half before it.
    Middle,
    /// It ends there.
    End,
}

/// A rectangle, pixels, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Rect {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Rect {
    /// The x of a share of its width.
    pub fn x(&self, share: f64) -> f64 {
        self.left + share * self.width
    }

    /// The y of a share of its height, from the bottom.
    pub fn y(&self, share: f64) -> f64 {
        self.bottom() - share * self.height
    }

    /// Right edge.
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    /// Lower edge.
    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }
}

/// A drawing.
#[derive(Clone, Debug)]
pub struct Svg {
    width: f64,
    height: f64,
    body: String,
}

impl Svg {
    /// An empty one, pixels.
    pub const fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            body: String::new(),
        }
    }

    /// The whole file. It may stand in a page as it is.
    pub fn finish(self) -> String {
        let Self {
            width,
            height,
            body,
        } = self;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"{0}\" height=\"{1}\" \
             font-family=\"sans-serif\" fill=\"{INK}\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{body}</svg>\n",
            length(width),
            length(height)
        )
    }

    /// Elements as they are.
    pub fn raw(&mut self, elements: &str) {
        self.body.push_str(elements);
    }

    /// A line; `more`: further attributes.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], color: &str, width: f64, more: &str) {
        let [x1, y1, x2, y2] = [from[0], from[1], to[0], to[1]].map(length);
        let _ = writeln!(
            self.body,
            "<path d=\"M{x1} {y1}L{x2} {y2}\" stroke=\"{color}\" stroke-width=\"{width}\" {more}/>"
        );
    }

    /// Lines from point to point.
    pub fn polyline(&mut self, points: &[[f64; 2]], color: &str, width: f64, dash: &str) {
        let points = points.iter().map(|point| point.map(length).join(","));
        let points = points.collect::<Vec<_>>().join(" ");
        let dash = if dash.is_empty() {
            String::new()
        } else {
            format!(" stroke-dasharray=\"{dash}\"")
        };
        let _ = writeln!(
            self.body,
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" \
             stroke-linejoin=\"round\"{dash}/>"
        );
    }

    /// A rectangle with the attributes `paint`.
    pub fn rect(&mut self, rect: Rect, paint: &str) {
        let [x, y, width, height] = [rect.left, rect.top, rect.width, rect.height].map(length);
        let _ = writeln!(
            self.body,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" {paint}/>"
        );
    }

    /// Text of `size` pixels.
    pub fn text(&mut self, at: [f64; 2], size: f64, anchor: Anchor, text: &str) {
        self.write(at, size, anchor, text, "");
    }

    /// Bold text.
    pub fn bold(&mut self, at: [f64; 2], size: f64, text: &str) {
        self.write(at, size, Anchor::Start, text, " font-weight=\"bold\"");
    }

    /// Text that reads upward, centred.
    pub fn rotated(&mut self, at: [f64; 2], size: f64, text: &str) {
        let [x, y] = at.map(length);
        let more = format!(" transform=\"rotate(-90 {x} {y})\"");
        self.write(at, size, Anchor::Middle, text, &more);
    }

    fn write(&mut self, at: [f64; 2], size: f64, anchor: Anchor, text: &str, more: &str) {
        let [x, y] = at.map(length);
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\"{anchor}{more}>{}</text>",
            escape(text)
        );
    }
}

/// One decimal is a tenth of a pixel. What is no number goes to the edge rather than into the file.
fn length(value: f64) -> String {
    let value = if value.is_finite() { value } else { 0.0 };
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// Text as it may stand in SVG and HTML, between elements and in attributes.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // Not allowed in XML, whatever the escape.
            c if c.is_control() && c != '\n' && c != '\t' => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Width of text, pixels: an upper estimate for the fonts that browsers take as sans-serif.
pub fn text_width(text: &str, size: f64) -> f64 {
    0.62 * size * text.chars().count() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_escaped_and_finite() {
        let mut svg = Svg::new(10.0, 20.5);
        svg.text([f64::NAN, 1.25], 12.0, Anchor::End, "a<b & \"c\"\u{1}");
        svg.polyline(&[[0.0, 1.0], [f64::INFINITY, 2.0]], "#000", 1.0, "");
        let text = svg.finish();
        assert!(text.contains("a&lt;b &amp; &quot;c&quot;\u{fffd}"));
        assert!(
            text.contains("viewBox=\"0 0 10 20.5\"")
                && !text.contains("NaN")
                && !text.contains("inf")
        );
    }
}
