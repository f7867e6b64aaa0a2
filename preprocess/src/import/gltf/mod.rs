//! glTF 2.0, text and binary: geometry, transforms, base colours and cameras. Images are never read.
//!
//! Container and JSON are the `gltf` crate's: [`gltf::Glb`] and the types of [`gltf::json`]. The views
//! of its `Document` and its accessor iterators are not used. They take every index and every size for
//! checked, but `Document::from_json` looks neither at buffers nor at cycles, itself panics on a wrong
//! POSITION index, and refuses legal files: every required extension it does not know, accessors
//! without a buffer view, any fault in what a bake never reads. So each index is looked up where it is
//! used, by [`document::get`], which names the place, and each size is checked in [`accessor`].
//!
//! Section numbers are those of the glTF 2.0 specification.

mod accessor;
mod animation;
mod buffers;
mod camera_path;
mod decode;
mod document;
mod extensions;
mod material;
mod meshopt;
mod nodes;
mod primitive;
mod skin;
mod uri;

use super::error::{ImportError, ImportErrorKind, Result};
use super::folder::Folder;
use super::{Import, ImportedCamera, MAX_OBJECTS};
use crate::scene::{SourceCamera, SourceObject};
use accessor::Accessors;
use buffers::Buffers;
use document::{Document, get, without_bom};
use glam::DAffine3;
use gltf::Glb;
use gltf::json::{Camera, Index, Node, Root};
use primitive::{Place, Primitives, Skipped};
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use camera_path::CameraChoice;

/// What reads glTF. A test compares the versions with those in use.
pub(super) const LOADER: &str = "gltf 1.4.1";

/// File name extensions of glTF.
pub(super) const EXTENSIONS: [&str; 2] = ["glb", "gltf"];

const GLB_MAGIC: &[u8] = b"glTF";

pub(super) fn is_glb(_: &Path, bytes: &[u8]) -> bool {
    bytes.starts_with(GLB_MAGIC)
}

/// A JSON object is taken for glTF whatever its name.
pub(super) fn is_gltf(_: &Path, bytes: &[u8]) -> bool {
    without_bom(bytes).trim_ascii_start().starts_with(b"{")
}

pub(super) fn import_glb(import: &mut Import<'_>) -> Result<()> {
    let glb = open_glb(import.bytes)?;
    import_document(import, &glb.json, glb.bin.as_deref())
}

fn open_glb(bytes: &[u8]) -> Result<Glb<'_>> {
    let Some(header) = bytes.first_chunk::<12>() else {
        return Err(ImportError::malformed(format!(
            "the file ends within its header: {} of 12 bytes",
            bytes.len()
        )));
    };
    // The crate subtracts the header's 12 bytes from the declared length without a check, and takes
    // bytes behind the declared end for chunks.
    let length = u32::from_le_bytes([header[8], header[9], header[10], header[11]]) as usize;
    if length < header.len() {
        return Err(ImportError::malformed(format!(
            "declares {length} bytes, less than its header"
        )));
    }
    Glb::from_slice(&bytes[..length.min(bytes.len())]).map_err(|error| {
        let what = match error {
            gltf::Error::Binary(gltf::binary::Error::Io(_)) => {
                "it ends within a chunk's header".into()
            }
            error => error.to_string(),
        };
        ImportError::malformed(format!("is not binary glTF 2.0: {what}"))
    })
}

pub(super) fn import_gltf(import: &mut Import<'_>) -> Result<()> {
    import_document(import, import.bytes, None)
}

/// A camera of the file in `folder`, which has these `bytes`.
pub(super) fn camera_path(
    folder: &Folder,
    bytes: &[u8],
    choice: CameraChoice<'_>,
) -> Result<ImportedCamera> {
    let glb;
    let (json, bin) = if bytes.starts_with(GLB_MAGIC) {
        glb = open_glb(bytes)?;
        (&*glb.json, glb.bin.as_deref())
    } else {
        (bytes, None)
    };
    let document = Document::parse(json)?;
    extensions::check_version(&document.root)?;
    let buffers = Buffers::new(&document.root, bin, folder);
    let accessors = Accessors::new(&document.root, &buffers);
    let animations = animation::read(&document, json)?;
    Ok(ImportedCamera {
        path: camera_path::camera_path(&document, &animations, &accessors, choice)?,
        files: named_files(&document, folder).collect(),
    })
}

/// The files that the document names, whether they are read or not.
fn named_files(document: &Document, folder: &Folder) -> impl Iterator<Item = PathBuf> {
    let uris = document.uris().filter(|uri| !uri::is_data(uri));
    let names = uris.flat_map(|uri| uri::file_names(uri).unwrap_or_default());
    names.map(|name| folder.beside(&name))
}

fn import_document(import: &mut Import<'_>, json: &[u8], bin: Option<&[u8]>) -> Result<()> {
    let document = Document::parse(json)?;
    let root = &document.root;
    extensions::check_version(root)?;
    for warning in extensions::check(root)? {
        import.warn(warning);
    }
    let unread = named_files(&document, import.folder);
    import.scene.unread_files.extend(unread);
    let buffers = Buffers::new(root, bin, import.folder);
    let accessors = Accessors::new(root, &buffers);
    let first_material = import.scene.materials.names.len();
    let names = root.materials.iter().enumerate();
    import
        .scene
        .materials
        .names
        .extend(names.map(|(number, material)| {
            let name = material.name.clone().unwrap_or_default();
            if name.is_empty() {
                format!("material {number}")
            } else {
                name
            }
        }));
    let mut drawing = Drawing {
        first_material,
        root,
        primitives: Primitives::new(accessors, import.options),
        skipped: Skipped::default(),
        unskinned: 0,
        instanced_skins: 0,
        undrawn_instances: 0,
        first_mesh: import.scene.meshes.len(),
    };
    let placed = nodes::place(&document, import.options.scene.as_deref())?;
    if placed.hidden > 0 {
        import.warn(format_args!(
            "nodes that KHR_node_visibility hides, left out: {}",
            placed.hidden
        ));
    }
    for (count, what) in [
        (
            placed.listed_again,
            "nodes listed twice, or by the scene and below another node of it, drawn once",
        ),
        (
            placed.detached,
            "nodes of the scene below nodes outside it, drawn without the transform of those",
        ),
    ] {
        if count > 0 {
            import.warn(format_args!("{what}: {count}"));
        }
    }
    if root.scenes.is_empty() && !root.nodes.is_empty() {
        import.warn("the file has no scene; all its root nodes are taken");
    }
    for &(node, world_from_node) in &placed.drawn {
        drawing
            .node(import, &placed, node, world_from_node)
            .map_err(|error| error.within(named("node", node, &root.nodes[node].name)))?;
    }
    drawing.warn(import);
    let meshes = drawing.primitives.decode(|place, error| {
        let mesh = named("mesh", place.mesh, &root.meshes[place.mesh].name);
        let node = named("node", place.node, &root.nodes[place.node].name);
        error
            .within(format_args!("{mesh}, primitive {}", place.primitive))
            .within(node)
    })?;
    import.scene.meshes.extend(meshes);
    Ok(())
}

/// `node 3 "door"`, for error messages.
fn named(what: &str, index: usize, name: &Option<String>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{what} {index} {name:?}"),
        _ => format!("{what} {index}"),
    }
}

/// Turns nodes into objects and cameras.
struct Drawing<'a> {
    root: &'a Root,
    primitives: Primitives<'a>,
    skipped: Skipped,
    /// Skinned nodes drawn without their skin.
    unskinned: usize,
    /// Skinned nodes with instances.
    instanced_skins: usize,
    /// Instances of such nodes that could not be placed.
    undrawn_instances: usize,
    /// Meshes of the files before this one.
    first_mesh: usize,
    /// Materials of the files before this one.
    first_material: usize,
}

impl Drawing<'_> {
    fn node(
        &mut self,
        import: &mut Import<'_>,
        placed: &nodes::Placed,
        index: usize,
        world_from_node: DAffine3,
    ) -> Result<()> {
        let node = &self.root.nodes[index];
        if let Some(camera) = node.camera {
            self.camera(import, node, camera, world_from_node)?;
        }
        let Some(mesh_index) = node.mesh else {
            return Ok(());
        };
        let mesh = get(self.root, mesh_index, "mesh")?;
        let place = || named("mesh", mesh_index.value(), &mesh.name);

        let skin = self.skin(placed, node)?;
        let mut instances = self.instances(node)?;
        let world_from_object = match &skin {
            Some(joints) => joints.world_from_vertices(),
            None => world_from_node,
        };
        if let (Some(joints), Some(instances)) = (&skin, &mut instances) {
            self.place_skinned(instances, joints, world_from_node);
        } else {
            for node_from_instance in instances.iter_mut().flatten() {
                *node_from_instance = world_from_node * *node_from_instance;
            }
        }
        let weights = node.weights.as_ref().or(mesh.weights.as_ref());

        // Read every primitive once, before the instances multiply it.
        let mut parts = Vec::new();
        let mut materials = Vec::new();
        for (primitive_index, primitive) in mesh.primitives.iter().enumerate() {
            let place = || format!("{}, primitive {primitive_index}", place());
            let deform = primitive::Deform {
                weights,
                skin: skin.as_ref().map(|joints| (index, joints)),
            };
            let mesh = self
                .primitives
                .read(
                    primitive,
                    Place {
                        node: index,
                        mesh: mesh_index.value(),
                        primitive: primitive_index,
                    },
                    deform,
                    &mut self.skipped,
                )
                .map_err(|error| error.within(place()))?;
            let Some(mesh) = mesh else { continue };
            let look = material::look(self.root, primitive.material)
                .map_err(|error| error.within(place()))?;
            let material = primitive.material;
            materials.push(material.map(|material| self.first_material + material.value()));
            parts.push((primitive_index, self.first_mesh + mesh, look));
        }

        let name = [&node.name, &mesh.name]
            .into_iter()
            .flatten()
            .find(|name| !name.is_empty());
        let name = name.map(String::as_str).unwrap_or_default();
        let file = import.file;
        let objects = &mut import.scene.objects;
        let first_object = objects.len();
        let count = parts
            .len()
            .saturating_mul(instances.as_ref().map_or(1, Vec::len));
        if objects.len().saturating_add(count) > MAX_OBJECTS {
            let what = format!("the scene has more than {MAX_OBJECTS} objects");
            return Err(ImportError::new(ImportErrorKind::TooLarge, what));
        }
        let mut draw = |world_from_object: DAffine3, name: &str| {
            objects.extend(parts.iter().map(|&(primitive, mesh, look)| SourceObject {
                mesh,
                world_from_object,
                base_color: look.base_color,
                alpha: look.alpha,
                double_sided: look.double_sided,
                name: name.to_owned(),
                file,
                node: index,
                primitive,
            }));
        };
        match instances {
            None => draw(world_from_object, name),
            Some(instances) => {
                for (number, world_from_instance) in instances.into_iter().enumerate() {
                    draw(world_from_instance, &format!("{name}[{number}]"));
                }
            }
        }
        // Each instance has all primitives in turn.
        let drawn = first_object..import.scene.objects.len();
        for (object, material) in drawn.zip(materials.iter().cycle()) {
            if let Some(material) = *material {
                import.scene.materials.set(object, material as u32);
            }
        }
        Ok(())
    }

    /// The transforms of a node's instances; `None` for a node that is drawn once.
    fn instances(&self, node: &Node) -> Result<Option<Vec<DAffine3>>> {
        const NAME: &str = "EXT_mesh_gpu_instancing";
        let Some(extensions) = &node.extensions else {
            return Ok(None);
        };
        extensions::read(&extensions.others, &[NAME])?
            .map(|instancing| nodes::instances(self.primitives.accessors(), &instancing))
            .transpose()
            .map_err(|error| error.within(NAME))
    }

    /// Turns the transforms of a skinned node's instances, each within the node, into those of its objects.
    ///
    /// glTF says nothing about skins and instances together: a skin ignores its node's transform, an instance is
    /// placed by it. Here the skin poses the vertices first, then the instance moves them within the node, as it moves
    /// those of a mesh without a skin. A node that flattens everything has no such space; one object is left.
    fn place_skinned(
        &mut self,
        instances: &mut Vec<DAffine3>,
        joints: &skin::Joints,
        world_from_node: DAffine3,
    ) {
        let world_from_vertices = joints.world_from_vertices();
        let node_from_world = world_from_node.inverse();
        self.instanced_skins += 1;
        if !node_from_world.is_finite() {
            self.undrawn_instances += instances.len().saturating_sub(1);
            instances.truncate(1);
            instances.fill(world_from_vertices);
            return;
        }
        for instance in instances {
            *instance = world_from_node * *instance * node_from_world * world_from_vertices;
        }
    }

    /// The joint matrices of a skinned node; `None` for others and where the skin cannot be applied.
    fn skin(&mut self, placed: &nodes::Placed, node: &Node) -> Result<Option<Arc<skin::Joints>>> {
        let Some(index) = node.skin else {
            return Ok(None);
        };
        let skin = get(self.root, index, "skin")?;
        let joints = skin::joints(self.primitives.accessors(), skin, placed)
            .map_err(|error| error.within(named("skin", index.value(), &skin.name)))?;
        self.unskinned += usize::from(joints.is_none());
        Ok(joints.map(Arc::new))
    }

    fn camera(
        &self,
        import: &mut Import<'_>,
        node: &Node,
        index: Index<Camera>,
        world_from_node: DAffine3,
    ) -> Result<()> {
        let camera = get(self.root, index, "camera")?;
        let name = [&node.name, &camera.name]
            .into_iter()
            .flatten()
            .find(|name| !name.is_empty());
        let (perspective, orthographic) =
            (camera.perspective.as_ref(), camera.orthographic.as_ref());
        let (near, far) = match (perspective, orthographic) {
            (Some(lens), _) => (lens.znear, lens.zfar.unwrap_or(f32::INFINITY)),
            (None, Some(lens)) => (lens.znear, lens.zfar),
            (None, None) => (0.0, 0.0),
        };
        let source = SourceCamera {
            name: name.cloned().unwrap_or_default(),
            position: world_from_node.translation,
            orientation: nodes::rotation(&world_from_node),
            fov_y_rad: perspective.map_or(0.0, |lens| lens.yfov),
            half_height: orthographic.map_or(0.0, |lens| lens.ymag),
            near,
            far,
        };
        if source.is_usable() {
            import.scene.cameras.push(source);
        } else {
            import.warn(format_args!("camera {index} has no usable lens; left out"));
        }
        Ok(())
    }

    fn warn(&self, import: &mut Import<'_>) {
        self.skipped
            .warnings()
            .into_iter()
            .for_each(|warning| import.warn(warning));
        if self.unskinned > 0 {
            import.warn(format_args!(
                "skinned nodes with joints outside the scene, drawn under their own transform: {}",
                self.unskinned
            ));
        }
        if self.instanced_skins > 0 {
            import.warn(format_args!(
                "skinned nodes with EXT_mesh_gpu_instancing, which glTF leaves undefined, posed once and then drawn at \
                 every instance: {}",
                self.instanced_skins
            ));
        }
        if self.undrawn_instances > 0 {
            import.warn(format_args!(
                "instances of skinned nodes whose transform has no inverse, left out: {}",
                self.undrawn_instances
            ));
        }
    }
}
