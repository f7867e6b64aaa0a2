//! Runs through the library: that the check fails where it should.

mod support;

use hroc_format::{BakedScene, Check, to_bytes};
use hroc_runtime::{DepthConvention, HostSync, Noc, Scene};
use hroc_study::camera_path::orbit;
use hroc_study::error::{StudyError, exit};
use hroc_study::gpu::{Gpu, GpuOptions};
use hroc_study::gpu_clock::ClockChoice;
use hroc_study::registry::{Exactness, Method, Mode, method};
use hroc_study::results::RunResults;
use hroc_study::run::{Contender, Course, run};
use indicatif::ProgressBar;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Draws only the first of two rooms.
const FORGETFUL: Method = Method {
    name: "forgetful",
    source: "a method with a bug",
    features: wgpu::Features::empty(),
    modes: &[Mode {
        name: "",
        exactness: Exactness::Exact,
        host_sync: HostSync::Never,
    }],
    knobs: &[],
    uses_tree: false,
    groups: false,
    is_told: false,
    counts_work: false,
    make: |parts| {
        let opaque = parts.device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: &0x1ff_u32.to_le_bytes(),
            usage: wgpu::BufferUsages::STORAGE,
        });
        let scene = Scene {
            opaque,
            ..parts.scene.clone()
        };
        Box::new(Noc::new(parts.device, &scene, parts.depth))
    },
};

fn checked(method: &'static Method) -> Result<RunResults, StudyError> {
    checked_in(method, &method.modes[0])
}

fn checked_in(method: &'static Method, mode: &'static Mode) -> Result<RunResults, StudyError> {
    let file = to_bytes(&support::rooms(2)).unwrap();
    let baked = BakedScene::from_aligned(file, Check::Everything).unwrap();
    let gpu_options = GpuOptions {
        validation: true,
        ..Default::default()
    };
    let gpu = Gpu::open(&gpu_options).expect("HROC_SKIP_GPU=1 skips this");
    let course = Course {
        scene_name: "rooms".into(),
        path_name: "orbit".into(),
        path: orbit(baked.scene()),
        frames: 5,
        size: [96, 54],
        depth: DepthConvention::default(),
        profile: gpu.profile.clone(),
        clock: ClockChoice::Wall,
        check: true,
        repeats: 1,
        overdraw_frame: None,
        truth_cache: None,
    };
    let contender = Contender::new(method, mode);
    let progress = ProgressBar::hidden();
    run(
        &gpu,
        &baked,
        &course,
        &contender,
        &progress,
        &mut |_| Ok(()),
    )
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
    let hroc = method("hroc").unwrap();
    for mode in hroc
        .modes
        .iter()
        .filter(|m| m.exactness == Exactness::Exact)
    {
        let results = checked_in(hroc, mode).unwrap();
        assert_eq!(results.errors(), Some([0, 0]), "{}", mode.name);
    }
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
