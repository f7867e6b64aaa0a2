//! The JSON as the `gltf` crate's schema, and node transforms in f64.

use super::{ImportError, Result};
use gltf::json::root::Get;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use serde::Deserialize;
use serde_json::{Value, json};

/// A node's own transform. The crate keeps it in f32, which at 1,000 km is good to 6 cm; a second
/// pass over the JSON reads these four members, and nothing else, as they stand there.
#[derive(Clone, Deserialize)]
pub(super) struct Transform {
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
}

pub(super) struct Document {
    pub(super) root: Root,
    /// One per node.
    pub(super) transforms: Vec<Transform>,
}

impl Document {
    pub(super) fn parse(json: &[u8]) -> Result<Self> {
        #[derive(Deserialize)]
        struct Transforms {
            #[serde(default)]
            nodes: Vec<Transform>,
        }
        let fault = |error| ImportError::malformed(format!("the JSON is not glTF 2.0: {error}"));
        let (root, transforms) = rayon::join(
            || Root::from_slice(json).or_else(|error| bare_root(json).ok_or(error)),
            || serde_json::from_slice(json),
        );
        let (root, Transforms { nodes: transforms }) =
            (root.map_err(fault)?, transforms.map_err(fault)?);
        Ok(Self { root, transforms })
    }
}

/// The crate insists on members that the standard leaves optional, such as a scene's nodes and the
/// node of an animation channel. What it refuses is tried again without anything a bake never looks
/// at.
fn bare_root(json: &[u8]) -> Option<Root> {
    let mut value: Value = serde_json::from_slice(json).ok()?;
    let root = value.as_object_mut()?;
    for unused in ["animations", "images", "samplers", "textures"] {
        root.remove(unused);
    }
    if let Some(Value::Array(scenes)) = root.get_mut("scenes") {
        for scene in scenes.iter_mut().filter_map(Value::as_object_mut) {
            scene.entry("nodes").or_insert(json!([]));
        }
    }
    serde_json::from_value(value).ok()
}

/// Looks up what an index of the file refers to.
pub(super) fn get<'a, T>(root: &'a Root, index: Index<T>, what: &str) -> Result<&'a T>
where
    Root: Get<T>,
{
    root.get(index).ok_or_else(|| {
        ImportError::malformed(format!("refers to {what} {index}, which does not exist"))
    })
}

/// The value of an enumeration, if it is one that glTF knows.
pub(super) fn known<T: Copy>(value: Checked<T>, what: &str) -> Result<T> {
    match value {
        Checked::Valid(value) => Ok(value),
        Checked::Invalid => Err(ImportError::malformed(format!("has an unknown {what}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_bake_looks_at_stands_in_nobodys_way() {
        let json = br#"{ "asset": { "version": "2.0" }, "scenes": [{ "extras": 1 }], "nodes": [{}],
            "animations": [{ "samplers": [], "channels": [{ "sampler": 0, "target": { "path": "pointer" } }] }] }"#;
        assert!(Root::from_slice(json).is_err());
        let root = Document::parse(json).unwrap().root;
        assert_eq!((root.scenes.len(), root.animations.len()), (1, 0));
        assert!(root.scenes[0].nodes.is_empty());
        assert!(Document::parse(br#"{ "asset": {} }"#).is_err());
    }
}
