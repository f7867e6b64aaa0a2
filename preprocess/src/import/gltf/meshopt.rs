//! `EXT_meshopt_compression` and `KHR_meshopt_compression`: decompresses a buffer view.
//!
//! The C++ decoders are made for untrusted input as long as the destination has the size they are
//! told and the element sizes are legal, which is all checked here before a call.

use super::{ImportError, ImportErrorKind, Result};
use gltf::json::Index;
use gltf::json::buffer::Buffer;
use meshopt::ffi;
use serde::Deserialize;

/// Both have the same members and, where both are given, the same data.
pub(super) const NAMES: &[&str] = &["KHR_meshopt_compression", "EXT_meshopt_compression"];

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Meshopt {
    pub(super) buffer: Index<Buffer>,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: u64,
    count: u64,
    mode: String,
    filter: Option<String>,
}

/// No codec writes more bytes than this per byte it reads: the vertex codec's best case spends, on a
/// block of 256 elements, one control byte per 4 byte channels, 1024 bytes of output.
const MAX_RATIO: u64 = 1024;

pub(super) fn decompress(view: &Meshopt, source: &[u8]) -> Result<Vec<u8>> {
    let (stride, count) = (view.byte_stride, view.count);
    let illegal = |what: String| Err(ImportError::malformed(what));
    let legal_stride = match view.mode.as_str() {
        "ATTRIBUTES" => (4..=256).contains(&stride) && stride % 4 == 0,
        "TRIANGLES" | "INDICES" => stride == 2 || stride == 4,
        mode => return illegal(format!("unknown mode {mode:?}")),
    };
    if !legal_stride {
        return illegal(format!(
            "a stride of {stride} bytes is not legal for {}",
            view.mode
        ));
    }
    if view.mode == "TRIANGLES" && count % 3 != 0 {
        return illegal(format!("{count} indices are not a multiple of three"));
    }
    let size = match count.checked_mul(stride) {
        Some(size) if size <= (source.len() as u64).saturating_mul(MAX_RATIO) => size as usize,
        _ => {
            return illegal(format!(
                "{count} elements cannot come from {} bytes",
                source.len()
            ));
        }
    };
    let filter = view.filter.as_deref().unwrap_or("NONE");
    let legal_filter = match filter {
        "NONE" => true,
        "OCTAHEDRAL" | "COLOR" => stride == 4 || stride == 8,
        "QUATERNION" => stride == 8,
        "EXPONENTIAL" => true,
        _ => false,
    };
    if !legal_filter || (filter != "NONE" && view.mode != "ATTRIBUTES") {
        let what = format!(
            "filter {filter:?} with mode {} and stride {stride}",
            view.mode
        );
        return Err(ImportError::new(ImportErrorKind::Unsupported, what));
    }

    let (stride, count) = (stride as usize, count as usize);
    // Zeroed u64s: the filters read and write elements of up to 8 bytes in place.
    let mut words = vec![0u64; size.div_ceil(8)];
    let target = words.as_mut_ptr().cast();
    // SAFETY: `target` points to at least count * stride writable bytes, `source` to `source.len()`
    // readable ones. Strides are 4..=256 and a multiple of 4 for attributes, 2 or 4 for indices, and
    // triangle indices come in threes: the conditions which the decoders assert. They check every
    // read against the end of the source.
    let status = unsafe {
        match view.mode.as_str() {
            "ATTRIBUTES" => ffi::meshopt_decodeVertexBuffer(
                target,
                count,
                stride,
                source.as_ptr(),
                source.len(),
            ),
            "TRIANGLES" => {
                ffi::meshopt_decodeIndexBuffer(target, count, stride, source.as_ptr(), source.len())
            }
            _ => ffi::meshopt_decodeIndexSequence(
                target,
                count,
                stride,
                source.as_ptr(),
                source.len(),
            ),
        }
    };
    if status != 0 {
        return illegal(format!(
            "the compressed data is damaged (decoder status {status})"
        ));
    }
    // SAFETY: as above, count elements of `stride` bytes each; each filter's stride was checked
    // (octahedral and colour 4 or 8, quaternion 8, exponential a multiple of 4) and `target` is
    // aligned to 8 bytes.
    unsafe {
        match filter {
            "OCTAHEDRAL" => ffi::meshopt_decodeFilterOct(target, count, stride),
            "QUATERNION" => ffi::meshopt_decodeFilterQuat(target, count, stride),
            "EXPONENTIAL" => ffi::meshopt_decodeFilterExp(target, count, stride),
            "COLOR" => ffi::meshopt_decodeFilterColor(target, count, stride),
            _ => {}
        }
    }
    let mut bytes: Vec<u8> = bytemuck::cast_slice(&words).to_vec();
    bytes.truncate(size);
    Ok(bytes)
}
