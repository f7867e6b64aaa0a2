//! Frames at random: every frame another camera, size, method and depth convention, histories kept from cut to
//! cut. Nothing may be wrong in any of them, and neither wgpu nor the driver may have anything to say.
//!
//! `HROC_CUTS` frames are drawn, a short run where it is not set. `make test-validation` draws 10,000 of them
//! under the Khronos validation layer and sets `HROC_VALIDATION=1`, which makes sure that the layer is heard.

use std::process::Command;

use glam::DVec3;
use hroc_runtime::{Camera, CullingMethod, DepthConvention, Noc, Projection};
use hroc_study::hard_cases::builder::{Rng, looking};
use hroc_study::hard_cases::{CaseFrame, Scale, case};
use hroc_tests::host::{Host, World, difference};
use hroc_tests::messages::LevelFilter;
use hroc_tests::variants::exact_methods;
use hroc_tests::{gpu, messages};

const DEFAULT_CUTS: usize = 400;
/// Scenes of at most 1,000 objects, each with another difficulty.
const SCENES: [&str; 6] = [
    "rooms",
    "clutter",
    "around-the-eye",
    "flat-and-tiny",
    "coplanar",
    "odd-transforms",
];
/// Largest side of an image, pixels.
const LARGEST_SIDE: f64 = 128.0;

/// A scene in one depth convention, with a method of every kind and its history.
struct View<'a> {
    name: String,
    world: &'a World,
    host: Host<'a>,
    noc: Noc,
    methods: Vec<(String, Box<dyn CullingMethod>)>,
}

#[test]
fn random_cuts_are_drawn_exactly_and_in_silence() {
    messages::listen(LevelFilter::Warn);
    let Some(gpu) = gpu() else { return };
    let cuts = std::env::var("HROC_CUTS").map_or(DEFAULT_CUTS, |cuts| {
        cuts.parse()
            .unwrap_or_else(|_| panic!("HROC_CUTS={cuts} is no number of frames"))
    });
    let worlds = SCENES.map(|name| {
        let scene = (case(name).unwrap().make)(Scale::Small);
        assert!(scene.source.objects.len() <= 1000, "{name}");
        World::of_case(gpu, &scene)
    });
    let mut views = Vec::new();
    for (name, world) in SCENES.iter().zip(&worlds) {
        for depth in DepthConvention::ALL {
            views.push(View {
                name: format!("{name} {depth:?}"),
                world,
                host: Host::new(gpu, world, Scale::Small.size(), depth),
                noc: Noc::new(&gpu.device, &world.scene, depth),
                methods: exact_methods(gpu, world, depth, views.len()),
            });
        }
    }
    let mut rng = Rng(2021);
    let mut failures = Vec::new();
    for number in 0..cuts {
        let pick = rng.bits() as usize % views.len();
        let view = &mut views[pick];
        let frame = random_frame(&mut rng, view.world);
        let pick = rng.bits() as usize % view.methods.len();
        let (name, method) = &mut view.methods[pick];
        if rng.bits().is_multiple_of(16) {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            method.reset(&mut encoder);
            gpu.queue.submit([encoder.finish()]);
        }
        let truth = view.host.render_frame(&mut view.noc, &frame);
        let found = difference(&truth, &view.host.render_frame(method.as_mut(), &frame));
        if found.wrong_pixels + found.false_negatives > 0 {
            failures.push(format!(
                "cut {number}, {} by {name}: {found:?}\n{frame:?}",
                view.name
            ));
        }
    }
    gpu.check().unwrap();
    let told = messages::telling();
    assert!(
        failures.is_empty(),
        "{} of {cuts} frames are wrong:\n{}",
        failures.len(),
        failures.join("\n")
    );
    assert!(
        told.is_empty(),
        "{} messages in {cuts} frames:\n{}",
        told.len(),
        told.join("\n")
    );
    eprintln!(
        "{cuts} cuts on {}: nothing wrong, nothing said",
        gpu.info.name
    );
}

/// A camera anywhere in and about the scene, turned any way, into an image of any size.
fn random_frame(rng: &mut Rng, world: &World) -> CaseFrame {
    let shape = &world.scene.shape;
    let position = shape.origin + rng.point(1.0) * shape.radius * rng.magnitude(0.05, 1.5);
    let mut side = || rng.magnitude(1.0, LARGEST_SIDE + 1.0) as u32;
    let size = [side(), side()];
    let perspective = !rng.bits().is_multiple_of(4);
    let near = rng.magnitude(1e-3, 0.5);
    let far = near + rng.magnitude(0.1, 4.0) * shape.radius;
    CaseFrame {
        camera: Camera {
            orientation: rng.rotation(),
            projection: if perspective {
                Projection::Perspective {
                    fov_y_rad: rng.within(0.1, 3.0),
                }
            } else {
                Projection::Orthographic {
                    half_height: shape.radius * rng.magnitude(0.05, 1.5),
                }
            },
            near,
            far: rng.bits().is_multiple_of(2).then_some(far),
            ..looking(position, position + DVec3::NEG_Z)
        },
        size: Some(size),
        view: 0,
    }
}

/// Silence proves nothing if nobody could be heard: asked for its advice on good practice, the layer talks.
#[test]
fn the_validation_layer_is_heard() {
    if std::env::var_os("HROC_VALIDATION").is_none_or(|value| value != "1") {
        eprintln!("SKIPPED: HROC_VALIDATION=1 is not set, frames are drawn without the layer");
        return;
    }
    let heard = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "print_messages", "--ignored", "--nocapture"])
        .env("HROC_CUTS", "1")
        .env(
            "VK_LAYER_ENABLES",
            "VK_VALIDATION_FEATURE_ENABLE_BEST_PRACTICES_EXT",
        )
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&heard.stderr);
    assert!(
        text.contains("BestPractices"),
        "VK_LAYER_KHRONOS_validation says nothing: is it in VK_LAYER_PATH, are WGPU_VALIDATION and WGPU_DEBUG set?\n{text}"
    );
}

/// What a child process of the test above runs.
#[test]
#[ignore = "prints for the_validation_layer_is_heard"]
fn print_messages() {
    messages::listen(LevelFilter::Warn);
    let Some(gpu) = gpu() else { return };
    let world = World::of_case(gpu, &(case(SCENES[0]).unwrap().make)(Scale::Small));
    let depth = DepthConvention::Reversed;
    let mut host = Host::new(gpu, &world, Scale::Small.size(), depth);
    let frame = random_frame(&mut Rng(1), &world);
    host.render_frame(&mut Noc::new(&gpu.device, &world.scene, depth), &frame);
    for message in messages::all() {
        eprintln!("{message}");
    }
}
