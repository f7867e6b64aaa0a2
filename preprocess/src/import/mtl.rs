//! Wavefront material libraries: diffuse colour and opacity, nothing else.

use crate::scene::AlphaMode;
use std::collections::HashMap;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Material {
    /// Taken as linear: the format does not say.
    pub(super) diffuse: [f32; 3],
    /// 1 is opaque.
    pub(super) opacity: f32,
    /// The opacity comes from an image.
    pub(super) masked: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            diffuse: [1.0; 3],
            opacity: 1.0,
            masked: false,
        }
    }
}

impl Material {
    pub(super) fn base_color(&self) -> [f32; 4] {
        let [r, g, b] = self.diffuse;
        [r, g, b, self.opacity]
    }

    pub(super) fn alpha(&self) -> AlphaMode {
        match self {
            _ if self.opacity < 1.0 => AlphaMode::Blended,
            _ if self.masked => AlphaMode::Masked,
            _ => AlphaMode::Opaque,
        }
    }
}

/// Materials by name. What cannot be read is left at its default: a look is not worth a failed bake.
pub(super) fn parse(text: &str, materials: &mut HashMap<String, Material>) {
    let mut current: Option<&mut Material> = None;
    for line in text.lines().map(str::trim) {
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        if keyword == "newmtl" {
            let material = materials.entry(rest.trim().to_owned()).or_default();
            *material = Material::default();
            current = Some(material);
        }
        let Some(material) = current.as_deref_mut() else {
            continue;
        };
        let mut numbers = rest
            .split_whitespace()
            .map_while(|word| word.parse::<f32>().ok());
        match keyword {
            // One number stands for all three channels.
            "Kd" => {
                if let Some(red) = numbers.next() {
                    material.diffuse = [
                        red,
                        numbers.next().unwrap_or(red),
                        numbers.next().unwrap_or(red),
                    ];
                }
            }
            "d" => material.opacity = numbers.next().unwrap_or(material.opacity),
            "Tr" => material.opacity = numbers.next().map_or(material.opacity, |clear| 1.0 - clear),
            "map_d" => material.masked = true,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_and_opacities_are_read_and_nonsense_is_not() {
        let mut materials = HashMap::new();
        parse(
            "Kd 1 1 1\nnewmtl a b\n Kd .5\nnewmtl c\nKd 0.1 0.2 x\nd 0.5\nnewmtl e\nTr 0.25\nd\nKd",
            &mut materials,
        );
        assert_eq!(materials.len(), 3);
        assert_eq!(materials["a b"].base_color(), [0.5, 0.5, 0.5, 1.0]);
        assert_eq!(materials["c"].base_color(), [0.1, 0.2, 0.1, 0.5]);
        assert_eq!(materials["c"].alpha(), AlphaMode::Blended);
        assert_eq!(materials["e"].base_color(), [1.0, 1.0, 1.0, 0.75]);
    }
}
