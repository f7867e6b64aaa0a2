//! A scene as the importers deliver it and the bake consumes it: plain triangles, every transform in
//! f64, nothing shared with any file format.

use glam::{DAffine3, DQuat, DVec3};
use std::path::PathBuf;

/// Everything read from the inputs.
#[derive(Clone, Debug, Default)]
pub struct SourceScene {
    /// File stem of the first input.
    pub name: String,
    /// The inputs, in the order given.
    pub files: Vec<SourceFile>,
    /// The files those refer to, in the order they were looked for.
    pub referenced_files: Vec<ReferencedFile>,
    /// Files that the inputs name and that need not have been read, such as images.
    pub unread_files: Vec<PathBuf>,
    /// The scene that was asked for, where a file has several.
    pub choice: Option<String>,
    /// Meshes; several objects may share one.
    pub meshes: Vec<SourceMesh>,
    /// For each mesh how far the importer moved a vertex from where the file has it, in object space: it rounds
    /// coordinates to f32. Meshes behind the end of the list were not moved.
    pub position_errors: Vec<f64>,
    /// Objects in source order: file by file, node by node (depth first), primitive by primitive.
    pub objects: Vec<SourceObject>,
    /// The library that read each of the files.
    pub loaders: Vec<&'static str>,
    /// Names of materials, and which one each object has.
    pub materials: Materials,
    /// Cameras of the source.
    pub cameras: Vec<SourceCamera>,
    /// What was left out or read differently from what the file says; shown to the user.
    pub warnings: Vec<String>,
}

/// Names of materials, and which one each object has. They are for people: what a material looks like is in the object.
#[derive(Clone, Debug, Default)]
pub struct Materials {
    /// Of all files, one after the other.
    pub names: Vec<String>,
    /// For each object a number of a name, or [`NONE`](Self::NONE). Objects behind the end of the list have none.
    pub of_object: Vec<u32>,
}

impl Materials {
    /// The number of no material.
    pub const NONE: u32 = u32::MAX;

    /// Notes the material of an object.
    pub fn set(&mut self, object: usize, material: u32) {
        if self.of_object.len() <= object {
            self.of_object.resize(object + 1, Self::NONE);
        }
        self.of_object[object] = material;
    }
}

/// One input file.
#[derive(Clone, Debug)]
pub struct SourceFile {
    /// File name without folders.
    pub name: String,
    /// xxh3 of its bytes.
    pub hash: u64,
}

/// A file that an input refers to: a buffer, a material library.
#[derive(Clone, Debug)]
pub struct ReferencedFile {
    /// Its path from the input's folder, as the input spells it.
    pub name: String,
    /// Where that leads to from here.
    pub path: PathBuf,
    /// xxh3 of its bytes; 0 where it could not be read and the import went on without.
    pub hash: u64,
    /// Index into [`SourceScene::files`].
    pub by: usize,
}

/// Triangles in object space. Every index is below `positions.len()`, the number of indices is a
/// multiple of three and positions are finite: importers guarantee it.
#[derive(Clone, Debug, Default)]
pub struct SourceMesh {
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Empty, or one unit normal per vertex.
    pub normals: Vec<[f32; 3]>,
    /// Empty, or one texture coordinate per vertex.
    pub uvs: Vec<[f32; 2]>,
    /// Triangle list.
    pub indices: Vec<u32>,
}

impl SourceMesh {
    /// Bytes of its arrays.
    pub fn byte_count(&self) -> u64 {
        let bytes = size_of_val(self.positions.as_slice())
            + size_of_val(self.normals.as_slice())
            + size_of_val(self.uvs.as_slice())
            + size_of_val(self.indices.as_slice());
        bytes as u64
    }
}

/// How an object's alpha is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AlphaMode {
    /// Ignored.
    #[default]
    Opaque,
    /// Cuts holes.
    Masked,
    /// Blends with what lies behind.
    Blended,
}

/// A mesh under one transform.
#[derive(Clone, Debug)]
pub struct SourceObject {
    /// Index into [`SourceScene::meshes`].
    pub mesh: usize,
    /// Object space to the source's world, any affine map.
    pub world_from_object: DAffine3,
    /// Linear RGBA in 0..=1.
    pub base_color: [f32; 4],
    /// From the material.
    pub alpha: AlphaMode,
    /// From the material.
    pub double_sided: bool,
    /// The source's name for it; may be empty.
    pub name: String,
    /// Index into [`SourceScene::files`].
    pub file: usize,
    /// glTF node index, or the running number of the OBJ group.
    pub node: usize,
    /// Primitive within the glTF mesh, or number of the material within the OBJ group. Objects of one file and node
    /// are parts of one thing: they share the grid of 16-bit positions.
    pub primitive: usize,
}

/// A camera of the source.
#[derive(Clone, Debug)]
pub struct SourceCamera {
    /// May be empty.
    pub name: String,
    /// In the source's world.
    pub position: DVec3,
    /// The camera looks along its -z, y up.
    pub orientation: DQuat,
    /// Perspective: full vertical field of view in radians. Orthographic: 0.
    pub fov_y_rad: f32,
    /// Orthographic: half the height of the view volume. Perspective: 0.
    pub half_height: f32,
    /// Near plane distance.
    pub near: f32,
    /// Far plane distance; infinite where the source gives none.
    pub far: f32,
}

impl SourceCamera {
    /// Whether it can show anything: a finite place, one of the two lenses, planes in order.
    pub fn is_usable(&self) -> bool {
        let perspective = self.fov_y_rad > 0.0 && self.fov_y_rad < std::f32::consts::PI;
        let orthographic = self.half_height > 0.0 && self.half_height.is_finite();
        let least_near = if perspective { f32::MIN_POSITIVE } else { 0.0 };
        self.position.is_finite()
            && self.orientation.is_finite()
            && perspective != orthographic
            && self.near >= least_near
            && self.far > self.near
    }
}
