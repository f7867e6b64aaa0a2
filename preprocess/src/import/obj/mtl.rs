//! Wavefront material libraries: diffuse colour and opacity, nothing else.

use crate::scene::AlphaMode;
use std::fmt::Write;

/// Copies what a bake uses of a library, as `tobj` 4.0.5 expects it: that panics on a colour of fewer
/// than three numbers and gives up a whole library for one bad line, such as the empty name that some
/// exporters write. So every name gets a `=` in front, for [`name`] to take away. What cannot be read
/// is left at its default: a look is not worth a failed bake.
pub(super) fn clean(library: &str, text: &mut String) {
    for line in library.lines().map(str::trim) {
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let mut numbers = rest
            .split_whitespace()
            .map_while(|word| word.parse::<f64>().ok());
        // Writing to a string cannot fail.
        let _ = match (keyword, numbers.next()) {
            ("newmtl", _) => writeln!(text, "newmtl ={rest}"),
            ("map_d", _) => writeln!(text, "map_d ={rest}"),
            // One number stands for all three channels.
            ("Kd", Some(red)) => {
                let (green, blue) = (numbers.next(), numbers.next());
                let (green, blue) = (green.unwrap_or(red), blue.unwrap_or(red));
                writeln!(text, "Kd {red} {green} {blue}")
            }
            ("d", Some(opacity)) => writeln!(text, "d {opacity}"),
            ("Tr", Some(clear)) => writeln!(text, "d {}", 1.0 - clear),
            _ => Ok(()),
        };
    }
}

/// A material's name in its library.
pub(super) fn name(material: &tobj::Material) -> &str {
    material.name.strip_prefix('=').unwrap_or_default()
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

    #[test]
    fn colours_and_opacities_are_read_and_nonsense_is_not() {
        let mut text = String::new();
        clean(
            "Kd 1 1 1\nnewmtl a b\n Kd .5\nnewmtl c\nKd 0.1 0.2 x\nd 0.5\nnewmtl e\nTr 0.25\nd\nKd\nnewmtl \nmap_d",
            &mut text,
        );
        let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).unwrap();
        let found: Vec<_> = materials.iter().map(|m| (name(m), look(Some(m)))).collect();
        assert_eq!(
            found,
            [
                ("a b", ([0.5, 0.5, 0.5, 1.0], AlphaMode::Opaque)),
                ("c", ([0.1, 0.2, 0.1, 0.5], AlphaMode::Blended)),
                ("e", ([1.0, 1.0, 1.0, 0.75], AlphaMode::Blended)),
                ("", ([1.0; 4], AlphaMode::Masked)),
            ]
        );
    }
}
