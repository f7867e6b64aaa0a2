//! Nothing, hardly anything, everything.

use glam::DVec3;
use hroc_runtime::Camera;

use super::builder::{Builder, looking};
use super::everyday::clutter;
use super::{CaseScene, HardCase};

pub(super) const EMPTY: HardCase = HardCase {
    name: "empty",
    failure: "no objects: empty buffers cannot be bound, empty dispatches hang",
    make: |_| few(0),
};

pub(super) const ONE_OBJECT: HardCase = HardCase {
    name: "one-object",
    failure: "one object: the root of the tree is a leaf",
    make: |_| few(1),
};

pub(super) const TWO_OBJECTS: HardCase = HardCase {
    name: "two-objects",
    failure: "two objects: the smallest tree with an inner node",
    make: |_| few(2),
};

fn few(count: u32) -> CaseScene {
    let mut b = Builder::of_boxes();
    for i in 0..count {
        b.boxed(DVec3::new(0.0, 0.0, -3.0 * f64::from(i)), DVec3::ONE);
    }
    let cameras = [4.0, 1.0, 0.0, -1.5, -40.0]
        .map(|z| looking(DVec3::new(0.1, 0.2, z), DVec3::new(0.1, 0.2, z - 1.0)));
    CaseScene::new(b.build(), cameras)
}

/// One layer of boxes that faces the camera.
pub(super) const EVERYTHING_VISIBLE: HardCase = HardCase {
    name: "everything-visible",
    failure: "no occlusion at all: culling was slower than no culling, the first complaint of its users",
    make: |scale| {
        let mut b = Builder::of_boxes();
        let (columns, rows) = scale.pick((36, 24), (150, 80));
        for x in 0..columns {
            for y in 0..rows {
                let place = |i: i32, n: i32| (f64::from(i) + 0.5) / f64::from(n) - 0.5;
                let at = DVec3::new(place(x, columns) * 14.0, place(y, rows) * 8.0, -10.0);
                b.boxed(at, DVec3::splat(4.0 / f64::from(columns)));
            }
        }
        let cameras = (0..10).map(|i| {
            let eye = DVec3::new(0.02 * f64::from(i), 0.01 * f64::from(i), 0.0);
            looking(eye, eye - DVec3::Z)
        });
        CaseScene::new(b.build(), cameras)
    },
};

/// Looking away, with a far plane before everything, and with a near plane behind it.
pub(super) const NOTHING_VISIBLE: HardCase = HardCase {
    name: "nothing-visible",
    failure: "nothing in view: draws of no instances, an occlusion map of the clear value only",
    make: |scale| {
        let eye = DVec3::new(0.0, 0.0, 40.0);
        let away = looking(eye, eye + DVec3::Z);
        let short = Camera {
            far: Some(10.0),
            ..looking(eye, DVec3::ZERO)
        };
        let beyond = Camera {
            near: 100.0,
            ..looking(eye, DVec3::ZERO)
        };
        CaseScene::new(clutter(scale), [away, short, beyond, away, away, short])
    },
};
