//! The knobs of the methods.

use hroc_methods::{ChcOptions, HierarchicalZ};

use super::Knob;

const CHC: ChcOptions = ChcOptions::CHC_PLUS_PLUS;

pub(super) const BOX_COST: Knob = Knob {
    name: "box-cost",
    help: "adaptive grouping: cost of a box in ray-box tests; measured on the device if not given",
    default: f64::NAN,
    sweep: &[],
};

pub(super) const FIRST_DEPTH: Knob = Knob {
    name: "first-depth",
    help: "depth of the BVH that the test begins at; 5 less than log2 of the number of objects if not given",
    default: f64::NAN,
    sweep: &[2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0],
};

pub(super) const DEPTHS: Knob = Knob {
    name: "depths",
    help: "how many depths of the BVH are tested",
    default: 3.0,
    sweep: &[1.0, 2.0, 3.0, 4.0, 6.0, 8.0],
};

pub(super) const SIDE: Knob = Knob {
    name: "side",
    help: "side of the square occluder depth buffer, pixels",
    default: HierarchicalZ::SIDE_PX as f64,
    sweep: &[64.0, 128.0, 256.0, 512.0, 1024.0, 2048.0],
};

pub(super) const SEEDS: Knob = Knob {
    name: "seeds",
    help: "starts of the fixed-point iteration per pixel (the paper's N)",
    default: 8.0,
    sweep: &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0],
};

pub(super) const STEPS: Knob = Knob {
    name: "steps",
    help: "steps of the fixed-point iteration from each start at most",
    default: 3.0,
    sweep: &[1.0, 2.0, 3.0, 5.0, 8.0],
};

pub(super) const OCCLUDER_TRIANGLES: Knob = Knob {
    name: "occluder-triangles",
    help: "triangles of occluders that are rasterized per frame at most",
    default: 50_000.0,
    sweep: &[0.0, 1_000.0, 10_000.0, 50_000.0, 200_000.0],
};

pub(super) const BATCH: Knob = Knob {
    name: "batch",
    help: "hidden nodes that are asked about together at most (b; 1000 in the thesis)",
    default: CHC.batch.expect("CHC++ has batches") as f64,
    sweep: &[16.0, 64.0, 256.0, 1000.0, 4000.0],
};

pub(super) const MULTI_QUERIES: Knob = Knob {
    name: "multi-queries",
    help: "1: nodes that are likely to stay hidden share a query; 0: each has its own",
    default: CHC.multi_queries as u8 as f64,
    sweep: &[0.0, 1.0],
};

pub(super) const ASSUMED_VISIBLE: Knob = Knob {
    name: "assumed-visible",
    help: "leaves that show are asked about again after up to so many frames (n_av); 0: in every frame",
    default: CHC.assumed_visible as f64,
    sweep: &[0.0, 5.0, 10.0, 20.0],
};

pub(super) const TIGHTER_LEVELS: Knob = Knob {
    name: "tighter-levels",
    help: "bounds are the boxes up to so many levels below (d_max); 0: their own",
    default: CHC.tighter_levels as f64,
    sweep: &[0.0, 2.0, 4.0],
};

pub(super) const TIGHTER_SURFACE: Knob = Knob {
    name: "tighter-surface",
    help: "as long as their surface is no more than so many times the box's own (s_max)",
    // That of CHC++, which is an f32 and not quite this.
    default: 1.4,
    sweep: &[1.0, 1.4, 2.0],
};

pub(super) const OPEN_LEVELS: Knob = Knob {
    name: "open-levels",
    help: "levels below a node that shows that are asked about next",
    default: CHC.open_levels as f64,
    sweep: &[1.0, 2.0, 3.0, 4.0],
};

pub(super) const LATE_MARGIN: Knob = Knob {
    name: "late-margin",
    help: "modes cr-late and cr-late-exact: draws beyond the last count that are allowed, as a share of it",
    default: 0.25,
    sweep: &[0.0, 0.05, 0.25, 1.0, 4.0],
};
