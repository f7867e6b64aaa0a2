//! Every index and every vertex. Each inner loop reduces a whole mesh or block to one yes or no, without a
//! branch per element, so that it runs at memory speed; only a failure looks for the culprit.

use super::{Result, ensure, failure, mesh_box};
use crate::read::dequantize;
use crate::types::ArchivedScene;

/// Every index is below its mesh's vertex count: what the GPU follows without asking.
pub(super) fn indices(scene: &ArchivedScene) -> Result {
    let indices = scene.indices();
    for (i, mesh) in scene.meshes.iter().enumerate() {
        // The range lies within the array: `mesh_ranges` was here before.
        let indices = &indices[mesh.index_range()];
        let count = mesh.vertex_count.to_native();
        let largest = indices.iter().fold(0, |largest, &index| largest.max(index));
        ensure(
            largest < count,
            || format!("mesh {i}"),
            || format!("index {largest} of {count} vertices"),
        )?;
    }
    Ok(())
}

/// Every position lies within its mesh's bounds.
pub(super) fn check(scene: &ArchivedScene) -> Result {
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let (min, max) = mesh_box(mesh);
        let vertices = mesh.vertex_range();
        let good = match scene.quantized_positions() {
            [] => all_within(&scene.positions()[vertices.clone()], min, max),
            quantized => quantized[vertices.clone()]
                .iter()
                .fold(true, |all, &stored| {
                    all & (stored[3] == 0) & within(dequantize(stored), min, max)
                }),
        };
        if !good {
            let outside = vertices
                .clone()
                .position(|vertex| !within(scene.position(vertex), min, max));
            // None is outside only where a fourth lane is in use.
            let Some(outside) = outside else {
                return Err(failure(
                    || format!("mesh {i}"),
                    || "reserved bytes in use".into(),
                ));
            };
            let position = scene.position(vertices.start + outside);
            return Err(failure(
                || format!("mesh {i}, vertex {outside}"),
                || format!("position {position:?} outside the bounds {min:?} to {max:?}"),
            ));
        }
    }
    let uvs = scene.uvs();
    let finite = uvs
        .as_flattened()
        .iter()
        .fold(true, |all, v| all & v.is_finite());
    ensure(
        finite,
        || "uvs".into(),
        || "a texture coordinate is not finite".into(),
    )
    // Normals need no check: every pair of 16-bit numbers is a direction.
}

/// False for a NaN too; infinities are outside, as bounds are finite.
fn within(position: [f32; 3], min: [f32; 3], max: [f32; 3]) -> bool {
    (0..3).fold(true, |all, k| {
        all & (min[k] <= position[k]) & (position[k] <= max[k])
    })
}

/// Four positions at a time are twelve numbers: three whole vectors of four.
fn all_within(positions: &[[f32; 3]], min: [f32; 3], max: [f32; 3]) -> bool {
    let (min4, max4): ([f32; 12], [f32; 12]) = (
        std::array::from_fn(|k| min[k % 3]),
        std::array::from_fn(|k| max[k % 3]),
    );
    let (blocks, rest) = positions.as_flattened().as_chunks::<12>();
    let mut all = [true; 12];
    for block in blocks {
        for k in 0..12 {
            all[k] &= (min4[k] <= block[k]) & (block[k] <= max4[k]);
        }
    }
    all == [true; 12]
        && rest
            .as_chunks::<3>()
            .0
            .iter()
            .all(|&position| within(position, min, max))
}
