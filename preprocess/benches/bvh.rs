//! Builds trees over the same boxes with every split rule and with obvhs's PLOC presets, at the
//! object counts of the four scenes of the HROC paper. Prints the SAH cost of each tree, since time
//! alone says nothing. `HROC_BENCH_LARGE=1` adds a million objects, `RAYON_NUM_THREADS` sets the
//! threads of our builder (obvhs runs on one).

use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion};
use hroc_format::Bounds;
use hroc_preprocess::bvh;
use hroc_preprocess::generate::Rng;
use hroc_preprocess::split::{self, SplitRule};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

const COUNTS: [usize; 4] = [7_437, 46_600, 73_812, 120_000];
const LARGE_COUNT: usize = 1_000_000;

/// Boxes of very different size in clusters: half of them around 64 centres, half anywhere.
fn boxes(count: usize) -> Vec<Bounds> {
    let mut rng = Rng::new(count as u64);
    let point = |rng: &mut Rng, radius: f32| -> [f32; 3] {
        std::array::from_fn(|_| rng.within(-radius..radius))
    };
    let centres: Vec<_> = (0..64).map(|_| point(&mut rng, 1000.0)).collect();
    (0..count)
        .map(|i| {
            let centre = if i % 2 == 0 {
                let (around, offset) = (centres[rng.below(centres.len())], point(&mut rng, 40.0));
                std::array::from_fn(|axis| around[axis] + offset[axis])
            } else {
                point(&mut rng, 1000.0)
            };
            let size = 10_f32.powf(rng.within(-2.0..1.0));
            let half: [f32; 3] = std::array::from_fn(|_| size * rng.within(0.2..1.2));
            Bounds {
                min: std::array::from_fn(|axis| centre[axis] - half[axis]),
                max: std::array::from_fn(|axis| centre[axis] + half[axis]),
            }
        })
        .collect()
}

fn ploc_presets() -> BTreeMap<&'static str, BvhBuildParams> {
    let presets = [
        ("ploc-fastest", BvhBuildParams::fastest_build()),
        ("ploc-fast", BvhBuildParams::fast_build()),
        ("ploc-medium", BvhBuildParams::medium_build()),
        ("ploc-slow", BvhBuildParams::slow_build()),
    ];
    presets
        .map(|(name, params)| {
            (
                name,
                BvhBuildParams {
                    max_prims_per_leaf: 1,
                    ..params
                },
            )
        })
        .into()
}

fn build_ploc(boxes: &[Aabb], params: BvhBuildParams) -> Bvh2 {
    build_bvh2(boxes, params, &mut Duration::default())
}

/// The SAH cost as [`hroc_format::BvhStats`] defines it.
fn ploc_cost(tree: &Bvh2) -> f64 {
    let areas = tree
        .nodes
        .iter()
        .map(|node| f64::from(node.aabb().half_area()));
    areas.sum::<f64>() / f64::from(tree.nodes[0].aabb().half_area())
}

fn build_ours(boxes: &[Bounds], rule: &dyn SplitRule) -> hroc_format::Bvh {
    bvh::build(boxes, rule).expect("the boxes are finite")
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args().sample_size(10);
    let large = std::env::var_os("HROC_BENCH_LARGE").map(|_| LARGE_COUNT);
    for count in COUNTS.into_iter().chain(large) {
        let boxes = boxes(count);
        let obvhs_boxes: Vec<Aabb> = boxes
            .iter()
            .map(|b| Aabb::new(b.min.into(), b.max.into()))
            .collect();
        let mut group = criterion.benchmark_group("bvh");
        for rule in split::RULES {
            eprintln!(
                "{count} {}: SAH cost {:.2}",
                rule.name(),
                build_ours(&boxes, *rule).stats.sah_cost
            );
            group.bench_with_input(
                BenchmarkId::new(rule.name(), count),
                &boxes,
                |bencher, boxes| {
                    bencher.iter(|| build_ours(black_box(boxes), *rule));
                },
            );
        }
        for (name, params) in ploc_presets() {
            eprintln!(
                "{count} {name}: SAH cost {:.2}",
                ploc_cost(&build_ploc(&obvhs_boxes, params))
            );
            group.bench_with_input(
                BenchmarkId::new(name, count),
                &obvhs_boxes,
                |bencher, boxes| {
                    bencher.iter(|| build_ploc(black_box(boxes), params));
                },
            );
        }
        group.finish();
    }
    // The worst case for a builder without a depth bound: nothing to cut by.
    let identical = vec![
        Bounds {
            min: [0.0; 3],
            max: [1.0; 3]
        };
        LARGE_COUNT
    ];
    let mut group = criterion.benchmark_group("bvh-identical");
    for rule in split::RULES {
        group.bench_with_input(
            BenchmarkId::new(rule.name(), LARGE_COUNT),
            &identical,
            |bencher, boxes| {
                bencher.iter(|| build_ours(black_box(boxes), *rule));
            },
        );
    }
    group.finish();
    criterion.final_summary();
}
