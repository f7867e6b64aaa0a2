//! Optional sections: named byte strings behind the payload. A reader skips those whose names it does not know, so
//! that a later program can add data without a new version of the format.
//!
//! The directory begins at the first multiple of [`ALIGNMENT`] behind the payload and has one entry of
//! [`ENTRY_LEN`] bytes per section, in ascending order of names. The sections follow in the same order, each at the
//! next multiple of [`ALIGNMENT`]. All padding is zero. A file without sections has no directory and ends with the
//! payload.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use xxhash_rust::xxh3::xxh3_64;

use crate::error::OpenError;
use crate::header::{HEADER_LEN, Header};

/// Sections begin at multiples of this, counted from the start of the file.
pub const ALIGNMENT: usize = 16;
/// Name, offset, length, checksum: eight bytes each.
pub(crate) const ENTRY_LEN: usize = 32;

/// The name of a section: one to eight printable ASCII characters without spaces. Stored with spaces up to eight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SectionName([u8; 8]);

impl SectionName {
    /// The section of this name.
    ///
    /// # Panics
    /// If `name` is not one to eight printable ASCII characters without spaces. Use it for constants.
    pub const fn new(name: &str) -> Self {
        let name = name.as_bytes();
        assert!(name.len() <= 8, "a section name has at most 8 characters");
        let mut padded = [b' '; 8];
        let mut at = 0;
        while at < name.len() {
            padded[at] = name[at];
            at += 1;
        }
        match Self::from_stored(padded) {
            Some(name) => name,
            None => panic!("a section name is made of printable ASCII characters"),
        }
    }

    /// Reads a stored name; `None` if it breaks the rules for names.
    const fn from_stored(stored: [u8; 8]) -> Option<Self> {
        let mut len = 8;
        while len > 0 && stored[len - 1] == b' ' {
            len -= 1;
        }
        let mut at = 0;
        while at < len {
            if !stored[at].is_ascii_graphic() {
                return None;
            }
            at += 1;
        }
        if len == 0 { None } else { Some(Self(stored)) }
    }
}

impl fmt::Display for SectionName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(std::str::from_utf8(self.0.trim_ascii_end()).unwrap_or_default())
    }
}

/// The sections of a file to write, by name.
pub type Sections = BTreeMap<SectionName, Vec<u8>>;

/// An entry of the directory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SectionEntry {
    /// The name; unique in the file.
    pub name: SectionName,
    /// Where the section begins, from the start of the file; a multiple of 16.
    pub offset: u64,
    /// Its bytes.
    pub len: u64,
    /// xxh3-64 of its bytes.
    pub checksum: u64,
}

impl SectionEntry {
    pub(crate) fn to_bytes(self) -> [u8; ENTRY_LEN] {
        let mut bytes = [0; ENTRY_LEN];
        bytes[0..8].copy_from_slice(&self.name.0);
        for (at, number) in [(8, self.offset), (16, self.len), (24, self.checksum)] {
            bytes[at..at + 8].copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }
}

/// What lies behind a payload that ends at `payload_end`: the directory, its padding, and the length of the file.
pub(crate) struct Layout {
    pub(crate) entries: Vec<SectionEntry>,
    pub(crate) file_len: u64,
}

impl Layout {
    pub(crate) fn new(payload_end: u64, sections: &Sections) -> Self {
        let directory = aligned(payload_end);
        let mut end = match sections.is_empty() {
            true => payload_end,
            false => directory + (sections.len() * ENTRY_LEN) as u64,
        };
        let entries = sections
            .iter()
            .map(|(&name, bytes)| {
                let offset = aligned(end);
                end = offset + bytes.len() as u64;
                SectionEntry {
                    name,
                    offset,
                    len: bytes.len() as u64,
                    checksum: xxh3_64(bytes),
                }
            })
            .collect();
        Self {
            entries,
            file_len: end,
        }
    }

    pub(crate) fn directory(&self) -> Vec<u8> {
        let entries = self.entries.iter().flat_map(|entry| entry.to_bytes());
        entries.collect()
    }
}

/// The checksum of a directory in the header.
pub(crate) fn directory_checksum(directory: &[u8]) -> u32 {
    match directory {
        [] => 0,
        _ => xxh3_64(directory) as u32,
    }
}

/// The zero bytes between `end` and the next multiple of [`ALIGNMENT`].
pub(crate) fn padding(end: u64) -> &'static [u8] {
    &[0; ALIGNMENT][..(aligned(end) - end) as usize]
}

/// The next multiple of [`ALIGNMENT`]; the number itself where there is none below 2^64.
fn aligned(end: u64) -> u64 {
    end.checked_next_multiple_of(ALIGNMENT as u64)
        .unwrap_or(end)
}

/// Reads the directory of `file`, whose header is `header` and whose length is the one in the header, and checks
/// every rule about where sections lie. The sections themselves are not read.
pub(crate) fn parse(
    file: &[u8],
    header: &Header,
    path: &Path,
) -> Result<Vec<SectionEntry>, OpenError> {
    let damaged = |problem: String| OpenError::Directory {
        path: path.into(),
        problem,
    };
    let payload_end = HEADER_LEN as u64 + header.payload_len;
    let mut at = Cursor {
        file,
        end: payload_end,
    };
    let count = header.section_count as usize;
    let mut entries: Vec<SectionEntry> = Vec::new();
    if count > 0 {
        at.pad().map_err(damaged)?;
        let len = count as u64 * ENTRY_LEN as u64;
        let directory = at
            .take(len)
            .ok_or_else(|| damaged(format!("{count} entries do not fit into the file")))?;
        let found = directory_checksum(directory);
        if found != header.directory_checksum {
            return Err(damaged(format!(
                "its checksum is {found:08x} and should be {:08x}",
                header.directory_checksum
            )));
        }
        for stored in directory.as_chunks::<ENTRY_LEN>().0 {
            let entry = entry(stored, entries.last()).map_err(damaged)?;
            at.section(&entry).map_err(damaged)?;
            entries.push(entry);
        }
    }
    if at.end != file.len() as u64 {
        let (end, len) = (at.end, file.len());
        return Err(damaged(format!(
            "the contents end at byte {end} of a file of {len} bytes"
        )));
    }
    Ok(entries)
}

fn entry(stored: &[u8; ENTRY_LEN], before: Option<&SectionEntry>) -> Result<SectionEntry, String> {
    let [name, offset, len, checksum] =
        std::array::from_fn(|i| std::array::from_fn(|byte| stored[8 * i + byte]));
    let name = SectionName::from_stored(name)
        .ok_or_else(|| format!("a section has the name \"{}\"", name.escape_ascii()))?;
    match before.map(|before| before.name) {
        Some(before) if before == name => return Err(format!("section {name} is there twice")),
        Some(before) if before > name => {
            return Err(format!(
                "section {name} follows {before}, which is not in order"
            ));
        }
        _ => {}
    }
    Ok(SectionEntry {
        name,
        offset: u64::from_le_bytes(offset),
        len: u64::from_le_bytes(len),
        checksum: u64::from_le_bytes(checksum),
    })
}

/// How far a file is accounted for.
struct Cursor<'a> {
    file: &'a [u8],
    end: u64,
}

impl<'a> Cursor<'a> {
    /// The next `len` bytes, if the file has them.
    fn take(&mut self, len: u64) -> Option<&'a [u8]> {
        let end = self.end.checked_add(len)?;
        let bytes = self
            .file
            .get(usize::try_from(self.end).ok()?..usize::try_from(end).ok()?)?;
        self.end = end;
        Some(bytes)
    }

    /// Skips padding, which must be there and zero.
    fn pad(&mut self) -> Result<(), String> {
        let start = self.end;
        match self.take(padding(start).len() as u64) {
            Some(bytes) if bytes.iter().all(|&byte| byte == 0) => Ok(()),
            Some(_) => Err(format!("the padding at byte {start} is not zero")),
            None => Err(format!("the padding at byte {start} is missing")),
        }
    }

    /// Skips a section, which must lie where the one before it ends.
    fn section(&mut self, entry: &SectionEntry) -> Result<(), String> {
        self.pad()?;
        let SectionEntry {
            name, offset, len, ..
        } = *entry;
        if !offset.is_multiple_of(ALIGNMENT as u64) {
            return Err(format!(
                "section {name} begins at byte {offset}, which is not a multiple of {ALIGNMENT}"
            ));
        }
        if offset < self.end {
            return Err(format!(
                "section {name} begins at byte {offset} and overlaps what ends at byte {}",
                self.end
            ));
        }
        if offset > self.end {
            return Err(format!(
                "section {name} begins at byte {offset} and should begin at byte {}",
                self.end
            ));
        }
        match self.take(len) {
            Some(_) => Ok(()),
            None => Err(format!(
                "section {name} of {len} bytes at byte {offset} leads out of the file"
            )),
        }
    }
}

/// The bytes of a section of `file`, with their checksum checked.
pub(crate) fn read<'a>(
    file: &'a [u8],
    entry: &SectionEntry,
    path: &Path,
) -> Result<&'a [u8], OpenError> {
    // `parse` found it within the file.
    let start = entry.offset as usize;
    let bytes = file
        .get(start..start + entry.len as usize)
        .unwrap_or_default();
    let found = xxh3_64(bytes);
    if found != entry.checksum {
        return Err(OpenError::Section {
            path: path.into(),
            name: entry.name,
            expected: entry.checksum,
            found,
        });
    }
    Ok(bytes)
}
