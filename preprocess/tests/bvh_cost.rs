//! How good the trees are: against a sweep that tries every cut of every node, and one rule against
//! another.

mod boxes;

use hroc_format::{Bounds, Bvh};
use hroc_preprocess::{bvh, split, tree};

fn build(boxes: &[Bounds], rule: &str) -> Bvh {
    bvh::build(boxes, split::by_name(rule).unwrap()).unwrap()
}

#[derive(Clone, Copy)]
struct Box64 {
    min: [f64; 3],
    max: [f64; 3],
}

impl Box64 {
    const EMPTY: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    fn union(self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    fn area(&self) -> f64 {
        let [x, y, z] = std::array::from_fn(|axis| self.max[axis] - self.min[axis]);
        2.0 * (x * y + y * z + z * x)
    }

    fn centroid(&self, axis: usize) -> f64 {
        0.5 * (self.min[axis] + self.max[axis])
    }
}

/// Areas of the unions of the first 1, 2, ... boxes.
fn running_areas<'a>(boxes: impl Iterator<Item = &'a Box64>) -> Vec<f64> {
    let mut union = Box64::EMPTY;
    let grow = |next| {
        union = union.union(next);
        union.area()
    };
    boxes.map(grow).collect()
}

/// Sum of the areas of the nodes of the tree that a full sweep builds: in f64, sorted on every axis,
/// every cut tried.
fn full_sweep_area(boxes: &mut [Box64]) -> f64 {
    let count = boxes.len();
    let root = boxes
        .iter()
        .fold(Box64::EMPTY, |all, next| all.union(next))
        .area();
    if count == 1 {
        return root;
    }
    let mut best = (f64::INFINITY, 0, 0);
    for axis in 0..3 {
        boxes.sort_by(|a, b| a.centroid(axis).total_cmp(&b.centroid(axis)));
        let left = running_areas(boxes.iter());
        let right = running_areas(boxes.iter().rev());
        for cut in 1..count {
            let cost = left[cut - 1] * cut as f64 + right[count - cut - 1] * (count - cut) as f64;
            if cost < best.0 {
                best = (cost, axis, cut);
            }
        }
    }
    let (_, axis, cut) = best;
    boxes.sort_by(|a, b| a.centroid(axis).total_cmp(&b.centroid(axis)));
    let (left, right) = boxes.split_at_mut(cut);
    root + full_sweep_area(left) + full_sweep_area(right)
}

fn full_sweep_cost(boxes: &[Bounds]) -> f64 {
    let wide = |b: &Bounds| Box64 {
        min: b.min.map(f64::from),
        max: b.max.map(f64::from),
    };
    let mut boxes: Vec<_> = boxes.iter().map(wide).collect();
    let root = boxes
        .iter()
        .fold(Box64::EMPTY, |all, next| all.union(next))
        .area();
    full_sweep_area(&mut boxes) / root
}

#[test]
fn sah_costs_at_most_two_percent_more_than_a_full_sweep() {
    let scenes = [
        ("uniform", boxes::uniform(5000, 11)),
        ("clustered", boxes::clustered(5000, 12)),
        ("of all sizes", boxes::of_all_sizes(5000, 13)),
        ("sticks", boxes::sticks(5000, 14)),
        ("grid", boxes::grid(17)),
    ];
    for (kind, boxes) in scenes {
        let (cost, reference) = (build(&boxes, "sah").stats.sah_cost, full_sweep_cost(&boxes));
        assert!(
            cost <= 1.02 * reference,
            "{kind}: {cost} against {reference}"
        );
    }
}

#[test]
fn sah_costs_no_more_than_the_other_rules_on_clusters() {
    for seed in 0..4 {
        let boxes = boxes::clustered(5000, seed);
        let sah = build(&boxes, "sah").stats.sah_cost;
        for rule in split::RULES {
            let cost = build(&boxes, rule.name()).stats.sah_cost;
            assert!(
                sah <= cost,
                "seed {seed}: {} costs {cost}, sah {sah}",
                rule.name()
            );
        }
    }
}

#[test]
fn reinsertion_pays() {
    for seed in 0..4 {
        let boxes = boxes::clustered(5000, seed);
        let cost = |name: &str| {
            let tree = tree::by_name(name).unwrap().build(&boxes);
            tree.unwrap().stats.sah_cost
        };
        let (without, with) = (cost("ploc"), cost("ploc-reinsert"));
        assert!(
            with < without,
            "seed {seed}: {with} with, {without} without"
        );
    }
}
