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
pub const VERSION: u32 = 2;
/// Bytes before the payload; a multiple of every alignment in it.
pub const HEADER_LEN: usize = 64;
/// Flags that this version knows: none.
const KNOWN_FLAGS: u32 = 0;
/// The part that the header's own checksum covers: all of it but the checksum.
const COVERED: usize = HEADER_LEN - 8;

/// What a header says about the payload behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Bytes after the header.
    pub payload_len: u64,
    /// xxh3-64 of the payload.
    pub checksum: u64,
}

impl Header {
    /// The bytes of a header in this version.
    pub fn to_bytes(&self) -> [u8; HEADER_LEN] {
        let mut bytes = [0; HEADER_LEN];
        bytes[0..8].copy_from_slice(&MAGIC);
        bytes[8..12].copy_from_slice(&VERSION.to_le_bytes());
        bytes[12..16].copy_from_slice(&KNOWN_FLAGS.to_le_bytes());
        bytes[16..24].copy_from_slice(&SCHEMA_HASH.to_le_bytes());
        bytes[24..32].copy_from_slice(&self.payload_len.to_le_bytes());
        bytes[32..40].copy_from_slice(&self.checksum.to_le_bytes());
        // 40..56 is reserved and zero.
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
        if bytes[40..COVERED].iter().any(|&byte| byte != 0) {
            return Err(OpenError::Header {
                path: path(),
                problem: "reserved bytes in use",
            });
        }
        let schema_hash = u64_at(bytes, 16);
        if schema_hash != SCHEMA_HASH {
            return Err(OpenError::Schema {
                path: path(),
                found: schema_hash,
            });
        }
        let payload_len = u64_at(bytes, 24);
        let expected = payload_len.saturating_add(HEADER_LEN as u64);
        if found != expected {
            return Err(OpenError::Length {
                path: path(),
                expected,
                found,
            });
        }
        Ok(Self {
            payload_len,
            checksum: u64_at(bytes, 32),
        })
    }
}

fn u32_at(bytes: &[u8; HEADER_LEN], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn u64_at(bytes: &[u8; HEADER_LEN], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}
