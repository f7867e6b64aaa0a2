//! Bounds that the near plane, the eye plane or the eye itself cuts.

use glam::{DQuat, DVec3};
use hroc_runtime::Camera;

use super::builder::{Builder, Rng, ball, cube, looking};
use super::{CaseScene, HardCase};

pub(super) const AROUND_THE_EYE: HardCase = HardCase {
    name: "around-the-eye",
    failure: "bounds cross the near or the eye plane (w <= 0): the divided nearest depth was too far for 99% of them",
    make: |scale| {
        let mut rng = Rng(101);
        let mut b = Builder::of_boxes();
        for _ in 0..scale.pick(900, 20_000) {
            let distance = rng.magnitude(2e-3, 40.0);
            let mut half = || distance * rng.magnitude(0.02, 1.2);
            let half = DVec3::new(half(), half(), half());
            b.boxed(rng.rotation() * DVec3::Z * distance, half);
        }
        let frames = scale.pick(12, 13);
        let cameras = (0..frames).map(|i| Camera {
            orientation: rng.rotation(),
            near: 10f64.powf(4.0 * f64::from(i) / f64::from(frames - 1) - 3.0),
            ..looking(DVec3::ZERO, DVec3::NEG_Z)
        });
        let cameras = cameras.collect::<Vec<_>>();
        CaseScene::new(b.build(), cameras)
    },
};

pub(super) const THROUGH_A_WALL: HardCase = HardCase {
    name: "through-a-wall",
    failure: "the front face lies between eye and near plane and is clipped: the wall vanished",
    make: |scale| {
        let mut b = Builder::new(vec![cube(), ball(4)]);
        // Steps of 1e-4 that begin in front of the wall and end with the near plane beyond it.
        let (half, near, frames) = scale.pick((1e-4, 5e-4, 12), (2e-3, 1e-2, 170));
        let start = half + near + 0.5e-4;
        b.boxed(DVec3::ZERO, DVec3::new(3.0, 3.0, half));
        for i in 0..9 {
            let x = -2.0 + 0.5 * f64::from(i);
            b.boxed(DVec3::new(x, 0.3, -4.0), DVec3::splat(0.15));
            b.placed(
                1,
                DVec3::splat(0.2),
                DQuat::IDENTITY,
                DVec3::new(x, -0.3, 4.0),
            );
        }
        let cameras = (0..frames).map(|i| {
            let z = start - 1e-4 * f64::from(i);
            Camera {
                near,
                ..looking(DVec3::new(0.1, 0.1, z), DVec3::new(0.1, 0.12, z - 1.0))
            }
        });
        CaseScene::new(b.build(), cameras)
    },
};

pub(super) const EYE_IN_BOUNDS: HardCase = HardCase {
    name: "eye-in-bounds",
    failure: "the eye is inside the bounds of an object or a node: their front faces were culled, and all within",
    make: |scale| {
        // About zero, so that coordinates relative to the scene's centre are these.
        let half = DVec3::new(1.0, 0.75, 1.25);
        let mut b = Builder::new(vec![cube(), ball(4)]);
        b.boxed(DVec3::ZERO, half);
        b.boxed(DVec3::ZERO, half / 4.0);
        let mut rng = Rng(102);
        for i in 0..200 {
            let out = rng.rotation() * DVec3::Z * rng.within(2.0, 8.0);
            b.placed(
                i % 2,
                DVec3::splat(rng.within(0.1, 0.5)),
                rng.rotation(),
                out,
            );
        }
        b.boxed(DVec3::ZERO, DVec3::splat(10.0));
        // The centre; then a face, an edge and a corner: one ulp inside, on it, one ulp outside.
        let mut eyes = vec![DVec3::new(0.0, 0.0, 1e-30)];
        for place in [DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::ONE] {
            let on = place * half;
            let moved = |step: fn(f32) -> f32| {
                on.to_array().map(|x| {
                    if x == 0.0 {
                        x
                    } else {
                        f64::from(step(x as f32))
                    }
                })
            };
            eyes.extend([moved(f32::next_down).into(), on, moved(f32::next_up).into()]);
        }
        let nears: &[f64] = scale.pick(&[1e-3], &[1e-5, 1e-3, 0.1]);
        let mut cameras = Vec::new();
        for &near in nears {
            for (i, &eye) in eyes.iter().enumerate() {
                // Outward, inward and across; each in turn where frames are few.
                let directions = [eye, -eye, DVec3::new(eye.z, 0.1, -eye.x - 1.0)];
                let chosen = scale.pick(i % 3..i % 3 + 1, 0..3);
                cameras.extend(directions[chosen].iter().map(|direction| Camera {
                    near,
                    ..looking(eye, eye + *direction)
                }));
            }
        }
        CaseScene::new(b.build(), cameras)
    },
};
