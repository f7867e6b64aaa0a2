//! From opened accessors to a mesh: a triangle list over the vertices it uses. Needs nothing of the file but its
//! bytes, so that primitives are decoded side by side.

use super::accessor::Elements;
use super::skin::{Joints, Weights};
use super::{ImportError, Result};
use crate::scene::SourceMesh;
use glam::Vec3;
use gltf::json::{Accessor, Index};
use std::sync::Arc;

/// A primitive whose accessors are opened: their sizes are known to fit, their contents are not.
pub(super) struct Opened<'a> {
    /// POSITION's accessor, for errors.
    pub(super) position: Index<Accessor>,
    pub(super) positions: Elements<'a>,
    pub(super) indices: Option<(Index<Accessor>, Elements<'a>)>,
    /// Primitive mode: 4, 5 or 6.
    pub(super) mode: u32,
    pub(super) normals: Option<Elements<'a>>,
    pub(super) uvs: Option<Elements<'a>>,
    /// Weight, displacements of positions and of normals.
    pub(super) targets: Vec<(f32, Option<Elements<'a>>, Option<Elements<'a>>)>,
    pub(super) skin: Option<(Arc<Joints>, Vec<Weights<'a>>)>,
}

impl Opened<'_> {
    /// How many elements make triangles.
    pub(super) fn element_count(&self) -> usize {
        let indices = self.indices.as_ref();
        indices.map_or(self.positions.count(), |(_, indices)| indices.count())
    }

    /// Bytes that it takes itself, beside those of the file.
    pub(super) fn owned_bytes(&self) -> u64 {
        let targets = self.targets.iter();
        let targets = targets.flat_map(|(_, positions, normals)| [positions, normals]);
        let indices = self.indices.as_ref().map(|(_, indices)| indices);
        let skin = self.skin.iter().flat_map(|(_, sets)| sets);
        [
            Some(&self.positions),
            indices,
            self.normals.as_ref(),
            self.uvs.as_ref(),
        ]
        .into_iter()
        .chain(targets.map(Option::as_ref))
        .flatten()
        .chain(skin.flat_map(|set| [&set.joints, &set.weights]))
        .map(Elements::owned_bytes)
        .sum()
    }

    pub(super) fn decode(&self) -> Result<SourceMesh> {
        let vertex_count = self.positions.count();
        let elements = match &self.indices {
            Some((accessor, indices)) => indices
                .indices()
                .map_err(|error| error.within(format_args!("accessor {accessor}")))?,
            None => (0..u32::try_from(vertex_count).unwrap_or(u32::MAX)).collect(),
        };
        if let Some(index) = elements
            .iter()
            .find(|&&index| index as usize >= vertex_count)
        {
            let accessor = self
                .indices
                .as_ref()
                .map_or(self.position, |(accessor, _)| *accessor);
            let what = format!("index {index} is not below the {vertex_count} vertices");
            return Err(ImportError::malformed(what).within(format_args!("accessor {accessor}")));
        }
        let mut indices = triangle_list(self.mode, elements);
        let used = compact(&mut indices, vertex_count);

        let mut mesh = SourceMesh {
            positions: gather(&self.positions, &used),
            indices,
            ..Default::default()
        };
        if let Some(normals) = &self.normals {
            mesh.normals = gather(normals, &used);
        }
        if let Some(uvs) = &self.uvs {
            mesh.uvs = gather(uvs, &used);
        }
        for (weight, positions, normals) in &self.targets {
            if let Some(by) = positions {
                displace(&mut mesh.positions, by, &used, *weight);
            }
            if let Some(by) = normals {
                displace(&mut mesh.normals, by, &used, *weight);
            }
        }
        if let Some((joints, weights)) = &self.skin {
            joints.apply(&mut mesh, weights, &used)?;
        }
        finish(mesh, self.position)
    }
}

/// Checks positions and makes normals unit vectors.
fn finish(mut mesh: SourceMesh, position: Index<Accessor>) -> Result<SourceMesh> {
    if let Some(vertex) = mesh
        .positions
        .iter()
        .position(|point| !Vec3::from(*point).is_finite())
    {
        let what = format!("the position {:?} is not finite", mesh.positions[vertex]);
        return Err(ImportError::malformed(what).within(format_args!("accessor {position}")));
    }
    for normal in &mut mesh.normals {
        *normal = Vec3::from(*normal)
            .try_normalize()
            .unwrap_or(Vec3::Z)
            .into();
    }
    for uv in &mut mesh.uvs {
        *uv = uv.map(|lane| if lane.is_finite() { lane } else { 0.0 });
    }
    Ok(mesh)
}

fn displace(vectors: &mut [[f32; 3]], by: &Elements<'_>, used: &[u32], weight: f32) {
    for (vector, &vertex) in vectors.iter_mut().zip(used) {
        let by: [f32; 3] = by.floats(vertex as usize);
        *vector = std::array::from_fn(|axis| {
            (f64::from(vector[axis]) + f64::from(weight) * f64::from(by[axis])) as f32
        });
    }
}

fn gather<const N: usize>(elements: &Elements<'_>, used: &[u32]) -> Vec<[f32; N]> {
    used.iter()
        .map(|&vertex| elements.floats(vertex as usize))
        .collect()
}

/// Unrolls strips and fans (section 3.7.2.1); a trailing incomplete triangle is left out.
fn triangle_list(mode: u32, mut elements: Vec<u32>) -> Vec<u32> {
    let corners = |w: &[u32]| [w[0], w[1], w[2]];
    let windows = elements.windows(3).map(corners);
    match mode {
        // Every other triangle of a strip is turned round, which swaps its last two corners.
        5 => {
            let turn =
                |(i, [a, b, c]): (usize, [u32; 3])| if i % 2 == 0 { [a, b, c] } else { [a, c, b] };
            windows.enumerate().flat_map(turn).collect()
        }
        6 => windows.flat_map(|[_, b, c]| [b, c, elements[0]]).collect(),
        _ => {
            elements.truncate(elements.len() / 3 * 3);
            elements
        }
    }
}

/// Renumbers the vertices that `indices` use from 0, in ascending order, and returns their old
/// numbers. Many primitives may share one large vertex buffer; none keeps a copy of all of it.
fn compact(indices: &mut [u32], vertex_count: usize) -> Vec<u32> {
    let used: Vec<u32> = if vertex_count / 8 > indices.len() {
        let mut used = indices.to_vec();
        used.sort_unstable();
        used.dedup();
        used
    } else {
        let mut is_used = vec![false; vertex_count];
        indices
            .iter()
            .for_each(|&index| is_used[index as usize] = true);
        (0..)
            .zip(is_used)
            .filter(|(_, is_used)| *is_used)
            .map(|(vertex, _)| vertex)
            .collect()
    };
    if used.len() < vertex_count {
        for index in indices {
            // Every index is in the list made of them.
            *index = used.partition_point(|vertex| vertex < index) as u32;
        }
    }
    used
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_become_lists() {
        assert_eq!(triangle_list(4, vec![0, 1, 2, 3]), [0, 1, 2]);
        assert_eq!(
            triangle_list(5, vec![0, 1, 2, 3, 4]),
            [0, 1, 2, 1, 3, 2, 2, 3, 4]
        );
        assert_eq!(triangle_list(6, vec![0, 1, 2, 3]), [1, 2, 0, 2, 3, 0]);
        for mode in 4..=6 {
            assert!(triangle_list(mode, vec![0, 1]).is_empty());
        }
    }

    #[test]
    fn compacting_keeps_order_and_drops_the_unused() {
        for vertex_count in [10, 1000] {
            let mut indices = [7, 2, 7, 9, 2, 7];
            assert_eq!(compact(&mut indices, vertex_count), [2, 7, 9]);
            assert_eq!(indices, [1, 0, 1, 2, 0, 1]);
        }
    }
}
