//! The shader of choose_threshold against its twin, on random counts and at their ends, and the twin against what
//! it is for: it comes to rest.

use hroc_runtime::readback;
use hroc_runtime::twin::extract_groups::choose_threshold;
use hroc_study::hard_cases::builder::Rng;
use hroc_tests::compute::{Kernel, storage};
use hroc_tests::gpu;

const BOX_COSTS: [f32; 4] = [0.0, 4.0, 256.0, 16384.0];
const ROUNDS: usize = 500;

/// Threshold, fragments, survivors; survivors are no more than fragments.
fn random_input(rng: &mut Rng) -> (f32, u32, u32) {
    let last_px = match rng.bits() % 8 {
        0 => 0.0,
        1 => 16.0,
        2 => 1e9,
        _ => rng.magnitude(16.0, 1e9) as f32,
    };
    let fragments = match rng.bits() % 8 {
        0 => 0,
        1 => 1,
        2 => u32::MAX,
        _ => rng.magnitude(1.0, 1e8) as u32,
    };
    let survivors = match rng.bits() % 4 {
        0 => 0,
        1 => fragments,
        _ => (f64::from(fragments) * rng.magnitude(1e-6, 1.0)) as u32,
    };
    (last_px, fragments, survivors)
}

#[test]
fn choose_threshold_agrees_with_its_twin() {
    let Some(gpu) = gpu() else { return };
    let wgsl = hroc_shaders::source("extract_groups").unwrap();
    let mut rng = Rng(1);
    let mut moved = 0;
    for box_cost in BOX_COSTS {
        let constants = [("BOX_COST", f64::from(box_cost))];
        let kernel = Kernel::new(gpu, &wgsl, "choose_threshold", &constants);
        for round in 0..ROUNDS {
            let (last_px, fragments, survivors) = random_input(&mut rng);
            let grouping = storage(gpu, &[last_px.to_bits(), fragments, survivors, 0]);
            kernel.run_on(gpu, &[(10, &grouping)], 1);
            let words = readback::words(&gpu.device, &gpu.queue, &grouping);
            let found = f32::from_bits(words[0]);
            let twin = choose_threshold(last_px, fragments, survivors, box_cost);
            let at = format!("cost {box_cost} round {round}: {last_px} {fragments} {survivors}");
            // Divisions and a root: a few ulps, or the other side of where it rests.
            let near = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-5;
            let wanted = box_cost / (2.0 * (survivors as f32 + 0.5) / fragments as f32);
            let rests_or_not = [0.5, 2.0].iter().any(|edge| near(wanted / last_px, *edge));
            assert!(near(found, twin) || rests_or_not, "{at}: {found} {twin}");
            // The counts are taken, for the next frame to count anew.
            assert_eq!(words[1..3], [0, 0], "{at}");
            moved += usize::from(twin != last_px);
        }
    }
    assert!(moved > ROUNDS, "only {moved} thresholds changed");
}

#[test]
fn the_threshold_comes_to_rest() {
    let mut rng = Rng(2);
    for _ in 0..10_000 {
        let (mut px, fragments, survivors) = random_input(&mut rng);
        // Halfway in ratio: within a factor of two of its aim after few steps, from anywhere in its range.
        for _ in 0..6 {
            px = choose_threshold(px, fragments, survivors, 256.0);
        }
        let rest = choose_threshold(px, fragments, survivors, 256.0);
        assert_eq!(px, rest, "{fragments} {survivors}");
    }
}
