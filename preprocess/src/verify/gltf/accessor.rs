//! Elements of accessors as f64 or as indices.

use super::buffers::Buffers;
use super::json::{Result, item, optional, required};
use serde_json::Value;

/// Accessors without data may have this many elements: they cost the file nothing.
const MAX_ZEROS: usize = 1 << 20;

/// An accessor whose bytes are known to be there.
pub(super) struct Accessor<'a> {
    bytes: Option<(&'a [u8], usize)>,
    /// Elements that a sparse accessor replaces, in ascending order, and their new bytes.
    replaced: Vec<(usize, &'a [u8])>,
    pub(super) count: usize,
    lanes: usize,
    component: usize,
    is_normalized: bool,
}

impl<'a> Accessor<'a> {
    pub(super) fn open(
        root: &Value,
        buffers: &'a Buffers<'_>,
        index: usize,
        kind: &str,
    ) -> Result<Self> {
        Self::find(root, buffers, index, kind).map_err(|what| format!("accessor {index}: {what}"))
    }

    fn find(root: &Value, buffers: &'a Buffers<'_>, index: usize, kind: &str) -> Result<Self> {
        let accessor = item(root, "accessors", index)?;
        if accessor["type"] != kind {
            return Err(format!("is of type {}, not {kind}", accessor["type"]));
        }
        let mut opened = Self {
            bytes: None,
            replaced: Vec::new(),
            count: required(accessor, "count")?,
            lanes: match kind {
                "SCALAR" => 1,
                "VEC2" => 2,
                "VEC3" => 3,
                "VEC4" => 4,
                _ => 16,
            },
            component: required(accessor, "componentType")?,
            is_normalized: accessor["normalized"] == true,
        };
        let size = opened.lanes * width(opened.component)?;
        match optional(accessor, "bufferView")? {
            Some(view) => {
                let offset = optional(accessor, "byteOffset")?.unwrap_or(0);
                opened.bytes = Some(run(buffers, view, offset, opened.count, size)?);
            }
            None if opened.count > MAX_ZEROS => {
                return Err(format!("{} elements without data", opened.count));
            }
            None => {}
        }
        let sparse = &accessor["sparse"];
        if sparse.is_object() {
            let count = required(sparse, "count")?;
            let (indices, values) = (&sparse["indices"], &sparse["values"]);
            let component = required(indices, "componentType")?;
            let offset = |of: &Value| Ok::<_, String>(optional(of, "byteOffset")?.unwrap_or(0));
            let view = required(indices, "bufferView")?;
            let places = run(buffers, view, offset(indices)?, count, width(component)?)?;
            let view = required(values, "bufferView")?;
            let values = run(buffers, view, offset(values)?, count, size)?;
            for at in 0..count {
                let place = lane(&places.0[at * places.1..], component) as usize;
                opened.replaced.push((place, &values.0[at * values.1..]));
            }
            opened.replaced.sort_by_key(|(place, _)| *place);
        }
        Ok(opened)
    }

    /// Whether elements are not f32 numbers of the file.
    pub(super) fn is_converted(&self) -> bool {
        self.component != 5126 && self.is_normalized
    }

    fn element(&self, index: usize) -> Option<&[u8]> {
        match self
            .replaced
            .binary_search_by_key(&index, |(place, _)| *place)
        {
            Ok(found) => Some(self.replaced[found].1),
            Err(_) => self.bytes.map(|(bytes, stride)| &bytes[index * stride..]),
        }
    }

    /// The components of an element, which is below the count.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> [f64; N] {
        let Some(bytes) = self.element(index) else {
            return [0.0; N];
        };
        let width = width(self.component).unwrap_or(1);
        std::array::from_fn(|i| {
            let value = lane(&bytes[i * width..], self.component);
            match (self.is_normalized, self.component) {
                (true, 5120) => (value / 127.0).max(-1.0),
                (true, 5121) => value / 255.0,
                (true, 5122) => (value / 32767.0).max(-1.0),
                (true, 5123) => value / 65535.0,
                _ => value,
            }
        })
    }

    /// All elements as indices.
    pub(super) fn indices(&self) -> Result<Vec<u32>> {
        if !matches!(self.component, 5121 | 5123 | 5125) {
            return Err("indices are not unsigned integers".into());
        }
        let index = |at| {
            self.element(at)
                .map_or(0, |bytes| lane(bytes, self.component) as u32)
        };
        Ok((0..self.count).map(index).collect())
    }
}

/// The bytes of `count` elements of `size` bytes in a buffer view, and their stride.
fn run<'a>(
    buffers: &'a Buffers<'_>,
    view: usize,
    offset: usize,
    count: usize,
    size: usize,
) -> Result<(&'a [u8], usize)> {
    let (bytes, stride) = buffers.view(view)?;
    let stride = stride.unwrap_or(size);
    let len = match count.checked_sub(1) {
        None => Some(0),
        Some(gaps) => gaps
            .checked_mul(stride)
            .and_then(|gaps| gaps.checked_add(size)),
    };
    let end = len.and_then(|len| len.checked_add(offset));
    match end.and_then(|end| bytes.get(offset..end)) {
        Some(bytes) if stride >= size => Ok((bytes, stride)),
        _ => Err(format!(
            "{count} elements do not fit into buffer view {view}"
        )),
    }
}

/// Bytes of a component.
fn width(component: usize) -> Result<usize> {
    match component {
        5120 | 5121 => Ok(1),
        5122 | 5123 => Ok(2),
        5125 | 5126 => Ok(4),
        _ => Err(format!("the component type {component} is not known")),
    }
}

fn lane(bytes: &[u8], component: usize) -> f64 {
    match component {
        5120 => f64::from(bytes[0] as i8),
        5121 => f64::from(bytes[0]),
        5122 => f64::from(i16::from_le_bytes([bytes[0], bytes[1]])),
        5123 => f64::from(u16::from_le_bytes([bytes[0], bytes[1]])),
        _ => {
            let word = [bytes[0], bytes[1], bytes[2], bytes[3]];
            match component {
                5126 => f64::from(f32::from_le_bytes(word)),
                _ => f64::from(u32::from_le_bytes(word)),
            }
        }
    }
}
