//! What a bake keeps of a material (section 3.9): base colour, alpha mode, sidedness.

use super::Result;
use super::document::{get, known};
use crate::scene::AlphaMode;
use gltf::json::material::{self, Material};
use gltf::json::{Index, Root};

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
    Ok(Look {
        base_color: match specular {
            Some(specular) => specular.diffuse_factor.0,
            None => material.pbr_metallic_roughness.base_color_factor.0,
        },
        alpha: match alpha {
            material::AlphaMode::Opaque => AlphaMode::Opaque,
            material::AlphaMode::Mask => AlphaMode::Masked,
            material::AlphaMode::Blend => AlphaMode::Blended,
        },
        double_sided: material.double_sided,
    })
}
