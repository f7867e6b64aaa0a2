//! Objects below a pixel, flat ones seen edge-on, and gaps that a coarser buffer would close.

use glam::DVec3;

use super::builder::{Builder, Rng, ball, cube, looking, pixel_at, unit_pixels};
use super::{CaseFrame, CaseScene, HardCase};

pub(super) const SUB_PIXEL: HardCase = HardCase {
    name: "sub-pixel",
    failure: "cubes of 0.01 to 2 pixels and wires: the projected bounds cover no sample, so the object was never tested",
    make: |scale| {
        let mut rng = Rng(301);
        let mut b = Builder::of_boxes();
        let height = scale.size()[1];
        // A screen before half of them: some of them leave its shade from frame to frame.
        b.boxed(DVec3::new(-6.0, 0.0, -20.0), DVec3::new(6.0, 4.0, 0.1));
        for _ in 0..scale.pick(600, 20_000) {
            let distance = rng.within(22.0, 60.0);
            let (x, y) = (
                rng.within(-0.9, 0.9) * distance,
                rng.within(-0.5, 0.5) * distance,
            );
            let half = 0.5 * pixel_at(distance, height) * rng.magnitude(0.01, 2.0);
            b.placed(
                0,
                DVec3::splat(half),
                rng.rotation(),
                DVec3::new(x, y, -distance),
            );
        }
        for _ in 0..scale.pick(400, 2000) {
            let distance = rng.within(22.0, 60.0);
            let at = DVec3::new(
                rng.within(-0.9, 0.9) * distance,
                rng.within(-0.5, 0.5) * distance,
                -distance,
            );
            let half = 0.5 * pixel_at(distance, height) * rng.magnitude(0.01, 1.0);
            b.placed(
                0,
                DVec3::new(rng.within(0.5, 10.0), half, half),
                rng.rotation(),
                at,
            );
        }
        let cameras = (0..scale.pick(10, 12)).map(|i| {
            let drift = 0.013 * f64::from(i);
            looking(
                DVec3::new(drift, 0.4 * drift, 0.0),
                DVec3::new(drift, 0.0, -40.0),
            )
        });
        CaseScene::new(b.build(), cameras)
    },
};

pub(super) const FLAT_AND_TINY: HardCase = HardCase {
    name: "flat-and-tiny",
    failure: "plates without thickness seen edge-on among crumbs far below a pixel",
    make: |scale| {
        let mut rng = Rng(3);
        let mut b = Builder::new(vec![cube(), ball(3)]);
        for i in 0..60 {
            let thin = [
                DVec3::new(0.6, 0.0, 0.6),
                DVec3::new(0.0, 0.6, 0.6),
                DVec3::new(0.6, 0.6, 0.0),
            ];
            b.boxed(rng.point(4.0), thin[i % 3]);
        }
        for i in 0..scale.pick(800, 10_000) {
            let at = rng.point(6.0);
            let size = DVec3::splat(rng.magnitude(3e-4, 3e-2));
            b.placed(i % 2, size, rng.rotation(), at);
        }
        let edge_on =
            (0..6).map(|i| looking(DVec3::new(12.0, 0.002 * f64::from(i), 0.0), DVec3::ZERO));
        let inward = (0..6).map(|i| {
            looking(
                DVec3::new(0.0, 0.0, 9.0 - f64::from(i)),
                DVec3::new(0.1, 0.0, 0.0),
            )
        });
        CaseScene::new(b.build(), edge_on.chain(inward))
    },
};

/// Slats with gaps between, one target behind each gap: rows of equal gaps, from 0.1 to 4 pixels, at every
/// offset from the pixels' centres. The camera drifts by parts of a pixel.
pub(super) const NARROW_GAPS: HardCase = HardCase {
    name: "narrow-gaps",
    failure: "gaps of 0.1 to 4 pixels between occluders: a buffer of lower resolution closes them",
    make: |scale| {
        let size = scale.size();
        let [width, height] = size.map(f64::from);
        let (columns, rows) = scale.pick((20, 12), (70, 60));
        let [cell, row_height] = [width / f64::from(columns), height / f64::from(rows)];
        let mut rng = Rng(303);
        let mut b = Builder::of_boxes();
        for row in 0..rows {
            let gap = 0.1 * 40f64.powf(f64::from(row) / f64::from(rows - 1));
            let (bottom, top) = (f64::from(row) * row_height, f64::from(row + 1) * row_height);
            let mut begin = -4.0;
            for column in 0..columns {
                let from = f64::from(column) * cell + rng.within(0.1, 0.9) * (cell - gap);
                b.span([begin, bottom, -0.1], [from, top, 0.1]);
                begin = from + gap;
                b.span(
                    [from - 1.5, bottom + 0.2, -3.0],
                    [begin + 1.5, top - 0.2, -2.0],
                );
            }
            b.span([begin, bottom, -0.1], [width + 4.0, top, 0.1]);
        }
        let cameras =
            (0..scale.pick(10, 24)).map(|i| unit_pixels(0.23 * f64::from(i % 10) - 1.0, 0.0, size));
        let frames = cameras.map(|camera| CaseFrame {
            size: Some(size),
            ..camera.into()
        });
        CaseScene {
            motion: None,
            source: b.build(),
            frames: frames.collect(),
        }
    },
};
