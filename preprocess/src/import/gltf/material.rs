//! What a bake keeps of a material (section 3.9): base colour, alpha mode, sidedness.

use super::schema::{Root, get};
use super::{ImportError, Result};
use crate::scene::AlphaMode;

#[derive(Clone, Copy)]
pub(super) struct Look {
    /// Linear RGBA.
    pub(super) base_color: [f32; 4],
    pub(super) alpha: AlphaMode,
    pub(super) double_sided: bool,
}

/// The look of a primitive's material; the default material is white, opaque and single-sided.
pub(super) fn look(root: &Root, material: Option<usize>) -> Result<Look> {
    let Some(index) = material else {
        return Ok(Look {
            base_color: [1.0; 4],
            alpha: AlphaMode::Opaque,
            double_sided: false,
        });
    };
    let material = get(&root.materials, index, "material")?;
    let diffuse = material
        .extensions
        .specular_glossiness
        .as_ref()
        .map(|look| look.diffuse_factor);
    let factor = diffuse.unwrap_or(material.pbr_metallic_roughness.base_color_factor);
    let alpha = match material.alpha_mode.as_deref() {
        None | Some("OPAQUE") => AlphaMode::Opaque,
        Some("MASK") => AlphaMode::Masked,
        Some("BLEND") => AlphaMode::Blended,
        Some(mode) => {
            let what = format!("unknown alpha mode {mode:?}");
            return Err(ImportError::malformed(what).within(format_args!("material {index}")));
        }
    };
    Ok(Look {
        base_color: factor.unwrap_or([1.0; 4]),
        alpha,
        double_sided: material.double_sided,
    })
}
