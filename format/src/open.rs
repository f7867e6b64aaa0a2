//! Opening a baked file: the mapped bytes *are* the scene; nothing is copied or parsed.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use memmap2::Mmap;
use rkyv::rancor::BoxedError;
use rkyv::util::AlignedVec;
use xxhash_rust::xxh3::xxh3_64;

use crate::check;
use crate::error::{IN_MEMORY, OpenError};
use crate::header::{HEADER_LEN, Header};
use crate::section::{self, SectionEntry, SectionName};
use crate::types::ArchivedScene;

/// How much of a scene is checked when it is opened. Each depth includes the ones before it. The
/// header, the directory of sections and the archive's structure (pointers, lengths, strings) are always checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Check {
    /// The meshes' ranges lie within the vertices and indices. For files that this process wrote.
    Ranges,
    /// Objects, indices, bounds, names, cameras and trees are consistent: whatever follows them, on the CPU or
    /// the GPU, stays within the arrays and ends. Reads all but the vertices. What everybody should use.
    Objects,
    /// The checksums of the payload and of every section, and every vertex too: reads the whole file.
    Everything,
}

/// An opened baked file.
///
/// # Mapped files
///
/// [`open`](Self::open) and its siblings map the file. [`write`](crate::write()) never changes a file in
/// place, it puts a new one under the name, so that a mapped scene stays what it was. A program that
/// truncates or overwrites the file nevertheless while it is mapped ends this process with a bus error
/// (SIGBUS; an in-page exception on Windows) or makes it read bytes that were never checked, as with
/// any mapped file. Where others may do that, use [`read_with`](Self::read_with), which survives it.
pub struct BakedScene {
    bytes: Bytes,
    payload_len: usize,
    sections: Vec<SectionEntry>,
    path: Option<PathBuf>,
}

enum Bytes {
    Mapped(Mmap),
    Owned(AlignedVec<16>),
}

impl Bytes {
    fn as_slice(&self) -> &[u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Owned(bytes) => bytes,
        }
    }
}

impl BakedScene {
    /// Maps a file and checks it to the depth of [`Check::Ranges`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, OpenError> {
        Self::open_with(path, Check::Ranges)
    }

    /// Maps a file and checks it to the depth of [`Check::Objects`]: the one to use by default.
    pub fn open_checked(path: impl AsRef<Path>) -> Result<Self, OpenError> {
        Self::open_with(path, Check::Objects)
    }

    /// Maps a file and checks it to the depth of [`Check::Everything`].
    pub fn verify(path: impl AsRef<Path>) -> Result<Self, OpenError> {
        Self::open_with(path, Check::Everything)
    }

    /// Reads a file into memory and checks it: what happens to the file afterwards, or meanwhile, cannot hurt.
    pub fn read_with(path: impl AsRef<Path>, check: Check) -> Result<Self, OpenError> {
        let path = path.as_ref();
        let mut file = open_regular(path)?;
        let mut bytes = AlignedVec::new();
        bytes
            .extend_from_reader(&mut file)
            .map_err(|source| OpenError::Io {
                path: path.into(),
                source,
            })?;
        Self::new(Bytes::Owned(bytes), Some(path.into()), check)
    }

    /// Maps a file and checks it.
    pub fn open_with(path: impl AsRef<Path>, check: Check) -> Result<Self, OpenError> {
        let path = path.as_ref();
        let file = open_regular(path)?;
        // SAFETY: the map is private to this value and never written through. That nobody else
        // changes the file meanwhile is the condition stated in the documentation of the type.
        let map = unsafe { Mmap::map(&file) }.map_err(|source| OpenError::Io {
            path: path.into(),
            source,
        })?;
        Self::new(Bytes::Mapped(map), Some(path.into()), check)
    }

    /// Copies the bytes of a file and checks them.
    pub fn from_bytes(file: &[u8], check: Check) -> Result<Self, OpenError> {
        let mut bytes = AlignedVec::with_capacity(file.len());
        bytes.extend_from_slice(file);
        Self::from_aligned(bytes, check)
    }

    /// Takes the bytes of a file, as [`to_bytes`](crate::to_bytes) makes them, and checks them.
    pub fn from_aligned(file: AlignedVec<16>, check: Check) -> Result<Self, OpenError> {
        Self::new(Bytes::Owned(file), None, check)
    }

    fn new(bytes: Bytes, path: Option<PathBuf>, depth: Check) -> Result<Self, OpenError> {
        let at = path.as_deref().unwrap_or(Path::new(IN_MEMORY));
        let header = Header::parse(bytes.as_slice(), at)?;
        let sections = section::parse(bytes.as_slice(), &header, at)?;
        // `Header::parse` found it no longer than the file.
        let payload_len = header.payload_len as usize;
        let payload = &bytes.as_slice()[HEADER_LEN..HEADER_LEN + payload_len];
        // First, where asked for: damage is told as damage, not as the rule that it happens to break.
        if depth >= Check::Everything {
            let found = xxh3_64(payload);
            if found != header.checksum {
                return Err(OpenError::Checksum {
                    path: at.into(),
                    expected: header.checksum,
                    found,
                });
            }
            for entry in &sections {
                section::read(bytes.as_slice(), entry, at)?;
            }
        }
        let scene = rkyv::access::<ArchivedScene, BoxedError>(payload).map_err(|source| {
            OpenError::Archive {
                path: at.into(),
                source,
            }
        })?;
        check::check(scene, depth).map_err(|source| OpenError::Invalid {
            path: at.into(),
            source,
        })?;
        Ok(Self {
            bytes,
            payload_len,
            sections,
            path,
        })
    }

    /// The scene.
    pub fn scene(&self) -> &ArchivedScene {
        let payload = &self.bytes.as_slice()[HEADER_LEN..HEADER_LEN + self.payload_len];
        // SAFETY: `new` validated an `ArchivedScene` at the end of these very bytes, which lie at the
        // same address since (heap or map; moving `self` does not move them) and are never written.
        unsafe { rkyv::access_unchecked(payload) }
    }

    /// The bytes of an optional section, or `None` where the file has no section of that name. They begin at a
    /// multiple of 16 bytes. Each call compares them with their checksum: keep the slice.
    pub fn section(&self, name: SectionName) -> Result<Option<&[u8]>, OpenError> {
        let Ok(at) = self
            .sections
            .binary_search_by_key(&name, |entry| entry.name)
        else {
            return Ok(None);
        };
        let path = self.path.as_deref().unwrap_or(Path::new(IN_MEMORY));
        section::read(self.bytes.as_slice(), &self.sections[at], path).map(Some)
    }

    /// The optional sections in the file, in the order of their names, known to this program or not.
    pub fn sections(&self) -> &[SectionEntry] {
        &self.sections
    }

    /// The whole file, header included.
    pub fn file_bytes(&self) -> &[u8] {
        self.bytes.as_slice()
    }

    /// Where it was opened; `None` for a scene from memory.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }
}

fn open_regular(path: &Path) -> Result<File, OpenError> {
    let io_error = |source| OpenError::Io {
        path: path.into(),
        source,
    };
    // Asked before opening: opening a pipe waits for its other end.
    if !fs::metadata(path).map_err(io_error)?.is_file() {
        return Err(OpenError::NotAFile { path: path.into() });
    }
    File::open(path).map_err(io_error)
}

impl std::fmt::Debug for BakedScene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BakedScene")
            .field("path", &self.path)
            .field("file_bytes", &self.file_bytes().len())
            .field("objects", &self.scene().objects.len())
            .finish()
    }
}
