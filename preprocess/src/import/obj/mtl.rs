//! Wavefront material libraries: diffuse colour and opacity, nothing else.

use super::lines::{Lines, keyword, number, without_bom, words};
use crate::scene::AlphaMode;
use std::collections::HashMap;
use std::fmt::Write;

/// `d` and 1 - `Tr` that differ by more than this contradict each other; exporters round them.
const OPACITY_TOLERANCE: f64 = 0.01;

/// What a bake uses of material libraries, as `tobj` 4.0.5 expects it: that panics on a colour of fewer
/// than three numbers and gives up a whole library for one bad line. What cannot be read is left at its
/// default: a look is not worth a failed bake.
#[derive(Default)]
pub(super) struct Libraries {
    text: String,
    /// The materials' names, as bytes; in `text` the name of material `n` is `=n`.
    names: Vec<Vec<u8>>,
    /// The latest `d` and `Tr` of the material being read.
    opacity: Option<f64>,
    transparency: Option<f64>,
    /// Materials whose `d` and `Tr` differ.
    pub(super) contradictions: usize,
}

/// Materials by name. The last of one name counts.
pub(super) type Materials = HashMap<Vec<u8>, tobj::Material>;

impl Libraries {
    /// Adds a library.
    pub(super) fn add(&mut self, library: &[u8]) {
        let known = self.names.len();
        for line in Lines::new(without_bom(library)) {
            let (keyword, rest) = keyword(line);
            if keyword == b"newmtl" {
                self.end_material();
                let _ = writeln!(self.text, "newmtl ={}", self.names.len());
                self.names.push(rest.to_owned());
            } else if self.names.len() > known {
                self.property(keyword, rest);
            }
        }
        self.end_material();
    }

    /// Reads a line of the latest material.
    fn property(&mut self, keyword: &[u8], rest: &[u8]) {
        let mut numbers = words(rest).map_while(number);
        match (keyword, numbers.next()) {
            (b"map_d", _) => self.text.push_str("map_d =\n"),
            // One number stands for all three channels.
            (b"Kd", Some(red)) => {
                let (green, blue) = (numbers.next(), numbers.next());
                let (green, blue) = (green.unwrap_or(red), blue.unwrap_or(red));
                let _ = writeln!(self.text, "Kd {red} {green} {blue}");
            }
            (b"d", Some(opacity)) => self.opacity = Some(opacity.clamp(0.0, 1.0)),
            // The opacity of what faces the eye; it grows towards the outline.
            (b"d", None) if rest.starts_with(b"-halo") => {
                let opacity = words(rest).nth(1).and_then(number);
                self.opacity = opacity
                    .map(|opacity| opacity.clamp(0.0, 1.0))
                    .or(self.opacity);
            }
            (b"Tr", Some(clear)) => self.transparency = Some(clear.clamp(0.0, 1.0)),
            _ => {}
        }
    }

    /// Decides the opacity of the material that was read: `d` is in the format, and `Tr` is what some
    /// exporters add, not all of them in the same sense.
    fn end_material(&mut self) {
        let by_tr = self.transparency.take().map(|clear| 1.0 - clear);
        let by_d = self.opacity.take();
        if let (Some(d), Some(tr)) = (by_d, by_tr) {
            self.contradictions += usize::from((d - tr).abs() > OPACITY_TOLERANCE);
        }
        if let Some(opacity) = by_d.or(by_tr) {
            let _ = writeln!(self.text, "d {opacity}");
        }
    }

    /// The materials of all libraries.
    pub(super) fn materials(&self) -> Materials {
        let Ok((materials, _)) = tobj::load_mtl_buf(&mut self.text.as_bytes()) else {
            return Materials::new();
        };
        let named = |material: tobj::Material| {
            let number = material.name.strip_prefix('=')?.parse::<usize>().ok()?;
            Some((self.names.get(number)?.clone(), material))
        };
        materials.into_iter().filter_map(named).collect()
    }
}

/// Base colour, taken as linear since the format does not say, and the use of alpha.
pub(super) fn look(material: Option<&tobj::Material>) -> ([f32; 4], AlphaMode) {
    let diffuse = material.and_then(|material| material.diffuse);
    let opacity = material.and_then(|material| material.dissolve);
    let masked = material.is_some_and(|material| material.dissolve_texture.is_some());
    let [red, green, blue] = diffuse.unwrap_or([1.0; 3]).map(|channel| channel as f32);
    let opacity = opacity.unwrap_or(1.0) as f32;
    let alpha = match masked {
        _ if opacity < 1.0 => AlphaMode::Blended,
        true => AlphaMode::Masked,
        false => AlphaMode::Opaque,
    };
    ([red, green, blue, opacity], alpha)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looks(library: &[u8]) -> (Vec<(Vec<u8>, [f32; 4], AlphaMode)>, usize) {
        let mut libraries = Libraries::default();
        libraries.add(library);
        let look = |(name, material): (Vec<u8>, tobj::Material)| {
            let (color, alpha) = look(Some(&material));
            (name, color, alpha)
        };
        let mut looks: Vec<_> = libraries.materials().into_iter().map(look).collect();
        looks.sort_by(|a, b| a.0.cmp(&b.0));
        (looks, libraries.contradictions)
    }

    #[test]
    fn colours_and_opacities_are_read_and_nonsense_is_not() {
        let (found, contradictions) = looks(
            b"Kd 1 1 1\nnewmtl a b\n Kd .5\nnewmtl c\nKd 0.1 0.2 x\nd 0.5\nnewmtl e\nTr 0.25\nd\nKd\nnewmtl \nmap_d\n\
              newmtl f\nd nan\nTr inf\nKd nan 1 1\nnewmtl g\nd 255",
        );
        let expected = [
            (&b""[..], [1.0; 4], AlphaMode::Masked),
            (b"a b", [0.5, 0.5, 0.5, 1.0], AlphaMode::Opaque),
            (b"c", [0.1, 0.2, 0.1, 0.5], AlphaMode::Blended),
            (b"e", [1.0, 1.0, 1.0, 0.75], AlphaMode::Blended),
            (b"f", [1.0; 4], AlphaMode::Opaque),
            (b"g", [1.0; 4], AlphaMode::Opaque),
        ];
        let expected = expected.map(|(name, color, alpha)| (name.to_owned(), color, alpha));
        assert_eq!((found.as_slice(), contradictions), (&expected[..], 0));
    }

    #[test]
    fn d_decides_over_tr_in_any_order() {
        for (lines, opacity, contradictions) in [
            ("d 1\nTr 1", 1.0, 1),
            ("Tr 1\nd 1", 1.0, 1),
            ("d 0.25\nTr 0.75", 0.25, 0),
            ("Tr 0.75\nd 0.25", 0.25, 0),
            ("d 0\nTr 0", 0.0, 1),
            ("Tr 1", 0.0, 0),
            ("d -halo 0.5", 0.5, 0),
            ("Tr 0\nd -halo 0.5", 0.5, 1),
            ("d -halo", 1.0, 0),
        ] {
            // The next material does not inherit, nor does one of another library.
            let library = format!("newmtl a\n{lines}\nnewmtl b\n");
            let (found, count) = looks(library.as_bytes());
            assert_eq!((found[0].1[3], found[1].1[3]), (opacity, 1.0), "{lines}");
            assert_eq!(count, contradictions, "{lines}");
        }
    }

    #[test]
    fn the_last_material_of_a_name_counts_and_names_are_bytes() {
        let (found, _) = looks(
            b"\xEF\xBB\xBFnewmtl a\rKd 0\rnewmtl \xB2\xC4\rKd 1 0 0\rnewmtl \xB2\xC5\rKd 0 1 0\rnewmtl a\rKd 0 0 1",
        );
        let colors: Vec<_> = found
            .iter()
            .map(|(name, color, _)| (name.as_slice(), &color[..3]))
            .collect();
        let expected: [(&[u8], &[f32]); 3] = [
            (b"a", &[0.0, 0.0, 1.0]),
            (b"\xB2\xC4", &[1.0, 0.0, 0.0]),
            (b"\xB2\xC5", &[0.0, 1.0, 0.0]),
        ];
        assert_eq!(colors, expected);
    }
}
