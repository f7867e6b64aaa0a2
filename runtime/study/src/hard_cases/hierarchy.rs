//! Scenes that no split divides well.

use glam::DVec3;

use super::builder::{Builder, Rng, looking};
use super::{CaseFrame, CaseScene, HardCase};

pub(super) const IDENTICAL_BOXES: HardCase = HardCase {
    name: "identical-boxes",
    failure: "boxes that no plane divides: trees as deep as there are objects, quadratic time, a stack overflow",
    make: |scale| {
        let mut b = Builder::of_boxes();
        for _ in 0..scale.pick(400, 20_000) {
            b.boxed(DVec3::ZERO, DVec3::ONE);
        }
        b.boxed(DVec3::new(0.0, 0.0, -5.0), DVec3::new(3.0, 3.0, 0.1));
        let cameras = (0..6).map(|i| {
            let angle = 0.5 * f64::from(i);
            looking(
                DVec3::new(5.0 * angle.sin(), 0.5, 5.0 * angle.cos()),
                DVec3::ZERO,
            )
        });
        // Each covers the others: few pixels keep that bearable.
        let frames = cameras.map(|camera| CaseFrame {
            size: Some([64, 36]),
            ..camera.into()
        });
        CaseScene {
            motion: None,
            frames: frames.collect(),
            source: b.build(),
        }
    },
};

/// Boxes along a line, each twice as far and as large as the one before, with a swarm round each.
pub(super) const COLLINEAR: HardCase = HardCase {
    name: "collinear",
    failure: "collinear centroids at powers of two: every split peels off one object",
    make: |scale| {
        let mut rng = Rng(702);
        let mut b = Builder::of_boxes();
        for power in -20..=20 {
            let size = f64::from(power).exp2();
            for _ in 0..scale.pick(20, 500) {
                let at = DVec3::NEG_Z * size * rng.within(1.0, 1.5);
                b.boxed(at, DVec3::splat(size * rng.magnitude(0.01, 0.3)));
            }
        }
        let cameras = (0..10).map(|i| {
            let eye = DVec3::new(0.7, 0.3, 1.0) * (f64::from(i) * 3.0 - 15.0).exp2();
            hroc_runtime::Camera {
                near: 1e-4,
                ..looking(eye, eye - DVec3::new(0.3, 0.1, 1.0))
            }
        });
        CaseScene::new(b.build(), cameras)
    },
};

pub(super) const HUGE_BESIDE_TINY: HardCase = HardCase {
    name: "huge-beside-tiny",
    failure: "1e30 beside 1e-30: areas overflow or underflow in the cost of a split, and comparisons with NaN never end",
    make: |scale| {
        let mut rng = Rng(703);
        let mut b = Builder::of_boxes();
        for _ in 0..scale.pick(300, 3000) {
            b.boxed(rng.point(10.0), DVec3::splat(rng.magnitude(1e-30, 1.0)));
        }
        // Clippers multiply clip coordinates, so of a triangle with corners beyond 1e19 that a border of the image cuts
        // nothing is left but NaN, and a rasterizer may walk the 2^27 rows up to it, edge by edge. The largest lie
        // wholly inside or wholly outside of every view; those at 1e18 are cut.
        for side in [-1.0, 1.0] {
            b.boxed(DVec3::new(2e31 * side, 0.0, 0.0), DVec3::splat(1e30));
            b.boxed(DVec3::new(0.0, 0.0, 1e18 * side), DVec3::splat(1e17));
        }
        let cameras = (0..8).map(|i| {
            let angle = 0.9 * f64::from(i);
            looking(
                DVec3::new(20.0 * angle.cos(), 1.0, 20.0 * angle.sin()),
                DVec3::ZERO,
            )
        });
        CaseScene::new(b.build(), cameras)
    },
};
