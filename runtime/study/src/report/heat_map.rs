//! Overdraw as pictures, from blue to red.

use crate::report::numbers::short;
use crate::report::plot::{Anchor, Rect, Svg, TEXT};
use crate::results::Overdraw;
use crate::run::overdraw::decode;

/// ColorBrewer's RdYlBu from its blue end: it tells values apart for the colour-blind too.
const COLORS: [[u8; 3]; 11] = [
    [49, 54, 149],
    [69, 117, 180],
    [116, 173, 209],
    [171, 217, 233],
    [224, 243, 248],
    [255, 255, 191],
    [254, 224, 144],
    [253, 174, 97],
    [244, 109, 67],
    [215, 48, 39],
    [165, 0, 38],
];
const NOTHING: [u8; 3] = [236, 236, 236];
/// Entries of a picture's palette, the last one for cells without fragments.
const STEPS: usize = 255;

/// The scale of all pictures that are to be compared: logarithmic, from one fragment per pixel to the most.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeatScale {
    most: f32,
}

impl HeatScale {
    /// The scale for these maps.
    pub(super) fn of<'a>(maps: impl Iterator<Item = &'a Overdraw>) -> Self {
        let values = maps.filter_map(|map| decode(map).ok()).flatten();
        Self {
            most: values.fold(2.0, f32::max),
        }
    }

    fn step(&self, value: f32) -> usize {
        if value <= 0.0 {
            return STEPS;
        }
        // Less than one fragment per pixel: a cell that is partly empty.
        let share = value.max(1.0).ln() / self.most.ln();
        ((share * (STEPS - 1) as f32).round() as usize).min(STEPS - 1)
    }

    /// The picture of `map`: a PNG.
    ///
    /// # Errors
    /// What is wrong with the map.
    pub(super) fn picture(&self, map: &Overdraw) -> Result<Vec<u8>, String> {
        let indices = decode(map)?.into_iter().map(|value| self.step(value) as u8);
        let palette = (0..STEPS).map(|step| color(step as f32 / (STEPS - 1) as f32));
        let palette = palette.chain([NOTHING]).flatten().collect::<Vec<_>>();
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, map.map_size[0], map.map_size[1]);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_palette(palette);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header().map_err(|error| error.to_string())?;
        writer
            .write_image_data(&indices.collect::<Vec<_>>())
            .map_err(|error| error.to_string())?;
        writer.finish().map_err(|error| error.to_string())?;
        Ok(file)
    }

    /// The scale with numbers, as SVG.
    pub(super) fn legend(&self) -> String {
        let mut svg = Svg::new(560.0, 52.0);
        let bar = Rect {
            left: 96.0,
            top: 8.0,
            width: 440.0,
            height: 14.0,
        };
        let steps = 110;
        for step in 0..steps {
            let [r, g, b] = color(step as f32 / (steps - 1) as f32);
            let width = bar.width / f64::from(steps);
            // Half a pixel more, so that no seams show.
            let part = Rect {
                left: bar.left + f64::from(step) * width,
                width: width + 0.5,
                ..bar
            };
            svg.rect(part, &format!("fill=\"#{r:02x}{g:02x}{b:02x}\""));
        }
        let [r, g, b] = NOTHING;
        let nothing = Rect {
            left: 40.0,
            width: 26.0,
            ..bar
        };
        svg.rect(
            nothing,
            &format!("fill=\"#{r:02x}{g:02x}{b:02x}\" stroke=\"#999\""),
        );
        svg.text([53.0, 38.0], TEXT, Anchor::Middle, "none");
        let step = if self.most > 300.0 { 4.0 } else { 2.0 };
        let powers = (0..).map(|power| f32::powi(step, power));
        // The last one has room for itself.
        let powers = powers.take_while(|value| *value < 0.8 * self.most);
        for value in powers.chain([self.most]) {
            let at = bar.left + bar.width * f64::from(value.ln() / self.most.ln());
            let tick = [[at, bar.bottom()], [at, bar.bottom() + 4.0]];
            svg.line(tick[0], tick[1], "#222", 1.0, "");
            svg.text([at, 38.0], TEXT, Anchor::Middle, &short(value.into()));
        }
        svg.text([bar.left, 50.0], 11.0, Anchor::Start, "fragments per pixel");
        svg.finish()
    }
}

/// 0 is blue, 1 is red.
fn color(share: f32) -> [u8; 3] {
    let place = share.clamp(0.0, 1.0) * (COLORS.len() - 1) as f32;
    let below = (place as usize).min(COLORS.len() - 2);
    let t = place - below as f32;
    std::array::from_fn(|i| {
        let [from, to] = [COLORS[below][i], COLORS[below + 1][i]].map(f32::from);
        (from + t * (to - from)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_blue_to_red() {
        let scale = HeatScale { most: 64.0 };
        let steps = [0.5, 1.0, 8.0, 64.0, 1e9].map(|value| scale.step(value));
        assert_eq!(steps, [0, 0, 127, 254, 254]);
        assert_eq!(scale.step(0.0), STEPS);
        assert_eq!(
            [color(0.0), color(0.5), color(1.0)],
            [COLORS[0], COLORS[5], COLORS[10]]
        );
        for label in [">1<", ">64<", ">none<"] {
            assert!(scale.legend().contains(label));
        }
    }
}
