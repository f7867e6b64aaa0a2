//! Sizes of the image, footprints in it, and the ways to project into it.

use glam::DVec3;
use hroc_runtime::{Camera, Projection};

use super::builder::{Builder, looking, unit_pixels};
use super::everyday::clutter;
use super::{CaseFrame, CaseScene, HardCase, Scale};

pub(super) const FOOTPRINTS: HardCase = HardCase {
    name: "footprints",
    failure: "level of the depth pyramid by floor instead of ceil: a footprint of 2x2 texels missed the last one",
    make: footprints,
};

pub(super) const ODD_SIZES: HardCase = HardCase {
    name: "odd-sizes",
    failure: "a depth pyramid over a size that is no power of two dropped the texels at its right and lower border",
    make: odd_sizes,
};

pub(super) const VIEWPORTS: HardCase = HardCase {
    name: "viewports",
    failure: "images of one pixel, one row or one column: pyramids without levels, degenerate padding",
    make: |scale| {
        let long = scale.pick(128, 4096);
        let sizes = [[1, 1], [1, long], [long, 1], [2, long], [long, 3], [7, 7]];
        let frames = sizes.iter().flat_map(|&size| {
            [DVec3::new(16.0, 3.0, 9.0), DVec3::new(1.0, 0.5, 2.0)].map(|eye| CaseFrame {
                size: Some(size),
                ..looking(eye, DVec3::ZERO).into()
            })
        });
        CaseScene {
            motion: None,
            source: clutter(Scale::Small),
            frames: frames.collect(),
        }
    },
};

pub(super) const PROJECTIONS: HardCase = HardCase {
    name: "projections",
    failure: "fields of view of 1 and 179 degrees, orthographic views, far planes through the scene",
    make: |scale| {
        let eye = looking(DVec3::new(9.0, 2.0, 12.0), DVec3::ZERO);
        let degrees: &[f64] = scale.pick(
            &[1.0, 60.0, 150.0, 179.0],
            &[1.0, 2.0, 5.0, 20.0, 60.0, 90.0, 120.0, 150.0, 170.0, 179.0],
        );
        let perspective = degrees.iter().map(|degrees| Projection::Perspective {
            fov_y_rad: degrees.to_radians(),
        });
        let orthographic = [6.0, 0.5].map(|half_height| Projection::Orthographic { half_height });
        let cameras = perspective.chain(orthographic).flat_map(|projection| {
            [None, Some(14.0)].map(|far| Camera {
                projection,
                far,
                ..eye
            })
        });
        CaseScene::new(clutter(scale), cameras)
    },
};

/// Shift of the camera, pixels, by which a gap of half a pixel round a pixel's centre closes.
const CLOSING: f64 = 0.4;

/// Every footprint (offset, size) in a row of texels, one per row of pixels: a target behind a wall with one open
/// texel, the footprint's first or last. Each is seen shifted, with all gaps closed, and then not, so that the
/// walls are known occluders when their targets come into view.
fn footprints(scale: Scale) -> CaseScene {
    let [width, height] = scale.pick([16, 128], [64, 480]);
    let mut b = Builder::of_boxes();
    let mut rows = 0;
    let mut row = |offset: u32, size: u32, open: u32| {
        let [y, offset, size, open] = [rows, offset, size, open].map(f64::from);
        b.span(
            [offset + 0.25, y + 0.25, -3.0],
            [offset + size - 0.25, y + 0.75, -2.0],
        );
        b.span([-2.0, y + 0.1, -0.1], [open + 0.25, y + 0.9, 0.1]);
        b.span(
            [open + 0.75, y + 0.1, -0.1],
            [f64::from(width) + 2.0, y + 0.9, 0.1],
        );
        rows += 1;
    };
    for size in 1..=width {
        for offset in 0..=width - size {
            row(offset, size, offset);
            if size > 1 {
                row(offset, size, offset + size - 1);
            }
        }
    }
    let size = [width, height];
    let frames = (0..rows.div_ceil(height)).flat_map(|page| {
        [CLOSING, 0.0].map(|shift| CaseFrame {
            size: Some(size),
            ..unit_pixels(shift, f64::from(page * height), size).into()
        })
    });
    CaseScene {
        motion: None,
        frames: frames.collect(),
        source: b.build(),
    }
}

/// For each size of image a place of its own: a wall that leaves the last column and the lowest row of pixels
/// open, and targets behind that peek out there. Seen shifted, with the wall over everything, and then not.
fn odd_sizes(scale: Scale) -> CaseScene {
    let sizes = scale.pick(
        vec![
            [1, 1],
            [2, 1],
            [1, 3],
            [3, 2],
            [5, 7],
            [7, 5],
            [9, 33],
            [17, 31],
            [33, 9],
            [63, 65],
            [65, 63],
            [127, 97],
            [97, 127],
        ],
        (1..=257)
            .step_by(4)
            .chain([2, 3, 7, 15, 31, 63, 127, 255, 256])
            .map(|k| [k, 258 - k])
            .chain([[1366, 768], [1919, 1079]])
            .collect(),
    );
    let mut b = Builder::of_boxes();
    let mut frames = Vec::new();
    let mut left = 0.0;
    for size in sizes {
        let [width, height] = size.map(f64::from);
        b.span(
            [left - 2.0, 0.75, -0.1],
            [left + width - 0.75, height + 2.0, 0.1],
        );
        for i in 0..3 {
            let part = |i: i32, length: f64| length * f64::from(i) / 3.0;
            let (x, y) = (left + width - 0.25, 0.25);
            b.span(
                [left + width / 3.0, part(i, height), -3.0],
                [x, part(i + 1, height), -2.0],
            );
            b.span(
                [left + part(i, width), y, -5.0],
                [left + part(i + 1, width), height * 0.6, -4.0],
            );
            b.span(
                [left + part(i, width), height * 0.7, -7.0],
                [left + part(i + 1, width) - 1.0, height * 0.8, -6.0],
            );
        }
        frames.extend([CLOSING, 0.0].map(|shift| CaseFrame {
            size: Some(size),
            ..unit_pixels(left - shift, shift, size).into()
        }));
        left += 2.0 * width + 16.0;
    }
    CaseScene {
        motion: None,
        source: b.build(),
        frames,
    }
}
