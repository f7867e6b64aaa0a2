//! Triangles without area, or with next to none: whatever a rasterizer makes of them, no image may depend on what was
//! culled.

use glam::DVec3;
use hroc_preprocess::scene::SourceMesh;

use super::builder::{Builder, Rng, looking, pixel_at, unit_pixels};
use super::{CaseFrame, CaseScene, HardCase};

/// Triangles of `corners`, no two of which share a vertex.
fn triangles(corners: impl IntoIterator<Item = [DVec3; 3]>) -> SourceMesh {
    let positions = corners.into_iter().flatten();
    let positions = positions
        .map(|p| p.as_vec3().to_array())
        .collect::<Vec<_>>();
    SourceMesh {
        indices: (0..positions.len() as u32).collect(),
        positions,
        ..Default::default()
    }
}

/// Triangles whose corners lie on one line or on one point, in the cube -1..1.
fn without_area(rng: &mut Rng, count: usize) -> SourceMesh {
    triangles((0..count).map(|i| {
        let (a, b) = (rng.point(1.0), rng.point(1.0));
        match i % 4 {
            0 => [a, a, b],
            1 => [a, b, b],
            2 => [a, a, a],
            _ => [a, b, (a + b) / 2.0],
        }
    }))
}

/// Triangles narrower than f32 resolves after a transform, in the cube -1..1.
fn narrow(rng: &mut Rng, count: usize) -> SourceMesh {
    triangles((0..count).map(|i| {
        let (a, b) = (rng.point(1.0), rng.point(1.0));
        let off = rng.point(1.0) * rng.magnitude(1e-8, 1e-3);
        match i % 3 {
            0 => [a, a + off, b],
            1 => [a, b, b + off],
            _ => [a, b, a.lerp(b, rng.within(0.0, 1.0)) + off],
        }
    }))
}

/// A disc of radius 1 whose rim lies on a coarse grid, as a fan seen from both sides: many of its triangles lie on a
/// line, as those of round heads that were written with few digits.
fn coarse_disc(rng: &mut Rng, corners: usize) -> SourceMesh {
    let (grid, height) = (rng.within(5.0, 12.0), rng.within(-0.5, 0.5));
    let rim = (0..corners).map(|i| {
        let angle = std::f64::consts::TAU * i as f64 / corners as f64;
        let at = |x: f64| (x * grid).round() / grid;
        DVec3::new(at(angle.cos()), height, at(angle.sin()))
    });
    let rim = rim.collect::<Vec<_>>();
    let fan = (1..corners - 1).flat_map(|i| {
        let [a, b, c] = [rim[0], rim[i], rim[i + 1]];
        [[a, b, c], [a, c, b]]
    });
    triangles(fan)
}

/// Puts objects of all meshes from `first` on about a wall: most behind it, some before it and beside it. `pixels`
/// bounds their size in the image.
fn about_a_wall(
    b: &mut Builder,
    rng: &mut Rng,
    [first, meshes, count]: [usize; 3],
    pixels: [f64; 2],
    height: u32,
) {
    b.boxed(DVec3::new(0.0, 0.0, -14.0), DVec3::new(5.0, 3.0, 0.2));
    for i in 0..count {
        let distance = rng.within(9.0, 40.0);
        let half = 0.5 * pixel_at(distance, height) * rng.magnitude(pixels[0], pixels[1]);
        let (x, y) = (rng.within(-0.7, 0.7), rng.within(-0.4, 0.4));
        let at = DVec3::new(x * distance, y * distance, -distance);
        b.placed(first + i % meshes, DVec3::splat(half), rng.rotation(), at);
    }
}

fn drifting(frames: u32) -> impl Iterator<Item = hroc_runtime::Camera> {
    (0..frames).map(|i| {
        let drift = 0.017 * f64::from(i);
        let eye = DVec3::new(drift, 0.3 * drift, 0.0);
        hroc_runtime::Camera {
            near: 0.002,
            ..looking(eye, DVec3::new(-drift, 0.0, -20.0))
        }
    })
}

/// Objects all of whose triangles have no area, which should show nowhere.
pub(super) const DEGENERATE: HardCase = HardCase {
    name: "degenerate",
    failure: "triangles whose corners coincide or lie on one line got depths that are no numbers",
    make: |scale| {
        let mut rng = Rng(311);
        let mut meshes = vec![super::builder::cube()];
        meshes.extend((0..8).map(|_| without_area(&mut rng, scale.pick(40, 400))));
        let mut b = Builder::new(meshes);
        let count = scale.pick(400, 4000);
        let height = scale.size()[1];
        about_a_wall(&mut b, &mut rng, [1, 8, count], [0.3, 30.0], height);
        CaseScene::new(b.build(), drifting(scale.pick(10, 24)))
    },
};

/// Objects of triangles far narrower than a pixel.
pub(super) const NEAR_DEGENERATE: HardCase = HardCase {
    name: "near-degenerate",
    failure: "triangles far narrower than a pixel got depths of any size, or none: they showed through walls",
    make: |scale| {
        let mut rng = Rng(312);
        let mut meshes = vec![super::builder::cube()];
        meshes.extend((0..8).map(|_| narrow(&mut rng, scale.pick(80, 400))));
        meshes.extend((0..8).map(|_| coarse_disc(&mut rng, 36)));
        let mut b = Builder::new(meshes);
        let count = scale.pick(900, 9000);
        let height = scale.size()[1];
        about_a_wall(&mut b, &mut rng, [1, 16, count], [0.1, 10.0], height);
        CaseScene::new(b.build(), drifting(scale.pick(10, 24)))
    },
};

/// Triangles whose corners lie on one line in every bit, at whatever place and scale they are computed: rounding to the
/// subpixel grid gives some of them an area again, and they cover a pixel's centre.
pub(super) const COLLINEAR: HardCase = HardCase {
    name: "on-one-line",
    failure: "corners on one line left it once they were snapped: the depth of their fragments was 0 * infinity, NaN",
    make: |scale| {
        let mut rng = Rng(313);
        let size = [scale.pick(128, 512), scale.pick(64, 256)];
        let [width, height] = size.map(f64::from);
        let mut meshes = vec![super::builder::cube()];
        meshes.extend((0..16).map(|_| collinear(&mut rng, 60)));
        let mut b = Builder::new(meshes);
        b.span([-8.0, -8.0, -14.0], [width + 8.0, height + 8.0, -13.0]);
        for i in 0..scale.pick(300, 4000) {
            let at = DVec3::new(
                rng.within(0.0, width).round(),
                rng.within(0.0, height).round(),
                -rng.within(16.0, 80.0).round(),
            );
            b.placed(1 + i % 16, DVec3::ONE, glam::DQuat::IDENTITY, at);
        }
        // The camera moves by fractions that f32 holds exactly and the subpixel grid does not.
        let frames = (0..scale.pick(8, 24)).map(|i| {
            let off = f64::from(i) * 0.25 * (1.0 + 1.0 / 512.0);
            CaseFrame {
                size: Some(size),
                ..unit_pixels(off, -off, size).into()
            }
        });
        CaseScene {
            frames: frames.collect(),
            source: b.build(),
            motion: None,
        }
    },
};

/// Triangles at right angles to z, in the cube -8..8, whose corners are multiples of 1/1024 on one line.
fn collinear(rng: &mut Rng, count: usize) -> SourceMesh {
    triangles((0..count).map(|_| {
        let mut grid = |r: f64| (rng.within(-r, r) * 1024.0).round() / 1024.0;
        let (a, step) = (
            DVec3::new(grid(4.0), grid(4.0), grid(1.0)),
            DVec3::new(grid(1.0), grid(1.0), 0.0),
        );
        [a, a + step, a + 4.0 * step]
    }))
}
/// The same, no object larger than a pixel or two.
pub(super) const ONE_PIXEL: HardCase = HardCase {
    name: "one-pixel",
    failure: "objects of one pixel, made of triangles without area: the only fragment had no depth",
    make: |scale| {
        let mut rng = Rng(314);
        let mut meshes = vec![super::builder::cube()];
        meshes.extend((0..4).map(|_| without_area(&mut rng, 12)));
        meshes.extend((0..4).map(|_| narrow(&mut rng, 12)));
        meshes.extend((0..8).map(|_| coarse_disc(&mut rng, 36)));
        let mut b = Builder::new(meshes);
        let count = scale.pick(900, 9000);
        let height = scale.size()[1];
        about_a_wall(&mut b, &mut rng, [1, 16, count], [0.5, 2.0], height);
        CaseScene::new(b.build(), drifting(scale.pick(10, 24)))
    },
};
