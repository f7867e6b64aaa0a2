//! What the methods that ask by occlusion queries promise of their work, on a device of given times.

use hroc_methods::{ChcOptions, CoherentCulling, HardwareTimes, NearOptimalCulling};
use hroc_runtime::{CullingMethod, DepthConvention, QueryCounts};
use hroc_study::hard_cases::{CASES, CaseScene, Scale};
use hroc_tests::gpu;
use hroc_tests::host::{Host, World};

const SIZE: [u32; 2] = [160, 90];
const DEPTH: DepthConvention = DepthConvention::Reversed;
/// Triangles of a box.
const BOX: f64 = 12.0;

/// A hardware GPU as in the paper's Table 2, and a software rasterizer: milliseconds.
const DEVICES: [HardwareTimes; 2] = [
    HardwareTimes {
        draw_ms: 5e-3,
        triangle_ms: 1e-5,
        fragment_ms: 5e-7,
        query_ms: 5e-3,
        query_fragment_ms: 5e-7,
        query_latency_ms: 0.1,
        query_overhead_ms: 1e-3,
    },
    HardwareTimes {
        draw_ms: 2e-4,
        triangle_ms: 4.5e-4,
        fragment_ms: 1.3e-6,
        query_ms: 3.7e-2,
        query_fragment_ms: 1.4e-6,
        query_latency_ms: 0.4,
        query_overhead_ms: 3.1e-2,
    },
];

fn case(name: &str) -> CaseScene {
    let case = CASES.iter().find(|case| case.name == name).unwrap();
    (case.make)(Scale::Small)
}

/// Draws of all frames, and questions.
fn work(world: &World, scene: &CaseScene, method: &mut dyn CullingMethod) -> (usize, QueryCounts) {
    let host = Host::new(gpu().unwrap(), world, SIZE, DEPTH);
    let mut sum = QueryCounts::default();
    let mut draws = 0;
    for frame in &scene.frames {
        draws += host.render(method, &frame.camera).pvs().len();
        let counts = method.queries().unwrap();
        sum.queries += counts.queries;
        sum.wasted += counts.wasted;
        sum.waits += counts.waits;
        sum.boxes += counts.boxes;
    }
    (draws, sum)
}

fn chc(world: &World, options: ChcOptions) -> CoherentCulling {
    let (device, baked) = (&gpu().unwrap().device, world.baked.scene());
    CoherentCulling::new(device, &world.scene, baked, &world.trees[0], DEPTH, options)
}

fn nohc(world: &World, hardware: HardwareTimes) -> NearOptimalCulling {
    let (device, baked) = (&gpu().unwrap().device, world.baked.scene());
    NearOptimalCulling::new(
        device,
        &world.scene,
        baked,
        &world.trees[0],
        DEPTH,
        hardware,
    )
}

/// Milliseconds on a device of these times, fragments left out: they are the same.
fn modelled_ms(hardware: &HardwareTimes, draws: usize, counts: &QueryCounts) -> f64 {
    draws as f64 * (hardware.draw_ms + BOX * hardware.triangle_ms)
        + f64::from(counts.queries) * hardware.query_ms
        + f64::from(counts.waits) * hardware.query_latency_ms
}

#[test]
fn nohc_takes_no_longer_than_frustum_culling_where_nothing_is_hidden() {
    let Some(gpu) = gpu() else { return };
    let scene = case("everything-visible");
    let world = World::of_case(gpu, &scene);
    let all = world.scene.shape.object_count as usize * scene.frames.len();
    for hardware in DEVICES {
        let (draws, counts) = work(&world, &scene, &mut nohc(&world, hardware));
        assert!(draws <= all, "{draws} of {all}");
        let ms = modelled_ms(&hardware, draws, &counts);
        let frustum_ms = modelled_ms(&hardware, all, &QueryCounts::default());
        assert!(
            ms <= 1.05 * frustum_ms,
            "{ms:.2} ms, frustum culling {frustum_ms:.2} ms: {draws} draws, {counts:?}"
        );
    }
}

#[test]
fn where_much_is_hidden_chc_plus_plus_asks_less_than_chc_and_nohc_in_vain_less_often() {
    let Some(gpu) = gpu() else { return };
    let mut waits = [0; 2];
    for name in ["clutter", "rooms", "still-camera"] {
        let scene = case(name);
        let world = World::of_case(gpu, &scene);
        let (_, plain) = work(&world, &scene, &mut chc(&world, ChcOptions::CHC));
        let (_, plus) = work(&world, &scene, &mut chc(&world, ChcOptions::CHC_PLUS_PLUS));
        assert!(
            plus.queries < plain.queries,
            "{name}: CHC {plain:?}, CHC++ {plus:?}"
        );
        assert!(
            plus.waits <= plain.waits,
            "{name}: CHC {plain:?}, CHC++ {plus:?}"
        );
        waits[0] += plain.waits;
        waits[1] += plus.waits;
        for hardware in DEVICES {
            let (_, counts) = work(&world, &scene, &mut nohc(&world, hardware));
            assert!(
                counts.wasted <= plain.wasted,
                "{name}: CHC {plain:?}, NOHC {counts:?}"
            );
        }
    }
    assert!(waits[1] < waits[0], "waits of CHC, CHC++: {waits:?}");
}
