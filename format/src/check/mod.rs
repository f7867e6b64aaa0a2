//! The consistency of an archive that is structurally valid. rkyv's validation knows pointers, lengths
//! and strings; that an index is below a count, that a tree is one, is checked here. All of it in
//! linear time, without recursion, and without memory beyond two numbers per node.

mod objects;
mod tree;
mod vertices;

use crate::error::CheckError;
use crate::open::Check;
use crate::types::{ArchivedMesh, ArchivedScene};

type Result<T = ()> = std::result::Result<T, CheckError>;

/// Checks `scene` to `depth`; the error is the first broken rule.
pub(crate) fn check(scene: &ArchivedScene, depth: Check) -> Result {
    mesh_ranges(scene)?;
    if depth >= Check::Objects {
        objects::check(scene)?;
        vertices::indices(scene)?;
        let origins = scene.cell_origins();
        for (i, bvh) in scene.bvhs.iter().enumerate() {
            let split = bvh.split.as_str();
            ensure(
                !split.is_empty(),
                || format!("tree {i}"),
                || "has no name".into(),
            )?;
            let first = scene
                .bvhs
                .iter()
                .take(i)
                .all(|other| other.split != bvh.split);
            ensure(
                first,
                || format!("tree {split}"),
                || "its name is used twice".into(),
            )?;
            tree::check(bvh, scene.object_bounds.as_slice(), &origins)?;
        }
    }
    if depth >= Check::Everything {
        vertices::check(scene)?;
    }
    Ok(())
}

/// The meshes lie in the arrays in order, without gaps and without overlap. (Overlapping ranges would
/// let a small file ask for endless work.)
fn mesh_ranges(scene: &ArchivedScene) -> Result {
    let (mut index, mut vertex) = (0_u64, 0_u64);
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let at = || format!("mesh {i}");
        let [first_index, index_count, first_vertex, vertex_count] = [
            mesh.first_index,
            mesh.index_count,
            mesh.first_vertex,
            mesh.vertex_count,
        ]
        .map(|number| u64::from(number.to_native()));
        ensure(first_index == index, at, || {
            format!("first index {first_index}, should be {index}")
        })?;
        ensure(first_vertex == vertex, at, || {
            format!("first vertex {first_vertex}, should be {vertex}")
        })?;
        ensure(index_count > 0 && index_count % 3 == 0, at, || {
            format!("{index_count} indices, no multiple of three")
        })?;
        ensure(vertex_count > 0, at, || "no vertices".into())?;
        ensure(mesh.reserved == [0, 0], at, || {
            "reserved bytes in use".into()
        })?;
        index += index_count;
        vertex += vertex_count;
        let (indices, vertices) = (scene.indices.len(), scene.vertex_count());
        ensure(index <= indices as u64, at, || {
            format!("indices up to {index} of {indices}")
        })?;
        ensure(vertex <= vertices as u64, at, || {
            format!("vertices up to {vertex} of {vertices}")
        })?;
    }
    same_count("indices", scene.indices.len(), index as usize)?;
    let vertex = vertex as usize;
    same_count("positions", scene.vertex_count(), vertex)?;
    ensure(
        scene.positions.is_empty() || scene.quantized_positions.is_empty(),
        || "positions".into(),
        || "both plain and quantized".into(),
    )?;
    for (name, len) in [("normals", scene.normals.len()), ("uvs", scene.uvs.len())] {
        if len != 0 {
            same_count(name, len, vertex)?;
        }
    }
    Ok(())
}

/// `Ok` where `rule` holds.
#[inline(always)]
fn ensure(rule: bool, place: impl FnOnce() -> String, problem: impl FnOnce() -> String) -> Result {
    if rule {
        Ok(())
    } else {
        Err(failure(place, problem))
    }
}

#[cold]
fn failure(place: impl FnOnce() -> String, problem: impl FnOnce() -> String) -> CheckError {
    CheckError {
        place: place(),
        problem: problem(),
    }
}

fn same_count(array: &str, found: usize, expected: usize) -> Result {
    ensure(
        found == expected,
        || array.into(),
        || format!("{found} entries, should be {expected}"),
    )
}

/// Both corners finite, `min <= max`.
fn is_box(min: [f32; 3], max: [f32; 3]) -> bool {
    (0..3).all(|k| min[k].is_finite() && max[k].is_finite() && min[k] <= max[k])
}

/// A box in the space of a cell.
struct CellBox {
    cell: u32,
    min: [f32; 3],
    max: [f32; 3],
}

impl CellBox {
    /// Whether all of `inner` lies in this box. Between two cells the comparison is made in f64, to 8 units in its
    /// last place of the numbers compared: exact where cells lie on grids, as those of the bake do.
    fn contains(&self, inner: &Self, origins: &[[f64; 3]]) -> bool {
        if self.cell == inner.cell {
            return (0..3).all(|k| self.min[k] <= inner.min[k] && inner.max[k] <= self.max[k]);
        }
        let (own, others) = (origins[self.cell as usize], origins[inner.cell as usize]);
        (0..3).all(|k| {
            let shift = own[k] - others[k];
            let [min, max] = [self.min[k], self.max[k]].map(|x| f64::from(x) + shift);
            let [inner_min, inner_max] = [inner.min[k], inner.max[k]].map(f64::from);
            let slack = 8.0 * f64::EPSILON * (shift.abs() + min.abs().max(max.abs()));
            min <= inner_min + slack && inner_max <= max + slack
        })
    }
}

fn mesh_box(mesh: &ArchivedMesh) -> ([f32; 3], [f32; 3]) {
    (
        mesh.min.map(|v| v.to_native()),
        mesh.max.map(|v| v.to_native()),
    )
}
