//! Writes a model as binary glTF 2.0: one scene, a node per group, a child node per part, one
//! primitive per mesh, positions and indices in one buffer.

use std::io::{self, Write};
use std::path::Path;

use glam::{Quat, Vec3};
use serde::Serialize;
use serde_json::{Value, json};

use super::{GenerateError, Model};

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
    let (buffer, buffer_views, accessors, meshes) = geometry(model);
    let document = json!({
        "asset": { "version": "2.0", "generator": concat!("hroc-preprocess ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "name": model.name, "nodes": roots(model) }],
        "materials": model.materials.iter().map(material).collect::<Vec<_>>(),
        "meshes": meshes,
        "accessors": accessors,
        "bufferViews": buffer_views,
        "buffers": [{ "byteLength": buffer.len() }],
    });
    let mut json = document.to_string();
    // The nodes are most of the text: written as they are, without a tree of values in between.
    json.pop();
    json.push_str(",\"nodes\":");
    json.push_str(&serde_json::to_string(&nodes(model)).expect("nodes are plain data"));
    json.push('}');
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }

    let bytes = FRAMING_BYTES + json.len() as u64 + buffer.len() as u64;
    if u32::try_from(bytes).is_err() {
        return Err(GenerateError::TooLarge { bytes });
    }
    let failed = |source| GenerateError::Write {
        path: path.to_owned(),
        source,
    };
    write_file(json.as_bytes(), &buffer, bytes as u32, path).map_err(failed)?;
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

fn write_file(json: &[u8], buffer: &[u8], bytes: u32, path: &Path) -> io::Result<()> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let mut file = tempfile::NamedTempFile::new_in(folder.unwrap_or(Path::new(".")))?;
    let mut put = |bytes: &[u8]| file.write_all(bytes);
    let word = |n: usize| (n as u32).to_le_bytes();
    put(b"glTF")?;
    put(&2_u32.to_le_bytes())?;
    put(&bytes.to_le_bytes())?;
    put(&word(json.len()))?;
    put(b"JSON")?;
    put(json)?;
    put(&word(buffer.len()))?;
    put(b"BIN\0")?;
    put(buffer)?;
    file.as_file().sync_all()?;
    file.persist(path)?;
    Ok(())
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

/// The buffer (positions, then indices), its views, the accessors and the meshes.
fn geometry(model: &Model) -> (Vec<u8>, Vec<Value>, Vec<Value>, Vec<Value>) {
    let mut buffer: Vec<u8> = Vec::new();
    let (mut accessors, mut meshes) = (Vec::new(), Vec::new());
    for mesh in &model.meshes {
        let positions = &mesh.shape.positions;
        let min = positions
            .iter()
            .copied()
            .fold(Vec3::INFINITY, Vec3::min)
            .to_array();
        let max = positions
            .iter()
            .copied()
            .fold(Vec3::NEG_INFINITY, Vec3::max)
            .to_array();
        accessors.push(json!({
            "bufferView": 0, "byteOffset": buffer.len(), "componentType": FLOAT,
            "count": positions.len(), "type": "VEC3", "min": min, "max": max,
        }));
        for position in positions {
            buffer.extend(position.to_array().iter().flat_map(|x| x.to_le_bytes()));
        }
    }
    let position_bytes = buffer.len();
    for mesh in &model.meshes {
        let indices = &mesh.shape.indices;
        // 65535 itself would restart the primitive.
        let short = mesh.shape.vertex_count() <= usize::from(u16::MAX);
        accessors.push(json!({
            "bufferView": 1, "byteOffset": buffer.len() - position_bytes,
            "componentType": if short { UNSIGNED_SHORT } else { UNSIGNED_INT },
            "count": indices.len(), "type": "SCALAR",
        }));
        for &index in indices {
            if short {
                buffer.extend((index as u16).to_le_bytes());
            } else {
                buffer.extend(index.to_le_bytes());
            }
        }
        // Accessors start at multiples of four bytes.
        buffer.resize(buffer.len().next_multiple_of(4), 0);
        let position = meshes.len();
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
            "byteLength": buffer.len() - position_bytes, "target": ELEMENT_ARRAY_BUFFER,
        }),
    ];
    (buffer, buffer_views, accessors, meshes)
}
