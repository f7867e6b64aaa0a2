//! Accessors (sections 3.6.2 to 3.6.2.4): typed elements, every size checked against the bytes that
//! are there before any element is read.

use super::buffers::{Buffers, range};
use super::schema::{Accessor, Root, Sparse, get};
use super::{ImportError, ImportErrorKind, Result};
use std::cell::Cell;

/// Elements of an accessor without a buffer view are zero and cost the file nothing; all such
/// accessors of a file together may have this many.
const MAX_ZEROS: u64 = 1 << 20;

pub(super) struct Accessors<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    /// How many elements without data may still be asked for.
    zeros_left: Cell<u64>,
}

impl<'a> Accessors<'a> {
    pub(super) fn new(root: &'a Root, buffers: &'a Buffers<'a>) -> Self {
        Self {
            root,
            buffers,
            zeros_left: Cell::new(MAX_ZEROS),
        }
    }

    /// The declaration of an accessor.
    pub(super) fn declared(&self, index: usize) -> Result<&'a Accessor> {
        get(&self.root.accessors, index, "accessor")
    }

    /// Bytes of the buffers read so far.
    pub(super) fn source_bytes(&self) -> u64 {
        self.buffers.loaded_bytes()
    }

    /// Opens an accessor whose elements have `shape`, such as `"VEC3"`.
    pub(super) fn open(&self, index: usize, shape: &str) -> Result<Elements<'a>> {
        let accessor = self.declared(index)?;
        self.elements(accessor, shape)
            .map_err(|error| error.within(format_args!("accessor {index}")))
    }

    fn elements(&self, accessor: &'a Accessor, shape: &str) -> Result<Elements<'a>> {
        if accessor.shape != shape {
            return Err(ImportError::malformed(format!(
                "is of type {:?}, not {shape}",
                accessor.shape
            )));
        }
        let component = Component::of(accessor.component_type)?;
        let size = component.size() * lane_count(shape);
        let count = usize::try_from(accessor.count).unwrap_or(usize::MAX);
        let base = match accessor.buffer_view {
            Some(view) => Some(self.strided(view, accessor.byte_offset, count, size)?),
            None => {
                let left = self
                    .zeros_left
                    .get()
                    .checked_sub(accessor.count)
                    .ok_or_else(|| {
                        let what =
                            format!("more than {MAX_ZEROS} elements without data in the file");
                        ImportError::new(ImportErrorKind::TooLarge, what)
                    })?;
                self.zeros_left.set(left);
                None
            }
        };
        let sparse = accessor
            .sparse
            .as_ref()
            .map(|sparse| self.overrides(sparse, count, size));
        let overrides = sparse.transpose().map_err(|error| error.within("sparse"))?;
        Ok(Elements {
            base,
            overrides,
            count,
            size,
            component,
            normalized: accessor.normalized,
        })
    }

    /// `count` elements of `size` bytes in a buffer view.
    fn strided(&self, view: usize, offset: u64, count: usize, size: usize) -> Result<Strided<'a>> {
        let (bytes, stride) = self.buffers.view(view)?;
        let stride = stride.filter(|&stride| stride != 0).unwrap_or(size);
        if stride < size {
            return Err(ImportError::malformed(format!(
                "a stride of {stride} bytes is less than the {size} of an element"
            )));
        }
        // The last element need not fill its stride.
        let length = match (count as u64).checked_sub(1) {
            None => Some(0),
            Some(gaps) => gaps
                .checked_mul(stride as u64)
                .and_then(|gaps| gaps.checked_add(size as u64)),
        };
        let range = length.and_then(|length| range(offset, length, bytes.len())).ok_or_else(|| {
            ImportError::malformed(format!(
                "{count} elements with a stride of {stride} bytes from byte {offset} do not fit in the {} \
                 bytes of buffer view {view}",
                bytes.len()
            ))
        })?;
        Ok(Strided {
            bytes: &bytes[range],
            stride,
        })
    }

    /// The elements that a sparse accessor replaces (section 3.6.2.3).
    fn overrides(&self, sparse: &Sparse, count: usize, size: usize) -> Result<Overrides<'a>> {
        let replaced = usize::try_from(sparse.count).unwrap_or(usize::MAX);
        let component = Component::of(sparse.indices.component_type)?;
        let size_of_index = component.size();
        let indices = self.strided(
            sparse.indices.buffer_view,
            sparse.indices.byte_offset,
            replaced,
            size_of_index,
        )?;
        let values = self.strided(
            sparse.values.buffer_view,
            sparse.values.byte_offset,
            replaced,
            size,
        )?;
        let indices: Vec<u32> = (0..replaced)
            .map(|i| component.index(indices.at(i)))
            .collect::<Result<_>>()?;
        let ascending = indices.is_sorted_by(|a, b| a < b);
        if !ascending || indices.last().is_some_and(|&last| last as usize >= count) {
            return Err(ImportError::malformed(format!(
                "the indices do not ascend within 0..{count}"
            )));
        }
        Ok(Overrides { indices, values })
    }
}

/// Elements of one size at a fixed distance.
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Strided<'a> {
    fn at(&self, index: usize) -> &'a [u8] {
        &self.bytes[index * self.stride..]
    }
}

struct Overrides<'a> {
    indices: Vec<u32>,
    values: Strided<'a>,
}

/// The elements of an accessor. Reading one costs no allocation.
pub(super) struct Elements<'a> {
    base: Option<Strided<'a>>,
    overrides: Option<Overrides<'a>>,
    count: usize,
    size: usize,
    component: Component,
    normalized: bool,
}

impl Elements<'_> {
    /// Number of elements.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// The first `N` components of element `index`, which is below the count; integers are converted
    /// as section 3.6.2.2 says, normalized or not.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> [f32; N] {
        match self.bytes(index) {
            Some(bytes) => {
                let size = self.component.size();
                std::array::from_fn(|lane| {
                    self.component.float(&bytes[lane * size..], self.normalized)
                })
            }
            None => [0.0; N],
        }
    }

    /// All elements as unsigned integers.
    pub(super) fn indices(&self) -> Result<Vec<u32>> {
        let index = |i| {
            self.bytes(i)
                .map_or(Ok(0), |bytes| self.component.index(bytes))
        };
        (0..self.count).map(index).collect()
    }

    /// The first `N` components of element `index` as unsigned integers.
    pub(super) fn uints<const N: usize>(&self, index: usize) -> Result<[u32; N]> {
        let mut lanes = [0; N];
        if let Some(bytes) = self.bytes(index) {
            for (lane, bytes) in lanes
                .iter_mut()
                .zip(bytes.chunks_exact(self.component.size()))
            {
                *lane = self.component.index(bytes)?;
            }
        }
        Ok(lanes)
    }

    /// The bytes of an element; `None` stands for zeros.
    fn bytes(&self, index: usize) -> Option<&[u8]> {
        let replaced = self.overrides.as_ref().and_then(|overrides| {
            let at = overrides
                .indices
                .binary_search(&u32::try_from(index).ok()?)
                .ok()?;
            Some(overrides.values.at(at))
        });
        let bytes = replaced.or_else(|| self.base.as_ref().map(|base| base.at(index)));
        bytes.map(|bytes| &bytes[..self.size])
    }
}

/// Component types (section 3.6.2.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Result<Self> {
        match code {
            5120 => Ok(Self::I8),
            5121 => Ok(Self::U8),
            5122 => Ok(Self::I16),
            5123 => Ok(Self::U16),
            5125 => Ok(Self::U32),
            5126 => Ok(Self::F32),
            _ => Err(ImportError::malformed(format!(
                "unknown component type {code}"
            ))),
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    fn float(self, bytes: &[u8], normalized: bool) -> f32 {
        let value = match self {
            Self::I8 => f32::from(bytes[0] as i8),
            Self::U8 => f32::from(bytes[0]),
            Self::I16 => f32::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            Self::U16 => f32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            Self::U32 => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as f32,
            Self::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        };
        match self {
            _ if !normalized => value,
            Self::I8 => (value / 127.0).max(-1.0),
            Self::U8 => value / 255.0,
            Self::I16 => (value / 32767.0).max(-1.0),
            Self::U16 => value / 65535.0,
            Self::U32 | Self::F32 => value,
        }
    }

    fn index(self, bytes: &[u8]) -> Result<u32> {
        match self {
            Self::U8 => Ok(u32::from(bytes[0])),
            Self::U16 => Ok(u32::from(u16::from_le_bytes([bytes[0], bytes[1]]))),
            Self::U32 => Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
            _ => Err(ImportError::malformed("indices must be unsigned integers")),
        }
    }
}

/// Components per element. Matrices whose columns would need padding are not read.
fn lane_count(shape: &str) -> usize {
    match shape {
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        _ => 1,
    }
}
