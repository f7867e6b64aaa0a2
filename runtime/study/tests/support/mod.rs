//! A small scene to cull, and when to leave out what draws.
#![allow(dead_code)] // Each test file uses its own part.

use hroc_format::Scene;
use hroc_preprocess::bake::{BakeOptions, bake};
use hroc_preprocess::progress::Silent;
use hroc_preprocess::scene::{AlphaMode, SourceFile, SourceMesh, SourceObject, SourceScene};

const CUBE_CORNERS: [[f32; 3]; 8] = {
    let mut corners = [[0.0; 3]; 8];
    let mut i = 0;
    while i < 8 {
        let mut axis = 0;
        while axis < 3 {
            corners[i][axis] = if i >> axis & 1 == 1 { 0.5 } else { -0.5 };
            axis += 1;
        }
        i += 1;
    }
    corners
};
const CUBE_INDICES: [u32; 36] = [
    0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3,
    5, 3, 7, 5,
];

/// `rooms` closed rooms in a row, far from the source's zero. Nine objects each: the shell, then the eight small
/// cubes in it.
pub fn rooms(rooms: u32) -> Scene {
    let mut objects = Vec::new();
    let mut cube = |scale: f64, at: [f64; 3]| {
        let scale = glam::DVec3::splat(scale);
        let translation = glam::DVec3::from_array(at) + glam::DVec3::new(5e5, 10.0, -3e5);
        objects.push(SourceObject {
            mesh: 0,
            world_from_object: glam::DAffine3::from_scale_rotation_translation(
                scale,
                glam::DQuat::IDENTITY,
                translation,
            ),
            base_color: [0.8, 0.6, 0.4, 1.0],
            alpha: AlphaMode::Opaque,
            double_sided: false,
            name: String::new(),
            file: 0,
            node: 0,
            primitive: 0,
        });
    };
    for room in 0..rooms {
        let x = 3.0 * f64::from(room);
        cube(2.0, [x, 0.0, 0.0]);
        for corner in CUBE_CORNERS {
            cube(
                0.2,
                [
                    x + f64::from(corner[0]),
                    f64::from(corner[1]),
                    f64::from(corner[2]),
                ],
            );
        }
    }
    let source = SourceScene {
        name: "rooms".into(),
        files: vec![SourceFile {
            name: "rooms.glb".into(),
            hash: 0,
        }],
        meshes: vec![SourceMesh {
            positions: CUBE_CORNERS.to_vec(),
            indices: CUBE_INDICES.to_vec(),
            ..Default::default()
        }],
        objects,
        ..Default::default()
    };
    bake(source, &BakeOptions::default(), &Silent).unwrap().0
}

/// Whether to leave out what draws.
pub fn without_gpu() -> bool {
    let skip = std::env::var_os("HROC_SKIP_GPU").is_some_and(|value| value == "1");
    if skip {
        eprintln!("SKIPPED: HROC_SKIP_GPU=1, this test ran nothing on a GPU");
    }
    skip
}
