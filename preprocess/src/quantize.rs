//! Positions as 16-bit numbers: a third less memory for them, at an error of less than a 65534th of the longest
//! edge of what shares a grid.
//!
//! The parts of a mesh share a grid: the meshes that `--split-objects` makes of one, the primitives of a glTF mesh
//! and the materials of an OBJ object. A vertex on the border of two parts is then stored as the same numbers in
//! both, and they stay watertight. The step of a grid is a power of two and its corner a multiple of the step:
//! vertices that lay on such a grid stay exactly where they were, so that walls which met still meet. The step is
//! the same on all axes, so that normals keep their direction.

use crate::scene::{SourceMesh, SourceObject};
use glam::{DAffine3, DMat3, DVec3};
use hroc_format::dequantize;
use std::collections::HashMap;

/// Where the 16-bit numbers lie in object space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    step: f64,
    corner: DVec3,
}

/// The least and the largest coordinates.
type Box = (DVec3, DVec3);

impl Grid {
    /// The grid of each mesh: the meshes that are drawn under one node of a file share one.
    pub fn of_meshes(meshes: &[SourceMesh], objects: &[SourceObject]) -> Vec<Self> {
        // A forest over the meshes; each points to one that shares its grid, a root to itself.
        let mut parents: Vec<usize> = (0..meshes.len()).collect();
        let mut mesh_of_node = HashMap::new();
        for object in objects {
            let other = *mesh_of_node
                .entry((object.file, object.node))
                .or_insert(object.mesh);
            let [a, b] = [object.mesh, other].map(|mesh| root(&mut parents, mesh));
            parents[a.max(b)] = a.min(b);
        }
        let mut boxes: Vec<Box> = meshes.iter().map(bounds).collect();
        for mesh in 0..meshes.len() {
            let root = root(&mut parents, mesh);
            boxes[root] = union(boxes[root], boxes[mesh]);
        }
        let grid = |mesh| Self::around(boxes[root(&mut parents, mesh)]);
        (0..meshes.len()).map(grid).collect()
    }

    fn around((min, max): Box) -> Self {
        let longest = (max - min).max_element();
        if longest > 0.0 {
            // One less than the largest number: the corner may lie up to a step below the smallest position.
            let step = (longest / f64::from(u16::MAX - 1)).log2().ceil().exp2();
            let corner = (min / step).floor() * step;
            Self { step, corner }
        } else {
            let corner = min;
            Self { step: 1.0, corner }
        }
    }

    /// Moves a mesh's positions to the grid and into the unit cube, as [`dequantize`] decodes them. Positions are
    /// finite and in the box that the grid was made for.
    pub fn quantize(&self, mesh: &mut SourceMesh) {
        for position in &mut mesh.positions {
            let place = (wide(position) - self.corner) / self.step;
            let [x, y, z] = place.to_array().map(|lane| lane.round() as u16);
            *position = dequantize([x, y, z, 0]);
        }
    }

    /// Takes the unit cube to object space.
    pub fn object_from_cube(&self) -> DAffine3 {
        DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::splat(self.step * f64::from(u16::MAX))),
            translation: self.corner,
        }
    }
}

/// The root of a mesh's tree. Halves the path to it, so that long paths are walked once.
fn root(parents: &mut [usize], mut mesh: usize) -> usize {
    while parents[mesh] != mesh {
        parents[mesh] = parents[parents[mesh]];
        mesh = parents[mesh];
    }
    mesh
}

fn wide(position: &[f32; 3]) -> DVec3 {
    DVec3::from(position.map(f64::from))
}

fn bounds(mesh: &SourceMesh) -> Box {
    let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let positions = mesh.positions.iter().map(wide);
    positions.fold(nothing, |all, position| union(all, (position, position)))
}

fn union(a: Box, b: Box) -> Box {
    (a.0.min(b.0), a.1.max(b.1))
}

/// The stored form of a position in the unit cube that [`quantize`] made.
pub fn encode(position: [f32; 3]) -> [u16; 4] {
    let [x, y, z] = position.map(|lane| (lane * f32::from(u16::MAX)).round() as u16);
    [x, y, z, 0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn quantized(positions: &[[f32; 3]]) -> (Vec<[f32; 3]>, Vec<DVec3>) {
        let mut mesh = SourceMesh {
            positions: positions.to_vec(),
            ..Default::default()
        };
        let grid = Grid::around(bounds(&mesh));
        grid.quantize(&mut mesh);
        let object_from_cube = grid.object_from_cube();
        let back = |p: &[f32; 3]| object_from_cube.transform_point3(DVec3::from(p.map(f64::from)));
        let back = mesh.positions.iter().map(back).collect();
        (mesh.positions, back)
    }

    #[test]
    fn what_lies_on_the_grid_stays() {
        let positions = [[0.25, -3.0, 1e6], [100.75, 0.5, 1e6 + 8.0], [7.0, 7.0, 1e6]];
        for (back, position) in quantized(&positions).1.iter().zip(positions) {
            assert!(
                back.abs_diff_eq(DVec3::from(position.map(f64::from)), 1e-6),
                "{back}"
            );
        }
        let (cube, back) = quantized(&[[3.3, -1e30, 0.0]; 4]);
        assert_eq!(cube, [[0.0; 3]; 4]);
        assert_eq!(
            back[0],
            DVec3::new(f64::from(3.3_f32), f64::from(-1e30_f32), 0.0)
        );
    }

    #[test]
    fn meshes_under_one_node_share_a_grid() {
        let mesh = |x: f32| SourceMesh {
            positions: vec![[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0]],
            ..Default::default()
        };
        let object = |(mesh, file, node)| SourceObject {
            mesh,
            world_from_object: DAffine3::IDENTITY,
            base_color: [1.0; 4],
            alpha: Default::default(),
            double_sided: false,
            name: String::new(),
            file,
            node,
            primitive: 0,
        };
        // Meshes 0 and 1 share node 0, and 1 and 2 node 5. Node 0 of another file is another node.
        let objects = [(2, 0, 5), (0, 0, 0), (1, 0, 0), (1, 0, 5), (3, 1, 0)].map(object);
        let meshes = [0.0, 10.0, 100.0, 0.0].map(mesh);
        let grids = Grid::of_meshes(&meshes, &objects);
        assert_eq!(
            grids[0],
            Grid::around((DVec3::ZERO, DVec3::new(101.0, 0.0, 0.0)))
        );
        assert!(grids[0] == grids[1] && grids[0] == grids[2]);
        assert_eq!(grids[3], Grid::around((DVec3::ZERO, DVec3::X)));
    }

    #[test]
    fn every_number_comes_back() {
        for number in 0..=u16::MAX {
            let stored = [number, u16::MAX - number, number / 2, 0];
            assert_eq!(encode(dequantize(stored)), stored);
        }
    }

    proptest! {
        #[test]
        fn the_error_is_below_a_65534th_of_the_longest_edge(
            positions in prop::collection::vec(prop::array::uniform3(-1e3_f32..1e3), 1..50),
            scale in -30..30_i32,
        ) {
            let positions: Vec<_> =
                positions.iter().map(|p| p.map(|lane| lane * 2_f32.powi(scale))).collect();
            let (cube, back) = quantized(&positions);
            let longest = (0..3).map(|axis| {
                let lanes = || positions.iter().map(|p| f64::from(p[axis]));
                lanes().fold(f64::MIN, f64::max) - lanes().fold(f64::MAX, f64::min)
            }).fold(0.0, f64::max);
            for (i, position) in positions.iter().enumerate() {
                prop_assert!(cube[i].iter().all(|lane| (0.0..=1.0).contains(lane)));
                let error = (back[i] - DVec3::from(position.map(f64::from))).abs().max_element();
                // The decoded f32 adds half a unit in the last place of the cube.
                prop_assert!(error <= longest / 65534.0 + longest * 3e-7, "{error} of {longest}");
            }
        }
    }
}
