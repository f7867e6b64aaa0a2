//! Cuts large meshes into spatially compact ones, so that occlusion is decided for parts of them. An object
//! that spans half of the scene is visible as a whole if any of it is (Guthe, Balazs, Klein 2006, subdivide for
//! that reason).

use crate::degenerate::gather;
use crate::optimize::{self, MeshError};
use crate::scene::{SourceMesh, SourceScene};
use glam::Vec3;
use rayon::prelude::*;

/// Replaces each mesh of more than `max_triangles` by parts of at most so many, and each object that draws it by
/// one object per part, one after the other: they share its source and name. Triangles keep their order within a
/// part; none is cut. The result depends on the scene alone.
///
/// # Errors
/// The first mesh that breaks the promises of [`SourceMesh`].
pub fn subdivide(scene: &mut SourceScene, max_triangles: usize) -> Result<(), (usize, MeshError)> {
    let cut = |(index, mesh): (usize, SourceMesh)| {
        if mesh.indices.len() / 3 <= max_triangles {
            return Ok(vec![mesh]);
        }
        optimize::check(&mesh).map_err(|error| (index, error))?;
        Ok(parts(&mesh, max_triangles))
    };
    let cut: Vec<Vec<SourceMesh>> = std::mem::take(&mut scene.meshes)
        .into_par_iter()
        .enumerate()
        .map(cut)
        .collect::<Result<_, _>>()?;
    let mut first = Vec::with_capacity(cut.len() + 1);
    first.push(0);
    first.extend(cut.iter().scan(0, |end, parts| {
        *end += parts.len();
        Some(*end)
    }));
    let errors = std::mem::take(&mut scene.position_errors);
    let of_parts = errors.iter().zip(&cut);
    scene.position_errors = of_parts
        .flat_map(|(&error, parts)| parts.iter().map(move |_| error))
        .collect();
    scene.meshes = cut.into_iter().flatten().collect();
    let materials = std::mem::take(&mut scene.materials.of_object);
    let of_parts = materials.iter().zip(&scene.objects);
    scene.materials.of_object = of_parts
        .flat_map(|(&material, object)| {
            let parts = first[object.mesh]..first[object.mesh + 1];
            parts.map(move |_| material)
        })
        .collect();
    let objects = std::mem::take(&mut scene.objects);
    scene.objects = objects
        .into_iter()
        .flat_map(|object| {
            let parts = first[object.mesh]..first[object.mesh + 1];
            parts.map(move |mesh| {
                let mut part = object.clone();
                part.mesh = mesh;
                part
            })
        })
        .collect();
    Ok(())
}

/// How many objects [`subdivide`] makes of the scene.
pub fn object_count(scene: &SourceScene, max_triangles: usize) -> u64 {
    let parts = |mesh: usize| scene.meshes[mesh].indices.len() / 3;
    let count = |mesh: usize| parts(mesh).div_ceil(max_triangles).max(1) as u64;
    scene.objects.iter().map(|object| count(object.mesh)).sum()
}

/// A triangle on its way into a part.
#[derive(Clone, Copy)]
struct Triangle {
    centroid: Vec3,
    number: u32,
}

fn parts(mesh: &SourceMesh, max_triangles: usize) -> Vec<SourceMesh> {
    let corner = |index: u32| Vec3::from(mesh.positions[index as usize]);
    // A third before the sum: it could overflow.
    let centroid = |t: &[u32]| (corner(t[0]) / 3.0) + (corner(t[1]) / 3.0) + (corner(t[2]) / 3.0);
    let mut triangles: Vec<Triangle> = (0..)
        .zip(mesh.indices.chunks_exact(3))
        .map(|(number, corners)| Triangle {
            centroid: centroid(corners),
            number,
        })
        .collect();
    let mut parts = Vec::new();
    let mut waiting = vec![triangles.as_mut_slice()];
    // Vertex of the part for a vertex of the mesh; all unset again after each part.
    let mut renumbered = vec![u32::MAX; mesh.positions.len()];
    while let Some(triangles) = waiting.pop() {
        let part_count = triangles.len().div_ceil(max_triangles);
        if part_count == 1 {
            triangles.sort_unstable_by_key(|triangle| triangle.number);
            parts.push(part(mesh, triangles, &mut renumbered));
            continue;
        }
        // As many parts on either side, all of the same size: `left / left_parts` rounds down, and the rest is
        // at most `max_triangles` for each part on the right.
        let left_parts = part_count / 2;
        let left = (triangles.len() as u64 * left_parts as u64 / part_count as u64) as usize;
        let axis = longest_axis(triangles);
        triangles.select_nth_unstable_by(left, |a, b| {
            let by_centroid = a.centroid[axis].total_cmp(&b.centroid[axis]);
            by_centroid.then(a.number.cmp(&b.number))
        });
        let (left, right) = triangles.split_at_mut(left);
        waiting.extend([right, left]);
    }
    parts
}

/// The axis on which the centroids spread most.
fn longest_axis(triangles: &[Triangle]) -> usize {
    let (min, max) = triangles.iter().fold(
        (Vec3::INFINITY, Vec3::NEG_INFINITY),
        |(min, max), triangle| (min.min(triangle.centroid), max.max(triangle.centroid)),
    );
    (max * 0.5 - min * 0.5).max_position()
}

/// A mesh of some of a mesh's triangles, with the vertices they use in the order of their first use.
fn part(mesh: &SourceMesh, triangles: &[Triangle], renumbered: &mut [u32]) -> SourceMesh {
    let mut used = Vec::new();
    let mut indices = Vec::with_capacity(3 * triangles.len());
    for triangle in triangles {
        let first = 3 * triangle.number as usize;
        for &vertex in &mesh.indices[first..first + 3] {
            let place = &mut renumbered[vertex as usize];
            if *place == u32::MAX {
                *place = used.len() as u32;
                used.push(vertex);
            }
            indices.push(*place);
        }
    }
    for &vertex in &used {
        renumbered[vertex as usize] = u32::MAX;
    }
    SourceMesh {
        positions: gather(&mesh.positions, &used),
        normals: gather(&mesh.normals, &used),
        uvs: gather(&mesh.uvs, &used),
        indices,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SourceObject;

    /// A strip of `count` quads along x.
    fn strip(count: u32) -> SourceMesh {
        SourceMesh {
            positions: (0..=count)
                .flat_map(|x| [[x as f32, 0.0, 0.0], [x as f32, 1.0, 0.0]])
                .collect(),
            uvs: (0..=count).flat_map(|x| [[x as f32, 0.0]; 2]).collect(),
            // The quads in a scattered order.
            indices: (0..count)
                .map(|quad| 2 * (quad * 7 % count))
                .flat_map(|v| [v, v + 1, v + 2, v + 2, v + 1, v + 3])
                .collect(),
            ..Default::default()
        }
    }

    fn corners(mesh: &SourceMesh) -> Vec<[[u32; 3]; 3]> {
        let corner = |index: u32| mesh.positions[index as usize].map(f32::to_bits);
        mesh.indices
            .as_chunks::<3>()
            .0
            .iter()
            .map(|triangle| triangle.map(corner))
            .collect()
    }

    #[test]
    fn parts_are_compact_full_and_complete() {
        let mesh = strip(500);
        for max in [1, 7, 64, 999] {
            let parts = parts(&mesh, max);
            assert_eq!(parts.len(), 1000_usize.div_ceil(max));
            let mut all: Vec<_> = parts.iter().flat_map(corners).collect();
            let mut expected = corners(&mesh);
            all.sort_unstable();
            expected.sort_unstable();
            assert!(all == expected);
            for part in &parts {
                assert!(part.indices.len() / 3 <= max);
                assert_eq!(optimize::check(part), Ok(()));
                let xs = || part.positions.iter().map(|position| position[0]);
                let width = xs().fold(0.0, f32::max) - xs().fold(f32::MAX, f32::min);
                assert!(width <= max as f32 / 2.0 + 2.0, "{width} of {max}");
                assert!(xs().eq(part.uvs.iter().map(|uv| uv[0])));
            }
        }
    }

    #[test]
    fn objects_are_replaced_by_their_parts_in_order() {
        let object = |mesh: usize, name: &str| SourceObject {
            mesh,
            world_from_object: glam::DAffine3::IDENTITY,
            base_color: [1.0; 4],
            alpha: Default::default(),
            double_sided: false,
            name: name.to_owned(),
            file: 0,
            node: 0,
            primitive: 0,
        };
        let mut scene = SourceScene {
            meshes: vec![strip(1), strip(10), strip(2)],
            objects: vec![
                object(1, "a"),
                object(0, "b"),
                object(1, "c"),
                object(2, "d"),
            ],
            ..Default::default()
        };
        assert_eq!(object_count(&scene, 10), 6);
        subdivide(&mut scene, 10).unwrap();
        let objects = scene.objects.iter();
        let found: Vec<_> = objects
            .map(|object| (object.name.as_str(), object.mesh))
            .collect();
        assert_eq!(
            found,
            [("a", 1), ("a", 2), ("b", 0), ("c", 1), ("c", 2), ("d", 3)]
        );
        assert_eq!(scene.meshes.len(), 4);
    }
}
