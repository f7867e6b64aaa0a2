//! Generated scenes, each with the cameras it is seen from. Small, seeded, made for one difficulty each.

use glam::{DAffine3, DQuat, DVec3};
use hroc_format::{BakedScene, Check};
use hroc_preprocess::bake::{BakeOptions, bake};
use hroc_preprocess::progress::Silent;
use hroc_preprocess::scene::{SourceFile, SourceMesh, SourceObject, SourceScene};
use hroc_runtime::camera::look_to;
use hroc_runtime::{Camera, Projection};

/// A scene and a path through it.
#[derive(Debug)]
pub struct TestScene {
    /// What is hard about it.
    pub name: &'static str,
    /// The objects.
    pub source: SourceScene,
    /// One camera per frame.
    pub cameras: Vec<Camera>,
}

impl TestScene {
    /// Bakes with all trees.
    ///
    /// # Panics
    /// If the bake refuses the scene.
    pub fn bake(&self) -> BakedScene {
        let (scene, _) = bake(self.source.clone(), &BakeOptions::default(), &Silent).unwrap();
        BakedScene::from_bytes(&hroc_format::to_bytes(&scene).unwrap(), Check::Everything).unwrap()
    }
}

/// splitmix64: small, seeded, the same everywhere.
#[derive(Clone, Debug)]
pub struct Rng(pub u64);

impl Rng {
    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `lo..hi`.
    pub fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A point of the cube `-r..r`.
    pub fn point(&mut self, r: f64) -> DVec3 {
        DVec3::new(self.within(-r, r), self.within(-r, r), self.within(-r, r))
    }

    /// A random rotation.
    pub fn rotation(&mut self) -> DQuat {
        DQuat::from_euler(
            glam::EulerRot::YXZ,
            self.within(-3.2, 3.2),
            self.within(-1.5, 1.5),
            self.within(-3.2, 3.2),
        )
    }
}

/// The cube -1..1, twelve triangles, eight vertices.
pub fn cube() -> SourceMesh {
    let positions = (0..8)
        .map(|i| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 }))
        .collect();
    let faces: [[u32; 4]; 6] = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let indices = faces
        .iter()
        .flat_map(|f| [f[0], f[1], f[2], f[0], f[2], f[3]])
        .collect();
    SourceMesh {
        positions,
        indices,
        ..Default::default()
    }
}

/// A ball of about `4 * n * n` triangles and radius 1.
pub fn ball(n: u32) -> SourceMesh {
    let mut positions = Vec::new();
    for row in 0..=n {
        let polar = std::f32::consts::PI * row as f32 / n as f32;
        for column in 0..=2 * n {
            let turn = std::f32::consts::PI * column as f32 / n as f32;
            positions.push([
                polar.sin() * turn.cos(),
                polar.cos(),
                polar.sin() * turn.sin(),
            ]);
        }
    }
    let stride = 2 * n + 1;
    let quad = |row: u32, column: u32| {
        let a = row * stride + column;
        [a, a + 1, a + stride, a + 1, a + stride + 1, a + stride]
    };
    let indices = (0..n)
        .flat_map(|row| (0..2 * n).flat_map(move |column| quad(row, column)))
        .collect();
    SourceMesh {
        positions,
        indices,
        ..Default::default()
    }
}

/// Collects objects into a source scene.
#[derive(Debug, Default)]
pub struct Builder(SourceScene);

impl Builder {
    /// A builder with `meshes`.
    pub fn new(meshes: Vec<SourceMesh>) -> Self {
        let files = vec![SourceFile {
            name: "generated".to_owned(),
            hash: 0,
        }];
        Self(SourceScene {
            name: "generated".to_owned(),
            files,
            meshes,
            ..Default::default()
        })
    }

    /// Adds an object.
    pub fn object(&mut self, mesh: usize, world_from_object: DAffine3) {
        let node = self.0.objects.len();
        let base_color = [0.4 + 0.05 * (node % 10) as f32, 0.6, 0.8, 1.0];
        self.0.objects.push(SourceObject {
            mesh,
            world_from_object,
            base_color,
            alpha: Default::default(),
            double_sided: false,
            name: String::new(),
            file: 0,
            node,
            primitive: 0,
        });
    }

    /// Adds mesh 0 as an axis-aligned box with these half extents.
    pub fn boxed(&mut self, center: DVec3, half: DVec3) {
        self.object(
            0,
            DAffine3::from_scale_rotation_translation(half, DQuat::IDENTITY, center),
        );
    }

    /// The scene.
    pub fn build(self) -> SourceScene {
        self.0
    }
}

/// A camera at `position` looking at `target`.
pub fn looking(position: DVec3, target: DVec3) -> Camera {
    let orientation = look_to(target - position, DVec3::Y);
    Camera {
        position,
        orientation,
        projection: Projection::Perspective { fov_y_rad: 1.0 },
        near: 0.05,
        far: None,
    }
}

/// A half turn on the spot in `frames` frames.
pub fn turning(position: DVec3, frames: usize) -> Vec<Camera> {
    (0..frames)
        .map(|i| {
            let angle = std::f64::consts::PI * i as f64 / frames as f64;
            looking(
                position,
                position + DVec3::new(angle.cos(), 0.05, angle.sin()),
            )
        })
        .collect()
}

/// Boxes and balls of all sizes and orientations, seen from outside and from within.
fn clutter() -> TestScene {
    let mut rng = Rng(1);
    let mut b = Builder::new(vec![cube(), ball(6)]);
    for i in 0..400 {
        let size = DVec3::new(
            rng.within(0.05, 1.0),
            rng.within(0.05, 1.0),
            rng.within(0.05, 1.0),
        );
        let at = rng.point(10.0);
        let turned = DAffine3::from_scale_rotation_translation(size, rng.rotation(), at);
        b.object(i % 2, turned);
    }
    let mut cameras: Vec<_> = (0..6)
        .map(|i| looking(DVec3::new(24.0 - 3.0 * i as f64, 3.0, 14.0), DVec3::ZERO))
        .collect();
    cameras.extend(turning(DVec3::new(1.0, 0.0, 2.0), 6));
    TestScene {
        name: "clutter",
        source: b.build(),
        cameras,
    }
}

/// Rooms in a grid with doors; small things in each. Walls hide nearly everything.
fn rooms() -> TestScene {
    let mut rng = Rng(2);
    let mut b = Builder::new(vec![cube(), ball(5)]);
    let (n, room) = (5, 4.0);
    for x in 0..n {
        for z in 0..n {
            let c = DVec3::new(x as f64 * room, 1.5, z as f64 * room);
            b.boxed(
                c - DVec3::Y * 1.55,
                DVec3::new(room / 2.0, 0.05, room / 2.0),
            );
            b.boxed(
                c + DVec3::Y * 1.55,
                DVec3::new(room / 2.0, 0.05, room / 2.0),
            );
            // Two walls a room, each with a doorway of 0.8 in the middle.
            for side in [-1.0, 1.0] {
                b.boxed(
                    c + DVec3::new(side * 1.2, 0.0, room / 2.0),
                    DVec3::new(0.8, 1.5, 0.05),
                );
                b.boxed(
                    c + DVec3::new(room / 2.0, 0.0, side * 1.2),
                    DVec3::new(0.05, 1.5, 0.8),
                );
            }
            for i in 0..8 {
                let at = c + DVec3::new(
                    rng.within(-1.6, 1.6),
                    rng.within(-1.3, 0.5),
                    rng.within(-1.6, 1.6),
                );
                b.object(
                    i % 2,
                    DAffine3::from_scale_rotation_translation(
                        DVec3::splat(rng.within(0.05, 0.2)),
                        rng.rotation(),
                        at,
                    ),
                );
            }
        }
    }
    let mut cameras = turning(DVec3::new(2.0 * room, 1.6, 2.0 * room), 8);
    cameras.extend((0..8).map(|i| {
        let x = i as f64 * 0.7;
        looking(
            DVec3::new(x, 1.6, room),
            DVec3::new(x + 1.0, 1.5, room + 0.1),
        )
    }));
    TestScene {
        name: "rooms",
        source: b.build(),
        cameras,
    }
}

/// A camera that goes through a thin wall in tiny steps: bounds cross the near plane, front faces fall
/// between eye and near plane, the eye is inside bounds.
fn through_a_wall() -> TestScene {
    let mut b = Builder::new(vec![cube(), ball(4)]);
    b.boxed(DVec3::ZERO, DVec3::new(3.0, 3.0, 0.01));
    for i in 0..9 {
        b.boxed(
            DVec3::new(-2.0 + 0.5 * f64::from(i), 0.3, -4.0),
            DVec3::splat(0.15),
        );
        b.object(
            1,
            DAffine3::from_scale_rotation_translation(
                DVec3::splat(0.2),
                DQuat::IDENTITY,
                DVec3::new(-2.0 + 0.5 * f64::from(i), -0.3, 4.0),
            ),
        );
    }
    let cameras = (0..24)
        .map(|i| {
            let z = 0.07 - 0.007 * f64::from(i);
            looking(DVec3::new(0.1, 0.1, z), DVec3::new(0.1, 0.12, z - 1.0))
        })
        .collect();
    TestScene {
        name: "through-a-wall",
        source: b.build(),
        cameras,
    }
}

/// Cubes that are their own bounds, in touching stacks: every face is a depth tie of bounds and geometry.
fn stacked() -> TestScene {
    let mut b = Builder::new(vec![cube()]);
    for x in -3..=3 {
        for y in -3..=3 {
            for z in -3..=3 {
                b.boxed(
                    DVec3::new(f64::from(x), f64::from(y), f64::from(z)),
                    DVec3::splat(0.5),
                );
            }
        }
    }
    let cameras = (0..10)
        .map(|i| {
            let angle = 0.3 * f64::from(i);
            looking(
                DVec3::new(
                    9.0 * angle.cos(),
                    2.0 - 0.4 * f64::from(i),
                    9.0 * angle.sin(),
                ),
                DVec3::ZERO,
            )
        })
        .collect();
    TestScene {
        name: "stacked",
        source: b.build(),
        cameras,
    }
}

/// Flat plates seen edge-on and objects far below a pixel.
fn flat_and_tiny() -> TestScene {
    let mut rng = Rng(3);
    let mut b = Builder::new(vec![cube(), ball(3)]);
    for i in 0..60 {
        let at = rng.point(4.0);
        let thin = [
            DVec3::new(0.6, 0.0, 0.6),
            DVec3::new(0.0, 0.6, 0.6),
            DVec3::new(0.6, 0.6, 0.0),
        ][i % 3];
        b.boxed(at, thin);
    }
    for i in 0..800 {
        let at = rng.point(6.0);
        let size = DVec3::splat(10f64.powf(rng.within(-3.5, -1.5)));
        b.object(
            i % 2,
            DAffine3::from_scale_rotation_translation(size, rng.rotation(), at),
        );
    }
    let mut cameras: Vec<_> = (0..6)
        .map(|i| looking(DVec3::new(12.0, 0.002 * f64::from(i), 0.0), DVec3::ZERO))
        .collect();
    cameras.extend((0..6).map(|i| {
        looking(
            DVec3::new(0.0, 0.0, 9.0 - f64::from(i)),
            DVec3::new(0.1, 0.0, 0.0),
        )
    }));
    TestScene {
        name: "flat-and-tiny",
        source: b.build(),
        cameras,
    }
}

/// Far from the source's zero: coordinates that f32 could not hold apart.
fn far_from_zero() -> TestScene {
    let offset = DVec3::new(3.0e6, -2.0e6, 1.0e7);
    let mut scene = rooms();
    for object in &mut scene.source.objects {
        object.world_from_object.translation += offset;
    }
    for camera in &mut scene.cameras {
        camera.position += offset;
    }
    TestScene {
        name: "far-from-zero",
        ..scene
    }
}

/// Mirrored, sheared, squashed and hugely scaled objects.
fn odd_transforms() -> TestScene {
    let mut rng = Rng(4);
    let mut b = Builder::new(vec![cube(), ball(5)]);
    for i in 0..200 {
        let mut m = DAffine3::from_scale_rotation_translation(
            DVec3::new(
                rng.within(-1.0, 1.0),
                10f64.powf(rng.within(-6.0, 0.0)),
                rng.within(-1.0, 1.0),
            ),
            rng.rotation(),
            rng.point(6.0),
        );
        m.matrix3.x_axis += 0.5 * m.matrix3.y_axis;
        if i % 17 == 0 {
            m.matrix3 = glam::DMat3::ZERO;
        }
        b.object(i % 2, m);
    }
    b.boxed(DVec3::new(0.0, -2000.0, 0.0), DVec3::splat(1990.0));
    let cameras = (0..10)
        .map(|i| {
            looking(
                DVec3::new(14.0 - 2.0 * f64::from(i), 1.0, 7.0),
                DVec3::new(0.0, -0.5, 0.0),
            )
        })
        .collect();
    TestScene {
        name: "odd-transforms",
        source: b.build(),
        cameras,
    }
}

/// 0, 1 and 2 objects.
fn few(count: usize) -> TestScene {
    let mut b = Builder::new(vec![cube()]);
    for i in 0..count {
        b.boxed(DVec3::new(0.0, 0.0, -3.0 * i as f64), DVec3::ONE);
    }
    let cameras = [4.0, 1.0, 0.0, -1.5, -40.0]
        .map(|z| looking(DVec3::new(0.1, 0.2, z), DVec3::new(0.1, 0.2, z - 1.0)));
    let name = ["empty", "one-object", "two-objects"][count];
    TestScene {
        name,
        source: b.build(),
        cameras: cameras.into(),
    }
}

/// Cuts between opposite views: nothing of the last frame helps.
fn teleports() -> TestScene {
    let mut scene = rooms();
    let mut rng = Rng(5);
    scene.cameras = (0..20)
        .map(|_| {
            let at = DVec3::new(
                rng.within(-3.0, 20.0),
                rng.within(-1.0, 4.0),
                rng.within(-3.0, 20.0),
            );
            Camera {
                orientation: rng.rotation(),
                ..looking(at, at + DVec3::X)
            }
        })
        .collect();
    TestScene {
        name: "teleports",
        ..scene
    }
}

/// Narrow and wide lenses, a box-shaped view volume, a far plane through the scene.
fn projections() -> TestScene {
    let mut scene = clutter();
    let eye = looking(DVec3::new(9.0, 2.0, 12.0), DVec3::ZERO);
    let perspective = |degrees: f64| Projection::Perspective {
        fov_y_rad: degrees.to_radians(),
    };
    scene.cameras = [
        perspective(1.0),
        perspective(60.0),
        perspective(150.0),
        perspective(179.0),
        Projection::Orthographic { half_height: 6.0 },
        Projection::Orthographic { half_height: 0.5 },
    ]
    .into_iter()
    .flat_map(|projection| {
        [None, Some(14.0)].map(|far| Camera {
            projection,
            far,
            ..eye
        })
    })
    .collect();
    TestScene {
        name: "projections",
        ..scene
    }
}

/// Every generated scene.
pub fn all() -> Vec<TestScene> {
    vec![
        few(0),
        few(1),
        few(2),
        clutter(),
        rooms(),
        through_a_wall(),
        stacked(),
        flat_and_tiny(),
        far_from_zero(),
        odd_transforms(),
        teleports(),
        projections(),
    ]
}
