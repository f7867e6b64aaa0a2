//! Whether the files that a command writes may be written: none of them is read, and no two are one file.

use hroc_format::folder_of;
use std::path::{Path, PathBuf};

/// Refuses an output that is one of the files `read`. `what` says what those are, as in "is an input".
///
/// # Errors
/// A message with the output and the next step.
pub fn refuse_inputs<'a>(
    outputs: &[&Path],
    read: impl IntoIterator<Item = &'a Path>,
    what: &str,
) -> Result<(), String> {
    let outputs: Vec<(&Path, Identity)> = outputs
        .iter()
        .map(|path| (*path, Identity::of(path)))
        .collect();
    for input in read {
        let input = Identity::of(input);
        if let Some((output, _)) = outputs.iter().find(|(_, output)| *output == input) {
            return Err(format!(
                "{}: {what}; name another file to write",
                output.display()
            ));
        }
    }
    Ok(())
}

/// Refuses two outputs that are one file. Each comes with the option that names it.
///
/// # Errors
/// A message with the output and the next step.
pub fn refuse_repetitions(outputs: &[(&str, &Path)]) -> Result<(), String> {
    for (at, (option, path)) in outputs.iter().enumerate() {
        let mut others = outputs[..at].iter();
        if let Some((_, other)) = others.find(|(_, other)| is_same_file(path, other)) {
            return Err(format!(
                "{option} names {}, which is written too; name another file",
                other.display()
            ));
        }
    }
    Ok(())
}

/// Whether two paths lead to one file, or will where neither is there yet: by a hard link, a symbolic link, another
/// spelling of a folder, or letters of another case where the file system does not tell them apart.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    Identity::of(a) == Identity::of(b)
}

/// What tells files apart.
enum Identity {
    /// A file that is there.
    File(same_file::Handle),
    /// The place of one that is not there or cannot be opened.
    Place(PathBuf),
    /// A path that leads nowhere.
    Nowhere,
}

impl Identity {
    fn of(path: &Path) -> Self {
        // Only regular files are opened: a pipe would wait for somebody to write to it.
        if path.is_file()
            && let Ok(file) = same_file::Handle::from_path(path)
        {
            return Self::File(file);
        }
        resolved(path).map_or(Self::Nowhere, Self::Place)
    }
}

impl PartialEq for Identity {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::File(a), Self::File(b)) => a == b,
            (Self::Place(a), Self::Place(b)) => a == b,
            _ => false,
        }
    }
}

/// The path without links and dots; of a file that is not there, its folder's.
fn resolved(path: &Path) -> Option<PathBuf> {
    let in_folder = || Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(in_folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_known_by_each_of_its_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("sub")).unwrap();
        std::fs::write(path("a"), "").unwrap();
        std::fs::write(path("b"), "").unwrap();
        assert!(is_same_file(&path("a"), &path("sub/../a")));
        assert!(!is_same_file(&path("a"), &path("b")));
        assert!(!is_same_file(&path("a"), &path("new")));
        assert!(is_same_file(&path("new"), &path("sub/../new")));
        assert!(!is_same_file(&path("new"), &path("sub/new")));
        assert!(!is_same_file(&path("none/new"), &path("none/new2")));
        std::fs::hard_link(path("a"), path("hard")).unwrap();
        assert!(is_same_file(&path("a"), &path("hard")));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("a", path("soft")).unwrap();
            std::os::unix::fs::symlink("sub", path("folder")).unwrap();
            assert!(is_same_file(&path("hard"), &path("soft")));
            assert!(is_same_file(&path("folder/new"), &path("sub/new")));
        }
    }
}
