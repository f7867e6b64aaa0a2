//! Triangles that cover nothing: those the bake leaves out, and those it counts.

use crate::scene::SourceMesh;
use glam::DVec3;

/// What a mesh has of degenerate triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Degenerate {
    /// Triangles left out: two of their corners coincide.
    pub coincident: u64,
    /// Triangles kept that f32 cannot tell from a line.
    pub slivers: u64,
}

/// Leaves out the triangles two of whose corners have the same index or the same position, and then the
/// vertices that no triangle uses. The others keep their order. Returns how many triangles went.
///
/// Such a triangle covers no pixel, but a rasterizer may divide by its area and give fragments that are not
/// finite. Positions are compared as numbers, so that 0 and -0 are the same.
pub fn remove_coincident(mesh: &mut SourceMesh) -> u64 {
    let before = mesh.indices.len();
    let positions = &mesh.positions;
    let same = |a: u32, b: u32| a == b || positions[a as usize] == positions[b as usize];
    let coincides = |&[a, b, c]: &[u32; 3]| same(a, b) || same(b, c) || same(c, a);
    let triangles = mesh.indices.as_chunks::<3>().0;
    if triangles.iter().any(coincides) {
        let kept = triangles.iter().filter(|triangle| !coincides(triangle));
        mesh.indices = kept.flatten().copied().collect();
    }
    remove_unused_vertices(mesh);
    (before - mesh.indices.len()) as u64 / 3
}

/// A vertex that no triangle uses would still count in the bounds of the mesh.
fn remove_unused_vertices(mesh: &mut SourceMesh) {
    let mut renumbered = vec![u32::MAX; mesh.positions.len()];
    for &index in &mesh.indices {
        renumbered[index as usize] = 0;
    }
    if renumbered.iter().all(|&used| used == 0) {
        return;
    }
    let used = (0_u32..).zip(&renumbered).filter(|(_, used)| **used == 0);
    let used: Vec<u32> = used.map(|(vertex, _)| vertex).collect();
    for (new, &vertex) in (0..).zip(&used) {
        renumbered[vertex as usize] = new;
    }
    mesh.positions = gather(&mesh.positions, &used);
    mesh.normals = gather(&mesh.normals, &used);
    mesh.uvs = gather(&mesh.uvs, &used);
    for index in &mut mesh.indices {
        *index = renumbered[*index as usize];
    }
}

/// The attributes of some vertices; none of a mesh without the attribute.
pub(crate) fn gather<T: Copy>(attributes: &[T], vertices: &[u32]) -> Vec<T> {
    if attributes.is_empty() {
        return Vec::new();
    }
    let attribute = |&vertex: &u32| attributes[vertex as usize];
    vertices.iter().map(attribute).collect()
}

/// Number of triangles whose area f32 cannot tell from zero.
///
/// Twice the area is the length of the cross product of two edges. A component of it is the difference of
/// two products of edge coordinates. In f32, each edge coordinate has a relative error of at most
/// u = 2^-24, each product one of about 3u, and the difference adds another u. The sum of the two products'
/// sizes is at most the product of the edges' lengths (Cauchy-Schwarz), which is at most L^2 for the longest
/// edge L. So a component is wrong by up to 4u L^2 = 2^-22 L^2, and where twice the area is no more than
/// that, neither the sign nor the direction of the computed normal means anything.
pub fn count_slivers(mesh: &SourceMesh) -> u64 {
    const SHARE: f64 = 1.0 / (1 << 22) as f64;
    let corner = |index: u32| DVec3::from(mesh.positions[index as usize].map(f64::from));
    let is_sliver = |triangle: &&[u32; 3]| {
        let [a, b, c] = triangle.map(corner);
        let edges = [b - a, c - b, a - c];
        let longest = edges
            .map(DVec3::length_squared)
            .into_iter()
            .fold(0.0, f64::max);
        edges[0].cross(edges[1]).length_squared() <= (SHARE * longest).powi(2)
    };
    let triangles = mesh.indices.as_chunks::<3>().0;
    triangles.iter().filter(is_sliver).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_indices_and_equal_positions_go_with_their_vertices() {
        let mut mesh = SourceMesh {
            positions: vec![
                [9.0; 3],
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [-0.0; 3],
                [7.0; 3],
            ],
            uvs: (0..6).map(|vertex| [vertex as f32; 2]).collect(),
            indices: vec![1, 2, 3, 1, 1, 2, 1, 4, 2, 2, 1, 4, 0, 5, 0, 3, 2, 4],
            ..Default::default()
        };
        assert_eq!(remove_coincident(&mut mesh), 4);
        assert_eq!(mesh.indices, [0, 1, 2, 2, 1, 3]);
        let uvs: Vec<f32> = mesh.uvs.iter().map(|uv| uv[0]).collect();
        assert_eq!(uvs, [1.0, 2.0, 3.0, 4.0]);
        let whole = mesh.clone();
        assert_eq!(remove_coincident(&mut mesh), 0);
        assert_eq!(
            (whole.indices, whole.positions),
            (mesh.indices, mesh.positions)
        );
        let mut empty = SourceMesh {
            positions: vec![[0.0; 3]; 3],
            indices: vec![0, 1, 2],
            ..Default::default()
        };
        assert_eq!(remove_coincident(&mut empty), 1);
        assert!(empty.indices.is_empty() && empty.positions.is_empty());
    }

    #[test]
    fn slivers_are_triangles_that_f32_cannot_tell_from_a_line() {
        let count = |height: f32, length: f32| {
            count_slivers(&SourceMesh {
                positions: vec![[0.0; 3], [length, 0.0, 0.0], [length / 2.0, height, 0.0]],
                indices: vec![0, 1, 2],
                ..Default::default()
            })
        };
        assert_eq!(
            [count(0.0, 1.0), count(1e-8, 1.0), count(2e-7, 1.0)],
            [1, 1, 1]
        );
        assert_eq!([count(3e-7, 1.0), count(1.0, 1e6)], [0, 0]);
        // The share counts, not the size.
        assert_eq!([count(3e-27, 1e-20), count(2e-27, 1e-20)], [0, 1]);
        assert_eq!([count(3e13, 1e20), count(2e13, 1e20)], [0, 1]);
    }
}
