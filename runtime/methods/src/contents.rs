//! What is drawn below the nodes of a tree.

use hroc_format::{ArchivedMesh, ArchivedScene};

use crate::host_tree::{HostTree, position};

/// Sums over the leaves before each node, and one past the last: below a node is what lies between it and its skip.
#[derive(Debug)]
pub(crate) struct Contents {
    triangles: Vec<f64>,
    /// World units squared.
    surface: Vec<f64>,
}

impl Contents {
    pub fn new(baked: &ArchivedScene, tree: &HostTree) -> Self {
        let meshes = baked.meshes.iter().map(|mesh| surface(baked, mesh));
        let meshes = meshes.collect::<Vec<_>>();
        let mut sums = [0.0; 2];
        let mut contents = Self {
            triangles: vec![0.0],
            surface: vec![0.0],
        };
        for node in &tree.nodes {
            if let Some(object) = node.object {
                let object = &baked.objects[object as usize];
                let mesh = object.mesh.to_native() as usize;
                let row = |i: usize| {
                    let row = object.world_from_object[i].map(|x| x.to_native());
                    let row = glam::Vec3::new(row[0], row[1], row[2]);
                    row.as_dvec3().length_squared()
                };
                sums[0] += f64::from(baked.meshes[mesh].index_count.to_native() / 3);
                // The mean scale squared.
                sums[1] += meshes[mesh] * (row(0) + row(1) + row(2)) / 3.0;
            }
            contents.triangles.push(sums[0]);
            contents.surface.push(sums[1]);
        }
        contents
    }

    pub fn triangles(&self, tree: &HostTree, n: u32) -> f64 {
        below(&self.triangles, tree, n)
    }

    /// Surface of the geometry over that of the bounds, times 3/2: fragments of it per pixel of the box (R_cov of
    /// Guthe, Balázs and Klein 2006, where it is no more than 1).
    pub fn coverage(&self, tree: &HostTree, n: u32) -> f64 {
        let bounds = f64::from(tree.surface(n)).max(f64::MIN_POSITIVE);
        1.5 * below(&self.surface, tree, n) / bounds
    }
}

fn below(sums: &[f64], tree: &HostTree, n: u32) -> f64 {
    sums[tree.nodes[n as usize].skip as usize] - sums[n as usize]
}

/// Surface of a mesh in object space.
fn surface(baked: &ArchivedScene, mesh: &ArchivedMesh) -> f64 {
    let first = mesh.first_index.to_native() as usize;
    let count = mesh.index_count.to_native() as usize;
    let base = mesh.first_vertex.to_native() as usize;
    let corner = |index: &rend::u32_le| {
        let vertex = base + index.to_native() as usize;
        glam::Vec3::from(position(baked, vertex)).as_dvec3()
    };
    let triangles = baked.indices[first..first + count].chunks_exact(3);
    let areas = triangles.map(|corners| {
        let [a, b, c] = [0, 1, 2].map(|i| corner(&corners[i]));
        0.5 * (b - a).cross(c - a).length()
    });
    areas.sum()
}
