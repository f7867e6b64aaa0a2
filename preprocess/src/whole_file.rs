//! Files that appear whole or not at all.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use hroc_format::{file_to_replace, folder_of};

/// Writes a file through a temporary one beside it, readable as any new file is. A symbolic link stays one: its
/// target is replaced.
pub(crate) fn write(
    path: &Path,
    contents: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let target = file_to_replace(path)?;
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Less what the user's mask takes away.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder_of(&target))?;
    let mut out = BufWriter::new(file);
    contents(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.as_file().sync_all()?;
    file.persist(target)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn only_files_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        let put = |path: &Path, text: &[u8]| write(path, |out| out.write_all(text));
        put(&file, b"old").unwrap();
        assert!(put(folder.path(), b"").is_err());
        #[cfg(unix)]
        {
            let link = folder.path().join("link");
            std::os::unix::fs::symlink("file", &link).unwrap();
            put(&link, b"new").unwrap();
            assert!(link.is_symlink());
            assert_eq!(fs::read(&file).unwrap(), b"new");
            // Never the device itself: a test that fails must leave it alone.
            let null = folder.path().join("null");
            std::os::unix::fs::symlink("/dev/null", &null).unwrap();
            assert!(put(&null, b"").is_err() && null.is_symlink());
        }
    }
}
