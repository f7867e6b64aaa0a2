//! What is found out about a device at start is sane and comes out the same again.

use hroc_runtime::device::COARSEST_SUBPIXEL_STEP_PX;
use hroc_runtime::{DeviceProfile, EarlyZ, Submission};
use hroc_tests::gpu;

#[test]
fn the_subpixel_step_is_a_power_of_two_and_stays() {
    let Some(gpu) = gpu() else { return };
    let step = DeviceProfile::probe(&gpu.device, &gpu.queue).subpixel_step_px;
    eprintln!("{}: subpixel step 1/{} px", gpu.info.name, 1.0 / step);
    assert!(step > 0.0 && step <= COARSEST_SUBPIXEL_STEP_PX);
    assert_eq!(step.log2().fract(), 0.0);
    assert_eq!(step, gpu.profile.subpixel_step_px);
}

#[test]
fn a_box_costs_more_than_a_test() {
    let Some(gpu) = gpu() else { return };
    for early_z in EarlyZ::ALL {
        let profile = DeviceProfile {
            early_z,
            ..gpu.profile.clone()
        };
        if gpu.device.features().contains(profile.features()) {
            let cost = profile.measure_box_cost(&gpu.device, &gpu.queue);
            eprintln!(
                "{}: a box costs {cost} ray-box tests ({})",
                gpu.info.name,
                early_z.name()
            );
            assert!(cost > 1.0 && cost.is_finite());
        }
    }
}

/// The best path is taken, and one that the device lacks is known to be lacking.
#[test]
fn paths_are_chosen_by_features() {
    let all = wgpu::Features::MULTI_DRAW_INDIRECT_COUNT | wgpu::Features::SHADER_EARLY_DEPTH_TEST;
    let none = wgpu::Features::empty();
    assert_eq!(Submission::of(all), Submission::IndirectCount);
    assert_eq!(Submission::of(none), Submission::ZeroedTail);
    assert_eq!(EarlyZ::of(all), EarlyZ::Forced);
    assert_eq!(EarlyZ::of(none), EarlyZ::Sampled);
    let Some(gpu) = gpu() else { return };
    assert!(gpu.device.features().contains(gpu.profile.features()));
}
