//! Every builder in the registry over boxes of every kind: the tree is well formed, its depth is
//! bounded, it does not depend on the number of threads, and obvhs agrees that it is a tree.

mod boxes;

use hroc_format::{Bounds, Bvh};
use hroc_preprocess::bvh::{self, BuildError};
use hroc_preprocess::split;
use hroc_preprocess::tree::{self, TreeBuilder};
use proptest::prelude::*;

fn build(boxes: &[Bounds], builder: &dyn TreeBuilder) -> Bvh {
    let tree = builder.build(boxes);
    tree.unwrap_or_else(|error| panic!("{}: {error}", builder.name()))
}

fn union(a: Bounds, b: Bounds) -> Bounds {
    Bounds {
        min: std::array::from_fn(|axis| a.min[axis].min(b.min[axis])),
        max: std::array::from_fn(|axis| a.max[axis].max(b.max[axis])),
    }
}

/// Checks everything that `hroc_format` promises about a tree, and the depth bound.
fn check(tree: &Bvh, boxes: &[Bounds], case: &str) {
    let nodes = &tree.nodes;
    assert_eq!(nodes.len(), 2 * boxes.len() - 1, "{case}");
    assert_eq!(tree.parents.len(), nodes.len(), "{case}");
    assert_eq!(tree.leaf_of_object.len(), boxes.len(), "{case}");
    assert_eq!(tree.parents[0], 0, "{case}");
    assert_eq!(nodes[0].skip as usize, nodes.len(), "{case}");
    let mut seen = vec![false; boxes.len()];
    let mut depths = vec![0; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        if i > 0 {
            depths[i] = depths[tree.parents[i] as usize] + 1;
        }
        let bounds = Bounds {
            min: node.min,
            max: node.max,
        };
        let Some(object) = node.object() else {
            let left = i + 1;
            let right = nodes[left].skip as usize;
            assert_eq!(
                nodes[right].skip, node.skip,
                "{case}: children of node {i} fill it"
            );
            assert_eq!(tree.parents[left] as usize, i, "{case}");
            assert_eq!(tree.parents[right] as usize, i, "{case}");
            let [left, right] = [left, right].map(|child| Bounds {
                min: nodes[child].min,
                max: nodes[child].max,
            });
            assert_eq!(
                bounds,
                union(left, right),
                "{case}: node {i} is the union of its children"
            );
            continue;
        };
        let object = object as usize;
        assert_eq!(node.skip as usize, i + 1, "{case}");
        assert!(
            !std::mem::replace(&mut seen[object], true),
            "{case}: object {object} twice"
        );
        assert_eq!(tree.leaf_of_object[object] as usize, i, "{case}");
        let bits = |b: Bounds| [b.min, b.max].map(|corner| corner.map(f32::to_bits));
        assert_eq!(
            bits(bounds),
            bits(boxes[object]),
            "{case}: bounds of object {object}"
        );
    }
    assert!(
        seen.iter().all(|&seen| seen),
        "{case}: an object is missing"
    );
    let depth = depths.iter().copied().max().unwrap();
    assert!(
        depth <= bvh::max_depth(boxes.len()),
        "{case}: depth {depth}"
    );
    assert_eq!(tree.stats.depth, depth, "{case}");
    let leaf_depths: f64 = tree
        .leaf_of_object
        .iter()
        .map(|&i| f64::from(depths[i as usize]))
        .sum();
    let mean = leaf_depths / boxes.len() as f64;
    assert!(
        (tree.stats.mean_leaf_depth - mean).abs() <= 1e-9 * mean,
        "{case}"
    );
    assert!(
        tree.stats.sah_cost.is_finite() && tree.stats.sah_cost >= 1.0,
        "{case}"
    );
    assert!(
        tree.stats.overlap.is_finite() && tree.stats.overlap >= 0.0,
        "{case}"
    );
}

#[test]
fn trees_are_well_formed_over_boxes_of_every_kind() {
    for (kind, boxes) in boxes::all_kinds() {
        for builder in tree::builders() {
            let tree = build(&boxes, builder);
            assert_eq!(tree.split, builder.name());
            check(&tree, &boxes, &format!("{kind}, {}", builder.name()));
        }
    }
}

#[test]
fn trees_do_not_depend_on_the_number_of_threads() {
    // Large enough that the top of the tree is built in parallel.
    let boxes = boxes::clustered(40_000, 3);
    for builder in tree::builders() {
        let trees = [1, 2, 16].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| build(&boxes, builder))
        });
        assert!(
            trees[0] == trees[1] && trees[0] == trees[2],
            "{}",
            builder.name()
        );
    }
}

#[test]
fn a_million_identical_boxes_make_a_balanced_tree() {
    let boxes = vec![
        Bounds {
            min: [1.0; 3],
            max: [2.0; 3]
        };
        1 << 20
    ];
    for builder in tree::builders() {
        assert_eq!(build(&boxes, builder).stats.depth, 20, "{}", builder.name());
    }
}

#[test]
fn stats_of_a_tree_known_by_hand() {
    // Two unit cubes that share a quarter-length slab: the root is 1.75 x 1 x 1.
    let cube = |x: f32| Bounds {
        min: [x, 0.0, 0.0],
        max: [x + 1.0, 1.0, 1.0],
    };
    for builder in tree::builders() {
        let stats = build(&[cube(0.0), cube(0.75)], builder).stats;
        let root = 2.0 * (1.75 + 1.75 + 1.0);
        assert_eq!(stats.depth, 1);
        assert_eq!(stats.mean_leaf_depth, 1.0);
        assert!((stats.sah_cost - (1.0 + 12.0 / root)).abs() < 1e-12);
        assert!((stats.overlap - 2.0 * (0.25 + 0.25 + 1.0) / root).abs() < 1e-12);
    }
}

#[test]
fn what_is_no_box_is_refused_by_name() {
    let good = Bounds {
        min: [0.0; 3],
        max: [1.0; 3],
    };
    let nan = Bounds {
        min: [0.0, f32::NAN, 0.0],
        max: [1.0; 3],
    };
    let infinite = Bounds {
        min: [0.0; 3],
        max: [1.0, 1.0, f32::INFINITY],
    };
    let inverted = Bounds {
        min: [0.0, 2.0, 0.0],
        max: [1.0; 3],
    };
    for builder in tree::builders() {
        assert_eq!(builder.build(&[]).unwrap_err(), BuildError::NoObjects);
        for bad in [nan, infinite] {
            let error = builder.build(&[good, good, bad]).unwrap_err();
            assert!(
                matches!(error, BuildError::NotFinite { object: 2, .. }),
                "{error}"
            );
            assert!(error.to_string().contains("object 2"));
        }
        let error = builder.build(&[good, inverted, good]).unwrap_err();
        assert!(
            matches!(error, BuildError::Inverted { object: 1, .. }),
            "{error}"
        );
    }
}

#[test]
fn builders_have_distinct_names_and_are_found_by_them() {
    for (i, builder) in tree::builders().enumerate() {
        let found = tree::by_name(builder.name()).map(TreeBuilder::name);
        assert_eq!(found, Some(builder.name()));
        assert!(!builder.describe().is_empty());
        let mut before = tree::builders().take(i);
        assert!(before.all(|other| other.name() != builder.name()));
    }
    assert!(tree::by_name("no such builder").is_none());
}

#[test]
fn every_split_rule_is_a_builder_and_baked_unasked() {
    let rules: Vec<_> = split::RULES.iter().map(|rule| rule.name()).collect();
    let baked: Vec<_> = tree::baked_by_default().map(TreeBuilder::name).collect();
    assert_eq!(baked, rules);
}

/// Clusters of equal boxes among others: what clustering from the leaves up handles worst.
#[test]
fn many_equal_boxes_among_others_make_a_shallow_tree() {
    let mut boxes = boxes::uniform(20_000, 21);
    for i in 0..40 {
        let copied = boxes[i];
        boxes.extend([copied; 500]);
    }
    for builder in tree::builders() {
        check(&build(&boxes, builder), &boxes, builder.name());
    }
}

#[test]
fn a_sequence_gives_its_tree_unless_that_is_too_deep() {
    let boxes = boxes::uniform(4, 22);
    let sequence = [None, Some(2), None, None, Some(0), Some(3), Some(1)];
    let tree = bvh::from_depth_first(&boxes, "by hand", &sequence);
    check(&tree, &boxes, "by hand");
    assert_eq!(tree.split, "by hand");
    assert!(tree.nodes.iter().map(|node| node.object()).eq(sequence));

    // A comb: each inner node has a leaf and the rest.
    let boxes = boxes::uniform(1000, 23);
    let mut comb: Vec<_> = (0..999).flat_map(|i| [None, Some(i)]).collect();
    comb.push(Some(999));
    check(
        &bvh::from_depth_first(&boxes, "comb", &comb),
        &boxes,
        "comb",
    );
}

/// The same tree in obvhs's layout: siblings side by side, root first.
fn to_obvhs(tree: &Bvh) -> obvhs::bvh2::Bvh2 {
    use obvhs::bvh2::node::Bvh2Node;
    let aabb = |i: usize| {
        let node = &tree.nodes[i];
        obvhs::aabb::Aabb::new(node.min.into(), node.max.into())
    };
    let mut nodes = vec![Bvh2Node::new(aabb(0), 0, 0)];
    let mut primitive_indices = Vec::new();
    let mut ours = vec![0];
    let mut i = 0;
    while i < nodes.len() {
        let node = &tree.nodes[ours[i]];
        let Some(object) = node.object() else {
            nodes[i].first_index = nodes.len() as u32;
            let left = ours[i] + 1;
            for child in [left, tree.nodes[left].skip as usize] {
                nodes.push(Bvh2Node::new(aabb(child), 0, 0));
                ours.push(child);
            }
            i += 1;
            continue;
        };
        nodes[i].prim_count = 1;
        nodes[i].first_index = primitive_indices.len() as u32;
        primitive_indices.push(object);
        i += 1;
    }
    obvhs::bvh2::Bvh2 {
        nodes,
        primitive_indices,
        max_depth: tree.stats.depth as usize + 2,
        children_are_ordered_after_parents: true,
        ..Default::default()
    }
}

#[test]
fn obvhs_accepts_the_trees() {
    for (kind, boxes) in boxes::all_kinds() {
        let aabbs: Vec<_> = boxes
            .iter()
            .map(|b| obvhs::aabb::Aabb::new(b.min.into(), b.max.into()))
            .collect();
        for builder in tree::builders() {
            let tree = build(&boxes, builder);
            let seen = to_obvhs(&tree).validate(&aabbs, false, true);
            assert_eq!(seen.leaf_count, boxes.len(), "{kind}, {}", builder.name());
            assert_eq!(
                seen.max_depth,
                tree.stats.depth,
                "{kind}, {}",
                builder.name()
            );
        }
    }
}

/// Coordinates of every magnitude, with many ties.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        (-4_i8..4).prop_map(f32::from),
        -1e3_f32..1e3,
        any::<f32>().prop_filter("finite", |x| x.is_finite()),
    ]
}

fn any_box() -> impl Strategy<Value = Bounds> {
    prop::array::uniform6(coordinate()).prop_map(|c| Bounds {
        min: std::array::from_fn(|axis| c[axis].min(c[axis + 3])),
        max: std::array::from_fn(|axis| c[axis].max(c[axis + 3])),
    })
}

proptest! {
    #[test]
    fn any_finite_boxes_make_a_well_formed_tree(boxes in prop::collection::vec(any_box(), 1..200)) {
        for builder in tree::builders() {
            check(&build(&boxes, builder), &boxes, builder.name());
        }
    }
}
