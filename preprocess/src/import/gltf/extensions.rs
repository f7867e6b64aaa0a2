//! Which required extensions a bake can honour, which it may ignore and which it must refuse.

use super::{ImportError, ImportErrorKind, Result};
use gltf::json::Root;
use serde::Deserialize;
use serde_json::{Map, Value};

/// Implemented here. Draco is not: a primitive that has no other data is refused by name, one that
/// also has plain accessors is read from those.
const HANDLED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_draco_mesh_compression",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
];

/// Beginnings of the names of extensions that add looks, light, sound, behaviour or remarks to a
/// scene, and leave its triangles and transforms as they are.
const NO_GEOMETRY: &[&str] = &[
    "ADOBE_materials_",
    "AGI_articulations",
    "EXT_instance_features",
    "EXT_lights_",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_property_",
    "EXT_structural_metadata",
    "EXT_texture_",
    "GODOT_",
    "KHR_animation_",
    "KHR_audio",
    "KHR_environment_map",
    "KHR_interactivity",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_physics_",
    "KHR_rigid_bodies",
    "KHR_texture_",
    "KHR_xmp",
    "MSFT_audio_emitter",
    "MSFT_packing_",
    "MSFT_texture_dds",
    "OMI_",
    "VRMC_",
];

/// One extension of an object, which the `gltf` crate keeps as it stands in the JSON; of several
/// names for the same content the first one that is there counts.
pub(super) fn read<'a, T: Deserialize<'a>>(
    extensions: &'a Map<String, Value>,
    names: &[&str],
) -> Result<Option<T>> {
    let found = names
        .iter()
        .find_map(|name| Some((name, extensions.get(*name)?)));
    found
        .map(|(name, value)| {
            T::deserialize(value)
                .map_err(|error| ImportError::malformed(error.to_string()).within(name))
        })
        .transpose()
}

/// Refuses glTF 1 and versions that say they are no longer readable as 2.0 (section 3.2).
pub(super) fn check_version(root: &Root) -> Result<()> {
    let newer = |version: &str| version != "2.0";
    let asset = &root.asset;
    if let Some(minimum) = asset
        .min_version
        .as_deref()
        .filter(|version| newer(version))
    {
        return Err(unsupported(format!("needs a reader of glTF {minimum}")));
    }
    if asset.version.split('.').next() != Some("2") {
        return Err(unsupported(format!("is glTF {:?}, not 2.0", asset.version)));
    }
    Ok(())
}

/// The required extensions that are ignored.
pub(super) fn check_required(root: &Root) -> Result<Vec<&str>> {
    let required = || root.extensions_required.iter().map(String::as_str);
    let handled = |name: &&str| HANDLED.contains(name);
    let harmless = |name: &&str| NO_GEOMETRY.iter().any(|start| name.starts_with(start));
    if let Some(name) = required().find(|name| !handled(name) && !harmless(name)) {
        return Err(unsupported(format!(
            "requires the extension {name:?}, which is not supported"
        )));
    }
    Ok(required().filter(|name| !handled(name)).collect())
}

fn unsupported(what: String) -> ImportError {
    ImportError::new(ImportErrorKind::Unsupported, what)
}
