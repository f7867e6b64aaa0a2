//! Scenes made by others, in the folder `HROC_TEST_SCENES`: each is baked, verified and drawn exactly, with every
//! tree, from outside and from within.

use std::path::{Path, PathBuf};

use hroc_format::{BakedScene, Check};
use hroc_preprocess::bake::{BakeOptions, bake};
use hroc_preprocess::import::{ImportOptions, import};
use hroc_preprocess::progress::Silent;
use hroc_runtime::{CullingMethod, DepthConvention, Hroc, HrocOptions, Noc};
use hroc_study::camera_path::{Cameras, orbit, walk_in};
use hroc_tests::gpu;
use hroc_tests::host::{Host, World, difference};

const SIZE: [u32; 2] = [192, 108];

/// The scenes of the folder's `real/`, if it is named.
fn scenes() -> Option<Vec<PathBuf>> {
    let Some(folder) = std::env::var_os("HROC_TEST_SCENES") else {
        eprintln!("SKIPPED: HROC_TEST_SCENES names no folder, no real scene was tested");
        return None;
    };
    let real = Path::new(&folder).join("real");
    let mut found = Vec::new();
    let mut folders = vec![real.clone()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder)
            .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path
                .extension()
                .is_some_and(|e| e == "glb" || e == "gltf" || e == "obj")
            {
                found.push(path);
            }
        }
    }
    found.sort();
    assert!(!found.is_empty(), "{} holds no scene", real.display());
    Some(found)
}

#[test]
fn real_scenes_are_drawn_exactly() {
    let Some(scenes) = scenes() else { return };
    let Some(gpu) = gpu() else { return };
    let mut failures = Vec::new();
    for path in scenes {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let source = import(
            std::slice::from_ref(&path),
            &ImportOptions::default(),
            &Silent,
        )
        .unwrap_or_else(|e| panic!("{e}"));
        let (scene, _) = bake(source, &BakeOptions::default(), &Silent)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let baked =
            BakedScene::from_bytes(&hroc_format::to_bytes(&scene).unwrap(), Check::Everything)
                .unwrap_or_else(|e| panic!("{name}: {e}"));
        let world = World::new(gpu, baked);
        let depth = DepthConvention::Reversed;
        let host = Host::new(gpu, &world, SIZE, depth);
        let mut noc = Noc::new(&gpu.device, &world.scene, depth);
        let options = HrocOptions {
            depth,
            ..Default::default()
        };
        let mut methods = world
            .trees
            .iter()
            .map(|tree| Hroc::new(&gpu.device, &world.scene, tree, options))
            .collect::<Vec<_>>();
        let (walk, circle) = (walk_in(world.baked.scene()), orbit(world.baked.scene()));
        // Two neighbouring frames each outside, on the way in and inside: one with a cut, one that coheres.
        let cameras = [0.0, 0.1, 4.5, 4.6, 8.0, 8.1].map(|t| walk.camera_at(t));
        let (mut visible, mut drawn) = (0, 0);
        for (number, camera) in cameras.iter().chain(&[circle.camera_at(2.0)]).enumerate() {
            let truth = host.render(&mut noc, camera);
            for (hroc, tree) in methods.iter_mut().zip(&world.trees) {
                let frame = host.render(hroc as &mut dyn CullingMethod, camera);
                let found = difference(&truth, &frame);
                if found.wrong_pixels + found.false_negatives > 0 {
                    failures.push(format!("{name} {} frame {number}: {found:?}", tree.split));
                }
                if number % 2 == 1 {
                    visible += truth.visible().len();
                    drawn += frame.pvs().len();
                }
            }
        }
        eprintln!(
            "{name}: {visible} visible, {drawn} drawn in nine coherent frames of {} objects",
            world.scene.shape.object_count
        );
    }
    assert!(
        failures.is_empty(),
        "{} wrong frames:\n{}",
        failures.len(),
        failures.join("\n")
    );
}
