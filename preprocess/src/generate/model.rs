//! A generated scene before it is written: meshes, and groups of parts that show them.

use glam::{Quat, Vec3};

use super::Shape;
use crate::camera_path::CameraPath;

/// A flat colour.
#[derive(Clone, Debug)]
pub struct Material {
    /// What it is.
    pub name: &'static str,
    /// Linear RGB.
    pub base_color: [f32; 3],
}

/// A shape in a material; any number of parts may show it.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// What it is.
    pub name: String,
    /// Index into [`Model::materials`].
    pub material: usize,
    /// The triangles, metres, y up.
    pub shape: Shape,
}

/// An object: a mesh, scaled, turned and moved within its group.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Index into [`Model::meshes`].
    pub mesh: usize,
    /// In the group.
    pub translation: Vec3,
    /// In the group.
    pub rotation: Quat,
    /// Per axis, before the rotation; positive.
    pub scale: Vec3,
}

/// Parts that stand together, such as a building.
#[derive(Clone, Debug)]
pub struct Group {
    /// What it is.
    pub name: String,
    /// In world.
    pub translation: Vec3,
    /// In world.
    pub rotation: Quat,
    /// The objects.
    pub parts: Vec<Part>,
}

/// A scene.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// The generator and its parameters.
    pub name: String,
    /// The materials.
    pub materials: Vec<Material>,
    /// The meshes.
    pub meshes: Vec<Mesh>,
    /// The groups, in source order.
    pub groups: Vec<Group>,
    /// Write every index in 32 bits, as exporters do that do not look for a shorter type.
    pub wide_indices: bool,
    /// Ways through the scene; the first is named [`MAIN_PATH`].
    pub paths: Vec<ScenePath>,
}

/// Name of the path that every generated scene has.
pub const MAIN_PATH: &str = "walk";

/// A way through a generated scene.
#[derive(Clone, Debug)]
pub struct ScenePath {
    /// Lower case, words joined by hyphens.
    pub name: &'static str,
    /// The way.
    pub path: CameraPath,
}

impl Model {
    /// Adds a mesh and returns its index.
    pub fn add_mesh(&mut self, name: impl Into<String>, material: usize, shape: Shape) -> usize {
        self.meshes.push(Mesh {
            name: name.into(),
            material,
            shape,
        });
        self.meshes.len() - 1
    }

    /// All parts, in source order.
    pub fn parts(&self) -> impl Iterator<Item = &Part> {
        self.groups.iter().flat_map(|group| &group.parts)
    }
}
