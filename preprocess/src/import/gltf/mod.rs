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
mod drawing;
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
use accessor::Accessors;
use buffers::Buffers;
use document::{Document, without_bom};
use drawing::{Drawing, First};
use gltf::Glb;
use primitive::Primitives;
use std::path::{Path, PathBuf};

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
    let names = names.map(|(number, material)| match &material.name {
        Some(name) if !name.is_empty() => name.clone(),
        _ => format!("material {number}"),
    });
    import.scene.materials.names.extend(names);
    let primitives = Primitives::new(accessors, import.options);
    let first = First {
        mesh: import.scene.meshes.len(),
        material: first_material,
    };
    let mut drawing = Drawing::new(root, primitives, first);
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
    let meshes = drawing.decode(|place, error| {
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
