//! Where objects are put and what is done to them.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use hroc_preprocess::scene::SourceMesh;

use super::builder::{Builder, Rng, ball, cube, looking, pixel_at};
use super::everyday::ROOMS;
use super::{CaseScene, HardCase, Scale};

const FAR: &str = "far from the source's zero: coordinates in f32 shook, and culled wrongly";

pub(super) const FAR_1E3: HardCase = HardCase {
    name: "far-1e3",
    failure: FAR,
    make: |scale| far_from_zero(scale, 1e3),
};

pub(super) const FAR_1E5: HardCase = HardCase {
    name: "far-1e5",
    failure: FAR,
    make: |scale| far_from_zero(scale, 1e5),
};

pub(super) const FAR_1E7: HardCase = HardCase {
    name: "far-1e7",
    failure: FAR,
    make: |scale| far_from_zero(scale, 1e7),
};

/// The rooms and their path, moved.
fn far_from_zero(scale: Scale, distance: f64) -> CaseScene {
    let offset = DVec3::new(0.3, -0.2, 1.0) * distance;
    let mut case = (ROOMS.make)(scale);
    for object in &mut case.source.objects {
        object.world_from_object.translation += offset;
    }
    for frame in &mut case.frames {
        frame.camera.position += offset;
    }
    case
}

pub(super) const WIDE_WORLD: HardCase = HardCase {
    name: "wide-world",
    failure: "a world 35 km wide: far from its middle, coordinates in f32 are millimetres apart",
    make: |scale| {
        let mut rng = Rng(602);
        let mut b = Builder::new(vec![cube(), ball(4)]);
        let corner = DVec3::new(17_500.0, 0.0, -17_500.0);
        b.boxed(
            DVec3::new(0.0, -0.5, 0.0),
            DVec3::new(17_600.0, 0.1, 17_600.0),
        );
        for i in 0..scale.pick(500, 10_000) {
            let street = DVec3::new(rng.within(-80.0, 80.0), 0.0, rng.within(-80.0, 80.0));
            b.boxed(
                corner + street + DVec3::Y * 2.0,
                DVec3::new(1.5, rng.within(0.5, 6.0), 1.5),
            );
            let size = DVec3::splat(rng.magnitude(0.02, 0.5));
            b.placed(
                i % 2,
                size,
                rng.rotation(),
                corner + street + DVec3::new(2.0, 0.3, rng.within(-2.0, 2.0)),
            );
        }
        let cameras = (0..10).map(|i| {
            let angle = 0.35 * f64::from(i);
            let eye = corner + DVec3::new(4.0 * f64::from(i) - 20.0, 1.7, 3.0);
            looking(eye, eye + DVec3::new(angle.cos(), -0.03, angle.sin()))
        });
        CaseScene::new(b.build(), cameras)
    },
};

pub(super) const ODD_TRANSFORMS: HardCase = HardCase {
    name: "odd-transforms",
    failure: "mirrored, sheared, squashed to nothing or hugely scaled: wrong winding, radius or inverse",
    make: |scale| {
        let mut rng = Rng(4);
        let mut b = Builder::new(vec![
            cube(),
            ball(5),
            scaled(cube(), 1e-6),
            scaled(ball(5), 1e6),
        ]);
        for i in 0..scale.pick(200, 4000) {
            let size = DVec3::new(
                rng.within(-1.0, 1.0),
                rng.magnitude(1e-6, 1.0),
                rng.within(-1.0, 1.0),
            );
            let rotation = rng.rotation();
            let mut m = DAffine3::from_scale_rotation_translation(size, rotation, rng.point(6.0));
            m.matrix3.x_axis += 0.5 * m.matrix3.y_axis;
            if i % 17 == 0 {
                m.matrix3 = DMat3::ZERO;
            }
            // Also meshes a million times too small or too large for the scene.
            let mesh = i % 4;
            m.matrix3 *= [1.0, 1.0, 1e6, 1e-6][mesh];
            b.object(mesh, m);
        }
        b.boxed(DVec3::new(0.0, -2000.0, 0.0), DVec3::splat(1990.0));
        let cameras = (0..10).map(|i| {
            looking(
                DVec3::new(14.0 - 2.0 * f64::from(i), 1.0, 7.0),
                DVec3::new(0.0, -0.5, 0.0),
            )
        });
        CaseScene::new(b.build(), cameras)
    },
};

/// The mesh with every coordinate multiplied.
fn scaled(mut mesh: SourceMesh, factor: f32) -> SourceMesh {
    let coordinates = mesh.positions.iter_mut().flatten();
    coordinates.for_each(|x| *x *= factor);
    mesh
}

/// Spikes modelled far from their own zero and brought back by their transform, behind a wall which their tips
/// overtop by a hair.
pub(super) const CANCELLING: HardCase = HardCase {
    name: "cancelling",
    failure: "transformed bounds rounded inward: a vertex stuck out, and showed where nothing was expected",
    make: |scale| {
        let modelled_at = [30_000.0f32, -20_000.0, 9_000.0];
        let spike = SourceMesh {
            positions: [
                [-0.5, -1.0, -0.5],
                [0.5, -1.0, -0.5],
                [0.0, -1.0, 0.5],
                [0.0, 1.0, 0.0],
            ]
            .map(|p| [0, 1, 2].map(|i| p[i] + modelled_at[i]))
            .to_vec(),
            indices: vec![0, 1, 2, 0, 1, 3, 1, 2, 3, 2, 0, 3],
            ..Default::default()
        };
        let back = DAffine3::from_translation(-DVec3::from_array(modelled_at.map(f64::from)));
        let mut rng = Rng(606);
        let mut b = Builder::new(vec![cube(), spike]);
        b.boxed(DVec3::new(0.0, -20.0, -10.0), DVec3::new(200.0, 20.0, 0.1));
        for _ in 0..scale.pick(600, 10_000) {
            let distance = rng.within(11.0, 60.0);
            let lean = DQuat::from_euler(
                glam::EulerRot::YXZ,
                rng.within(-3.0, 3.0),
                rng.within(-1.2, 1.2),
                0.0,
            );
            let tip = lean * DVec3::Y;
            // The wall's edge is at the height of the eye.
            let over = rng.within(-1.0, 2.5) * pixel_at(distance, scale.size()[1]);
            let at = DVec3::new(rng.within(-0.8, 0.8) * distance, over, -distance) - tip;
            b.object(1, DAffine3::from_rotation_translation(lean, at) * back);
        }
        let cameras = (0..10).map(|i| {
            let eye = DVec3::new(0.0, 0.004 * f64::from(i - 5), 0.0);
            looking(eye, eye - DVec3::Z)
        });
        CaseScene::new(b.build(), cameras)
    },
};
