//! Prepares a mesh for the GPU: merges equal vertices, orders triangles for the vertex cache and
//! against overdraw, orders vertices for fetching. No triangle is added or lost here; the bake leaves out those
//! that cover nothing before ([`crate::degenerate`]).

use crate::scene::SourceMesh;
use meshopt::{VertexDataAdapter, VertexStream};

/// How much the overdraw order may cost in vertex cache misses: 5 %, the value meshoptimizer's
/// documentation recommends.
const OVERDRAW_THRESHOLD: f32 = 1.05;

/// The sum of squared valences up to which the slower order is used: a fan of 1000 triangles.
const MAX_CACHE_WORK: u64 = 1 << 20;
/// What each index adds to that. Closed meshes of triangles have 6 triangles at a vertex on average, and a sum of
/// 6 per index.
const MAX_CACHE_WORK_PER_INDEX: u64 = 32;
/// Vertices in the cache that the FIFO order is made for: fewer than any GPU has.
const FIFO_SIZE: u32 = 16;

/// Why a mesh is not what importers promise.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// Nothing to draw, or an incomplete triangle.
    #[error("{0} indices are not a positive multiple of three")]
    IndexCount(usize),
    /// An index without a vertex.
    #[error("index {index} is not below the {vertices} vertices")]
    IndexOutOfRange {
        /// The first such index.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("vertex {0} is not finite")]
    NotFinite(usize),
    /// Normals or texture coordinates for some vertices only.
    #[error("{0} normals or texture coordinates for {1} vertices")]
    AttributeCount(usize, usize),
    /// More vertices than 32-bit indices reach.
    #[error("{0} vertices or indices are more than 2^32 - 1")]
    TooLarge(usize),
}

/// Checks what the rest of the bake, and every function of the `meshopt` crate, relies on.
///
/// # Errors
/// The first promise of [`SourceMesh`] that is broken.
pub fn check(mesh: &SourceMesh) -> Result<(), MeshError> {
    let vertices = mesh.positions.len();
    let indices = mesh.indices.len();
    if vertices.max(indices) > u32::MAX as usize {
        return Err(MeshError::TooLarge(vertices.max(indices)));
    }
    if indices == 0 || !indices.is_multiple_of(3) {
        return Err(MeshError::IndexCount(indices));
    }
    if let Some(&index) = mesh
        .indices
        .iter()
        .find(|&&index| index as usize >= vertices)
    {
        return Err(MeshError::IndexOutOfRange { index, vertices });
    }
    if let Some(vertex) = mesh
        .positions
        .iter()
        .position(|p| !p.iter().all(|x| x.is_finite()))
    {
        return Err(MeshError::NotFinite(vertex));
    }
    for count in [mesh.normals.len(), mesh.uvs.len()] {
        if count != 0 && count != vertices {
            return Err(MeshError::AttributeCount(count, vertices));
        }
    }
    Ok(())
}

/// Optimizes a mesh. The result depends on the mesh alone.
///
/// # Errors
/// If the mesh does not pass [`check`].
pub fn optimize(mesh: &SourceMesh) -> Result<SourceMesh, MeshError> {
    // The safe functions of `meshopt` trust indices, counts and finite positions: checked here first.
    check(mesh)?;
    let merged = merge_equal_vertices(mesh);
    let mut indices = order_for_vertex_cache(&merged.indices, merged.positions.len());
    let bytes = bytemuck::cast_slice(&merged.positions);
    // Cannot fail: the bytes are whole vertices of 12 bytes, positions first.
    if let Ok(adapter) = VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0) {
        meshopt::optimize_overdraw_in_place(&mut indices, &adapter, OVERDRAW_THRESHOLD);
    }
    let remap = meshopt::optimize_vertex_fetch_remap(&indices, merged.positions.len());
    Ok(remapped(&merged, &indices, &remap))
}

/// Orders triangles for the vertex cache, in time that is linear in the triangles.
///
/// meshoptimizer's best order rates all triangles of a vertex again for each triangle that it takes while the
/// vertex is in the cache. That is up to the square of the triangles at the vertex: minutes for a fan of 200 000.
/// Where the sum of these squares is large, its order for FIFO caches is used, which is linear and nearly as good.
fn order_for_vertex_cache(indices: &[u32], vertices: usize) -> Vec<u32> {
    let mut valences = vec![0_u64; vertices];
    for &index in indices {
        valences[index as usize] += 1;
    }
    let work: u64 = valences.iter().map(|valence| valence * valence).sum();
    if work <= MAX_CACHE_WORK + MAX_CACHE_WORK_PER_INDEX * indices.len() as u64 {
        meshopt::optimize_vertex_cache(indices, vertices)
    } else {
        meshopt::optimize_vertex_cache_fifo(indices, vertices, FIFO_SIZE)
    }
}

/// Merges vertices whose position, normal and texture coordinates are equal bit by bit, and drops
/// those that no triangle uses.
fn merge_equal_vertices(mesh: &SourceMesh) -> SourceMesh {
    let mut streams = vec![VertexStream::new(mesh.positions.as_ptr())];
    if !mesh.normals.is_empty() {
        streams.push(VertexStream::new(mesh.normals.as_ptr()));
    }
    if !mesh.uvs.is_empty() {
        streams.push(VertexStream::new(mesh.uvs.as_ptr()));
    }
    let vertices = mesh.positions.len();
    let (_, remap) = meshopt::generate_vertex_remap_multi(vertices, &streams, Some(&mesh.indices));
    remapped(mesh, &mesh.indices, &remap)
}

/// Renumbers vertices: vertex `v` becomes `remap[v]`; `u32::MAX` drops it.
fn remapped(mesh: &SourceMesh, indices: &[u32], remap: &[u32]) -> SourceMesh {
    let count = remap
        .iter()
        .filter(|&&to| to != u32::MAX)
        .max()
        .map_or(0, |&last| last as usize + 1);
    SourceMesh {
        positions: scatter(&mesh.positions, remap, count),
        normals: scatter(&mesh.normals, remap, count),
        uvs: scatter(&mesh.uvs, remap, count),
        indices: indices.iter().map(|&index| remap[index as usize]).collect(),
    }
}

fn scatter<T: Copy + Default>(from: &[T], remap: &[u32], count: usize) -> Vec<T> {
    if from.is_empty() {
        return Vec::new();
    }
    let mut to = vec![T::default(); count];
    for (&value, &index) in from
        .iter()
        .zip(remap)
        .filter(|(_, index)| **index != u32::MAX)
    {
        to[index as usize] = value;
    }
    to
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of quads, each with its own four vertices.
    fn soup(size: u32) -> SourceMesh {
        let mut mesh = SourceMesh::default();
        for cell in 0..size * size {
            let (x, y) = ((cell % size) as f32, (cell / size) as f32);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([
                [x, y, 0.0],
                [x + 1.0, y, 0.0],
                [x, y + 1.0, 0.0],
                [x + 1.0, y + 1.0, 0.0],
            ]);
            mesh.indices
                .extend([0, 1, 2, 2, 1, 3].map(|corner| first + corner));
        }
        mesh.indices.extend([0, 0, 0]);
        mesh
    }

    /// The triangles as sorted lists of corner positions, starting anywhere but in order.
    fn triangles(mesh: &SourceMesh) -> Vec<[[u32; 3]; 3]> {
        let corner = |index: &u32| mesh.positions[*index as usize].map(f32::to_bits);
        let mut triangles: Vec<_> = mesh
            .indices
            .chunks_exact(3)
            .map(|triangle| {
                let corners: [_; 3] = std::array::from_fn(|i| corner(&triangle[i]));
                let first = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
                std::array::from_fn(|i| corners[(first + i) % 3])
            })
            .collect();
        triangles.sort_unstable();
        triangles
    }

    #[test]
    fn keeps_every_triangle_and_merges_vertices() {
        let mesh = soup(9);
        let optimized = optimize(&mesh).unwrap();
        assert_eq!(triangles(&optimized), triangles(&mesh));
        assert_eq!(optimized.positions.len(), 100);
        assert_eq!(check(&optimized), Ok(()));
    }

    /// A fan of triangles round the first vertex.
    fn fan(count: u32) -> SourceMesh {
        let angle = |i: u32| i as f32 * std::f32::consts::TAU / count as f32;
        let rim = (0..=count).map(|i| [angle(i).cos(), angle(i).sin(), i as f32]);
        SourceMesh {
            positions: std::iter::once([0.0; 3]).chain(rim).collect(),
            indices: (0..count).flat_map(|i| [0, i + 1, i + 2]).collect(),
            ..Default::default()
        }
    }

    #[test]
    fn many_triangles_at_a_vertex_take_no_quadratic_time() {
        // 81 s with the order that rates all triangles of a vertex.
        let mesh = fan(200_000);
        let start = std::time::Instant::now();
        let optimized = optimize(&mesh).unwrap();
        assert!(start.elapsed().as_secs_f64() < 2.0, "{:?}", start.elapsed());
        assert_eq!(triangles(&optimized), triangles(&mesh));
        // Many fans of medium size in one mesh, as caps of pipes are, and in meshes of their own.
        let mut caps = SourceMesh::default();
        let cap = fan(2000);
        for first in (0..400).map(|i| i * cap.positions.len() as u32) {
            caps.positions.extend(&cap.positions);
            caps.indices
                .extend(cap.indices.iter().map(|index| first + index));
        }
        for (i, position) in caps.positions.iter_mut().enumerate() {
            position[0] += (i / cap.positions.len()) as f32;
        }
        let start = std::time::Instant::now();
        assert_eq!(optimize(&caps).unwrap().indices.len(), caps.indices.len());
        (0..400).for_each(|_| drop(optimize(&cap).unwrap()));
        assert!(start.elapsed().as_secs_f64() < 8.0, "{:?}", start.elapsed());
    }

    #[test]
    fn vertices_with_different_attributes_stay_apart() {
        let mut mesh = soup(1);
        mesh.positions.extend(mesh.positions.clone());
        mesh.indices = vec![0, 1, 2, 4, 5, 6];
        mesh.uvs = (0..8).map(|vertex| [vertex as f32 / 4.0, 0.0]).collect();
        let optimized = optimize(&mesh).unwrap();
        assert_eq!((optimized.positions.len(), optimized.uvs.len()), (6, 6));
    }

    #[test]
    fn broken_meshes_are_refused() {
        let mesh = soup(1);
        let broken = |edit: fn(&mut SourceMesh)| {
            let mut mesh = mesh.clone();
            edit(&mut mesh);
            optimize(&mesh).unwrap_err()
        };
        assert_eq!(
            broken(|mesh| mesh.indices.clear()),
            MeshError::IndexCount(0)
        );
        assert_eq!(
            broken(|mesh| mesh.indices.push(0)),
            MeshError::IndexCount(10)
        );
        let out_of_range = MeshError::IndexOutOfRange {
            index: 4,
            vertices: 4,
        };
        assert_eq!(broken(|mesh| mesh.indices[7] = 4), out_of_range);
        assert_eq!(
            broken(|mesh| mesh.positions[2][1] = f32::NAN),
            MeshError::NotFinite(2)
        );
        assert_eq!(
            broken(|mesh| mesh.normals.push([0.0; 3])),
            MeshError::AttributeCount(1, 4)
        );
    }
}
