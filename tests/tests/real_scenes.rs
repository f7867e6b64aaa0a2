//! Whole scenes, generated ones and those made by others in the folder `HROC_TEST_SCENES`: each is baked, verified
//! and drawn exactly, by every method, from outside and from within.

use std::cmp::Reverse;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use hroc_format::{BakedScene, Check};
use hroc_preprocess::bake::{BakeOptions, bake};
use hroc_preprocess::generate::{self, Params};
use hroc_preprocess::import::{ImportOptions, import};
use hroc_preprocess::progress::Silent;
use hroc_runtime::{CullingMethod, DepthConvention, Hroc, HrocOptions};
use hroc_study::camera_path::{Cameras, orbit, walk_in};
use hroc_study::hard_cases::CaseFrame;
use hroc_tests::host::{World, difference};
use hroc_tests::no_culling::{NoCulling, Sums};
use hroc_tests::variants::each_exact_method;
use hroc_tests::{Gpu, own_gpu};

const SIZE: [u32; 2] = [192, 108];

/// The scenes in these folders of `HROC_TEST_SCENES`, if it is set.
fn scenes(suites: &[&str]) -> Option<Vec<PathBuf>> {
    let Some(folder) = std::env::var_os("HROC_TEST_SCENES").map(PathBuf::from) else {
        eprintln!("SKIPPED: HROC_TEST_SCENES names no folder, no real scene was tested");
        return None;
    };
    let mut found = Vec::new();
    let mut folders: Vec<_> = suites
        .iter()
        .map(|suite| folder.join(suite))
        .filter(|suite| suite.is_dir())
        .collect();
    if folders.is_empty() {
        eprintln!(
            "SKIPPED: {} has none of the folders {suites:?}",
            folder.display()
        );
        return None;
    }
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
    assert!(!found.is_empty(), "{suites:?} hold no scene");
    Some(found)
}

/// Bakes a scene, verifies it and draws it along two paths with every tree; gives the frames that are wrong. `None`
/// for a scene that needs Draco, which is refused.
fn wrong_frames(gpu: &Gpu, path: &Path, options: &BakeOptions) -> Option<Vec<String>> {
    let name = path.file_stem().unwrap().to_string_lossy().into_owned();
    let imported = import(&[path.to_owned()], &ImportOptions::default(), &Silent);
    let source = match imported {
        Err(error) if error.to_string().contains("KHR_draco_mesh_compression") => return None,
        imported => imported.unwrap_or_else(|error| panic!("{error}")),
    };
    let (scene, _) = bake(source, options, &Silent).unwrap_or_else(|e| panic!("{name}: {e}"));
    let bytes = hroc_format::to_bytes(&scene).unwrap();
    let baked =
        BakedScene::from_bytes(&bytes, Check::Everything).unwrap_or_else(|e| panic!("{name}: {e}"));
    let world = World::new(gpu, baked);
    let depth = DepthConvention::Reversed;
    let mut no_culling = NoCulling::new(gpu, &world, SIZE, depth);
    let mut sums = Sums::default();
    // Each method once, HROC with every tree.
    let mut methods = each_exact_method(gpu, &world, depth);
    methods.extend(world.trees[1..].iter().map(|tree| {
        let options = HrocOptions {
            depth,
            ..Default::default()
        };
        let hroc = Hroc::new(&gpu.device, &world.scene, tree, options);
        let made: Box<dyn CullingMethod> = Box::new(hroc);
        (format!("hroc {}", tree.split), made)
    }));
    let (walk, circle) = (walk_in(world.baked.scene()), orbit(world.baked.scene()));
    // Two neighbouring frames each outside, on the way in and inside: one with a cut, one that coheres.
    let cameras = [0.0, 0.1, 4.5, 4.6, 8.0, 8.1].map(|t| walk.camera_at(t));
    let (mut visible, mut drawn) = (0, 0);
    let mut failures = Vec::new();
    for (number, camera) in cameras.iter().chain(&[circle.camera_at(2.0)]).enumerate() {
        let (judgement, truth, _) = no_culling.judge(&world, &CaseFrame::from(*camera));
        sums.add(judgement);
        if let Some(fault) = judgement.first_fault {
            failures.push(format!("{name} without culling frame {number}: {fault}"));
        }
        for (method, culling) in &mut methods {
            let frame = no_culling.kept.render(culling.as_mut(), camera);
            let found = difference(&truth, &frame);
            if found.wrong_pixels + found.false_negatives > 0 {
                failures.push(format!("{name} {method} frame {number}: {found:?}"));
            }
            if number % 2 == 1 && method.starts_with("hroc") {
                visible += truth.visible().len();
                drawn += frame.pvs().len();
            }
        }
    }
    assert!(visible > 0, "{name}: no camera saw anything");
    eprintln!(
        "{name}: {visible} visible, {drawn} drawn in nine coherent frames of {} objects; {sums:?}",
        world.scene.shape.object_count
    );
    Some(failures)
}

/// Bakes and draws all, on two devices side by side: a software device shades vertices on one thread.
#[track_caller]
fn assert_all_exact(mut scenes: Vec<PathBuf>, options: &BakeOptions) {
    // The largest first, so that none is left to one device at the end.
    scenes.sort_by_key(|path| Reverse(path.metadata().map_or(0, |file| file.len())));
    let scenes = Mutex::new(scenes.into_iter());
    let next = || scenes.lock().unwrap().next();
    let draw = || {
        let mut failures = Vec::new();
        let Some(gpu) = own_gpu() else {
            return failures;
        };
        while let Some(path) = next() {
            failures.extend(wrong_frames(&gpu, &path, options).unwrap_or_default());
        }
        failures
    };
    let failures = std::thread::scope(|scope| {
        let others = scope.spawn(draw);
        let mut failures = draw();
        failures.extend(others.join().unwrap());
        failures
    });
    assert!(
        failures.is_empty(),
        "{} wrong frames:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

/// Bakes and draws all of a suite.
fn assert_exact(suite: &str) {
    if let Some(scenes) = scenes(&[suite]) {
        assert_all_exact(scenes, &BakeOptions::default());
    }
}

#[test]
fn real_scenes_are_drawn_exactly() {
    assert_exact("real");
}

#[test]
fn feature_scenes_are_drawn_exactly() {
    assert_exact("features");
}

/// A generated city, and the feature scenes where there are any.
#[test]
fn quantized_and_subdivided_scenes_are_drawn_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let city = folder.path().join("city.glb");
    let params = Params {
        scale: 0.01,
        detail: 1.0,
        seed: 1,
    };
    let generator = generate::by_name("radial-city").unwrap();
    generator.write(&params, &city).unwrap();
    let options = BakeOptions {
        quantize: true,
        split_objects: NonZeroU32::new(40),
        ..Default::default()
    };
    let mut scenes = scenes(&["features"]).unwrap_or_default();
    scenes.push(city);
    assert_all_exact(scenes, &options);
}
