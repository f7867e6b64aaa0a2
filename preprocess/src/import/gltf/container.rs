//! The binary container (section 4.4): a 12-byte header, a JSON chunk, perhaps a BIN chunk.

use super::{ImportError, Result};

pub(super) const MAGIC: &[u8] = b"glTF";
const JSON: &[u8] = b"JSON";
const BIN: &[u8] = b"BIN\0";

/// The two chunks that have a meaning; later ones are skipped, as section 4.4.3.1 asks.
pub(super) struct Glb<'a> {
    pub(super) json: &'a [u8],
    pub(super) bin: Option<&'a [u8]>,
}

impl<'a> Glb<'a> {
    pub(super) fn parse(file: &'a [u8]) -> Result<Self> {
        let fault = |what: String| Err(ImportError::malformed(what));
        let (Some(version), Some(length)) = (u32_at(file, 4), u32_at(file, 8)) else {
            return fault(format!(
                "the file ends within its header: {} of 12 bytes",
                file.len()
            ));
        };
        if version != 2 {
            return fault(format!("is binary glTF version {version}, not 2"));
        }
        let Some(mut rest) = file.get(12..length as usize) else {
            return fault(format!("declares {length} bytes, has {}", file.len()));
        };
        let mut chunks = Vec::new();
        while !rest.is_empty() {
            let number = chunks.len();
            let (Some(length), Some(kind)) = (u32_at(rest, 0), rest.get(4..8)) else {
                return fault(format!("the file ends within the header of chunk {number}"));
            };
            let Some(data) = rest.get(8..).and_then(|data| data.get(..length as usize)) else {
                return fault(format!(
                    "chunk {number} declares {length} bytes, {} are left",
                    rest.len() - 8
                ));
            };
            chunks.push((kind, data));
            rest = &rest[8 + data.len()..];
        }
        match chunks.first() {
            Some(&(JSON, json)) => {
                let bin = chunks
                    .get(1)
                    .filter(|(kind, _)| *kind == BIN)
                    .map(|&(_, data)| data);
                Ok(Self { json, bin })
            }
            Some(_) => fault("the first chunk is not JSON".into()),
            None => fault("has no chunks".into()),
        }
    }
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}
