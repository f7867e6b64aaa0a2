//! Accessors (sections 3.6.2 to 3.6.2.4): typed elements, every size checked against the bytes that
//! are there before any element is read.

use super::buffers::{Buffers, range};
use super::document::{get, known};
use super::{ImportError, ImportErrorKind, Result};
use gltf::json::accessor::sparse::Sparse;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::buffer::View;
use gltf::json::{Accessor, Index, Root};
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
    pub(super) fn declared(&self, index: Index<Accessor>) -> Result<&'a Accessor> {
        get(self.root, index, "accessor")
    }

    /// Bytes of the buffers read so far.
    pub(super) fn source_bytes(&self) -> u64 {
        self.buffers.loaded_bytes()
    }

    /// Opens an accessor whose elements have `shape`.
    pub(super) fn open(&self, index: Index<Accessor>, shape: Type) -> Result<Elements<'a>> {
        let accessor = self.declared(index)?;
        self.elements(accessor, shape)
            .map_err(|error| error.within(format_args!("accessor {index}")))
    }

    fn elements(&self, accessor: &'a Accessor, shape: Type) -> Result<Elements<'a>> {
        let declared = known(accessor.type_, "type")?;
        if declared != shape {
            let what = format!("is of type {}, not {}", name(declared), name(shape));
            return Err(ImportError::malformed(what));
        }
        let component = known(accessor.component_type, "component type")?.0;
        let size = component.size() * shape.multiplicity();
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        let offset = accessor.byte_offset.unwrap_or_default().0;
        let base = match accessor.buffer_view {
            Some(view) => Some(self.strided(view, offset, count, size)?),
            None => {
                let left = self
                    .zeros_left
                    .get()
                    .checked_sub(accessor.count.0)
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
    fn strided(
        &self,
        view: Index<View>,
        offset: u64,
        count: usize,
        size: usize,
    ) -> Result<Strided<'a>> {
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
        let replaced = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
        let component = known(sparse.indices.component_type, "component type")?.0;
        let indices = self.strided(
            sparse.indices.buffer_view,
            sparse.indices.byte_offset.0,
            replaced,
            component.size(),
        )?;
        let values = self.strided(
            sparse.values.buffer_view,
            sparse.values.byte_offset.0,
            replaced,
            size,
        )?;
        let indices: Vec<u32> = (0..replaced)
            .map(|i| uint(component, indices.at(i)))
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
    component: ComponentType,
    normalized: bool,
}

impl Elements<'_> {
    /// Number of elements.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Bytes that it takes itself.
    pub(super) fn owned_bytes(&self) -> u64 {
        let overrides = self.overrides.as_ref();
        overrides.map_or(0, |overrides| {
            size_of_val(overrides.indices.as_slice()) as u64
        })
    }

    /// The first `N` components of element `index`, which is below the count; integers are converted
    /// as section 3.6.2.2 says, normalized or not.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> [f32; N] {
        match self.bytes(index) {
            Some(bytes) if self.component == ComponentType::F32 => {
                let (lanes, _) = bytes.as_chunks::<4>();
                std::array::from_fn(|lane| f32::from_le_bytes(lanes[lane]))
            }
            Some(bytes) => {
                let size = self.component.size();
                std::array::from_fn(|lane| {
                    float(self.component, &bytes[lane * size..], self.normalized)
                })
            }
            None => [0.0; N],
        }
    }

    /// All elements as unsigned integers.
    pub(super) fn indices(&self) -> Result<Vec<u32>> {
        // Plain runs, which most are, without a question per element.
        if let (Some(base), None) = (&self.base, &self.overrides)
            && base.stride == self.size
        {
            let bytes = &base.bytes[..self.count * self.size];
            match self.component {
                ComponentType::U32 => {
                    let indices = bytes.as_chunks().0.iter();
                    return Ok(indices.copied().map(u32::from_le_bytes).collect());
                }
                ComponentType::U16 => {
                    let indices = bytes.as_chunks().0.iter().copied();
                    return Ok(indices.map(u16::from_le_bytes).map(u32::from).collect());
                }
                _ => {}
            }
        }
        let index = |i| {
            self.bytes(i)
                .map_or(Ok(0), |bytes| uint(self.component, bytes))
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
                *lane = uint(self.component, bytes)?;
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

/// A type as it stands in the JSON.
fn name(shape: Type) -> String {
    format!("{shape:?}").to_uppercase()
}

/// A component as section 3.6.2.2 converts it.
fn float(component: ComponentType, bytes: &[u8], normalized: bool) -> f32 {
    let value = match component {
        ComponentType::I8 => f32::from(bytes[0] as i8),
        ComponentType::U8 => f32::from(bytes[0]),
        ComponentType::I16 => f32::from(i16::from_le_bytes([bytes[0], bytes[1]])),
        ComponentType::U16 => f32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
        ComponentType::U32 => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as f32,
        ComponentType::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    };
    match component {
        _ if !normalized => value,
        ComponentType::I8 => (value / 127.0).max(-1.0),
        ComponentType::U8 => value / 255.0,
        ComponentType::I16 => (value / 32767.0).max(-1.0),
        ComponentType::U16 => value / 65535.0,
        ComponentType::U32 | ComponentType::F32 => value,
    }
}

fn uint(component: ComponentType, bytes: &[u8]) -> Result<u32> {
    match component {
        ComponentType::U8 => Ok(u32::from(bytes[0])),
        ComponentType::U16 => Ok(u32::from(u16::from_le_bytes([bytes[0], bytes[1]]))),
        ComponentType::U32 => Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
        _ => Err(ImportError::malformed("indices must be unsigned integers")),
    }
}
