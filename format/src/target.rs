//! Which file a writer replaces, and in which folder.

use std::io;
use std::path::{Path, PathBuf};

/// The file that a new one for `path` takes the place of: what a symbolic link leads to, so that the link stays one.
/// There need not be one yet.
///
/// # Errors
/// If it is a folder, a device, a pipe or write-protected, all of which a renamed file would replace or fail at; if a
/// link leads nowhere; if the path has no file name.
pub fn file_to_replace(path: &Path) -> io::Result<PathBuf> {
    let refused = |kind, reason| Err(io::Error::new(kind, reason));
    match path.metadata() {
        Ok(found) if found.is_dir() => {
            return refused(io::ErrorKind::IsADirectory, "it is a folder");
        }
        Ok(found) if !found.is_file() => {
            let reason = "it is a device or a pipe, not a file";
            return refused(io::ErrorKind::InvalidInput, reason);
        }
        Ok(found) if found.permissions().readonly() => {
            return refused(io::ErrorKind::PermissionDenied, "it is write-protected");
        }
        _ => {}
    }
    let target = if path.is_symlink() {
        path.canonicalize()?
    } else {
        path.to_owned()
    };
    match target.file_name() {
        Some(_) => Ok(target),
        None => refused(io::ErrorKind::InvalidInput, "it has no file name"),
    }
}

/// The folder that a file is in, or is to be in.
pub fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}
