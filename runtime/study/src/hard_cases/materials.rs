//! Objects that are not opaque all over.

use glam::{DQuat, DVec3};
use hroc_preprocess::scene::{AlphaMode, SourceScene};

use super::builder::{Builder, Rng, ball, cube, looking, turning};
use super::{CaseScene, HardCase, Scale};

pub(super) const GLASS: HardCase = HardCase {
    name: "glass",
    failure: "blended objects were taken for occluders: glass hid the rooms behind, or was itself lost behind glass",
    make: |scale| CaseScene::new(panes(scale, AlphaMode::Blended), cameras(scale)),
};

pub(super) const FENCE: HardCase = HardCase {
    name: "fence",
    failure: "a forced early test wrote the depth of fragments that an alpha test discards: holes hid what lay behind",
    make: |scale| CaseScene::new(panes(scale, AlphaMode::Masked), cameras(scale)),
};

fn cameras(scale: Scale) -> impl Iterator<Item = hroc_runtime::Camera> {
    let frames = scale.pick(7, 40);
    let walk = (0..frames).map(move |i| {
        let z = 14.0 - 20.0 * i as f64 / frames as f64;
        looking(DVec3::new(0.3, 0.4, z), DVec3::new(0.0, 0.0, z - 5.0))
    });
    walk.chain(turning(DVec3::new(0.0, 0.0, -1.0), frames))
}

/// Rows of panes, one behind the other, with opaque things and a wall with a gap between them.
fn panes(scale: Scale, alpha: AlphaMode) -> SourceScene {
    let mut rng = Rng(31);
    let mut b = Builder::new(vec![cube(), ball(5)]);
    for row in 0..4 {
        let z = 9.0 - 5.0 * f64::from(row);
        for column in -3..=3 {
            let at = DVec3::new(f64::from(column) * 2.0, 0.0, z);
            b.boxed(
                at,
                DVec3::new(0.95, 1.5, if column % 2 == 0 { 0.0 } else { 0.04 }),
            );
            b.with_alpha(alpha);
        }
        // A wall behind the first and the third row, open in the middle.
        if row % 2 == 0 {
            for side in [-4.5, 4.5] {
                b.boxed(DVec3::new(side, 0.0, z - 2.5), DVec3::new(3.6, 2.0, 0.1));
            }
        }
        for i in 0..scale.pick(40, 250) {
            let at = DVec3::new(
                rng.within(-7.0, 7.0),
                rng.within(-1.4, 1.4),
                z - rng.within(0.5, 4.5),
            );
            let size = DVec3::splat(rng.within(0.04, 0.25));
            b.placed(i % 2, size, rng.rotation(), at);
            if i % 3 == 0 {
                b.with_alpha(alpha);
            }
        }
    }
    // Hidden from most places: a pane behind everything.
    b.placed(
        0,
        DVec3::new(8.0, 2.0, 0.0),
        DQuat::IDENTITY,
        DVec3::new(0.0, 0.0, -12.0),
    );
    b.with_alpha(alpha);
    b.build()
}
