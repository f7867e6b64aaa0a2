//! The JSON as the `gltf` crate's schema, and node transforms in f64.

use super::{ImportError, Result};
use gltf::json::root::Get;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use serde::Deserialize;
use serde::de::DeserializeOwned;
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
    /// The JSON, where the crate could not read it as it stands: see [`Document::parse`].
    repaired: Option<Value>,
}

impl Document {
    /// Reads the JSON of a file; a byte-order mark before it is skipped.
    ///
    /// The crate refuses JSON that the standard allows: integers written as `1.0`, and objects without members that
    /// are optional. What it refuses is tried again with such integers written plainly and without what a bake never
    /// looks at. If that fails too, the first error is the one to report: it has a line and a column.
    pub(super) fn parse(json: &[u8]) -> Result<Self> {
        #[derive(Deserialize)]
        struct Transforms {
            #[serde(default)]
            nodes: Vec<Transform>,
        }
        let json = without_bom(json);
        let fault = |error| ImportError::malformed(format!("the JSON is not glTF 2.0: {error}"));
        let (root, transforms) = rayon::join(
            || Root::from_slice(json),
            || serde_json::from_slice::<Transforms>(json),
        );
        let (root, repaired) = match root {
            Ok(root) => (root, None),
            Err(error) => match repair(json) {
                Some((root, value)) => (root, Some(value)),
                None => return Err(fault(error)),
            },
        };
        Ok(Self {
            root,
            transforms: transforms.map_err(fault)?.nodes,
            repaired,
        })
    }

    /// The URIs of all buffers and images.
    pub(super) fn uris(&self) -> impl Iterator<Item = &str> {
        let buffers = self.root.buffers.iter().map(|buffer| &buffer.uri);
        let images = self.root.images.iter().map(|image| &image.uri);
        let removed = self
            .repaired
            .iter()
            .flat_map(|json| json["images"].as_array());
        let removed = removed.flatten().filter_map(|image| image["uri"].as_str());
        let uris = buffers.chain(images).flatten().map(String::as_str);
        uris.chain(removed)
    }

    /// Reads other members of the file from its `json`, which is the one that was parsed.
    pub(super) fn read<T: DeserializeOwned>(&self, json: &[u8]) -> serde_json::Result<T> {
        match &self.repaired {
            Some(value) => T::deserialize(value),
            None => serde_json::from_slice(without_bom(json)),
        }
    }
}

/// The standard forbids a byte-order mark; reading past one harms nobody.
pub(super) fn without_bom(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// The JSON as the crate can read it, if that can be done.
fn repair(json: &[u8]) -> Option<(Root, Value)> {
    let mut value: Value = serde_json::from_slice(json).ok()?;
    write_integers_plainly(&mut value);
    let members = value.as_object_mut()?;
    if let Some(Value::Array(scenes)) = members.get_mut("scenes") {
        for scene in scenes.iter_mut().filter_map(Value::as_object_mut) {
            scene.entry("nodes").or_insert(json!([]));
        }
    }
    let unused = ["animations", "images", "samplers", "textures"];
    let unused = unused.map(|name| members.remove_entry(name));
    let root = Root::deserialize(&value).ok()?;
    value.as_object_mut()?.extend(unused.into_iter().flatten());
    Some((root, value))
}

/// Replaces numbers such as `1.0` and `1e0` by the integers that they are: JSON has one kind of number, and the
/// standard's integers may be written either way. A float that is read from such an integer is the same float, because
/// the integers up to 2^53 are exact. Larger numbers and -0.0 stay as they are.
pub(super) fn write_integers_plainly(value: &mut Value) {
    const EXACT: f64 = (1u64 << 53) as f64;
    match value {
        Value::Number(number) if number.is_f64() => {
            let integer = number.as_f64().filter(|number| {
                number.fract() == 0.0
                    && number.abs() <= EXACT
                    && !(*number == 0.0 && number.is_sign_negative())
            });
            if let Some(integer) = integer {
                *value = (integer as i64).into();
            }
        }
        Value::Array(values) => values.iter_mut().for_each(write_integers_plainly),
        Value::Object(members) => members.values_mut().for_each(write_integers_plainly),
        _ => {}
    }
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

    #[test]
    fn integers_may_be_written_as_floats_and_floats_keep_their_value() {
        let mut value = json!([1.0, -3.0, 0.0, -0.0, 0.5, 1e300, { "a": [2.0] }]);
        value
            .as_array_mut()
            .unwrap()
            .push(serde_json::from_str("[1e0, 9007199254740992.0, 9007199254740994.0]").unwrap());
        write_integers_plainly(&mut value);
        let plain = r#"[1,-3,0,-0.0,0.5,1e+300,{"a":[2]},[1,9007199254740992,9007199254740994.0]]"#;
        assert_eq!(value.to_string(), plain);
    }
}
