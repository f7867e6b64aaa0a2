//! Geometry as far from the source's zero, and from other geometry, as a planet is large.

use glam::DVec3;
use hroc_preprocess::scene::SourceMesh;

use super::builder::{Builder, Rng, ball, cube, looking};
use super::{CaseScene, HardCase};

/// A place on the surface of the Earth, in metres from its middle.
pub const PLACE: DVec3 = DVec3::new(3_904_000.25, 301_000.5, 5_017_000.75);

/// Bolts of a decimetre on both sides of a wall, about `place`.
pub fn bolts(b: &mut Builder, count: usize, place: DVec3) {
    let mut rng = Rng(801);
    b.boxed(place, DVec3::new(2.0, 1.0, 0.01));
    for i in 0..count {
        let side = if i % 3 == 0 { 0.08 } else { -0.12 };
        let at = DVec3::new(rng.within(-1.9, 1.9), rng.within(-0.9, 0.9), side);
        b.placed(i % 2, DVec3::splat(0.05), rng.rotation(), place + at);
    }
}

/// The eyes before the wall of [`bolts`].
pub fn eyes(place: DVec3) -> impl Iterator<Item = hroc_runtime::Camera> {
    (0..8).map(move |i| {
        let eye = place + DVec3::new(0.3 * f64::from(i) - 1.0, 0.1, 2.5);
        hroc_runtime::Camera {
            near: 0.01,
            ..looking(eye, place)
        }
    })
}

/// Markers at the middle of the Earth and on its other side make the scene as large as it.
pub(super) const BOLTS_ON_A_PLANET: HardCase = HardCase {
    name: "bolts-on-a-planet",
    failure: "one stray object at zero left half a metre of precision to geometry on the Earth's surface",
    make: |scale| {
        let mut b = Builder::new(vec![cube(), ball(3)]);
        bolts(&mut b, scale.pick(300, 5000), PLACE);
        b.boxed(DVec3::ZERO, DVec3::ONE);
        b.boxed(-PLACE, DVec3::ONE);
        CaseScene::new(b.build(), eyes(PLACE))
    },
};

/// A plain of one mesh with hills, about the eye.
fn plain(side: u32, half: f64, rng: &mut Rng) -> SourceMesh {
    let mut positions = Vec::new();
    for z in 0..=side {
        for x in 0..=side {
            let at = |i: u32| (f64::from(i) / f64::from(side) * 2.0 - 1.0) * half;
            positions.push(
                DVec3::new(at(x), rng.within(-120.0, 0.0), at(z))
                    .as_vec3()
                    .to_array(),
            );
        }
    }
    let corner = |x: u32, z: u32| z * (side + 1) + x;
    let quad = |x: u32, z: u32| {
        let [a, b, c, d] = [
            corner(x, z),
            corner(x + 1, z),
            corner(x, z + 1),
            corner(x + 1, z + 1),
        ];
        [a, c, b, b, c, d]
    };
    SourceMesh {
        indices: (0..side)
            .flat_map(|z| (0..side).flat_map(move |x| quad(x, z)))
            .collect(),
        positions,
        ..Default::default()
    }
}

/// The eye stands on a mesh that reaches 18 km to every side; small things lie about it.
pub(super) const ON_A_WIDE_MESH: HardCase = HardCase {
    name: "on-a-wide-mesh",
    failure: "the padding went by the extent of the scene, so nothing near the eye was culled on a mesh 36 km wide",
    make: |scale| {
        let mut rng = Rng(802);
        let ground = plain(96, 18_000.0, &mut rng);
        let mut b = Builder::new(vec![cube(), ball(3), ground]);
        b.placed(2, DVec3::ONE, glam::DQuat::IDENTITY, DVec3::ZERO);
        b.boxed(DVec3::new(0.0, 1.0, -8.0), DVec3::new(4.0, 3.0, 0.1));
        for i in 0..scale.pick(400, 6000) {
            let at = DVec3::new(
                rng.within(-6.0, 6.0),
                rng.within(-0.5, 4.5),
                rng.within(-14.0, -6.0),
            );
            b.placed(
                i % 2,
                DVec3::splat(rng.magnitude(0.02, 0.2)),
                rng.rotation(),
                at,
            );
        }
        let cameras = (0..8).map(|i| {
            let eye = DVec3::new(0.2 * f64::from(i) - 0.8, 1.7, 0.0);
            looking(eye, eye - DVec3::Z)
        });
        CaseScene::new(b.build(), cameras)
    },
};
