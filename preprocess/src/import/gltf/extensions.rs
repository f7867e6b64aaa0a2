//! Which extensions a bake honours, which it may ignore, which it warns about and which it must refuse.

use super::document::write_integers_plainly;
use super::{ImportError, ImportErrorKind, Result};
use glam::DVec3;
use gltf::json::Root;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::collections::BTreeSet;

/// The extension with the scene's place.
pub(super) const RTC: &str = "CESIUM_RTC";

/// Implemented here. Draco is not: a primitive that has no other data is refused by name, one that
/// also has plain accessors is read from those.
const HANDLED: &[&str] = &[
    "ADOBE_materials_thin_transparency",
    RTC,
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_draco_mesh_compression",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_translucency",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
];

/// Beginnings of the names of extensions that add looks, light, sound, behaviour or remarks to a
/// scene, and leave its triangles and transforms as they are.
const NO_GEOMETRY: &[&str] = &[
    "ADOBE_materials_",
    "AGI_stk_metadata",
    "BENTLEY_materials_",
    "CESIUM_primitive_outline",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "EXT_lights_",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    // Plain primitives are there too, for readers that do not know it.
    "EXT_mesh_primitive_",
    "EXT_property_",
    "EXT_structural_metadata",
    "EXT_texture_",
    "FB_geometry_metadata",
    "FB_material_modes",
    "FB_ngon_encoding",
    "GODOT_",
    "GRIFFEL_bim_data",
    "KHR_animation_",
    "KHR_audio",
    "KHR_blend",
    "KHR_environment_map",
    // Splats are points, which are skipped and counted.
    "KHR_gaussian_splatting",
    "KHR_interactivity",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_physics_",
    "KHR_rigid_bodies",
    "KHR_texture_",
    "KHR_xmp",
    "MOZ_hubs_components",
    "MPEG_audio",
    "MPEG_media",
    "MPEG_texture",
    "MPEG_viewport",
    "MSFT_audio_emitter",
    "MSFT_packing_",
    "MSFT_texture_dds",
    "NV_materials_mdl",
    "OMI_",
    "VRM",
];

/// Beginnings of the names of extensions that move or add geometry beside what the bake reads, and what that means.
const PARTLY_READ: &[(&str, &str)] = &[
    (
        "AGI_articulations",
        "nodes stand where their transforms put them, not where an articulation does",
    ),
    (
        "CESIUM_geopose",
        "the scene stays in its own coordinates, not in those of the globe",
    ),
    (
        "KHR_techniques_webgl",
        "vertices stay where they are, whatever the shaders in the file do",
    ),
    (
        "MAXAR_mesh_variants",
        "only the meshes that the nodes name are baked",
    ),
    (
        "MPEG_",
        "geometry that changes over time is baked as it stands in the file",
    ),
    ("MSFT_lod", "only the most detailed level is baked"),
];

/// One extension of an object, which the `gltf` crate keeps as it stands in the JSON; of several
/// names for the same content the first one that is there counts.
pub(super) fn read<T: DeserializeOwned>(
    extensions: &Map<String, Value>,
    names: &[&str],
) -> Result<Option<T>> {
    let found = names
        .iter()
        .find_map(|name| Some((name, extensions.get(*name)?)));
    let Some((name, value)) = found else {
        return Ok(None);
    };
    let plain = || {
        let mut value = value.clone();
        write_integers_plainly(&mut value);
        T::deserialize(value)
    };
    T::deserialize(value)
        .or_else(|_| plain())
        .map(Some)
        .map_err(|error| ImportError::malformed(error.to_string()).within(name))
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

/// What the user should know about the extensions that the file uses and the bake does not honour.
///
/// # Errors
/// If one of them is required and not known to leave the geometry alone.
pub(super) fn check(root: &Root) -> Result<Vec<String>> {
    let required: BTreeSet<&str> = root
        .extensions_required
        .iter()
        .map(String::as_str)
        .collect();
    let mut used: BTreeSet<&str> = root.extensions_used.iter().map(String::as_str).collect();
    used.extend(members(root).map(String::as_str));
    used.extend(&required);
    let mut warnings = Vec::new();
    for name in used.into_iter().filter(|name| !HANDLED.contains(name)) {
        let is_required = required.contains(name);
        let partly = PARTLY_READ
            .iter()
            .find(|(start, _)| name.starts_with(start));
        if NO_GEOMETRY.iter().any(|start| name.starts_with(start)) {
            if is_required {
                warnings.push(format!(
                    "{name} is required by the file, but does not touch geometry; ignored"
                ));
            }
        } else if let Some((_, what)) = partly {
            warnings.push(format!(
                "{name} is used by the file and not supported: {what}"
            ));
        } else if is_required {
            return Err(unsupported(format!(
                "requires the extension {name:?}, which is not supported"
            )));
        } else {
            warnings.push(format!(
                "{name:?} is used by the file and not known here; what it adds or moves is missing from the bake"
            ));
        }
    }
    Ok(warnings)
}

/// The names of the extensions of the file as a whole.
fn members(root: &Root) -> impl Iterator<Item = &String> {
    let extensions = root.extensions.iter();
    extensions.flat_map(|extensions| extensions.others.keys())
}

/// Where `CESIUM_RTC` puts the origin of the file, in the file's axes; zero without the extension.
///
/// The extension defines the center in the coordinates of the application, which are those of the globe: z points
/// up. All readers by its authors apply it after the turn from glTF, whose y points up: `globe = center + turn * point`
/// with `turn * (x, y, z) = (x, -z, y)`. The bake keeps the axes of glTF, so that it needs
/// `turn^-1 * globe = turn^-1 * center + point`. Tiles of one data set then fit together as they do on the globe.
pub(super) fn rtc_center(root: &Root) -> Result<DVec3> {
    #[derive(Deserialize)]
    struct Rtc {
        center: [f64; 3],
    }
    let Some(extensions) = &root.extensions else {
        return Ok(DVec3::ZERO);
    };
    let found: Option<Rtc> = read(&extensions.others, &[RTC])?;
    Ok(found.map_or(DVec3::ZERO, |Rtc { center: [x, y, z] }| {
        DVec3::new(x, z, -y)
    }))
}

fn unsupported(what: String) -> ImportError {
    ImportError::new(ImportErrorKind::Unsupported, what)
}
