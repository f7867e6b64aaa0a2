//! Ties and near-ties of depth, and the ways to store it.

use glam::{DQuat, DVec3};
use hroc_runtime::Camera;

use super::builder::{Builder, Rng, looking};
use super::{CaseScene, HardCase};

/// Cubes clear of each other, so that no rounding of depth decides what shows: the same objects in every
/// convention, with and without a far plane.
pub(super) const DEPTH_CONVENTIONS: HardCase = HardCase {
    name: "depth-conventions",
    failure: "comparison, clear value or sign of a bias right for one convention of depth only",
    make: |scale| {
        let mut rng = Rng(501);
        let mut b = Builder::of_boxes();
        let n = scale.pick(4, 12);
        for x in -n..=n {
            for y in -n..=n {
                for z in -n..=n {
                    let cell = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * 2.0;
                    b.placed(
                        0,
                        DVec3::splat(0.45),
                        rng.rotation(),
                        cell + rng.point(0.15),
                    );
                }
            }
        }
        let cameras = (0..scale.pick(6, 12)).flat_map(|i| {
            let angle = 0.5 * f64::from(i);
            let eye = DVec3::new(angle.cos() * 3.0, 1.0, angle.sin() * 3.0) * f64::from(n);
            [None, Some(12.0 * f64::from(n))].map(|far| Camera {
                near: 0.5,
                far,
                ..looking(eye, DVec3::ZERO)
            })
        });
        CaseScene::new(b.build(), cameras)
    },
};

/// Cubes that are their own bounds, in touching stacks.
pub(super) const OWN_BOUNDS: HardCase = HardCase {
    name: "own-bounds",
    failure: "geometry lies on its own bounds: the bounds lost the depth test by an ulp, and the object with it",
    make: |scale| {
        let mut b = Builder::of_boxes();
        let n = scale.pick(3, 8);
        for x in -n..=n {
            for y in -n..=n {
                for z in -n..=n {
                    b.boxed(
                        DVec3::new(f64::from(x), f64::from(y), f64::from(z)),
                        DVec3::splat(0.5),
                    );
                }
            }
        }
        let cameras = (0..10).map(|i| {
            let angle = 0.3 * f64::from(i);
            let eye = DVec3::new(
                9.0 * angle.cos(),
                2.0 - 0.4 * f64::from(i),
                9.0 * angle.sin(),
            );
            looking(eye * f64::from(n) / 3.0, DVec3::ZERO)
        });
        CaseScene::new(b.build(), cameras)
    },
};

/// Floors, decals in the floor's plane, plates, lines and points.
pub(super) const COPLANAR: HardCase = HardCase {
    name: "coplanar",
    failure: "decals in the plane of the floor alternated between frames; bounds without volume were never hit",
    make: |scale| {
        let mut rng = Rng(503);
        let mut b = Builder::of_boxes();
        for y in [0.0, 1.0, 2.0] {
            b.boxed(DVec3::new(0.0, y, 0.0), DVec3::new(5.0, 0.0, 5.0));
            for i in 0..scale.pick(200, 4000) {
                let at = DVec3::new(rng.within(-5.0, 5.0), y, rng.within(-5.0, 5.0));
                let [a, c] = [rng.within(0.05, 0.5), rng.within(0.05, 0.5)];
                // Four decals on one plate, one line, one point.
                let half = match i % 6 {
                    0..4 => DVec3::new(a, 0.0, c),
                    4 => DVec3::new(a, 0.0, 0.0),
                    _ => DVec3::ZERO,
                };
                b.boxed(at, half);
                if i % 8 == 0 {
                    b.boxed(at + DVec3::Y * a, DVec3::new(0.0, a, c));
                }
            }
        }
        let cameras = (0..12).map(|i| {
            let angle = 0.4 * f64::from(i);
            // Also with the eye in the plane of a floor, looking along it.
            let [y, down] = [[2.7, 0.2], [1.0, 0.0], [0.4, 0.1], [1.6, 0.1]][i as usize % 4];
            let eye = DVec3::new(7.0 * angle.cos(), y, 7.0 * angle.sin());
            looking(eye, DVec3::new(0.0, y - down, 0.0))
        });
        CaseScene::new(b.build(), cameras)
    },
};

/// Plates one ulp of their coordinate behind each other, partly covered, turned out of all axes.
pub(super) const ULP_LAYERS: HardCase = HardCase {
    name: "ulp-layers",
    failure: "two pipelines did not compute the same depth bits: hundreds of objects lost against themselves",
    make: |scale| {
        let turned = DQuat::from_euler(glam::EulerRot::YXZ, 0.7, 0.4, 0.2);
        let mut b = Builder::of_boxes();
        let (stacks, layers) = scale.pick((24, 40), (200, 60));
        let mut rng = Rng(504);
        for _ in 0..stacks {
            let corner = DVec3::new(rng.within(-45.0, 40.0), rng.within(-25.0, 20.0), 0.0);
            let mut distance = rng.within(90.0, 110.0) as f32;
            let tilt = DQuat::from_axis_angle(rng.point(1.0).normalize_or(DVec3::X), 0.2);
            for layer in 0..layers {
                distance = distance.next_up();
                let step = DVec3::new(0.31, 0.17, 0.0) * f64::from(layer % 20);
                let at = corner + step - DVec3::Z * f64::from(distance);
                b.placed(0, DVec3::new(2.0, 1.3, 0.0), turned * tilt, turned * at);
            }
        }
        let cameras = (0..10).map(|i| {
            let eye = DVec3::new(0.9, 0.5, 0.1) * f64::from(i % 5);
            let camera = looking(eye, eye - DVec3::Z);
            Camera {
                position: turned * camera.position,
                orientation: turned * camera.orientation,
                near: 0.1,
                ..camera
            }
        });
        CaseScene::new(b.build(), cameras)
    },
};
