//! Nothing special: what a method that fails here has not understood. Other cases borrow these scenes.

use glam::DVec3;
use hroc_preprocess::scene::SourceScene;

use super::builder::{Builder, Rng, ball, cube, looking, turning};
use super::{CaseScene, HardCase, Scale};

pub(super) const CLUTTER: HardCase = HardCase {
    name: "clutter",
    failure: "boxes and balls of all sizes and orientations from outside and from within: the check of the others",
    make: |scale| {
        let frames = scale.pick(6, 10);
        let approach = (0..frames).map(|i| {
            let x = 24.0 - 18.0 * f64::from(i) / f64::from(frames);
            looking(DVec3::new(x, 3.0, 14.0), DVec3::ZERO)
        });
        let inside = turning(DVec3::new(1.0, 0.0, 2.0), frames as usize);
        CaseScene::new(clutter(scale), approach.chain(inside))
    },
};

pub(super) const ROOMS: HardCase = HardCase {
    name: "rooms",
    failure: "walls hide nearly everything: disocclusion through doors one frame late",
    make: |scale| {
        CaseScene::new(rooms(scale), {
            let frames = scale.pick(6, 12);
            let turn = turning(DVec3::new(2.0 * ROOM, 1.6, 2.0 * ROOM), frames);
            let walk = (0..frames).map(move |i| {
                let x = 5.6 * i as f64 / frames as f64;
                looking(
                    DVec3::new(x, 1.6, ROOM),
                    DVec3::new(x + 1.0, 1.5, ROOM + 0.1),
                )
            });
            turn.into_iter().chain(walk)
        })
    },
};

/// Boxes and balls, overlapping.
pub(super) fn clutter(scale: Scale) -> SourceScene {
    let mut rng = Rng(1);
    let mut b = Builder::new(vec![cube(), ball(6)]);
    for i in 0..scale.pick(400, 2000) {
        let mut side = || rng.within(0.05, 1.0);
        let size = DVec3::new(side(), side(), side());
        let at = rng.point(10.0);
        b.placed(i % 2, size, rng.rotation(), at);
    }
    b.build()
}

/// Side of a room.
pub(super) const ROOM: f64 = 4.0;

/// Rooms in a grid with doors; small things in each.
pub(super) fn rooms(scale: Scale) -> SourceScene {
    let mut rng = Rng(2);
    let mut b = Builder::new(vec![cube(), ball(5)]);
    let n = scale.pick(5, 10);
    for x in 0..n {
        for z in 0..n {
            let c = DVec3::new(f64::from(x) * ROOM, 1.5, f64::from(z) * ROOM);
            for y in [-1.55, 1.55] {
                b.boxed(c + DVec3::Y * y, DVec3::new(ROOM / 2.0, 0.05, ROOM / 2.0));
            }
            // Two walls a room, each with a doorway of 0.8 in the middle.
            for side in [-1.2, 1.2] {
                b.boxed(
                    c + DVec3::new(side, 0.0, ROOM / 2.0),
                    DVec3::new(0.8, 1.5, 0.05),
                );
                b.boxed(
                    c + DVec3::new(ROOM / 2.0, 0.0, side),
                    DVec3::new(0.05, 1.5, 0.8),
                );
            }
            for i in 0..8 {
                let (x, y, z) = (
                    rng.within(-1.6, 1.6),
                    rng.within(-1.3, 0.5),
                    rng.within(-1.6, 1.6),
                );
                let size = DVec3::splat(rng.within(0.05, 0.2));
                b.placed(i % 2, size, rng.rotation(), c + DVec3::new(x, y, z));
            }
        }
    }
    b.build()
}
