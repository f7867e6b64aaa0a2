//! Whether a baked file is what the bake would write again.

use crate::bake::GENERATOR;
use crate::import::hash_referenced;
use hroc_format::BakedScene;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3Default;

/// The baked file at `output`, if `verify` calls it good and this version made it with these `settings` from the very
/// bytes that `inputs` and the files they refer to hold now. Times of files do not matter.
///
/// The content is checked last, because it takes the longest: most of the bytes have no meaning that could be checked
/// without the checksum.
pub(super) fn open(output: &Path, inputs: &[PathBuf], settings: &str) -> Option<BakedScene> {
    let baked = BakedScene::open(output).ok()?;
    is_current(&baked, inputs, settings)?;
    BakedScene::verify(output).ok()
}

/// Whether the file says that it was baked by this version with these `settings` from what `inputs` hold now.
fn is_current(baked: &BakedScene, inputs: &[PathBuf], settings: &str) -> Option<()> {
    let scene = baked.scene();
    let same_bake = scene.generator == *GENERATOR && scene.settings == *settings;
    if !same_bake || scene.source_files.len() != inputs.len() {
        return None;
    }
    for (path, file) in inputs.iter().zip(scene.source_files.iter()) {
        let name = path.file_name().unwrap_or_default();
        let same = *name.to_string_lossy() == *file.name && hash(path).ok()? == file.hash;
        if !same {
            return None;
        }
    }
    for file in scene.referenced_files.iter() {
        let by = inputs.get(file.by.to_native() as usize)?;
        if hash_referenced(by, &file.name) != file.hash {
            return None;
        }
    }
    Some(())
}

/// xxh3-64 of a file, which may be larger than memory.
fn hash(path: &Path) -> io::Result<u64> {
    let mut file = File::open(path)?;
    let mut hash = Xxh3Default::new();
    let mut buffer = vec![0; 1 << 20];
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(hash.digest()),
            Ok(read) => hash.update(&buffer[..read]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}
