//! What a bake keeps of a material (section 3.9): base colour, alpha mode, sidedness.
//!
//! A material that lets light through is blended, whatever its alpha mode: what lies behind it shows, so it must
//! never occlude.

use super::document::{get, known};
use super::{Result, extensions};
use crate::scene::AlphaMode;
use gltf::json::material::{self, Material};
use gltf::json::{Index, Root};
use serde_json::{Map, Value};

/// Extensions that let light through a surface, with the names of the share that passes and of its texture.
/// `KHR_materials_volume`, `KHR_materials_dispersion` and their like say what happens to that light, and let none
/// through by themselves.
const TRANSMISSIVE: &[[&str; 3]] = &[
    [
        "KHR_materials_transmission",
        "transmissionFactor",
        "transmissionTexture",
    ],
    [
        "KHR_materials_diffuse_transmission",
        "diffuseTransmissionFactor",
        "diffuseTransmissionTexture",
    ],
    // Older names of the two.
    [
        "ADOBE_materials_thin_transparency",
        "transmissionFactor",
        "transmissionTexture",
    ],
    [
        "KHR_materials_translucency",
        "translucencyFactor",
        "translucencyTexture",
    ],
];

/// The least alpha that a transmissive surface is given: glass that lets everything through still reflects, and a
/// viewer without reflections should show that it is there.
const GLASS_ALPHA: f32 = 0.25;

#[derive(Clone, Copy)]
pub(super) struct Look {
    /// Linear RGBA.
    pub(super) base_color: [f32; 4],
    pub(super) alpha: AlphaMode,
    pub(super) double_sided: bool,
}

/// The look of a primitive's material; the default material is white, opaque and single-sided.
pub(super) fn look(root: &Root, material: Option<Index<Material>>) -> Result<Look> {
    let Some(index) = material else {
        return Ok(Look {
            base_color: [1.0; 4],
            alpha: AlphaMode::Opaque,
            double_sided: false,
        });
    };
    let material = get(root, index, "material")?;
    let specular = material
        .extensions
        .as_ref()
        .and_then(|extensions| extensions.pbr_specular_glossiness.as_ref());
    let alpha = known(material.alpha_mode, "alpha mode")
        .map_err(|error| error.within(format_args!("material {index}")))?;
    let mut base_color = match specular {
        Some(specular) => specular.diffuse_factor.0,
        None => material.pbr_metallic_roughness.base_color_factor.0,
    };
    let mut alpha = match alpha {
        material::AlphaMode::Opaque => AlphaMode::Opaque,
        material::AlphaMode::Mask => AlphaMode::Masked,
        material::AlphaMode::Blend => AlphaMode::Blended,
    };
    let others = material.extensions.iter().map(|found| &found.others);
    for others in others {
        let passes =
            transmission(others).map_err(|error| error.within(format_args!("material {index}")))?;
        if let Some(share) = passes {
            // Opaque materials have an alpha of 1, whatever the colour says.
            let covered = match alpha {
                AlphaMode::Opaque => 1.0,
                AlphaMode::Masked | AlphaMode::Blended => base_color[3],
            };
            base_color[3] = covered * (1.0 - (1.0 - GLASS_ALPHA) * share);
            alpha = AlphaMode::Blended;
        }
    }
    Ok(Look {
        base_color,
        alpha,
        double_sided: material.double_sided,
    })
}

/// The largest share of the light that an extension lets through; `None` where none does. A texture without a share
/// counts: it lets light through as soon as somebody raises the share.
fn transmission(extensions: &Map<String, Value>) -> Result<Option<f32>> {
    let mut largest = None;
    for [name, factor, texture] in TRANSMISSIVE {
        let found: Option<Map<String, Value>> = extensions::read(extensions, &[name])?;
        let Some(found) = found else { continue };
        let share = found.get(*factor).and_then(Value::as_f64).unwrap_or(0.0);
        if share > 0.0 || found.contains_key(*texture) {
            let share = share.clamp(0.0, 1.0) as f32;
            largest = Some(share.max(largest.unwrap_or(0.0)));
        }
    }
    Ok(largest)
}
