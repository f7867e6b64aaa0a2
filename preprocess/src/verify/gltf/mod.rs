//! Reads glTF 2.0: nodes, meshes, instances, skins and morph targets, as far as they place triangles.

mod accessor;
mod buffers;
mod json;
mod nodes;
mod primitive;

use super::affine::Affine;
use super::geometry::{Part, Shape};
use accessor::Accessor;
use buffers::Buffers;
use json::{Result, item, number, optional};
use nodes::Nodes;
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;

/// Beginnings of the names of extensions that a file may require: those that are read here, and those that do not
/// move triangles. Draco is found where it is used.
const KNOWN: &[&str] = &[
    "ADOBE_materials_",
    "AGI_stk_metadata",
    "BENTLEY_materials_",
    "CESIUM_RTC",
    "CESIUM_primitive_outline",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "EXT_lights_",
    "EXT_mesh_features",
    "EXT_mesh_gpu_instancing",
    "EXT_mesh_manifold",
    "EXT_mesh_primitive_",
    "EXT_meshopt_compression",
    "EXT_property_",
    "EXT_structural_metadata",
    "EXT_texture_",
    "FB_",
    "GODOT_",
    "GRIFFEL_bim_data",
    "KHR_animation_",
    "KHR_audio",
    "KHR_blend",
    "KHR_draco_mesh_compression",
    "KHR_environment_map",
    "KHR_interactivity",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_",
    "KHR_physics_",
    "KHR_rigid_bodies",
    "KHR_texture_",
    "KHR_xmp",
    "MSFT_audio_emitter",
    "MSFT_packing_",
    "MSFT_texture_dds",
    "NV_materials_mdl",
    "OMI_",
    "VRM",
];

/// A glTF file, read as far as its JSON.
pub(super) struct File {
    root: Value,
    bin: Option<Vec<u8>>,
}

/// What decides a shape.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Key {
    mesh: usize,
    primitive: usize,
    /// The bits of the weights of the morph targets.
    weights: Vec<u64>,
    /// The node, for a skinned primitive.
    skinned: Option<usize>,
}

/// The parts of a file and all that their shapes are read from.
pub(super) struct Scene<'a> {
    root: &'a Value,
    buffers: Buffers<'a>,
    nodes: Nodes,
    keys: Vec<Key>,
    pub(super) parts: Vec<Part>,
}

impl File {
    pub(super) fn read(bytes: &[u8]) -> Result<Self> {
        let (json, bin) = match bytes.starts_with(b"glTF") {
            true => chunks(bytes)?,
            false => (bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes), None),
        };
        let root: Value = serde_json::from_slice(json).map_err(|error| format!("JSON: {error}"))?;
        let required = root["extensionsRequired"].as_array();
        for name in required.into_iter().flatten().filter_map(Value::as_str) {
            if !KNOWN.iter().any(|known| name.starts_with(known)) {
                return Err(format!(
                    "requires {name}, which the comparison does not read"
                ));
            }
        }
        Ok(Self {
            root,
            bin: bin.map(<[u8]>::to_vec),
        })
    }
}

/// The JSON and the binary chunk of a GLB.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>)> {
    let word = |at: usize| {
        let word = bytes.get(at..at + 4)?.first_chunk()?;
        Some(u32::from_le_bytes(*word) as usize)
    };
    let end = word(8).unwrap_or(0).min(bytes.len());
    let mut at = 12;
    let (mut json, mut bin) = (None, None);
    while let (Some(len), Some(kind)) = (word(at), word(at + 4))
        && at + 8 <= end
    {
        let chunk = bytes
            .get(at + 8..at + 8 + len)
            .ok_or("a chunk leads out of the file")?;
        match kind {
            0x4E4F_534A => json = json.or(Some(chunk)),
            0x004E_4942 => bin = bin.or(Some(chunk)),
            _ => {}
        }
        at += 8 + len;
    }
    Ok((json.ok_or("has no JSON chunk")?, bin))
}

impl<'a> Scene<'a> {
    pub(super) fn read(file: &'a File, folder: &Path, choice: Option<&str>) -> Result<Self> {
        let root = &file.root;
        let mut scene = Self {
            root,
            buffers: Buffers::read(root, file.bin.as_deref(), folder),
            nodes: Nodes::place(root, choice)?,
            keys: Vec::new(),
            parts: Vec::new(),
        };
        let mut shapes = HashMap::new();
        for node in scene.nodes.drawn.clone() {
            let parts = scene.node(node, &mut shapes);
            let parts = parts.map_err(|what| format!("node {node}: {what}"))?;
            scene.parts.extend(parts);
        }
        Ok(scene)
    }

    /// Reads a shape. It is in the space of its node, and in the world for a skinned one.
    pub(super) fn shape(&self, shape: usize) -> Result<Shape> {
        let key = &self.keys[shape];
        self.primitive(key)
            .map_err(|what| format!("mesh {}, primitive {}: {what}", key.mesh, key.primitive))
    }

    fn node(&mut self, index: usize, shapes: &mut HashMap<Key, usize>) -> Result<Vec<Part>> {
        let node = item(self.root, "nodes", index)?;
        let Some(mesh_index) = optional(node, "mesh")? else {
            return Ok(Vec::new());
        };
        let mesh = item(self.root, "meshes", mesh_index)?;
        let place = self.nodes.places[index].unwrap_or(Affine::IDENTITY);
        let is_skinned = self.joints(node)?.is_some();
        let instances = self.instances(node)?;
        let name = [node, mesh].map(|named| named["name"].as_str().unwrap_or_default());
        let name = if name[0].is_empty() { name[1] } else { name[0] };
        let weights = [node, mesh].into_iter().find(|of| of["weights"].is_array());
        let weights = weights.and_then(|of| of["weights"].as_array());
        let weights: Vec<u64> = weights
            .into_iter()
            .flatten()
            // The importer reads weights as f32.
            .map(|weight| f64::from(weight.as_f64().unwrap_or(0.0) as f32).to_bits())
            .collect();
        let mut parts = Vec::new();
        let primitives = mesh["primitives"].as_array().into_iter().flatten();
        for (number, primitive) in primitives.enumerate() {
            if !self.has_triangles(primitive)? {
                continue;
            }
            let skinned = is_skinned && primitive["attributes"]["JOINTS_0"].is_number();
            let key = Key {
                mesh: mesh_index,
                primitive: number,
                weights: match primitive["targets"].is_array() {
                    true => weights.clone(),
                    false => Vec::new(),
                },
                skinned: skinned.then_some(index),
            };
            let shape = *shapes.entry(key.clone()).or_insert_with(|| {
                self.keys.push(key);
                self.keys.len() - 1
            });
            // A skin moves the vertices to the world; its node does not count.
            let start = if is_skinned { Affine::IDENTITY } else { place };
            let places = match (&instances, is_skinned) {
                (None, _) => vec![start],
                (Some(instances), false) => instances.iter().map(|i| place.after(i)).collect(),
                (Some(instances), true) => match place.inverse() {
                    Some(back) => {
                        let moved = |i: &Affine| place.after(i).after(&back);
                        instances.iter().map(moved).collect()
                    }
                    None => vec![start],
                },
            };
            parts.push(Part {
                node: index as u32,
                primitive: number as u32,
                name: name.to_owned(),
                places,
                shape,
            });
        }
        Ok(parts)
    }

    /// Whether a primitive makes a triangle, as far as its counts tell.
    fn has_triangles(&self, primitive: &Value) -> Result<bool> {
        let mode = optional(primitive, "mode")?.unwrap_or(4);
        let Some(position) = optional(&primitive["attributes"], "POSITION")? else {
            return Ok(false);
        };
        let counted = optional(primitive, "indices")?.unwrap_or(position);
        let count = number(&item(self.root, "accessors", counted)?["count"]).unwrap_or(0);
        Ok((4..=6).contains(&mode) && count >= 3)
    }

    fn open(&self, accessor: usize, kind: &str) -> Result<Accessor<'_>> {
        Accessor::open(self.root, &self.buffers, accessor, kind)
    }

    /// The transforms of `EXT_mesh_gpu_instancing` within a node; `None` for a node that is drawn once.
    fn instances(&self, node: &Value) -> Result<Option<Vec<Affine>>> {
        let attributes = &node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
        if !attributes.is_object() {
            return Ok(None);
        }
        let open = |name: &str, kind: &str| {
            let accessor = optional(attributes, name)?;
            accessor
                .map(|accessor| self.open(accessor, kind))
                .transpose()
        };
        let translation = open("TRANSLATION", "VEC3")?;
        let rotation = open("ROTATION", "VEC4")?;
        let scale = open("SCALE", "VEC3")?;
        let given = [&translation, &rotation, &scale].into_iter().flatten();
        let Some(count) = given.map(|accessor| accessor.count).min() else {
            return Err("its instances have no transforms".into());
        };
        let instance = |at| {
            Affine::compose(
                translation
                    .as_ref()
                    .map_or([0.0; 3], |accessor| accessor.floats(at)),
                rotation
                    .as_ref()
                    .map_or([0.0, 0.0, 0.0, 1.0], |accessor| accessor.floats(at)),
                scale
                    .as_ref()
                    .map_or([1.0; 3], |accessor| accessor.floats(at)),
            )
        };
        Ok(Some((0..count).map(instance).collect()))
    }

    /// The maps of a node's joints from the space the mesh was bound in to the world; `None` for a node without a
    /// skin, and for a skin with a joint outside the scene, which cannot be posed.
    fn joints(&self, node: &Value) -> Result<Option<Vec<Affine>>> {
        let Some(skin) = optional(node, "skin")? else {
            return Ok(None);
        };
        let skin = item(self.root, "skins", skin)?;
        let bind = optional(skin, "inverseBindMatrices")?;
        let bind = bind
            .map(|accessor| self.open(accessor, "MAT4"))
            .transpose()?;
        let joints = json::indices(skin, "joints")?;
        if bind.as_ref().is_some_and(|bind| bind.count < joints.len()) {
            return Err("the skin has fewer matrices than joints".into());
        }
        let joint = |(number, &joint): (usize, &usize)| {
            let place = (*self.nodes.places.get(joint)?)?;
            Some(match &bind {
                Some(bind) => place.after(&Affine::from_columns(bind.floats(number))),
                None => place,
            })
        };
        let joints: Option<Vec<Affine>> = joints.iter().enumerate().map(joint).collect();
        Ok(joints.filter(|joints| !joints.is_empty()))
    }
}
