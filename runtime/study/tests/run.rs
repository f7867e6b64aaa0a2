//! Runs through the library: that the check fails where it should.

mod support;

use hroc_format::{BakedScene, Check, to_bytes};
use hroc_runtime::{DepthConvention, HostSync, Noc, Scene, SceneShape};
use hroc_study::camera_path::orbit;
use hroc_study::error::{StudyError, exit};
use hroc_study::gpu::{Gpu, GpuOptions};
use hroc_study::gpu_clock::ClockChoice;
use hroc_study::registry::{Exactness, Method, method};
use hroc_study::results::RunResults;
use hroc_study::run::{RunOptions, run};
use indicatif::ProgressBar;

/// Draws only the first of two rooms.
const FORGETFUL: Method = Method {
    name: "forgetful",
    source: "a method with a bug",
    exactness: Exactness::Exact,
    host_sync: HostSync::Never,
    features: wgpu::Features::empty(),
    modes: &[],
    uses_tree: false,
    counts_work: false,
    make: |parts| {
        let shape = SceneShape {
            object_count: 9,
            ..parts.scene.shape
        };
        Box::new(Noc::new(
            parts.device,
            &Scene {
                shape,
                ..parts.scene.clone()
            },
            parts.depth,
        ))
    },
};

fn checked(method: &'static Method) -> Result<RunResults, StudyError> {
    let file = to_bytes(&support::rooms(2)).unwrap();
    let baked = BakedScene::from_aligned(file, Check::Everything).unwrap();
    let options = RunOptions {
        method,
        mode: method.mode(None).unwrap(),
        grouping: hroc_runtime::Grouping::default(),
        split: "sah".into(),
        path: orbit(baked.scene()),
        frames: 5,
        size: [96, 54],
        depth: DepthConvention::default(),
        clock: ClockChoice::Wall,
        check: true,
        truth_cache: None,
    };
    let gpu_options = GpuOptions {
        validation: true,
        ..Default::default()
    };
    let gpu = Gpu::open(&gpu_options).expect("HROC_SKIP_GPU=1 skips this");
    run(&gpu, &baked, &options, &ProgressBar::hidden(), &mut |_| {
        Ok(())
    })
}

#[test]
fn a_method_that_forgets_objects_fails_the_check() {
    if support::without_gpu() {
        return;
    }
    let results = checked(&FORGETFUL).unwrap();
    let [wrong_pixels, false_negatives] = results.errors().unwrap();
    assert!(wrong_pixels > 100, "{wrong_pixels}");
    // Only the second room's shell ever shows; at times it is behind the first.
    assert!((1..=5).contains(&false_negatives), "{false_negatives}");
}

#[test]
fn hroc_passes_under_validation() {
    if support::without_gpu() {
        return;
    }
    let results = checked(method("hroc").unwrap()).unwrap();
    assert_eq!(results.errors(), Some([0, 0]));
}

#[test]
fn a_device_without_a_methods_features_is_refused() {
    if support::without_gpu() {
        return;
    }
    // Never requested, so never there.
    static DEMANDING: Method = Method {
        features: wgpu::Features::TEXTURE_COMPRESSION_ETC2,
        ..FORGETFUL
    };
    let error = checked(&DEMANDING).unwrap_err();
    assert_eq!(error.exit_code(), exit::DEVICE);
    assert!(
        error.to_string().contains("needs TEXTURE_COMPRESSION_ETC2"),
        "{error}"
    );
}
