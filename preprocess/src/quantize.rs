//! Positions as 16-bit numbers: a third less memory for them, at an error of less than a 65534th of the mesh's
//! longest edge.
//!
//! A mesh gets a grid of its own. Its step is a power of two and its corner a multiple of the step: vertices that
//! lay on such a grid stay exactly where they were, so that walls which met still meet. The step is the same on
//! all axes, so that normals keep their direction.

use crate::scene::SourceMesh;
use glam::{DAffine3, DMat3, DVec3};
use hroc_format::dequantize;

/// Moves a mesh's positions to the grid and into the unit cube, as [`dequantize`] decodes them, and returns what
/// takes the unit cube back to object space. Positions are finite, and there are some.
pub fn quantize(mesh: &mut SourceMesh) -> DAffine3 {
    let wide = |position: &[f32; 3]| DVec3::from(position.map(f64::from));
    let (min, max) = mesh.positions.iter().map(wide).fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(min, max), position| (min.min(position), max.max(position)),
    );
    let longest = (max - min).max_element();
    let (step, corner) = if longest > 0.0 {
        // One less than the largest number: the corner may lie up to a step below the smallest position.
        let step = (longest / f64::from(u16::MAX - 1)).log2().ceil().exp2();
        (step, (min / step).floor() * step)
    } else {
        (1.0, min)
    };
    for position in &mut mesh.positions {
        let place = (wide(position) - corner) / step;
        let [x, y, z] = place.to_array().map(|lane| lane.round() as u16);
        *position = dequantize([x, y, z, 0]);
    }
    DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::splat(step * f64::from(u16::MAX))),
        translation: corner,
    }
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
        let object_from_cube = quantize(&mut mesh);
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
