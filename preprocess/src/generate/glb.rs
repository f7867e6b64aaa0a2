//! Writes a model as binary glTF 2.0: one scene, a node per group, a child node per part, one
//! primitive per mesh, positions and indices in one buffer.

use std::io::{self, Write};
use std::path::Path;

use glam::{Quat, Vec3};
use serde::Serialize;
use serde_json::{Value, json};

use super::{GenerateError, Model};
use crate::whole_file;

/// What was written. Triangles and vertices are counted once per object that shows them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct GlbStats {
    /// Number of objects: nodes that show a mesh.
    pub objects: usize,
    /// Triangles of all objects.
    pub triangles: usize,
    /// Vertices of all objects.
    pub vertices: usize,
    /// Size of the file.
    pub bytes: u64,
}

const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Bytes of the file header and of the two chunk headers.
const FRAMING_BYTES: u64 = 12 + 8 + 8;

#[derive(Serialize)]
struct Node {
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<usize>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    children: Vec<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    translation: Option<Vec3Json>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rotation: Option<[f32; 4]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    scale: Option<Vec3Json>,
}

type Vec3Json = [f32; 3];

impl Node {
    fn new(translation: Vec3, rotation: Quat, scale: Vec3) -> Self {
        // What is left out has these values.
        Self {
            name: None,
            mesh: None,
            children: Vec::new(),
            translation: (translation != Vec3::ZERO).then(|| translation.to_array()),
            rotation: (rotation != Quat::IDENTITY).then(|| rotation.to_array()),
            scale: (scale != Vec3::ONE).then(|| scale.to_array()),
        }
    }
}

/// Writes the model to `path`, through a temporary file beside it.
pub fn write(model: &Model, path: &Path) -> Result<GlbStats, GenerateError> {
    let layout = Layout::of(model);
    let document = json!({
        "asset": { "version": "2.0", "generator": concat!("hroc-preprocess ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "name": model.name, "nodes": roots(model) }],
        "materials": model.materials.iter().map(material).collect::<Vec<_>>(),
        "meshes": layout.meshes,
        "accessors": layout.accessors,
        "bufferViews": layout.buffer_views,
        "buffers": [{ "byteLength": layout.bytes }],
    });
    let mut json = document.to_string();
    drop(document);
    // The nodes are most of the text: written as they are, without a tree of values in between.
    json.pop();
    json.push_str(",\"nodes\":");
    json.push_str(&serde_json::to_string(&nodes(model)).expect("nodes are plain data"));
    json.push('}');
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }

    let bytes = FRAMING_BYTES + json.len() as u64 + layout.bytes;
    if u32::try_from(bytes).is_err() {
        return Err(GenerateError::TooLarge { bytes });
    }
    whole_file::write(path, |file| {
        let mut put = |bytes: &[u8]| file.write_all(bytes);
        let word = |n: u64| (n as u32).to_le_bytes();
        put(b"glTF")?;
        put(&2_u32.to_le_bytes())?;
        put(&word(bytes))?;
        put(&word(json.len() as u64))?;
        put(b"JSON")?;
        put(json.as_bytes())?;
        put(&word(layout.bytes))?;
        put(b"BIN\0")?;
        write_geometry(model, file)
    })
    .map_err(super::write_error(path))?;
    let sum = |count: fn(&super::Shape) -> usize| {
        model
            .parts()
            .map(|part| count(&model.meshes[part.mesh].shape))
            .sum()
    };
    Ok(GlbStats {
        objects: model.parts().count(),
        triangles: sum(super::Shape::triangle_count),
        vertices: sum(super::Shape::vertex_count),
        bytes,
    })
}

fn material(material: &super::Material) -> Value {
    let [r, g, b] = material.base_color;
    json!({
        "name": material.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9,
        },
    })
}

/// Node indices of the groups: each is followed by its parts.
fn roots(model: &Model) -> Vec<usize> {
    let mut next = 0;
    let root = |group: &super::Group| {
        let root = next;
        next += 1 + group.parts.len();
        root
    };
    model.groups.iter().map(root).collect()
}

fn nodes(model: &Model) -> Vec<Node> {
    let mut nodes = Vec::with_capacity(model.groups.len() + model.parts().count());
    for group in &model.groups {
        let first = nodes.len() + 1;
        nodes.push(Node {
            name: Some(group.name.clone()),
            children: (first..first + group.parts.len()).collect(),
            ..Node::new(group.translation, group.rotation, Vec3::ONE)
        });
        nodes.extend(group.parts.iter().map(|part| Node {
            mesh: Some(part.mesh),
            ..Node::new(part.translation, part.rotation, part.scale)
        }));
    }
    nodes
}

/// Whether a mesh has 16-bit indices.
fn has_short_indices(model: &Model, mesh: &super::Mesh) -> bool {
    // 65535 itself would restart the primitive.
    !model.wide_indices && mesh.shape.vertex_count() <= usize::from(u16::MAX)
}

/// Bytes of a mesh's indices, with what follows them: accessors start at multiples of four bytes.
fn index_bytes(model: &Model, mesh: &super::Mesh) -> u64 {
    let each = if has_short_indices(model, mesh) { 2 } else { 4 };
    (each * mesh.shape.indices.len() as u64).next_multiple_of(4)
}

/// Where everything lies in the buffer: all positions, then all indices.
struct Layout {
    bytes: u64,
    buffer_views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
}

impl Layout {
    fn of(model: &Model) -> Self {
        let (mut accessors, mut meshes) = (Vec::new(), Vec::new());
        let mut position_bytes = 0;
        for mesh in &model.meshes {
            let positions = &mesh.shape.positions;
            let fold = |start: Vec3, pick: fn(Vec3, Vec3) -> Vec3| {
                positions.iter().copied().fold(start, pick).to_array()
            };
            accessors.push(json!({
                "bufferView": 0, "byteOffset": position_bytes, "componentType": FLOAT,
                "count": positions.len(), "type": "VEC3",
                "min": fold(Vec3::INFINITY, Vec3::min), "max": fold(Vec3::NEG_INFINITY, Vec3::max),
            }));
            position_bytes += size_of_val(positions.as_slice()) as u64;
        }
        let mut all_index_bytes = 0;
        for (position, mesh) in model.meshes.iter().enumerate() {
            let short = has_short_indices(model, mesh);
            accessors.push(json!({
                "bufferView": 1, "byteOffset": all_index_bytes,
                "componentType": if short { UNSIGNED_SHORT } else { UNSIGNED_INT },
                "count": mesh.shape.indices.len(), "type": "SCALAR",
            }));
            all_index_bytes += index_bytes(model, mesh);
            meshes.push(json!({
                "name": mesh.name,
                "primitives": [{
                    "attributes": { "POSITION": position },
                    "indices": model.meshes.len() + position,
                    "material": mesh.material,
                }],
            }));
        }
        let buffer_views = vec![
            json!({
                "buffer": 0, "byteOffset": 0, "byteLength": position_bytes,
                "byteStride": 12, "target": ARRAY_BUFFER,
            }),
            json!({
                "buffer": 0, "byteOffset": position_bytes,
                "byteLength": all_index_bytes, "target": ELEMENT_ARRAY_BUFFER,
            }),
        ];
        Self {
            bytes: position_bytes + all_index_bytes,
            buffer_views,
            accessors,
            meshes,
        }
    }
}

/// Writes the buffer.
fn write_geometry(model: &Model, file: &mut dyn Write) -> io::Result<()> {
    for mesh in &model.meshes {
        let positions = mesh.shape.positions.iter();
        let bytes: Vec<u8> = positions
            .flat_map(|p| p.to_array().map(f32::to_le_bytes))
            .flatten()
            .collect();
        file.write_all(&bytes)?;
    }
    for mesh in &model.meshes {
        let indices = mesh.shape.indices.iter();
        let mut bytes: Vec<u8> = if has_short_indices(model, mesh) {
            indices.flat_map(|&i| (i as u16).to_le_bytes()).collect()
        } else {
            indices.flat_map(|i| i.to_le_bytes()).collect()
        };
        bytes.resize(index_bytes(model, mesh) as usize, 0);
        file.write_all(&bytes)?;
    }
    Ok(())
}
