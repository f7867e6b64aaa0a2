//! Reading an opened scene: arrays as bytes for the GPU, single entries as plain values for the CPU.

use rend::{f32_le, i16_le, u16_le, u32_le};

use crate::types::*;

/// The bytes of an array, to upload as they are: `bytes_of(scene.objects.as_slice())`.
pub fn bytes_of<T: bytemuck::Pod>(array: &[T]) -> &[u8] {
    bytemuck::cast_slice(array)
}

/// The object-space position that a quantized one stands for, as a GPU reads the vertex format `unorm16x4`: each
/// coordinate over 65535, in 0..=1.
pub fn dequantize(stored: [u16; 4]) -> [f32; 3] {
    std::array::from_fn(|axis| f32::from(stored[axis]) / f32::from(u16::MAX))
}

impl ArchivedScene {
    /// The name of an object; empty where it has none, and for an id or a name table that is wrong.
    pub fn object_name(&self, object: u32) -> &str {
        let ends = self.name_ends.as_slice();
        let object = object as usize;
        let start = object
            .checked_sub(1)
            .and_then(|before| ends.get(before))
            .map_or(0, |end| end.to_native());
        let end = ends.get(object).map_or(start, |end| end.to_native());
        let name = self
            .names
            .as_slice()
            .get(start as usize..end as usize)
            .unwrap_or_default();
        std::str::from_utf8(name).unwrap_or_default()
    }

    /// The tree that was built by `split`.
    pub fn bvh(&self, split: &str) -> Option<&ArchivedBvh> {
        self.bvhs.iter().find(|bvh| bvh.split == *split)
    }

    /// Triangles of all objects together: a mesh counts once for each object that draws it.
    pub fn drawn_triangle_count(&self) -> u64 {
        let count = |object: &ArchivedObject| {
            let mesh = self.meshes.get(object.mesh.to_native() as usize);
            mesh.map_or(0, |mesh| u64::from(mesh.index_count.to_native() / 3))
        };
        self.objects.iter().map(count).sum()
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.positions.len().max(self.quantized_positions.len())
    }

    /// Position of a vertex, object space, decoded where it is quantized.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn position(&self, vertex: usize) -> [f32; 3] {
        match self.quantized_positions.get(vertex) {
            Some(stored) => dequantize(stored.map(|lane| lane.to_native())),
            None => self.positions()[vertex],
        }
    }

    /// All vertex positions, object space; empty where they are quantized.
    pub fn positions(&self) -> &[[f32; 3]] {
        bytemuck::cast_slice::<[f32_le; 3], _>(self.positions.as_slice())
    }

    /// All quantized vertex positions; empty where they are not. See [`dequantize`].
    pub fn quantized_positions(&self) -> &[[u16; 4]] {
        bytemuck::cast_slice::<[u16_le; 4], _>(self.quantized_positions.as_slice())
    }

    /// All indices, each mesh's counting from its first vertex.
    pub fn indices(&self) -> &[u32] {
        bytemuck::cast_slice::<u32_le, _>(self.indices.as_slice())
    }

    /// All normals, octahedral; empty where there are none.
    pub fn normals(&self) -> &[[i16; 2]] {
        bytemuck::cast_slice::<[i16_le; 2], _>(self.normals.as_slice())
    }

    /// All texture coordinates; empty where there are none.
    pub fn uvs(&self) -> &[[f32; 2]] {
        bytemuck::cast_slice::<[f32_le; 2], _>(self.uvs.as_slice())
    }
}

impl ArchivedScene {
    /// The origins of the cells in the source's coordinates. A scene without objects may store none; then the only
    /// one is the scene's.
    pub fn cell_origins(&self) -> Vec<[f64; 3]> {
        let plain = |origin: &[rend::f64_le; 3]| origin.map(|x| x.to_native());
        match self.cells.as_slice() {
            [] => vec![plain(&self.origin)],
            cells => cells.iter().map(plain).collect(),
        }
    }
}

impl ArchivedBvh {
    /// The parent of each node; the root's is itself.
    pub fn parents(&self) -> &[u32] {
        bytemuck::cast_slice::<u32_le, _>(self.parents.as_slice())
    }

    /// The leaf of each object.
    pub fn leaf_of_object(&self) -> &[u32] {
        bytemuck::cast_slice::<u32_le, _>(self.leaf_of_object.as_slice())
    }
}

impl ArchivedMesh {
    /// Its entries in [`ArchivedScene::indices`].
    pub fn index_range(&self) -> std::ops::Range<usize> {
        let start = self.first_index.to_native() as usize;
        start..start + self.index_count.to_native() as usize
    }

    /// Its entries in [`ArchivedScene::positions`], normals and texture coordinates.
    pub fn vertex_range(&self) -> std::ops::Range<usize> {
        let start = self.first_vertex.to_native() as usize;
        start..start + self.vertex_count.to_native() as usize
    }
}

macro_rules! to_native {
    ($($archived:ident -> $native:ident { $($field:ident,)* })*) => {$(
        impl $archived {
            /// A copy with plain numbers.
            pub fn to_native(&self) -> $native {
                $native { $($field: ToNative::to_native(&self.$field),)* }
            }
        }
    )*};
}

to_native! {
    ArchivedObject -> Object { world_from_object, mesh, base_color, flags, cell, }
    ArchivedBounds -> Bounds { min, max, }
    ArchivedObjectBounds -> ObjectBounds { min, cell, max, reserved, }
    ArchivedMesh -> Mesh { min, first_index, max, index_count, first_vertex, vertex_count, reserved, }
    ArchivedBvhNode -> BvhNode { min, skip, max, cell_and_object, }
    ArchivedBvhStats -> BvhStats { depth, reserved, mean_leaf_depth, sah_cost, overlap, }
    ArchivedObjectSource -> ObjectSource { file, node, primitive, }
}

/// A stored number, or an array of them, as the plain one.
trait ToNative {
    type Native;
    fn to_native(&self) -> Self::Native;
}

macro_rules! number {
    ($($stored:ident -> $native:ident,)*) => {$(
        impl ToNative for rend::$stored {
            type Native = $native;
            fn to_native(&self) -> $native {
                rend::$stored::to_native(*self)
            }
        }
    )*};
}
number! { u32_le -> u32, f32_le -> f32, f64_le -> f64, }

impl<T: ToNative, const N: usize> ToNative for [T; N] {
    type Native = [T::Native; N];
    fn to_native(&self) -> Self::Native {
        std::array::from_fn(|i| self[i].to_native())
    }
}
