//! Tree builders over the same boxes, at the object counts of the four scenes of the HROC paper and a million. Time
//! alone says nothing: beside it stands the SAH cost, both constants 1, leaf size 1.

use crate::{Contender, measure};
use bvh::bounding_hierarchy::BHShape;
use hroc_format::Bounds;
use hroc_preprocess::generate::Rng;
use hroc_preprocess::{bvh as ours, split};
use nalgebra::Point3;
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2;
use parry3d::partitioning::{Bvh as ParryBvh, BvhBuildStrategy, TraversalAction};
use std::hint::black_box;
use std::time::Duration;

const COUNTS: [usize; 5] = [7_437, 46_600, 73_812, 120_000, 1_000_000];

/// Boxes of very different size: half of them around 64 centres, half anywhere. As in `benches/bvh.rs`.
fn boxes(count: usize) -> Vec<Bounds> {
    let mut rng = Rng::new(count as u64);
    let point = |rng: &mut Rng, radius: f32| -> [f32; 3] {
        std::array::from_fn(|_| rng.within(-radius..radius))
    };
    let centres: Vec<_> = (0..64).map(|_| point(&mut rng, 1000.0)).collect();
    let any = |i: usize| {
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
    };
    (0..count).map(any).collect()
}

/// Prints the table, with counts up to `max`.
pub fn table(max: usize) {
    let threads = rayon::current_num_threads();
    println!(
        "| objects | builder | threads | median ms | least ms | SAH cost |\n|---|---|---|---|---|---|"
    );
    for count in COUNTS.into_iter().filter(|&count| count <= max) {
        let boxes = boxes(count);
        let (mut contenders, costs) = contenders(&boxes, threads);
        let rounds = if count > 200_000 { 3 } else { 11 };
        let times = measure(&mut contenders, rounds);
        for ((contender, cost), [median, least]) in contenders.iter().zip(costs).zip(times) {
            println!(
                "| {count} | {} | {median:.1} | {least:.1} | {cost:.2} |",
                contender.name
            );
        }
        if count <= 120_000 {
            println!(
                "| {count} | full sweep, f64 (reference) | 1 | | | {:.2} |",
                sweep_cost(&boxes)
            );
        }
    }
}

/// Every builder, with what its tree costs.
fn contenders(boxes: &[Bounds], threads: usize) -> (Vec<Contender<'_>>, Vec<f64>) {
    let (mut all, mut costs) = (Vec::new(), Vec::new());
    for rule in split::RULES {
        for threads in [1, threads] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.expect("threads");
            costs.push(
                ours::build(boxes, *rule)
                    .expect("good boxes")
                    .stats
                    .sah_cost,
            );
            all.push(Contender {
                name: format!("hroc {} | {threads}", rule.name()),
                run: Box::new(move || {
                    pool.install(|| {
                        drop(black_box(ours::build(boxes, *rule).expect("good boxes")))
                    });
                }),
            });
        }
    }
    let presets = [
        ("fastest", BvhBuildParams::fastest_build()),
        ("fast", BvhBuildParams::fast_build()),
        ("medium", BvhBuildParams::medium_build()),
        ("slow", BvhBuildParams::slow_build()),
    ];
    for (name, params) in presets {
        let params = BvhBuildParams {
            max_prims_per_leaf: 1,
            ..params
        };
        let aabb = |b: &Bounds| obvhs::aabb::Aabb::new(b.min.into(), b.max.into());
        let aabbs: Vec<_> = boxes.iter().map(aabb).collect();
        let tree = build_bvh2(&aabbs, params, &mut Duration::default());
        let areas = tree
            .nodes
            .iter()
            .map(|node| f64::from(node.aabb().half_area()));
        costs.push(areas.sum::<f64>() / f64::from(tree.nodes[0].aabb().half_area()));
        all.push(Contender {
            name: format!("obvhs PLOC {name} | 1"),
            run: Box::new(move || {
                black_box(build_bvh2(&aabbs, params, &mut Duration::default()));
            }),
        });
    }
    for (name, strategy) in [
        ("binned", BvhBuildStrategy::Binned),
        ("PLOC", BvhBuildStrategy::Ploc),
    ] {
        let aabb = |b: &Bounds| parry3d::bounding_volume::Aabb {
            mins: b.min.into(),
            maxs: b.max.into(),
        };
        let leaves: Vec<_> = boxes.iter().map(aabb).collect();
        let tree = ParryBvh::from_leaves(strategy, &leaves);
        let root = f64::from(tree.root_aabb().half_area());
        let mut area = root;
        tree.traverse(|node| {
            area += f64::from(node.aabb().half_area());
            TraversalAction::Continue
        });
        costs.push(area / root);
        all.push(Contender {
            name: format!("parry3d {name} | 1"),
            run: Box::new(move || {
                black_box(ParryBvh::from_leaves(strategy, &leaves));
            }),
        });
    }
    let shapes: Vec<Shape> = boxes
        .iter()
        .map(|&bounds| Shape { bounds, node: 0 })
        .collect();
    costs.push(bvh_cost(&bvh::bvh::Bvh::build(&mut shapes.clone()), boxes));
    all.push(Contender {
        name: "bvh | 1".into(),
        run: Box::new(move || {
            black_box(bvh::bvh::Bvh::build(&mut shapes.clone()));
        }),
    });
    (all, costs)
}

/// A box as the `bvh` crate wants it.
#[derive(Clone)]
struct Shape {
    bounds: Bounds,
    node: usize,
}

impl bvh::aabb::Bounded<f32, 3> for Shape {
    fn aabb(&self) -> bvh::aabb::Aabb<f32, 3> {
        bvh::aabb::Aabb::with_bounds(Point3::from(self.bounds.min), Point3::from(self.bounds.max))
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

fn bvh_cost(tree: &bvh::bvh::Bvh<f32, 3>, boxes: &[Bounds]) -> f64 {
    let half = |min: [f32; 3], max: [f32; 3]| {
        Box64 {
            min: min.map(f64::from),
            max: max.map(f64::from),
        }
        .half_area()
    };
    let root = boxes
        .iter()
        .map(Box64::of)
        .reduce(Box64::union)
        .map_or(1.0, |b| b.half_area());
    let mut area = root;
    for node in &tree.nodes {
        if let bvh::bvh::BvhNode::Node {
            child_l_aabb: l,
            child_r_aabb: r,
            ..
        } = node
        {
            for child in [l, r] {
                area += half(child.min.into(), child.max.into());
            }
        }
    }
    area / root
}

#[derive(Clone, Copy)]
struct Box64 {
    min: [f64; 3],
    max: [f64; 3],
}

impl Box64 {
    fn of(b: &Bounds) -> Self {
        Self {
            min: b.min.map(f64::from),
            max: b.max.map(f64::from),
        }
    }

    fn union(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    fn half_area(&self) -> f64 {
        let [x, y, z] = std::array::from_fn(|axis| self.max[axis] - self.min[axis]);
        x * y + y * z + z * x
    }
}

/// The SAH cost of the tree of a full sweep: every cut of every node on every axis tried, in f64.
fn sweep_cost(boxes: &[Bounds]) -> f64 {
    let mut boxes: Vec<Box64> = boxes.iter().map(Box64::of).collect();
    let root = boxes
        .iter()
        .copied()
        .reduce(Box64::union)
        .map_or(1.0, |b| b.half_area());
    let mut area = 0.0;
    let mut waiting = vec![boxes.as_mut_slice()];
    while let Some(node) = waiting.pop() {
        area += node
            .iter()
            .copied()
            .reduce(Box64::union)
            .map_or(0.0, |b| b.half_area());
        if node.len() < 2 {
            continue;
        }
        let by = |axis: usize| {
            move |a: &Box64, b: &Box64| {
                (a.min[axis] + a.max[axis]).total_cmp(&(b.min[axis] + b.max[axis]))
            }
        };
        let (mut best, mut cut) = (f64::INFINITY, (0, 1));
        for axis in 0..3 {
            node.sort_by(by(axis));
            let running = |boxes: &mut dyn Iterator<Item = &Box64>| -> Vec<f64> {
                let mut union: Option<Box64> = None;
                boxes
                    .map(|next| {
                        union
                            .insert(union.map_or(*next, |all| all.union(*next)))
                            .half_area()
                    })
                    .collect()
            };
            let (left, right) = (running(&mut node.iter()), running(&mut node.iter().rev()));
            for count in 1..node.len() {
                let rest = node.len() - count;
                let cost = left[count - 1] * count as f64 + right[rest - 1] * rest as f64;
                if cost < best {
                    (best, cut) = (cost, (axis, count));
                }
            }
        }
        node.sort_by(by(cut.0));
        let (left, right) = node.split_at_mut(cut.1);
        waiting.extend([left, right]);
    }
    area / root
}
