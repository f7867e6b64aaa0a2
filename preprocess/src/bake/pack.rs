//! All meshes in the arrays of the file.

use super::{BakeError, Keep};
use crate::scene::SourceMesh;
use crate::world_bounds::Points;
use crate::{normals, quantize};
use hroc_format::Mesh;

/// All meshes in the arrays of the file.
pub(super) struct Packed {
    pub(super) meshes: Vec<Mesh>,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) quantized_positions: Vec<[u16; 4]>,
    pub(super) indices: Vec<u32>,
    pub(super) normals: Vec<[i16; 2]>,
    pub(super) uvs: Vec<[f32; 2]>,
}

impl Packed {
    /// Takes the meshes, each until it is copied.
    pub(super) fn new(
        sources: Vec<SourceMesh>,
        keep: Keep,
        quantize: bool,
    ) -> Result<Self, BakeError> {
        let vertex_count = sources.iter().map(|mesh| mesh.positions.len()).sum();
        let index_count = sources.iter().map(|mesh| mesh.indices.len()).sum();
        for (count, what) in [
            (vertex_count, "vertices"),
            (index_count, "indices"),
            (sources.len(), "meshes"),
        ] {
            if count > u32::MAX as usize {
                return Err(BakeError::TooLarge(what));
            }
        }
        let mut packed = Self {
            meshes: Vec::with_capacity(sources.len()),
            positions: Vec::with_capacity(if quantize { 0 } else { vertex_count }),
            quantized_positions: Vec::with_capacity(if quantize { vertex_count } else { 0 }),
            indices: Vec::with_capacity(index_count),
            normals: Vec::with_capacity(if keep.normals { vertex_count } else { 0 }),
            uvs: Vec::with_capacity(if keep.uvs { vertex_count } else { 0 }),
        };
        let mut first_vertex = 0;
        for source in sources {
            let fold = |start: f32, pick: fn(f32, f32) -> f32| {
                let pick =
                    |a: [f32; 3], b: &[f32; 3]| std::array::from_fn(|axis| pick(a[axis], b[axis]));
                source.positions.iter().fold([start; 3], pick)
            };
            packed.meshes.push(Mesh {
                min: fold(f32::INFINITY, f32::min),
                first_index: packed.indices.len() as u32,
                max: fold(f32::NEG_INFINITY, f32::max),
                index_count: source.indices.len() as u32,
                first_vertex: first_vertex as u32,
                vertex_count: source.positions.len() as u32,
                reserved: [0; 2],
            });
            first_vertex += source.positions.len();
            if quantize {
                let positions = source.positions.iter().copied();
                packed
                    .quantized_positions
                    .extend(positions.map(quantize::encode));
            } else {
                packed.positions.extend(&source.positions);
            }
            packed.indices.extend(&source.indices);
            packed.normals.extend(
                source
                    .normals
                    .iter()
                    .copied()
                    .map(normals::encode_octahedral),
            );
            packed.uvs.extend(&source.uvs);
        }
        Ok(packed)
    }

    /// The vertices of a mesh as the GPU reads them.
    pub(super) fn points(&self, mesh: usize) -> Points {
        let mesh = &self.meshes[mesh];
        let first = mesh.first_vertex as usize;
        let vertices = first..first + mesh.vertex_count as usize;
        match self.quantized_positions.as_slice() {
            [] => Points::new(&self.positions[vertices]),
            quantized => Points::quantized(&quantized[vertices]),
        }
    }
}
