//! What is reported where `hroc_keeps` is wrong: no culling, judged with one of its safeguards left out.

use hroc_runtime::{DepthConvention, Mutant};
use hroc_study::hard_cases::{HardCase, Scale, case};
use hroc_study::unculled::{Fault, FaultKind};
use hroc_tests::host::World;
use hroc_tests::no_culling::{NoCulling, Sums};
use hroc_tests::{Gpu, gpu};

/// All frames of a case, and the first fault.
fn judged(
    gpu: &Gpu,
    case: &HardCase,
    depth: DepthConvention,
    mutant: Mutant,
) -> (Sums, Option<Fault>) {
    let scene = (case.make)(Scale::Small);
    let mut world = World::of_case(gpu, &scene);
    let size = Scale::Small.size();
    let mut no_culling = NoCulling::with_mutant(gpu, &world, size, depth, mutant);
    let (mut sums, mut fault) = (Sums::default(), None);
    for (number, frame) in scene.frames.iter().enumerate() {
        world.advance(gpu, number);
        let (judgement, ..) = no_culling.judge(&world, frame);
        sums.add(judgement);
        fault = fault.or(judgement.first_fault);
    }
    (sums, fault)
}

/// Without their padding, bounds lose fragments on their own faces. The truth and every method lose the same ones, so
/// that no comparison of the two can tell.
#[test]
fn a_true_fragment_that_is_removed_is_told() {
    let Some(gpu) = gpu() else { return };
    for name in ["snapped-grid", "edge-rays", "narrow-gaps"] {
        let case = case(name).unwrap();
        for depth in DepthConvention::ALL {
            let (sums, fault) = judged(gpu, case, depth, Mutant::Coverage);
            assert!(sums.removed.true_ > 0, "{name} {depth:?}: {sums:?}");
            assert_eq!(fault.unwrap().kind, FaultKind::TrueRemoved);
            let (sums, fault) = judged(gpu, case, depth, Mutant::None);
            assert_eq!((sums.removed.true_, fault), (0, None), "{name} {depth:?}");
        }
    }
}

/// Without the guard of depths, fragments without a finite depth stay; with it, they are removed and told apart from
/// other strays. Only a rasterizer that makes such fragments can show it.
#[test]
fn a_fragment_without_a_finite_depth_is_told() {
    let Some(gpu) = gpu() else { return };
    let (mut unguarded, mut guarded) = (Sums::default(), Sums::default());
    for name in ["degenerate", "near-degenerate", "one-pixel"] {
        let case = case(name).unwrap();
        for depth in DepthConvention::ALL {
            let (sums, fault) = judged(gpu, case, depth, Mutant::NotFinite);
            assert_eq!(fault.is_some(), sums.kept_strays > 0);
            assert_eq!(sums.removed.true_, 0);
            unguarded.kept_strays += sums.kept_strays;
            unguarded.strays += sums.strays;
            let (sums, fault) = judged(gpu, case, depth, Mutant::None);
            assert_eq!((sums.removed.true_, sums.kept_strays, fault), (0, 0, None));
            guarded.removed += sums.removed;
            guarded.strays += sums.strays;
        }
    }
    eprintln!("without the guard {unguarded:?}, with it {guarded:?}");
    assert_eq!(
        unguarded.strays, guarded.strays,
        "the image without the snippet"
    );
    if gpu.info.name.contains("llvmpipe") {
        assert!(unguarded.kept_strays > 0 && guarded.removed.not_finite > 0);
        // Slivers among them have finite depths far from where they are.
        assert!(guarded.removed.stray > 0);
    }
}
