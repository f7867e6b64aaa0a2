//! Which objects meet the view volume: in f64, never too few.

use glam::{DMat4, DVec3, DVec4};

/// A view volume as six half-spaces, `dot(plane, (p, 1)) >= 0` inside.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    planes: [DVec4; 6],
}

impl Frustum {
    /// The volume that `clip_from_world` maps to -w <= x, y <= w and 0 <= z <= w.
    /// (Gribb and Hartmann, 2001, "Fast Extraction of Viewing Frustum Planes".)
    pub fn new(clip_from_world: &DMat4) -> Self {
        let [x, y, z, w] = std::array::from_fn(|row| clip_from_world.row(row));
        Self {
            planes: [w + x, w - x, w + y, w - y, z, w - z],
        }
    }

    /// No plane has all of the box outside. Also true for some boxes outside near the volume's edges.
    pub fn meets(&self, min: DVec3, max: DVec3) -> bool {
        self.planes.iter().all(|plane| {
            let terms = [0, 1, 2].map(|i| (plane[i] * min[i]).max(plane[i] * max[i]));
            let size = terms.iter().map(|term| term.abs()).sum::<f64>() + plane.w.abs();
            // A few roundings of f64, of which the matrix brings some along.
            terms.iter().sum::<f64>() + plane.w >= -64.0 * f64::EPSILON * size
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hroc_runtime::{Camera, DepthConvention, Projection};

    #[test]
    fn boxes_are_inside_on_the_edge_or_outside() {
        for depth in DepthConvention::ALL {
            for far in [None, Some(100.0)] {
                let camera = Camera {
                    position: DVec3::new(0.0, 0.0, 5.0),
                    orientation: glam::DQuat::IDENTITY,
                    projection: Projection::Perspective {
                        fov_y_rad: std::f64::consts::FRAC_PI_2,
                    },
                    near: 1.0,
                    far,
                    jitter_px: [0.0; 2],
                };
                let clip = camera
                    .clip_from_world(depth, [100, 100], DVec3::ZERO, 10.0)
                    .unwrap();
                let frustum = Frustum::new(&clip);
                let meets = |min: [f64; 3], max: [f64; 3]| frustum.meets(min.into(), max.into());
                assert!(meets([-1.0; 3], [1.0; 3]));
                // Behind the eye; in front of the near plane; touching it.
                assert!(!meets([-1.0, -1.0, 5.5], [1.0, 1.0, 9.0]));
                assert!(!meets([-0.1, -0.1, 4.1], [0.1, 0.1, 4.9]));
                assert!(meets([-0.1, -0.1, 4.0], [0.1, 0.1, 4.9]));
                // Beside it at view depth 5; touching the side.
                assert!(!meets([5.1, 0.0, 0.0], [6.0, 1.0, 0.0]));
                assert!(meets([5.0, 0.0, 0.0], [6.0, 1.0, 0.0]));
                assert_eq!(meets([0.0, 0.0, -200.0], [1.0, 1.0, -190.0]), far.is_none());
            }
        }
    }
}
