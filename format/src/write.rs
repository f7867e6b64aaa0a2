//! Writing a baked file: streamed, hashed on the way, and put in place only when it is complete.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use rkyv::rancor::BoxedError;
use rkyv::ser::Serializer;
use rkyv::ser::allocator::Arena;
use rkyv::ser::sharing::Unshare;
use rkyv::ser::writer::IoWriter;
use rkyv::util::AlignedVec;
use xxhash_rust::xxh3::Xxh3Default;

use crate::error::WriteError;
use crate::header::{HEADER_LEN, Header};
use crate::section::{Layout, Sections, directory_checksum, padding};
use crate::target::{file_to_replace, folder_of};
use crate::types::Scene;
use crate::unfinished::Unfinished;

const BUFFER_LEN: usize = 1 << 20;

/// Writes `scene` without optional sections; see [`write_with`].
pub fn write(path: &Path, scene: &Scene) -> Result<u64, WriteError> {
    write_with(path, scene, &Sections::new())
}

/// Writes `scene` and `sections` to `path` and returns the file's length in bytes.
///
/// The file appears whole or not at all: it is written beside `path`, flushed to the disk and renamed.
/// A file already there is replaced, unless it is write-protected; whoever has it mapped keeps the old one.
/// A symbolic link stays one: its target is replaced. The bytes depend on the scene and the
/// sections alone.
///
/// A process that is killed leaves at most one temporary file, whose name begins with
/// [`TEMPORARY_PREFIX`](crate::TEMPORARY_PREFIX); the next `write` to `path` removes it.
pub fn write_with(path: &Path, scene: &Scene, sections: &Sections) -> Result<u64, WriteError> {
    let replace_error = |source| WriteError::Replace {
        path: path.into(),
        source,
    };
    let target = file_to_replace(path).map_err(|source| WriteError::Target {
        path: path.into(),
        source,
    })?;
    let folder = folder_of(&target);
    let mut unfinished =
        Unfinished::create(folder, &target).map_err(|source| WriteError::Create {
            path: path.into(),
            folder: folder.into(),
            source,
        })?;
    let len = write_to(unfinished.file(), scene, sections).map_err(|source| WriteError::Write {
        path: path.into(),
        source,
    })?;
    unfinished.persist(&target).map_err(replace_error)?;
    // Makes the new name survive a power failure; only Unix can open a folder to do so.
    #[cfg(unix)]
    File::open(folder)
        .and_then(|folder| folder.sync_all())
        .map_err(replace_error)?;
    Ok(len)
}

/// The bytes that [`write()`] puts into a file.
pub fn to_bytes(scene: &Scene) -> io::Result<AlignedVec<16>> {
    to_bytes_with(scene, &Sections::new())
}

/// The bytes that [`write_with`] puts into a file.
pub fn to_bytes_with(scene: &Scene, sections: &Sections) -> io::Result<AlignedVec<16>> {
    let mut bytes = AlignedVec::new();
    bytes.extend_from_slice(&[0; HEADER_LEN]);
    let header = write_contents(&mut bytes, scene, sections)?;
    bytes[..HEADER_LEN].copy_from_slice(&header.to_bytes());
    Ok(bytes)
}

fn write_to(file: &mut File, scene: &Scene, sections: &Sections) -> io::Result<u64> {
    file.write_all(&[0; HEADER_LEN])?;
    let header = write_contents(&mut *file, scene, sections)?;
    // Last: until now the file has no magic, and nothing takes it for a baked one.
    file.seek(SeekFrom::Start(0))?;
    file.write_all(&header.to_bytes())?;
    file.sync_all()?;
    Ok(header.file_len)
}

/// Writes what follows the header.
fn write_contents(mut out: impl Write, scene: &Scene, sections: &Sections) -> io::Result<Header> {
    let (payload_len, checksum) = write_payload(&mut out, scene)?;
    let payload_end = HEADER_LEN as u64 + payload_len;
    let layout = Layout::new(payload_end, sections);
    let directory = layout.directory();
    if !directory.is_empty() {
        out.write_all(padding(payload_end))?;
        out.write_all(&directory)?;
        // The directory is a multiple of the alignment.
        let mut end = 0;
        for bytes in sections.values() {
            out.write_all(padding(end))?;
            out.write_all(bytes)?;
            end = bytes.len() as u64;
        }
    }
    Ok(Header {
        payload_len,
        checksum,
        file_len: layout.file_len,
        section_count: layout.entries.len() as u32,
        directory_checksum: directory_checksum(&directory),
    })
}

/// Writes the archive; returns its length and checksum.
fn write_payload(out: impl Write, scene: &Scene) -> io::Result<(u64, u64)> {
    let hashing = Hashing {
        out,
        hash: Xxh3Default::new(),
        len: 0,
    };
    let mut arena = Arena::new();
    let mut serializer = Serializer::new(
        IoWriter::new(BufWriter::with_capacity(BUFFER_LEN, hashing)),
        arena.acquire(),
        Unshare,
    );
    rkyv::api::serialize_using::<_, BoxedError>(scene, &mut serializer)
        .map_err(io::Error::other)?;
    let hashing = serializer
        .into_writer()
        .into_inner()
        .into_inner()
        .map_err(io::IntoInnerError::into_error)?;
    Ok((hashing.len, hashing.hash.digest()))
}

/// Passes bytes on and hashes them.
struct Hashing<W> {
    out: W,
    hash: Xxh3Default,
    len: u64,
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hash.update(&bytes[..written]);
        self.len += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk with room for so many bytes.
    struct Disk(usize);

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let written = bytes.len().min(self.0);
            self.0 -= written;
            if written == 0 && !bytes.is_empty() {
                Err(io::ErrorKind::StorageFull.into())
            } else {
                Ok(written)
            }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_full_disk_is_an_error_wherever_it_strikes() {
        let scene = Scene {
            indices: vec![7; BUFFER_LEN],
            ..Scene::default()
        };
        let len = to_bytes(&scene).unwrap().len() - HEADER_LEN;
        // Within the array, at the buffer's edge, in the root that is still in the buffer at the end.
        for room in [0, 1, BUFFER_LEN, 3 * BUFFER_LEN + 1, len - 1] {
            let error = write_payload(Disk(room), &scene).unwrap_err();
            assert!(error.to_string().contains("no storage space"), "{error}");
        }
        let (payload_len, _) = write_payload(Disk(len), &scene).unwrap();
        assert_eq!(payload_len, len as u64);
    }
}
