//! What the last frame says about this one: everything, nothing, or what another view saw.

use glam::{DQuat, DVec3};
use hroc_runtime::{Camera, Projection};

use super::builder::{Builder, Rng, looking, turning};
use super::everyday::{ROOM, clutter, rooms};
use super::{CaseFrame, CaseScene, HardCase};

/// A wall, seen alone, and the crowd behind it, seen at once.
pub(super) const SUDDEN_CROWD: HardCase = HardCase {
    name: "sudden-crowd",
    failure: "from 1 visible object to all of them in a frame: counters late by a frame drew too few",
    make: |scale| {
        let mut b = Builder::of_boxes();
        b.boxed(DVec3::ZERO, DVec3::new(100.0, 100.0, 0.1));
        let (columns, rows) = scale.pick((36, 24), (150, 80));
        for x in 0..columns {
            for y in 0..rows {
                let place = |i: i32, n: i32| (f64::from(i) + 0.5) / f64::from(n) - 0.5;
                let at = DVec3::new(place(x, columns) * 16.0, place(y, rows) * 9.0, -10.0);
                b.boxed(at, DVec3::splat(4.0 / f64::from(columns)));
            }
        }
        let cameras = [1.0, 1.0, -0.5, 1.0, -0.5, -0.5, 1.0, -0.5]
            .map(|z| looking(DVec3::new(0.0, 0.0, z), DVec3::new(0.0, 0.0, z - 1.0)));
        CaseScene::new(b.build(), cameras)
    },
};

pub(super) const STILL_CAMERA: HardCase = HardCase {
    name: "still-camera",
    failure: "objects that flip every other frame under a camera that stands still",
    make: |scale| {
        let eye = DVec3::new(2.0 * ROOM, 1.6, 2.0 * ROOM);
        let before = turning(eye, 4);
        let still = before[2];
        CaseScene::new(rooms(scale), before.into_iter().chain([still; 8]))
    },
};

pub(super) const ABOUT_TURNS: HardCase = HardCase {
    name: "about-turns",
    failure: "half a turn in a frame: nothing known is in view, and the occlusion map stays empty",
    make: |scale| {
        let eye = DVec3::new(2.0 * ROOM, 1.6, 2.0 * ROOM);
        let cameras = turning(eye, scale.pick(12, 20))
            .into_iter()
            .enumerate()
            .map(|(i, camera)| {
                let half_turn = DQuat::from_rotation_y(std::f64::consts::PI * (i % 2) as f64);
                Camera {
                    orientation: half_turn * camera.orientation,
                    ..camera
                }
            });
        CaseScene::new(rooms(scale), cameras)
    },
};

pub(super) const TELEPORTS: HardCase = HardCase {
    name: "teleports",
    failure: "cuts from anywhere to anywhere: what was visible says nothing about what is",
    make: |scale| {
        let mut rng = Rng(5);
        let far = scale.pick(20.0, 42.0);
        let cameras = (0..scale.pick(12, 24)).map(|_| {
            let at = DVec3::new(
                rng.within(-3.0, far),
                rng.within(-1.0, 4.0),
                rng.within(-3.0, far),
            );
            Camera {
                orientation: rng.rotation(),
                ..looking(at, at + DVec3::X)
            }
        });
        let cameras = cameras.collect::<Vec<_>>();
        CaseScene::new(rooms(scale), cameras)
    },
};

/// A view within the rooms and one from above, in turn, of different sizes and projections.
pub(super) const TWO_VIEWS: HardCase = HardCase {
    name: "two-views",
    failure: "two views shared a history: the second was culled by what the first had seen",
    make: |scale| {
        let inside = turning(DVec3::new(2.0 * ROOM, 1.6, 2.0 * ROOM), scale.pick(6, 12));
        let frames = inside.into_iter().enumerate().flat_map(|(i, camera)| {
            let middle = DVec3::new(2.0 * ROOM + 0.3 * i as f64, 0.0, 2.0 * ROOM);
            let above = Camera {
                projection: Projection::Orthographic {
                    half_height: 3.0 * ROOM,
                },
                ..looking(middle + DVec3::new(0.0, 30.0, 12.0), middle)
            };
            let above = CaseFrame {
                size: Some([70, 90]),
                view: 1,
                ..above.into()
            };
            [camera.into(), above]
        });
        CaseScene {
            motion: None,
            frames: frames.collect(),
            source: rooms(scale),
        }
    },
};

pub(super) const JITTER: HardCase = HardCase {
    name: "jitter",
    failure: "subpixel jitter of temporal antialiasing: history and test saw different images, edges flickered",
    make: |scale| {
        let eye = looking(DVec3::new(9.0, 2.0, 12.0), DVec3::ZERO);
        let frames = (0..scale.pick(12, 64)).map(|i| Camera {
            // Halton 2, 3; every fourth frame far beyond a pixel.
            jitter_px: [halton(i, 2), halton(i, 3)]
                .map(|px| px * if i % 4 == 3 { 40.0 } else { 1.0 }),
            ..eye
        });
        CaseScene::new(clutter(scale), frames)
    },
};

/// The van der Corput sequence in a base, centred on 0.
fn halton(i: u32, base: u32) -> f64 {
    let (mut rest, mut share, mut sum) = (i + 1, 1.0, 0.0);
    while rest > 0 {
        share /= f64::from(base);
        sum += share * f64::from(rest % base);
        rest /= base;
    }
    sum - 0.5
}

pub(super) const RESIZE: HardCase = HardCase {
    name: "resize",
    failure: "the image changed its size between frames: buffers and pyramids kept the old one",
    make: |scale| {
        let sizes = [
            [128, 72],
            [72, 128],
            [1, 1],
            [127, 71],
            [16, 16],
            [128, 128],
            [3, 90],
        ];
        let cameras = turning(DVec3::new(2.0 * ROOM, 1.6, 2.0 * ROOM), scale.pick(12, 21));
        let frames = cameras.into_iter().zip(sizes.into_iter().cycle());
        CaseScene {
            motion: None,
            frames: frames
                .map(|(camera, size)| CaseFrame {
                    size: Some(size),
                    ..camera.into()
                })
                .collect(),
            source: rooms(scale),
        }
    },
};
