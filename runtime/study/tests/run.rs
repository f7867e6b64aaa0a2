//! Runs through the library: that the check fails where it should.

mod support;

use hroc_format::{BakedScene, Check, to_bytes};
use hroc_runtime::{DepthConvention, HostSync, Noc, Scene, Stage, StageObserver};
use hroc_study::camera_path::orbit;
use hroc_study::error::{StudyError, exit};
use hroc_study::gpu::{Gpu, GpuOptions};
use hroc_study::gpu_clock::{ClockChoice, GpuClock, GpuStageClock};
use hroc_study::registry::{Exactness, METHODS, Method, Mode, method};
use hroc_study::results::{Counters, Frame, RunResults};
use hroc_study::run::{Contender, Course, View, run_all};
use hroc_study::sampling::Sampling;
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
    all(&[Contender::new(method, mode)]).pop().unwrap()
}

/// The contenders side by side, checked.
fn all(contenders: &[Contender]) -> Vec<Result<RunResults, StudyError>> {
    all_viewed(contenders, &mut |_| Ok(()))
}

fn all_viewed(
    contenders: &[Contender],
    view: &mut View<'_>,
) -> Vec<Result<RunResults, StudyError>> {
    let file = to_bytes(&support::rooms(2)).unwrap();
    let baked = BakedScene::from_aligned(file, Check::Everything).unwrap();
    let features = METHODS.iter().map(|method| method.features);
    let gpu_options = GpuOptions {
        validation: true,
        features: features.fold(wgpu::Features::empty(), |all, some| all | some),
        ..Default::default()
    };
    let gpu = Gpu::open(&gpu_options).expect("HROC_SKIP_GPU=1 skips this");
    let course = Course {
        scene_name: "rooms".into(),
        path_name: "orbit".into(),
        path: orbit(baked.scene()),
        sampling: Sampling::Spread,
        frames: 5,
        size: [96, 54],
        depth: DepthConvention::default(),
        profile: gpu.profile.clone(),
        clock: ClockChoice::Wall,
        check: true,
        repeats: 1,
        overdraw_frame: Some(2),
        truth_cache: None,
    };
    let progress = ProgressBar::hidden();
    run_all(&gpu, &baked, &course, contenders, &progress, view).unwrap()
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

/// Asks for a buffer that no device gives.
const GREEDY: Method = Method {
    name: "greedy",
    make: |parts| {
        let _ = parts.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("greedy"),
            size: 1 << 50,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        (FORGETFUL.make)(parts)
    },
    ..FORGETFUL
};

#[test]
fn a_contender_that_fails_takes_nobody_along() {
    if support::without_gpu() {
        return;
    }
    static ODD: [Method; 3] = [
        Method {
            features: wgpu::Features::TEXTURE_COMPRESSION_ETC2,
            ..FORGETFUL
        },
        GREEDY,
        FORGETFUL,
    ];
    let mut contenders = ODD
        .iter()
        .map(|method| Contender::new(method, &method.modes[0]))
        .collect::<Vec<_>>();
    let noc = method("noc").unwrap();
    contenders.push(Contender::new(noc, &noc.modes[0]));
    let outcomes = all(&contenders);
    let reason = |place: usize| outcomes[place].as_ref().unwrap_err().to_string();
    assert!(reason(0).contains("TEXTURE_COMPRESSION_ETC2"));
    assert!(reason(1).contains("the device failed"), "{}", reason(1));
    let errors = |place: usize| outcomes[place].as_ref().unwrap().errors().unwrap();
    assert!(errors(2) != [0, 0] && errors(3) == [0, 0]);
}

#[test]
fn side_by_side_contenders_find_what_they_find_alone() {
    if support::without_gpu() {
        return;
    }
    // These decide by times that are measured, which differ from device to device and from day to day.
    let timed = ["nohc", "nohc-optimum", "auto"];
    let contenders = METHODS
        .iter()
        .filter(|method| !timed.contains(&method.name))
        .flat_map(|method| method.modes.iter().map(|mode| Contender::new(method, mode)))
        .collect::<Vec<_>>();
    let together = all(&contenders);
    for (contender, together) in contenders.iter().zip(together) {
        // A device that lacks a feature is told elsewhere.
        let Ok(together) = together else { continue };
        let alone = all(std::slice::from_ref(contender)).pop().unwrap().unwrap();
        let label = contender.label();
        assert_eq!(together.memory_bytes, alone.memory_bytes, "{label}");
        for (frame, (a, b)) in together.per_frame.iter().zip(&alone.per_frame).enumerate() {
            let found = |frame: &Frame| Frame {
                frame_ms: 0.0,
                gpu_ms: None,
                stages_ms: frame
                    .stages_ms
                    .keys()
                    .map(|stage| (stage.clone(), 0.0))
                    .collect(),
                counters: Counters {
                    rays: None,
                    ray_box_tests: None,
                    ..frame.counters
                },
                ..frame.clone()
            };
            assert_eq!(found(a), found(b), "{label}, frame {frame}");
            // Subtrees are pruned in a race, so these vary a little.
            for work in [|c: &Counters| c.rays, |c: &Counters| c.ray_box_tests] {
                let [a, b] = [&a.counters, &b.counters].map(work);
                assert_eq!(a.is_some(), b.is_some(), "{label}, frame {frame}");
                let [a, b] = [a, b].map(Option::unwrap_or_default);
                assert!(
                    a <= 2 * b + 64 && b <= 2 * a + 64,
                    "{label}, frame {frame}: {a} and {b}"
                );
            }
        }
    }
}

#[test]
fn every_covered_pixel_has_a_fragment() {
    if support::without_gpu() {
        return;
    }
    let contenders = METHODS
        .iter()
        .flat_map(|method| method.modes.iter().map(|mode| Contender::new(method, mode)))
        .collect::<Vec<_>>();
    let mut covered = Vec::new();
    let results = all_viewed(&contenders, &mut |view| {
        if view.frame == 2 {
            let items = view.image.items.iter();
            covered.push(items.filter(|&&id| id != hroc_format::NO_OBJECT).count() as u64);
        }
        Ok(())
    });
    covered.sort_unstable();
    let mut counted = Vec::new();
    for results in results.iter().flatten() {
        let overdraw = results.overdraw.as_ref().unwrap();
        assert!(
            overdraw.fragments >= overdraw.covered_pixels,
            "{}",
            results.label()
        );
        counted.push(overdraw.covered_pixels);
    }
    counted.sort_unstable();
    assert_eq!(counted, covered);
}

#[test]
fn every_stage_of_a_frame_is_timed_or_none_is() {
    if support::without_gpu() {
        return;
    }
    let gpu = Gpu::open(&GpuOptions::default()).unwrap();
    let clock = match GpuClock::choose(&gpu, ClockChoice::Gpu) {
        Ok(clock) => clock.unwrap(),
        Err(error) => return eprintln!("SKIPPED: {error}"),
    };
    let time = |count: usize| {
        let mut stages = GpuStageClock::new(&clock);
        let mut encoder = gpu.encoder();
        for _ in 0..count {
            stages.begin(Stage::DRAW_ALL, &mut encoder);
            stages.end(Stage::DRAW_ALL, &mut encoder);
        }
        stages.resolve(&mut encoder);
        gpu.submit_and_wait(encoder).unwrap();
        stages.read(&gpu).map(|(stages, _)| stages.len())
    };
    // Coherent culling has some 75 waves of three stages.
    let most = wgpu::QUERY_SET_MAX_QUERIES as usize / 2;
    assert_eq!([0, 225, most].map(time), [0, 225, most].map(Some));
    assert_eq!(time(most + 1), None);
}
