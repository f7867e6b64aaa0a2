//! Reads the files that a scene refers to: from the scene's own folder and below, from nowhere else.

use super::error::{ImportError, ImportErrorKind, Result};
use crate::scene::ReferencedFile;
use hroc_format::folder_of;
use std::cell::RefCell;
use std::fs;
use std::path::{Component, Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// The folder a scene file lies in, and what was looked for there.
pub(crate) struct Folder {
    file: PathBuf,
    path: PathBuf,
    by: usize,
    looked_for: RefCell<Vec<ReferencedFile>>,
}

impl Folder {
    /// The folder of `file`, which is the input of that number.
    pub(crate) fn of(file: &Path, by: usize) -> Self {
        let path = folder_of(file).to_owned();
        Self {
            file: file.to_owned(),
            path,
            by,
            looked_for: RefCell::default(),
        }
    }

    /// What was looked for, in order.
    pub(crate) fn into_looked_for(self) -> Vec<ReferencedFile> {
        self.looked_for.into_inner()
    }

    /// Where `name` leads to from this folder, spelled like the scene file.
    pub(crate) fn beside(&self, name: &str) -> PathBuf {
        beside(&self.file, name)
    }

    /// Reads the file whose name is `relative`, bytes in any encoding. A name that is not UTF-8 is noted
    /// percent-encoded: [`percent_decode`] gives the bytes back.
    pub(crate) fn read_named(&self, relative: &[u8]) -> Result<Vec<u8>> {
        let Ok(name) = std::str::from_utf8(relative) else {
            let encoded = percent_encode(relative);
            let bytes = match path_of_bytes(relative) {
                Some(path) => self.find_path(&path, &encoded),
                None => self.find(&encoded),
            };
            self.note(&encoded, &bytes);
            return bytes;
        };
        self.read(name)
    }

    fn note(&self, name: &str, bytes: &Result<Vec<u8>>) {
        self.looked_for.borrow_mut().push(ReferencedFile {
            name: name.to_owned(),
            path: self.beside(name),
            hash: bytes.as_deref().map_or(0, xxh3_64),
            by: self.by,
        });
    }

    /// Reads the file `name`, a path from this folder. It may not lead out of it: not by an absolute path, not by
    /// `..`, not through a symbolic link.
    pub(crate) fn read(&self, name: &str) -> Result<Vec<u8>> {
        let bytes = self.find(name);
        self.note(name, &bytes);
        bytes
    }

    /// Reads the first of `names` that can be read; there is at least one. If none can, the error is that of the
    /// first one.
    pub(crate) fn read_first(&self, names: &[String]) -> Result<Vec<u8>> {
        let (first, others) = names.split_first().expect("there is a name");
        let mut others = others.iter();
        self.read(first)
            .or_else(|error| others.find_map(|name| self.read(name).ok()).ok_or(error))
    }

    fn find(&self, name: &str) -> Result<Vec<u8>> {
        self.find_path(Path::new(name), name)
    }

    /// Finds the file at `path`, which a message calls `name`.
    fn find_path(&self, path: &Path, name: &str) -> Result<Vec<u8>> {
        let refused = |why: &str| {
            ImportError::malformed(format!("{name:?} {why}"))
                .next("put the file beside the scene and refer to it by its name")
        };
        if name.is_empty() || name.contains('\0') {
            return Err(refused("is not a file name"));
        }
        if name.contains("://") {
            return Err(refused("is a network address"));
        }
        let unreadable = |error: std::io::Error| {
            ImportError::new(
                ImportErrorKind::Unreadable,
                format!("cannot read {name:?}: {error}"),
            )
            .next("put the file beside the scene")
        };
        let folder = self.path.canonicalize().map_err(unreadable)?;
        // Before the system is asked: whether there is a file elsewhere is nobody's business.
        let Some(inside) =
            without_dots(&folder.join(path)).filter(|path| path.starts_with(&folder))
        else {
            return Err(refused("leads out of the scene's folder"));
        };
        let target = inside.canonicalize().map_err(unreadable)?;
        if !target.starts_with(&folder) {
            return Err(refused("is a link that leads out of the scene's folder"));
        }
        read_regular(&target).map_err(unreadable)
    }
}

/// The absolute `path` with `.` left out and each `..` taken together with the folder before it; `None` if there is
/// none.
fn without_dots(path: &Path) -> Option<PathBuf> {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir
                if matches!(plain.components().next_back(), Some(Component::Normal(_))) =>
            {
                plain.pop();
            }
            Component::ParentDir => return None,
            part => plain.push(part),
        }
    }
    Some(plain)
}

/// Where the path `relative` from the folder of `file` leads, spelled like `file`. A name that
/// [`Folder::read_named`] noted percent-encoded is decoded.
pub(crate) fn beside(file: &Path, relative: &str) -> PathBuf {
    let folder = file.parent().unwrap_or(Path::new(""));
    let plain = folder.join(relative);
    let decoded = percent_decode(relative);
    if decoded == relative.as_bytes() || plain.exists() {
        return plain;
    }
    let decoded = path_of_bytes(&decoded).map(|name| folder.join(name));
    decoded.filter(|path| path.exists()).unwrap_or(plain)
}

/// Reads a regular file; a pipe or a device could deliver bytes without end.
pub(crate) fn read_regular(path: &Path) -> std::io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("not a regular file"));
    }
    fs::read(path)
}

/// The path whose name is these bytes, where the system's names are bytes.
fn path_of_bytes(name: &[u8]) -> Option<PathBuf> {
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        Some(std::ffi::OsStr::from_bytes(name).into())
    }
    #[cfg(not(unix))]
    std::str::from_utf8(name).ok().map(PathBuf::from)
}

/// Writes the bytes that are not ASCII, and `%`, as escapes.
fn percent_encode(bytes: &[u8]) -> String {
    let escape = |&byte: &u8| match byte {
        b'%' | 128.. => format!("%{byte:02X}"),
        _ => char::from(byte).to_string(),
    };
    bytes.iter().map(escape).collect()
}

/// Undoes percent-encoding. A `%` that starts no escape stands for itself.
pub(crate) fn percent_decode(text: &str) -> Vec<u8> {
    let hex = |byte: u8| (byte as char).to_digit(16).map(|digit| digit as u8);
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let digits = (
            bytes.get(at + 1).copied().and_then(hex),
            bytes.get(at + 2).copied().and_then(hex),
        );
        match (byte, digits) {
            (b'%', (Some(high), Some(low))) => {
                decoded.push(high << 4 | low);
                at += 3;
            }
            _ => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    decoded
}

/// Decodes base64 of either alphabet, padded or not; white space is skipped.
pub(crate) fn base64_decode(text: &[u8]) -> Option<Vec<u8>> {
    let mut decoded = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut bit_count) = (0u32, 0);
    let mut symbols = text.iter().filter(|byte| !byte.is_ascii_whitespace());
    for &symbol in symbols.by_ref() {
        let value = match symbol {
            b'A'..=b'Z' => symbol - b'A',
            b'a'..=b'z' => symbol - b'a' + 26,
            b'0'..=b'9' => symbol - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' => break,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        bit_count += 6;
        if bit_count >= 8 {
            bit_count -= 8;
            decoded.push((bits >> bit_count) as u8);
        }
    }
    // After the first '=' only padding may follow; a lone symbol cannot hold a byte.
    (symbols.all(|&symbol| symbol == b'=') && bit_count < 6).then_some(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_reads_padded_and_unpadded_text() {
        assert_eq!(base64_decode(b"").unwrap(), b"");
        assert_eq!(base64_decode(b"aGk=").unwrap(), b"hi");
        assert_eq!(base64_decode(b"aGk").unwrap(), b"hi");
        assert_eq!(base64_decode(b"aGly").unwrap(), b"hir");
        assert_eq!(base64_decode(b"_-\n8=").unwrap(), [0xFF, 0xEF]);
        assert!(base64_decode(b"aGk=a").is_none());
        assert!(base64_decode(b"a").is_none());
        assert!(base64_decode(b"a*==").is_none());
    }

    #[test]
    fn names_that_are_not_utf_8_are_encoded_and_come_back() {
        let name = b"a%b/\xB2\xC4\xFF.mtl";
        let encoded = percent_encode(name);
        assert_eq!(encoded, "a%25b/%B2%C4%FF.mtl");
        assert_eq!(percent_decode(&encoded), name);
    }

    #[test]
    fn percent_escapes_are_undone_and_stray_signs_kept() {
        assert_eq!(percent_decode("a%20b%2Fc"), b"a b/c");
        assert_eq!(percent_decode("100%"), b"100%");
        assert_eq!(percent_decode("%zz%4"), b"%zz%4");
    }
}
