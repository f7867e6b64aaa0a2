//! Reads scene files into a [`SourceScene`].
//!
//! An importer is one row of `IMPORTERS`: it says whether the first bytes (or, for text without a
//! magic number, the file name) are its format, and appends what it reads. Content decides before the
//! name does, so a mislabelled file is read for what it is or refused for what it is.
//!
//! An *object* is a mesh primitive under one transform; objects that draw the same primitive share
//! its mesh. Ids are dense and in source order, file by file. Points and lines are skipped and counted
//! in a warning. A scene without triangles is empty, with a warning, and no error.

mod error;
mod folder;
mod gltf;
mod obj;

pub use error::{ImportError, ImportErrorKind};
pub(crate) use folder::beside;
pub use gltf::CameraChoice;

use crate::camera_path::CameraPath;
use crate::progress::Progress;
use crate::scene::{SourceFile, SourceScene};
use error::Result;
use folder::Folder;
use std::path::{Path, PathBuf};

/// More objects than this are refused: instancing lets a small file ask for any number of them.
pub const MAX_OBJECTS: usize = 1 << 23;

/// What to read beside positions and indices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportOptions {
    /// The scene of each glTF file, by name or else by index; the file's own choice by default.
    pub scene: Option<String>,
    /// Vertex normals.
    pub normals: bool,
    /// The first set of texture coordinates.
    pub uvs: bool,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            scene: None,
            normals: true,
            uvs: false,
        }
    }
}

/// A file being imported, and where its content goes.
pub(crate) struct Import<'a> {
    /// Its content.
    bytes: &'a [u8],
    /// Its index in [`SourceScene::files`].
    file: usize,
    /// The folder it lies in.
    folder: &'a Folder,
    options: &'a ImportOptions,
    scene: &'a mut SourceScene,
}

impl Import<'_> {
    /// Adds a warning, with the file's name in front.
    fn warn(&mut self, what: impl std::fmt::Display) {
        let name = &self.scene.files[self.file].name;
        self.scene.warnings.push(format!("{name}: {what}"));
    }
}

/// One file format.
struct Importer {
    /// The library that reads it, and its version.
    loader: &'static str,
    /// Whether the file is of this format.
    accepts: fn(&Path, &[u8]) -> bool,
    import: fn(&mut Import<'_>) -> Result<()>,
}

/// All formats, in the order they are asked.
const IMPORTERS: &[Importer] = &[
    Importer {
        loader: gltf::LOADER,
        accepts: gltf::is_glb,
        import: gltf::import_glb,
    },
    Importer {
        loader: gltf::LOADER,
        accepts: gltf::is_gltf,
        import: gltf::import_gltf,
    },
    Importer {
        loader: obj::LOADER,
        accepts: obj::is_obj,
        import: obj::import,
    },
];

/// Reads the files at `paths`, in order, into one scene.
///
/// # Errors
/// Any fault of any file; the error names the file, the place and the next step.
pub fn import(
    paths: &[PathBuf],
    options: &ImportOptions,
    progress: &dyn Progress,
) -> Result<SourceScene, ImportError> {
    let mut scene = empty_scene(paths.first().map(PathBuf::as_path), options);
    progress.stage("import", paths.len() as u64);
    for path in paths {
        let bytes = read(path).map_err(|error| error.in_file(path))?;
        import_file(path, &bytes, options, &mut scene).map_err(|error| error.in_file(path))?;
        progress.advance(1);
    }
    warn_if_empty(&mut scene);
    Ok(scene)
}

/// Reads a scene file whose content is at hand. What it refers to is looked for beside `path`.
///
/// # Errors
/// As [`import`].
pub fn import_bytes(
    path: &Path,
    bytes: &[u8],
    options: &ImportOptions,
) -> Result<SourceScene, ImportError> {
    let mut scene = empty_scene(Some(path), options);
    import_file(path, bytes, options, &mut scene).map_err(|error| error.in_file(path))?;
    warn_if_empty(&mut scene);
    Ok(scene)
}

fn empty_scene(first: Option<&Path>, options: &ImportOptions) -> SourceScene {
    let stem = first.and_then(Path::file_stem).unwrap_or_default();
    SourceScene {
        name: stem.to_string_lossy().into_owned(),
        choice: options.scene.clone(),
        ..Default::default()
    }
}

fn warn_if_empty(scene: &mut SourceScene) {
    if scene.objects.is_empty() {
        scene.warnings.push("the scene has no triangles".into());
    }
}

/// A camera of a glTF file.
#[derive(Clone, Debug)]
pub struct ImportedCamera {
    /// Its way, at rest, or as the file's animations move it.
    pub path: CameraPath,
    /// The files that the given one refers to, read or not.
    pub files: Vec<PathBuf>,
}

/// Reads a camera of a glTF file.
///
/// # Errors
/// If the file is no glTF, has no such camera, or any fault in what moves it.
pub fn camera_path(path: &Path, choice: CameraChoice<'_>) -> Result<ImportedCamera, ImportError> {
    let read = || {
        let bytes = read(path)?;
        if !gltf::is_glb(path, &bytes) && !gltf::is_gltf(path, &bytes) {
            let what = "is no glTF, the one format whose cameras are read";
            return Err(ImportError::new(ImportErrorKind::UnknownFormat, what)
                .next("give a .glb or .gltf file"));
        }
        gltf::camera_path(&Folder::of(path, 0), &bytes, choice)
    };
    read().map_err(|error| error.in_file(path))
}

/// The hash that [`import`] gives a file that the input at `by` refers to; 0 where it cannot be read.
pub fn hash_referenced(by: &Path, name: &str) -> u64 {
    let folder = Folder::of(by, 0);
    // A name that is not UTF-8 was noted percent-encoded.
    let encoded = || folder.read_named(&folder::percent_decode(name));
    let bytes = folder.read(name).or_else(|_| encoded());
    bytes.map_or(0, |bytes| xxhash_rust::xxh3::xxh3_64(&bytes))
}

fn import_file(
    path: &Path,
    bytes: &[u8],
    options: &ImportOptions,
    scene: &mut SourceScene,
) -> Result<()> {
    let importer = IMPORTERS
        .iter()
        .find(|importer| (importer.accepts)(path, bytes))
        .ok_or_else(|| unknown_format(path, bytes))?;
    let name = path
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let hash = xxhash_rust::xxh3::xxh3_64(bytes);
    scene.files.push(SourceFile { name, hash });
    scene.loaders.push(importer.loader);
    let file = scene.files.len() - 1;
    let folder = Folder::of(path, file);
    let mut import = Import {
        bytes,
        file,
        folder: &folder,
        options,
        scene,
    };
    (importer.import)(&mut import)?;
    scene.referenced_files.extend(folder.into_looked_for());
    Ok(())
}

fn read(path: &Path) -> Result<Vec<u8>> {
    let unreadable = |what: String| ImportError::new(ImportErrorKind::Unreadable, what);
    if path.is_dir() {
        return Err(unreadable("is a folder".into()).next("give the scene file inside it"));
    }
    folder::read_regular(path).map_err(|error| unreadable(format!("cannot be read: {error}")))
}

/// Says what a file that no importer accepts looks like.
fn unknown_format(path: &Path, bytes: &[u8]) -> ImportError {
    let unknown = |what: &str| ImportError::new(ImportErrorKind::UnknownFormat, what);
    if bytes.is_empty() {
        return unknown("is empty").next("export the scene again");
    }
    if bytes.starts_with(&hroc_format::MAGIC) {
        return unknown("is a baked scene already")
            .next("look at it with `hroc-bake inspect`, or give the scene it was baked from");
    }
    const KNOWN: &[(&[u8], &str)] = &[
        (b"\x89PNG", "is a PNG image"),
        (b"\xFF\xD8\xFF", "is a JPEG image"),
        (b"PK\x03\x04", "is a ZIP archive"),
        (b"\x1F\x8B", "is gzip-compressed"),
        (b"Kaydara FBX", "is an FBX scene"),
        (b"BLENDER", "is a Blender scene"),
        (b"ply", "is a PLY mesh"),
        (b"<", "is XML or HTML"),
        (b"\xFE\xFF", "is UTF-16 text, not UTF-8"),
        (b"\xFF\xFE", "is UTF-16 text, not UTF-8"),
    ];
    if let Some((_, what)) = KNOWN.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        return unknown(what);
    }
    match path.extension() {
        Some(extension)
            if gltf::EXTENSIONS
                .iter()
                .any(|known| extension.eq_ignore_ascii_case(known)) =>
        {
            unknown("is neither binary glTF nor a JSON object").next("export the scene again")
        }
        _ => unknown("is in no known scene format"),
    }
}
