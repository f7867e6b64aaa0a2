//! Rays that meet faces, edges and corners exactly, and pixels at the limit between rasterizer and ray.

use glam::{DQuat, DVec3};
use hroc_runtime::Camera;

use super::builder::{Builder, Rng, looking, pixel_at, unit_pixels};
use super::{CaseFrame, CaseScene, HardCase};

/// Boxes whose faces, edges and corners lie on pixels' rays along an axis, and rays in the plane of a face.
pub(super) const PARALLEL_RAYS: HardCase = HardCase {
    name: "parallel-rays",
    failure: "rays parallel to and exactly on faces: 0 * infinity is NaN, and min and max took the wrong branch",
    make: |scale| {
        let side = scale.pick(65, 257);
        let mut rng = Rng(401);
        let mut b = Builder::of_boxes();
        for _ in 0..scale.pick(400, 8000) {
            // Centres of pixels are at half integers.
            let mut half_integer = |limit: f64| rng.within(0.0, limit).floor() + 0.5;
            let [x, y] = [half_integer(f64::from(side)), half_integer(f64::from(side))];
            let [dx, dy] = [half_integer(4.0) - 0.5, half_integer(4.0) - 0.5];
            let z = -rng.within(0.0, 60.0).floor();
            b.span([x, y, z - 1.0], [x + dx, y + dy, z]);
        }
        let middle = f64::from(side) / 2.0;
        // The middle pixel of an odd side looks straight ahead, here along faces.
        let ahead = (0..4).map(|i| {
            let eye = DVec3::new(middle, middle, 5.0 + f64::from(i));
            looking(eye, eye - DVec3::Z)
        });
        let size = [side; 2];
        let across = (0..4).map(|i| unit_pixels([0.0, 1.0][i % 2], [0.0, 0.0, 1.0, 0.5][i], size));
        let frames = across.chain(ahead).map(|camera| CaseFrame {
            size: Some(size),
            ..camera.into()
        });
        CaseScene {
            motion: None,
            frames: frames.collect(),
            source: b.build(),
        }
    },
};

/// Boxes, half of them flat, each with an edge or a corner on the ray through some pixel's centre.
pub(super) const EDGE_RAYS: HardCase = HardCase {
    name: "edge-rays",
    failure: "rays aimed at edges: a slab test in plain f32 missed 2 to 4% of them, 6 to 10% of flat boxes",
    make: |scale| {
        let size = scale.size();
        let [width, height] = size.map(f64::from);
        let mut rng = Rng(402);
        let mut b = Builder::of_boxes();
        for i in 0..scale.pick(900, 15_000) {
            let mut centre = |limit: f64| rng.within(0.0, limit).floor() + 0.5;
            let (x, y) = (centre(width), centre(height));
            let depth = rng.within(5.0, 80.0);
            let unit = pixel_at(depth, size[1]);
            let aimed = DVec3::new((x - width / 2.0) * unit, (height / 2.0 - y) * unit, -depth);
            let mut half = DVec3::new(
                rng.within(0.2, 2.0),
                rng.within(0.2, 2.0),
                rng.within(0.2, 2.0),
            ) * unit;
            if i % 2 == 0 {
                half[i / 2 % 3] = 0.0;
            }
            // Which corner is aimed at; on an edge where one coordinate is anything between.
            let mut corner = [0, 1, 2].map(|axis| {
                if rng.bits() >> axis & 1 == 0 {
                    1.0
                } else {
                    -1.0
                }
            });
            corner[i % 3] *= rng.within(0.0, 1.0).round().max(rng.within(0.0, 1.0));
            b.boxed(aimed + half * DVec3::from_array(corner), half);
        }
        let cameras = (0..scale.pick(8, 12)).map(|i| {
            // Every other frame is the one that is aimed; those between change what is known.
            let eye = DVec3::ZERO + DVec3::X * f64::from(i % 2) * f64::from(i);
            looking(eye, eye - DVec3::Z)
        });
        let frames = cameras.map(|camera| CaseFrame {
            size: Some(size),
            ..camera.into()
        });
        CaseScene {
            motion: None,
            frames: frames.collect(),
            source: b.build(),
        }
    },
};

/// Small boxes of every sub-pixel offset before an empty background, turned with the camera.
pub(super) const SNAPPED_GRID: HardCase = HardCase {
    name: "snapped-grid",
    failure: "the rasterizer snaps corners to a grid, the ray does not: boxes filled at a pixel whose ray misses them",
    make: |scale| {
        let height = scale.size()[1];
        let mut rng = Rng(403);
        let mut b = Builder::of_boxes();
        for _ in 0..scale.pick(1000, 20_000) {
            let distance = rng.magnitude(1.0, 200.0);
            let unit = pixel_at(distance, height);
            let mut half = || unit * rng.magnitude(0.2, 1.5);
            let half = DVec3::new(half(), half(), half());
            let (x, y) = (
                rng.within(-0.95, 0.95) * distance,
                rng.within(-0.54, 0.54) * distance,
            );
            b.boxed(DVec3::new(x, y, -distance), half);
        }
        let cameras = (0..scale.pick(8, 12)).map(|i| Camera {
            orientation: DQuat::from_euler(
                glam::EulerRot::YXZ,
                0.11 * f64::from(i),
                0.003,
                0.0007 * f64::from(i),
            ),
            ..looking(DVec3::ZERO, DVec3::NEG_Z)
        });
        CaseScene::new(b.build(), cameras)
    },
};
