//! The first 64 bytes of a baked file: enough to tell, before anything else is read, whether the rest
//! can be what this program expects.

use std::path::Path;

use xxhash_rust::xxh3::xxh3_64;

use crate::error::{LooksLike, OpenError};
use crate::schema::SCHEMA_HASH;

/// The first bytes of every baked file.
pub const MAGIC: [u8; 8] = *b"HROCBAKE";
/// Counts up with every change of the header or of what the payload's fields mean. A change of the
/// fields themselves shows in [`SCHEMA_HASH`].
pub const VERSION: u32 = 3;
/// Bytes before the payload; a multiple of every alignment in it.
pub const HEADER_LEN: usize = 64;
/// Flags that this version knows: none.
const KNOWN_FLAGS: u32 = 0;
/// The part that the header's own checksum covers: all of it but the checksum.
const COVERED: usize = HEADER_LEN - 8;

/// What a header says about the rest of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Bytes of the payload, which begins behind the header.
    pub payload_len: u64,
    /// xxh3-64 of the payload.
    pub checksum: u64,
    /// Bytes of the whole file, header included.
    pub file_len: u64,
    /// Number of sections behind the payload.
    pub section_count: u32,
    /// The lower half of xxh3-64 of the directory of sections; 0 without sections.
    pub directory_checksum: u32,
}

impl Header {
    /// The header of a file without sections.
    pub fn of_payload(payload: &[u8]) -> Self {
        Self {
            payload_len: payload.len() as u64,
            checksum: xxh3_64(payload),
            file_len: (HEADER_LEN + payload.len()) as u64,
            section_count: 0,
            directory_checksum: 0,
        }
    }

    /// The bytes of a header in this version.
    pub fn to_bytes(&self) -> [u8; HEADER_LEN] {
        let mut bytes = [0; HEADER_LEN];
        bytes[0..8].copy_from_slice(&MAGIC);
        bytes[8..12].copy_from_slice(&VERSION.to_le_bytes());
        bytes[12..16].copy_from_slice(&KNOWN_FLAGS.to_le_bytes());
        bytes[16..24].copy_from_slice(&SCHEMA_HASH.to_le_bytes());
        bytes[24..32].copy_from_slice(&self.payload_len.to_le_bytes());
        bytes[32..40].copy_from_slice(&self.checksum.to_le_bytes());
        bytes[40..48].copy_from_slice(&self.file_len.to_le_bytes());
        bytes[48..52].copy_from_slice(&self.section_count.to_le_bytes());
        bytes[52..56].copy_from_slice(&self.directory_checksum.to_le_bytes());
        let own_checksum = xxh3_64(&bytes[..COVERED]);
        bytes[COVERED..].copy_from_slice(&own_checksum.to_le_bytes());
        bytes
    }

    /// Reads the header of `file`, which is the whole file: its length is part of the check. `path`
    /// is for the error.
    pub fn parse(file: &[u8], path: &Path) -> Result<Self, OpenError> {
        let path = || path.to_path_buf();
        let found = file.len() as u64;
        if !file.starts_with(&MAGIC) {
            // The beginning of a baked file that was cut within its magic.
            if !file.is_empty() && MAGIC.starts_with(file) {
                return Err(OpenError::Length {
                    path: path(),
                    expected: HEADER_LEN as u64,
                    found,
                });
            }
            return Err(OpenError::NotHroc {
                path: path(),
                found: LooksLike::guess(file),
            });
        }
        let Some(bytes) = file.first_chunk::<HEADER_LEN>() else {
            return Err(OpenError::Length {
                path: path(),
                expected: HEADER_LEN as u64,
                found,
            });
        };
        // Before the checksum: another version may arrange the rest differently.
        let version = u32_at(bytes, 8);
        if version != VERSION {
            return Err(OpenError::Version {
                path: path(),
                found: version,
            });
        }
        if u64_at(bytes, COVERED) != xxh3_64(&bytes[..COVERED]) {
            return Err(OpenError::Header {
                path: path(),
                problem: "wrong checksum",
            });
        }
        if u32_at(bytes, 12) & !KNOWN_FLAGS != 0 {
            return Err(OpenError::Header {
                path: path(),
                problem: "unknown flags",
            });
        }
        let schema_hash = u64_at(bytes, 16);
        if schema_hash != SCHEMA_HASH {
            return Err(OpenError::Schema {
                path: path(),
                found: schema_hash,
            });
        }
        let header = Self {
            payload_len: u64_at(bytes, 24),
            checksum: u64_at(bytes, 32),
            file_len: u64_at(bytes, 40),
            section_count: u32_at(bytes, 48),
            directory_checksum: u32_at(bytes, 52),
        };
        if found != header.file_len {
            return Err(OpenError::Length {
                path: path(),
                expected: header.file_len,
                found,
            });
        }
        if found - (HEADER_LEN as u64) < header.payload_len {
            return Err(OpenError::Header {
                path: path(),
                problem: "the payload is longer than the file",
            });
        }
        if header.section_count == 0 && header.directory_checksum != 0 {
            return Err(OpenError::Header {
                path: path(),
                problem: "a checksum of a directory without sections",
            });
        }
        Ok(header)
    }
}

fn u32_at(bytes: &[u8; HEADER_LEN], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn u64_at(bytes: &[u8; HEADER_LEN], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}
