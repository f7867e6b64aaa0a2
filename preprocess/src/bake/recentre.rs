//! Vertices stay near the zero of their mesh: an f32 coordinate is off by up to 2^-24 of itself, so a mesh far from
//! its own zero loses what a transform could give.

use crate::scene::SourceMesh;
use glam::DVec3;

/// A mesh is moved on an axis where its middle lies farther from zero than this many times half its largest extent.
const FARTHEST: f64 = 4.0;

/// Moves a mesh that lies far from its zero there, without rounding, and returns where its zero was moved from: what
/// takes the new coordinates back to the old ones is a translation by it. Positions are finite, and there are some.
///
/// No coordinate is rounded: with the half extent `e` and the middle `c` on an axis, `|c| > 4e`, every coordinate is
/// larger than `3e` and a multiple of its unit in the last place; `c` is rounded to a multiple of at most `e/4`; so
/// the difference is a multiple of the smaller of the two and no larger than `1.25e`, which takes 24 bits or fewer.
pub(super) fn recentre(mesh: &mut SourceMesh) -> DVec3 {
    let wide = |position: &[f32; 3]| DVec3::from(position.map(f64::from));
    let (min, max) = mesh.positions.iter().map(wide).fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(min, max), position| (min.min(position), max.max(position)),
    );
    let half = (max - min).max_element() * 0.5;
    let middle = min + (max - min) * 0.5;
    let zero = DVec3::from_array(middle.to_array().map(|middle| {
        if middle.abs() <= FARTHEST * half {
            return 0.0;
        }
        // A single point: any zero will do, and its own coordinate needs no digits.
        if half == 0.0 {
            return middle;
        }
        let step = (half.log2().floor() - 2.0).exp2();
        (middle / step).round() * step
    }));
    if zero != DVec3::ZERO && zero.is_finite() {
        for position in &mut mesh.positions {
            *position = (wide(position) - zero).as_vec3().to_array();
        }
        return zero;
    }
    DVec3::ZERO
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_coordinate_is_rounded(
            positions in prop::collection::vec(prop::array::uniform3(-1.0_f32..1.0), 1..30),
            far in prop::array::uniform3(-1e7_f32..1e7),
            scale in -20..20_i32,
        ) {
            let place = |p: [f32; 3]| std::array::from_fn(|k| p[k] * 2_f32.powi(scale) + far[k]);
            let placed: Vec<[f32; 3]> = positions.into_iter().map(place).collect();
            let mut mesh = SourceMesh { positions: placed.clone(), ..Default::default() };
            let zero = recentre(&mut mesh);
            for (new, old) in mesh.positions.iter().zip(&placed) {
                for k in 0..3 {
                    prop_assert_eq!(f64::from(new[k]) + zero[k], f64::from(old[k]));
                }
            }
            let lanes = |k: usize| placed.iter().map(move |p| f64::from(p[k]));
            let extent = (0..3).map(|k| lanes(k).fold(f64::MIN, f64::max) - lanes(k).fold(f64::MAX, f64::min));
            let extent = extent.fold(0.0, f64::max);
            let reach = mesh.positions.iter().flatten().fold(0.0, |reach, x| f64::max(reach, x.abs().into()));
            prop_assert!(reach <= 2.5 * extent, "{} of {}", reach, extent);
        }
    }

    #[test]
    fn a_mesh_about_its_zero_stays_as_it_is() {
        let positions = vec![[-1.0, 2.0, 0.1], [3.0, -0.25, 0.3]];
        let mut mesh = SourceMesh {
            positions: positions.clone(),
            ..Default::default()
        };
        assert_eq!(recentre(&mut mesh), DVec3::ZERO);
        assert_eq!(mesh.positions, positions);
    }
}
