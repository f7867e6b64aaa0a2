//! Why a file could not be opened or written. Every message is one line that names the file, what is
//! wrong with it and what to do next.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use rkyv::rancor::BoxedError;

use crate::header::VERSION;
use crate::section::SectionName;

/// The path in the errors of scenes that were opened from memory.
pub const IN_MEMORY: &str = "(memory)";

/// Why a baked file could not be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The system could not open, read or map it.
    #[error("{}: cannot read it: {source}; check the name and that it may be read", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A folder, pipe or device.
    #[error("{}: not a regular file; name a baked file (.hroc)", path.display())]
    NotAFile {
        /// What was named instead of a file.
        path: PathBuf,
    },
    /// The magic bytes are not those of a baked file.
    #[error("{}: {found}; {}", path.display(), found.next_step(path))]
    NotHroc {
        /// The file.
        path: PathBuf,
        /// What its first bytes look like.
        found: LooksLike,
    },
    /// Written in another version of the format.
    #[error("{}: format version {found}, but this program reads version {VERSION}; {}", path.display(),
        if *found > VERSION { "update hroc, or bake it again with this version" }
        else { "bake it again with this version" })]
    Version {
        /// The file.
        path: PathBuf,
        /// The version in its header.
        found: u32,
    },
    /// Same format version, but the stored structs were declared differently.
    #[error("{}: written by another build of hroc (schema {found:016x}, this build {:016x}); \
        bake it again with this version", path.display(), crate::SCHEMA_HASH)]
    Schema {
        /// The file.
        path: PathBuf,
        /// The schema hash in its header.
        found: u64,
    },
    /// Truncated, or with bytes after the end.
    #[error("{}: {} ({found} bytes, should be {expected}); copy or bake it again", path.display(),
        if found < expected { "truncated" } else { "has trailing bytes" })]
    Length {
        /// The file.
        path: PathBuf,
        /// Bytes that the header announces, itself included.
        expected: u64,
        /// Bytes present.
        found: u64,
    },
    /// The header's own checksum or its unused fields are wrong.
    #[error("{}: the header is damaged ({problem}); copy or bake it again", path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// Which part of the header.
        problem: &'static str,
    },
    /// The payload is no valid archive: a pointer, a length or a string is wrong.
    #[error("{}: the archive is damaged: {}; copy or bake it again", path.display(), OneLine(source))]
    Archive {
        /// The file.
        path: PathBuf,
        /// What rkyv's validation found.
        source: BoxedError,
    },
    /// The archive is well-formed, but its contents contradict each other.
    #[error("{}: {source}; copy or bake it again", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// The rule that is broken, and where.
        source: CheckError,
    },
    /// The payload is not the one that was written.
    #[error("{}: damaged, the checksum is {found:016x} and should be {expected:016x}; copy or bake it again",
        path.display())]
    Checksum {
        /// The file.
        path: PathBuf,
        /// The checksum in the header.
        expected: u64,
        /// The checksum of the payload.
        found: u64,
    },
    /// The directory of the optional sections is damaged, or the sections do not lie where they should.
    #[error("{}: the directory of sections is damaged: {problem}; copy or bake it again", path.display())]
    Directory {
        /// The file.
        path: PathBuf,
        /// The rule that is broken, and where.
        problem: String,
    },
    /// An optional section is not the one that was written.
    #[error("{}: section {name} is damaged, the checksum is {found:016x} and should be {expected:016x}; \
        copy or bake it again", path.display())]
    Section {
        /// The file.
        path: PathBuf,
        /// The section.
        name: SectionName,
        /// The checksum in the directory.
        expected: u64,
        /// The checksum of the section.
        found: u64,
    },
}

/// A broken rule: where, and what is wrong there.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct CheckError {
    /// For example `object 17`, or `tree sah, node 5`.
    pub place: String,
    /// For example `mesh 40 of 12`.
    pub problem: String,
}

/// Why a baked file could not be written. Nothing is left at the path, or what was there before.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The path names a folder, a device, nothing, or a file that is write-protected.
    #[error("{}: cannot be written: {source}; name another file", path.display())]
    Target {
        /// The path given.
        path: PathBuf,
        /// What is wrong with it.
        source: io::Error,
    },
    /// The temporary file beside the target could not be created.
    #[error("{}: cannot create a file in {}: {source}; choose a folder that exists and can be written to",
        path.display(), folder.display())]
    Create {
        /// The file to write.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Writing failed half-way: a full disk, a quota, a lost network drive.
    #[error("{}: writing failed: {source}; free some space or choose another folder", path.display())]
    Write {
        /// The file to write.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The finished file could not be put in place of the target.
    #[error("{}: cannot put the finished file in place: {source}; check who may replace it", path.display())]
    Replace {
        /// The file to write.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// What the first bytes of a file that is not a baked one look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
#[non_exhaustive]
pub enum LooksLike {
    Empty,
    Glb,
    Json,
    Obj,
    Png,
    Jpeg,
    Zip,
    Gzip,
    Text,
    Unknown,
}

impl LooksLike {
    pub(crate) fn guess(bytes: &[u8]) -> Self {
        const MAGICS: [(&[u8], LooksLike); 5] = [
            (b"glTF", LooksLike::Glb),
            (b"\x89PNG", LooksLike::Png),
            (b"\xFF\xD8\xFF", LooksLike::Jpeg),
            (b"PK\x03\x04", LooksLike::Zip),
            (b"\x1F\x8B", LooksLike::Gzip),
        ];
        if bytes.is_empty() {
            return Self::Empty;
        }
        if let Some((_, kind)) = MAGICS.iter().find(|(magic, _)| bytes.starts_with(magic)) {
            return *kind;
        }
        let head = &bytes[..bytes.len().min(256)];
        let text = head
            .strip_prefix(b"\xEF\xBB\xBF")
            .unwrap_or(head)
            .trim_ascii_start();
        let is_text = head
            .iter()
            .all(|&b| b >= 0x20 && b != 0x7F || b.is_ascii_whitespace());
        let obj_starts: [&[u8]; 6] = [b"# ", b"v ", b"o ", b"g ", b"mtllib ", b"#"];
        match text.first() {
            _ if !is_text => Self::Unknown,
            Some(b'{') => Self::Json,
            _ if obj_starts.iter().any(|start| text.starts_with(start)) => Self::Obj,
            _ => Self::Text,
        }
    }

    fn next_step(self, path: &Path) -> String {
        match self {
            Self::Glb | Self::Json | Self::Obj if path != Path::new(IN_MEMORY) => {
                let baked = path.with_extension("hroc");
                format!(
                    "bake it first: hroc-bake bake {} -o {}",
                    path.display(),
                    baked.display()
                )
            }
            Self::Empty => "bake the scene again: hroc-bake bake SCENE.glb -o SCENE.hroc".into(),
            _ => "baked files come from: hroc-bake bake SCENE.glb -o SCENE.hroc".into(),
        }
    }
}

impl fmt::Display for LooksLike {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Empty => "the file is empty",
            Self::Glb => "this is a GLB file",
            Self::Json => "this is a JSON file, perhaps a glTF scene",
            Self::Obj => "this is a text file, perhaps an OBJ scene",
            Self::Png => "this is a PNG image, not a baked scene",
            Self::Jpeg => "this is a JPEG image, not a baked scene",
            Self::Zip => "this is a ZIP archive, not a baked scene",
            Self::Gzip => "this is a gzip archive, not a baked scene",
            Self::Text => "this is a text file, not a baked scene",
            Self::Unknown => "not a baked scene",
        })
    }
}

/// The first line: rkyv's messages go on with a trace of where in the archive it was.
struct OneLine<'a>(&'a BoxedError);

impl fmt::Display for OneLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.to_string().lines().next().unwrap_or("unknown"))
    }
}
