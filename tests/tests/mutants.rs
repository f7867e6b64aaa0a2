//! Each safeguard is needed, and the tests notice where one is missing: HROC with one left out is wrong on some hard
//! case, or the shader's slab test misses a box. What caught which is printed (`make mutants`).

use hroc_runtime::{
    CullingMethod, DepthConvention, DeviceProfile, Grouping, Hroc, HrocMode, HrocOptions, Mutant,
    Noc,
};
use hroc_study::hard_cases::{CASES, CaseScene, HardCase, Scale};
use hroc_tests::gpu;
use hroc_tests::host::{Host, World, difference};
use hroc_tests::slab;

/// Where HROC with `mutant` first differs from no culling.
fn caught(mutant: Mutant) -> Option<String> {
    let gpu = gpu()?;
    let mut images = 0;
    for case in by_theme(mutant) {
        let scene = (case.make)(Scale::Small);
        for depth in DepthConvention::ALL {
            if let Some(found) = caught_by(mutant, case, &scene, depth, &mut images) {
                return Some(format!("{found}, after {images} images"));
            }
        }
    }
    let misses = slab::misses(gpu, mutant);
    (misses > 0).then(|| format!("slab test: {misses} of {} boxes missed", slab::CASES))
}

/// The cases in the order in which they are likely to tell.
fn by_theme(mutant: Mutant) -> Vec<&'static HardCase> {
    let first: &[&str] = match mutant {
        Mutant::None | Mutant::SlabWidening => &[],
        Mutant::Coverage => &["snapped-grid", "sub-pixel", "flat-and-tiny"],
        Mutant::DepthPadding => &["on-one-line", "ulp-layers", "coplanar"],
        Mutant::NearPlane => &["around-the-eye", "through-a-wall"],
        Mutant::Pruning => &["clutter", "rooms"],
        Mutant::NotFinite => &["on-one-line", "near-degenerate"],
        Mutant::Fallback => &["sudden-crowd", "teleports"],
    };
    let rank = |case: &&HardCase| first.iter().position(|name| *name == case.name);
    let mut cases = CASES.iter().collect::<Vec<_>>();
    cases.sort_by_key(|case| rank(case).unwrap_or(first.len()));
    // Cases can say nothing about what only the slab test's own rounding shows.
    if mutant == Mutant::SlabWidening {
        cases.clear();
    }
    cases
}

fn caught_by(
    mutant: Mutant,
    case: &HardCase,
    scene: &CaseScene,
    depth: DepthConvention,
    images: &mut usize,
) -> Option<String> {
    let gpu = gpu()?;
    let profile = DeviceProfile {
        mutant,
        ..gpu.profile.clone()
    };
    let mut world = World::of_case_on(gpu, &profile, scene);
    let mut host = Host::new(gpu, &world, Scale::Small.size(), depth);
    let mut noc = Noc::new(&gpu.device, &world.scene, depth);
    let make = |(mode, grouping)| {
        let options = HrocOptions {
            mode,
            depth,
            grouping,
            late_margin: 0.0,
            ..Default::default()
        };
        Hroc::new(&gpu.device, &world.scene, &world.trees[0], options)
    };
    let variants = [
        (HrocMode::Of, Grouping::Published),
        (HrocMode::CrLateExact, Grouping::Adaptive { box_cost: 64.0 }),
    ];
    let mut views = (0..scene.view_count())
        .map(|_| variants.map(make))
        .collect::<Vec<_>>();
    for (number, frame) in scene.frames.iter().enumerate() {
        world.advance(gpu, number);
        host.follow(&world);
        let truth = host.render_frame(&mut noc, frame);
        for (hroc, (mode, _)) in views[frame.view].iter_mut().zip(variants) {
            *images += 1;
            let found = difference(
                &truth,
                &host.render_frame(hroc as &mut dyn CullingMethod, frame),
            );
            if found.wrong_pixels + found.false_negatives > 0 {
                return Some(format!(
                    "case {}, {} depth, frame {number}, mode {}: {} wrong pixels, {} false negatives",
                    case.name,
                    depth.name(),
                    mode.name(),
                    found.wrong_pixels,
                    found.false_negatives
                ));
            }
        }
    }
    None
}

#[test]
fn every_mutant_is_caught() {
    if gpu().is_none() {
        return;
    }
    let mut survivors = Vec::new();
    for mutant in Mutant::ALL {
        let by = caught(mutant);
        eprintln!(
            "{:14} {}",
            mutant.name(),
            by.as_deref().unwrap_or("SURVIVES")
        );
        if by.is_none() {
            survivors.push(mutant.name());
        }
    }
    assert!(survivors.is_empty(), "not caught: {survivors:?}");
}

/// The harness does not cry wolf: with nothing left out, the cases that catch mutants and the slab test pass.
#[test]
fn nothing_left_out_is_not_caught() {
    let Some(gpu) = gpu() else { return };
    let mut images = 0;
    for mutant in Mutant::ALL {
        for case in by_theme(mutant).into_iter().take(2) {
            let scene = (case.make)(Scale::Small);
            for depth in DepthConvention::ALL {
                let found = caught_by(Mutant::None, case, &scene, depth, &mut images);
                assert_eq!(found, None);
            }
        }
    }
    assert_eq!(slab::misses(gpu, Mutant::None), 0);
}
