//! A small scene to cull, and when to leave out what draws.
#![allow(dead_code)] // Each test file uses its own part.

use std::path::PathBuf;
use std::process::Output;

use assert_cmd::Command;
use hroc_format::Scene;
use hroc_preprocess::bake::{BakeOptions, bake};
use hroc_preprocess::progress::Silent;
use hroc_preprocess::scene::{AlphaMode, SourceFile, SourceMesh, SourceObject, SourceScene};
use tempfile::TempDir;

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

/// A folder with a baked scene, see [`rooms`].
pub struct House {
    pub folder: TempDir,
}

impl House {
    pub fn new(count: u32) -> Self {
        let house = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        let scene = rooms(count);
        hroc_format::write(&house.scene(), &scene).unwrap();
        house
    }

    pub fn scene(&self) -> PathBuf {
        self.path("rooms.hroc")
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `hroc` with `arguments`, in the folder.
    pub fn hroc(&self, arguments: &[&str]) -> Output {
        let mut command = Command::cargo_bin("hroc").unwrap();
        command.current_dir(self.folder.path()).args(arguments);
        command
            .env("XDG_CACHE_HOME", self.path("cache"))
            .output()
            .unwrap()
    }

    /// `hroc run` over six spread frames in a small size, which must end with `code`.
    pub fn run(&self, arguments: &[&str], code: i32) -> Output {
        let run = [
            "run",
            "rooms.hroc",
            "--size",
            "96x54",
            "--frames",
            "6",
            "--sampling",
            "spread",
        ];
        let output = self.hroc(&[&run[..], arguments].concat());
        assert_eq!(output.status.code(), Some(code), "{}", text(&output.stderr));
        output
    }
}

/// Lossy.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Asserts the exit code and that the one line on stderr says all of `parts`.
#[track_caller]
pub fn refused(output: &Output, code: i32, parts: &[&str]) {
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{message}");
    assert_eq!(text(&output.stdout), "");
    for part in parts {
        assert!(message.contains(part), "'{part}' in: {message}");
    }
}
