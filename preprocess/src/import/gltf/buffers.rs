//! Buffers and buffer views (section 3.6): bytes from the GLB, from a data URI, from a file beside
//! the scene, or decompressed. Each is loaded when first asked for, so what only images or animations
//! use may be missing.

use super::document::get;
use super::meshopt::{self, Meshopt};
use super::{ImportError, Result, extensions, uri};
use crate::import::folder::{Folder, base64_decode, percent_decode};
use gltf::json::buffer::{Buffer, View};
use gltf::json::{Index, Root};
use std::borrow::Cow;
use std::cell::OnceCell;
use std::ops::Range;

pub(super) struct Buffers<'a> {
    root: &'a Root,
    bin: Option<&'a [u8]>,
    folder: &'a Folder,
    loaded: Vec<OnceCell<Cow<'a, [u8]>>>,
    decompressed: Vec<OnceCell<Vec<u8>>>,
}

impl<'a> Buffers<'a> {
    pub(super) fn new(root: &'a Root, bin: Option<&'a [u8]>, folder: &'a Folder) -> Self {
        let loaded = root.buffers.iter().map(|_| OnceCell::new()).collect();
        let decompressed = root.buffer_views.iter().map(|_| OnceCell::new()).collect();
        Self {
            root,
            bin,
            folder,
            loaded,
            decompressed,
        }
    }

    /// The bytes of a buffer view and their stride, where it declares one.
    pub(super) fn view(&self, index: Index<View>) -> Result<(&[u8], Option<usize>)> {
        self.find_view(index)
            .map_err(|error| error.within(format_args!("buffer view {index}")))
    }

    fn find_view(&self, index: Index<View>) -> Result<(&[u8], Option<usize>)> {
        let view = get(self.root, index, "buffer view")?;
        let compressed = match &view.extensions {
            Some(extensions) => extensions::read::<Meshopt>(&extensions.others, meshopt::NAMES)?,
            None => None,
        };
        let Some(compressed) = compressed else {
            let offset = view.byte_offset.unwrap_or_default().0;
            let bytes = self.slice(view.buffer, offset, view.byte_length.0)?;
            return Ok((bytes, view.byte_stride.map(|stride| stride.0)));
        };
        let bytes = get_or_try_init(&self.decompressed[index.value()], || {
            let slice = self.slice(
                compressed.buffer,
                compressed.byte_offset,
                compressed.byte_length,
            )?;
            meshopt::decompress(&compressed, slice)
                .map_err(|error| error.within("meshopt compression"))
        })?;
        Ok((bytes, Some(clamp(compressed.byte_stride))))
    }

    fn slice(&self, buffer: Index<Buffer>, offset: u64, length: u64) -> Result<&[u8]> {
        let place = || format!("buffer {buffer}");
        let declared = get(self.root, buffer, "buffer")?.byte_length.0;
        let bytes = get_or_try_init(&self.loaded[buffer.value()], || self.load(buffer.value()))
            .map_err(|error| error.within(place()))?;
        range(offset, length, clamp(declared).min(bytes.len()))
            .map(|range| &bytes[range])
            .ok_or_else(|| {
                ImportError::malformed(format!(
                    "bytes {offset}..{} lie outside its {} bytes",
                    offset.saturating_add(length),
                    bytes.len()
                ))
                .within(place())
            })
    }

    fn load(&self, index: usize) -> Result<Cow<'a, [u8]>> {
        let buffer = &self.root.buffers[index];
        let bytes = match (&buffer.uri, self.bin) {
            (None, Some(bin)) if index == 0 => Cow::Borrowed(bin),
            (None, _) => return Err(ImportError::malformed("has no data")),
            (Some(uri), _) => Cow::Owned(self.resolve(uri)?),
        };
        let declared = buffer.byte_length.0;
        if (bytes.len() as u64) < declared {
            return Err(ImportError::malformed(format!(
                "declares {declared} bytes, has {}",
                bytes.len()
            )));
        }
        Ok(bytes)
    }

    fn resolve(&self, uri: &str) -> Result<Vec<u8>> {
        if !uri::is_data(uri) {
            return self.folder.read_first(&uri::file_names(uri)?);
        }
        let (kind, text) = uri["data:".len()..]
            .split_once(',')
            .ok_or_else(|| ImportError::malformed("the data URI has no comma"))?;
        if kind.to_ascii_lowercase().ends_with(";base64") {
            base64_decode(text.as_bytes())
                .ok_or_else(|| ImportError::malformed("the data URI is not base64"))
        } else {
            Ok(percent_decode(text))
        }
    }

    /// Bytes of all loaded buffers.
    pub(super) fn loaded_bytes(&self) -> u64 {
        self.loaded
            .iter()
            .filter_map(OnceCell::get)
            .map(|bytes| bytes.len() as u64)
            .sum()
    }
}

/// `offset..offset + length`, if it lies within `available`.
pub(super) fn range(offset: u64, length: u64, available: usize) -> Option<Range<usize>> {
    let end = offset
        .checked_add(length)
        .filter(|&end| end <= available as u64)?;
    Some(offset as usize..end as usize)
}

/// A size of the file as `usize`; one too large for that is too large for any check that follows.
fn clamp(size: u64) -> usize {
    usize::try_from(size).unwrap_or(usize::MAX)
}

/// `OnceCell::get_or_try_init`, which is not stable yet.
fn get_or_try_init<T>(cell: &OnceCell<T>, init: impl FnOnce() -> Result<T>) -> Result<&T> {
    match cell.get() {
        Some(value) => Ok(value),
        None => init().map(|value| cell.get_or_init(|| value)),
    }
}
