//! Bytes of buffers and buffer views.

use super::json::{Result, item, optional, required};
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;

/// All buffers and compressed buffer views of a file.
pub(super) struct Buffers<'a> {
    root: &'a Value,
    buffers: Vec<Result<Vec<u8>>>,
    /// Buffer views that were compressed, and their strides.
    decompressed: HashMap<usize, Result<(Vec<u8>, usize)>>,
}

impl<'a> Buffers<'a> {
    pub(super) fn read(root: &'a Value, bin: Option<&[u8]>, folder: &Path) -> Self {
        let list = |name: &str| root[name].as_array().map_or(&[][..], Vec::as_slice);
        let load = |(index, buffer): (usize, &Value)| {
            load(buffer, bin.filter(|_| index == 0), folder)
                .map_err(|what| format!("buffer {index}: {what}"))
        };
        let mut buffers = Self {
            root,
            buffers: list("buffers").iter().enumerate().map(load).collect(),
            decompressed: HashMap::new(),
        };
        for (index, view) in list("bufferViews").iter().enumerate() {
            let names = ["KHR_meshopt_compression", "EXT_meshopt_compression"];
            let compression = names.map(|name| &view["extensions"][name]);
            if let Some(compression) = compression.into_iter().find(|found| found.is_object()) {
                let bytes = buffers.decompress(compression);
                buffers.decompressed.insert(index, bytes);
            }
        }
        buffers
    }

    /// The bytes of a buffer view, and its stride where it has one.
    pub(super) fn view(&self, index: usize) -> Result<(&[u8], Option<usize>)> {
        let place = |what: String| format!("buffer view {index}: {what}");
        let view = item(self.root, "bufferViews", index)?;
        match self.decompressed.get(&index) {
            Some(Ok((bytes, stride))) => Ok((bytes, Some(*stride))),
            Some(Err(what)) => Err(place(what.clone())),
            None => {
                let stride = optional(view, "byteStride").map_err(place)?;
                Ok((self.slice(view).map_err(place)?, stride))
            }
        }
    }

    /// The bytes that `buffer`, `byteOffset` and `byteLength` of an object stand for.
    fn slice(&self, object: &Value) -> Result<&[u8]> {
        let buffer = required(object, "buffer")?;
        let offset = optional(object, "byteOffset")?.unwrap_or(0);
        let len = required(object, "byteLength")?;
        let bytes = match self.buffers.get(buffer) {
            Some(Ok(bytes)) => bytes,
            Some(Err(what)) => return Err(what.clone()),
            None => return Err(format!("there is no buffer {buffer}")),
        };
        let end = offset.checked_add(len);
        end.and_then(|end| bytes.get(offset..end))
            .ok_or_else(|| format!("{len} bytes from byte {offset} are not in buffer {buffer}"))
    }

    fn decompress(&self, compression: &Value) -> Result<(Vec<u8>, usize)> {
        let source = self.slice(compression)?;
        let count = required(compression, "count")?;
        let stride = required(compression, "byteStride")?;
        // No codec makes more than 1024 bytes of one.
        let size = count.checked_mul(stride);
        if size.is_none_or(|size| size / 1024 > source.len()) {
            return Err(format!(
                "{count} elements are too many for the compressed bytes"
            ));
        }
        let mode = compression["mode"].as_str().unwrap_or_default();
        let filter = compression["filter"].as_str().unwrap_or("NONE");
        let unsupported = || {
            format!(
                "cannot compare data of meshopt mode {mode:?} with filter {filter:?} and stride {stride}"
            )
        };
        let fault = |error: meshopt::Error| format!("meshopt: {error}");
        let bytes = match (mode, filter, stride) {
            ("TRIANGLES", _, 2) if count.is_multiple_of(3) => {
                let indices = meshopt::decode_index_buffer::<u16>(source, count);
                bytemuck::cast_slice(&indices.map_err(fault)?).to_vec()
            }
            ("TRIANGLES", _, 4) if count.is_multiple_of(3) => {
                let indices = meshopt::decode_index_buffer::<u32>(source, count);
                bytemuck::cast_slice(&indices.map_err(fault)?).to_vec()
            }
            ("INDICES", _, 2) => {
                let indices = meshopt::decode_index_sequence::<u16>(source, count);
                bytemuck::cast_slice(&indices.map_err(fault)?).to_vec()
            }
            ("INDICES", _, 4) => {
                let indices = meshopt::decode_index_sequence::<u32>(source, count);
                bytemuck::cast_slice(&indices.map_err(fault)?).to_vec()
            }
            ("ATTRIBUTES", _, _) => {
                let mut bytes = attributes(source, count, stride).ok_or_else(unsupported)??;
                match filter {
                    "NONE" => {}
                    // Normals and colours are not compared.
                    "OCTAHEDRAL" | "COLOR" => {}
                    "EXPONENTIAL" => exponential(&mut bytes),
                    "QUATERNION" if stride == 8 => {
                        let mut lanes: Vec<[i16; 4]> = bytemuck::pod_collect_to_vec(&bytes);
                        meshopt::decode_filter_quat(&mut lanes);
                        bytes = bytemuck::cast_slice(&lanes).to_vec();
                    }
                    _ => return Err(unsupported()),
                }
                bytes
            }
            _ => return Err(unsupported()),
        };
        Ok((bytes, stride))
    }
}

/// Elements of 4 bytes become f32: 8 bits of exponent above 24 bits of mantissa, both with a sign.
fn exponential(bytes: &mut [u8]) {
    for lane in bytes.as_chunks_mut::<4>().0 {
        let stored = i32::from_le_bytes(*lane);
        let (exponent, mantissa) = (stored >> 24, stored << 8 >> 8);
        let value = f64::from(mantissa) * f64::from(exponent).exp2();
        *lane = (value as f32).to_le_bytes();
    }
}

/// One vertex of compressed attributes.
#[derive(Clone, Copy)]
#[repr(C)]
struct Vertex<const WORDS: usize>([u32; WORDS]);

impl<const WORDS: usize> Default for Vertex<WORDS> {
    fn default() -> Self {
        Self([0; WORDS])
    }
}

fn vertices<const WORDS: usize>(source: &[u8], count: usize) -> Result<Vec<u8>> {
    let vertices = meshopt::decode_vertex_buffer::<Vertex<WORDS>>(source, count);
    let vertices = vertices.map_err(|error| format!("meshopt: {error}"))?;
    let words = vertices.iter().flat_map(|vertex| vertex.0);
    Ok(words.flat_map(u32::to_le_bytes).collect())
}

/// Decodes vertices of `stride` bytes; `None` for a stride that is not supported here.
fn attributes(source: &[u8], count: usize, stride: usize) -> Option<Result<Vec<u8>>> {
    macro_rules! by_words {
        ($($words:literal)*) => {
            match stride {
                $(stride if stride == 4 * $words => Some(vertices::<$words>(source, count)),)*
                _ => None,
            }
        };
    }
    by_words!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 20 24 28 32 64)
}

fn load(buffer: &Value, bin: Option<&[u8]>, folder: &Path) -> Result<Vec<u8>> {
    let mut bytes = match (buffer["uri"].as_str(), bin) {
        (None, Some(bin)) => bin.to_vec(),
        (None, None) => return Err("has no data".into()),
        (Some(uri), _) => resolve(uri, folder)?,
    };
    let len = required(buffer, "byteLength")?;
    if bytes.len() < len {
        return Err(format!("declares {len} bytes, has {}", bytes.len()));
    }
    bytes.truncate(len);
    Ok(bytes)
}

fn resolve(uri: &str, folder: &Path) -> Result<Vec<u8>> {
    let scheme = uri.get(..5).unwrap_or_default();
    if !scheme.eq_ignore_ascii_case("data:") {
        let plain = String::from_utf8_lossy(&unescape(uri)).into_owned();
        let name = plain.strip_prefix("./").unwrap_or(&plain);
        let names = [name.to_owned(), name.replace('\\', "/"), uri.to_owned()];
        let found = names
            .iter()
            .find_map(|name| std::fs::read(folder.join(name)).ok());
        return found.ok_or_else(|| format!("cannot read {plain:?} beside the scene"));
    }
    let (kind, data) = uri.split_once(',').ok_or("the data URI has no comma")?;
    let data = unescape(data);
    match kind.to_ascii_lowercase().ends_with(";base64") {
        true => base64(&data).ok_or_else(|| "the data URI is not base64".to_owned()),
        false => Ok(data),
    }
}

fn unescape(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let mut plain = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let code = text.get(at + 1..at + 3);
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(byte) if bytes[at] == b'%' => {
                plain.push(byte);
                at += 3;
            }
            _ => {
                plain.push(bytes[at]);
                at += 1;
            }
        }
    }
    plain
}

fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let (mut bits, mut held, mut bytes) = (0_u32, 0, Vec::with_capacity(text.len() / 4 * 3));
    for &byte in text.iter().filter(|byte| !byte.is_ascii_whitespace()) {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' => break,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris() {
        let read = |uri: &str| resolve(uri, Path::new("."));
        assert_eq!(read("data:;base64,aHJvYw==").unwrap(), b"hroc");
        assert_eq!(read("DATA:text/plain,a%20b").unwrap(), b"a b");
        assert!(read("data:;base64,!!!").is_err());
        assert!(read("nothing.bin").unwrap_err().contains("nothing.bin"));
    }

    #[test]
    fn exponents() {
        let mut bytes = (0xFE00_0003_u32).to_le_bytes();
        exponential(&mut bytes);
        assert_eq!(f32::from_le_bytes(bytes), 0.75);
    }
}
