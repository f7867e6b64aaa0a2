//! The methods, an entry each.

use hroc_methods::{
    Auto, ChcOptions, CoherentCulling, DepthRange, HardwareTimes, HierarchicalZ, IocMode,
    IterativeOcclusionCulling, MaskedSoftware, MsocMode, NearOptimalCulling,
    PrerejectedOcclusionCulling, Projected, RasterOcclusionCulling, Reference,
    TwoPassHierarchicalZ, ViewFrustumCulling, WarpedOcclusionCulling, WocMode, WocOptions,
};
use hroc_runtime::{Grouping, HostSync, Hroc, HrocMode, HrocOptions, Noc, device};

use super::knobs::{
    ASSUMED_VISIBLE, BATCH, BOX_COST, DEPTHS, FIRST_DEPTH, LATE_MARGIN, MULTI_QUERIES,
    OCCLUDER_TRIANGLES, OPEN_LEVELS, SEEDS, SIDE, STEPS, TIGHTER_LEVELS, TIGHTER_SURFACE,
};
use super::{Exactness, Method, Mode, Parts};

/// The one mode of a method without modes that is exact and never waits.
const PLAIN: Mode = Mode {
    name: "",
    exactness: Exactness::Exact,
    host_sync: HostSync::Never,
};

/// The one mode of an exact method that waits within the frame.
const WAITS: Mode = Mode {
    host_sync: HostSync::MidFrame,
    ..PLAIN
};

const fn hroc_mode(mode: HrocMode) -> Mode {
    Mode {
        name: mode.name(),
        exactness: if mode.is_exact() {
            Exactness::Exact
        } else {
            Exactness::Approximate
        },
        host_sync: mode.host_sync(),
    }
}

fn hardware_times(parts: &Parts<'_>) -> HardwareTimes {
    HardwareTimes::of(parts.device, parts.queue, &parts.scene.profile)
}

fn near_optimal(parts: &Parts<'_>) -> NearOptimalCulling {
    let tree = parts.tree();
    NearOptimalCulling::new(
        parts.device,
        parts.scene,
        parts.baked,
        tree,
        parts.depth,
        hardware_times(parts),
    )
}

/// HROC in one of its modes.
fn hroc_options(parts: &Parts<'_>) -> HrocOptions {
    HrocOptions {
        mode: HrocMode::ALL
            .into_iter()
            .find(|mode| mode.name() == parts.mode)
            .unwrap_or_default(),
        depth: parts.depth,
        grouping: match (parts.grouping, parts.knobs.get(&BOX_COST) as f32) {
            (Grouping::Adaptive { .. }, box_cost) if box_cost.is_finite() => {
                Grouping::Adaptive { box_cost }
            }
            (grouping, _) => grouping,
        },
        late_margin: parts.knobs.get(&LATE_MARGIN) as f32,
        count_work: parts.count_work,
        ..HrocOptions::default()
    }
}

/// CHC, with or without what CHC++ adds.
fn coherent(parts: &Parts<'_>, options: ChcOptions) -> CoherentCulling {
    let tree = parts.tree();
    CoherentCulling::new(
        parts.device,
        parts.scene,
        parts.baked,
        tree,
        parts.depth,
        options,
    )
}

/// No culling. The other methods say in what they differ: name, source and `make` always.
const NOC: Method = Method {
    name: "noc",
    source: "no culling: every object is drawn; the truth for all others",
    features: device::REQUIRED,
    modes: &[PLAIN],
    knobs: &[],
    uses_tree: false,
    groups: false,
    is_told: false,
    counts_work: false,
    make: |parts| Box::new(Noc::new(parts.device, parts.scene, parts.depth)),
};

/// The registry.
pub const METHODS: &[Method] = &[
    NOC,
    Method {
        name: "vfc",
        source: "view frustum culling, object by object",
        make: |parts| {
            Box::new(ViewFrustumCulling::flat(
                parts.device,
                parts.scene,
                parts.depth,
            ))
        },
        ..NOC
    },
    Method {
        name: "vfc-bvh",
        source: "view frustum culling down the hierarchy (Clark 1976)",
        uses_tree: true,
        make: |parts| {
            let tree = parts.tree();
            Box::new(ViewFrustumCulling::hierarchical(
                parts.device,
                parts.scene,
                tree,
                parts.depth,
            ))
        },
        ..NOC
    },
    Method {
        name: "ref",
        source: "the ideal: what is known to show is drawn, and nothing else (recorded with no culling beforehand)",
        is_told: true,
        make: |parts| {
            let recorded = parts.recorded.clone();
            Box::new(Reference::new(
                parts.device,
                parts.scene,
                parts.depth,
                recorded,
            ))
        },
        ..NOC
    },
    Method {
        name: "roc",
        source: "raster occlusion culling (Kubisch, Tavenrath, GTC 2014; Boudier, Kubisch, GTC 2015)",
        make: |parts| {
            Box::new(RasterOcclusionCulling::new(
                parts.device,
                parts.scene,
                parts.depth,
            ))
        },
        ..NOC
    },
    Method {
        name: "roc-hiz",
        source: "ROC of what a depth pyramid of full resolution does not hide",
        make: |parts| {
            Box::new(PrerejectedOcclusionCulling::new(
                parts.device,
                parts.scene,
                parts.depth,
            ))
        },
        ..NOC
    },
    Method {
        name: "ioc",
        source: "iterative raster occlusion culling down a range of BVH depths (Lee, Lee 2020)",
        modes: &[
            Mode {
                name: "indirect",
                ..PLAIN
            },
            Mode {
                name: "read-back",
                host_sync: HostSync::MidFrame,
                ..PLAIN
            },
        ],
        knobs: &[FIRST_DEPTH, DEPTHS],
        uses_tree: true,
        make: |parts| {
            let tree = parts.tree();
            let mode = match parts.mode {
                "read-back" => IocMode::ReadBack,
                _ => IocMode::Indirect,
            };
            let mut range = DepthRange::of(parts.scene.shape.static_count);
            let first = parts.knobs.get(&FIRST_DEPTH);
            if first.is_finite() {
                range.first = first as u32;
            }
            range.count = parts.knobs.get(&DEPTHS).clamp(1.0, 64.0) as u32;
            Box::new(IterativeOcclusionCulling::new(
                parts.device,
                parts.scene,
                tree,
                parts.depth,
                mode,
                range,
            ))
        },
        ..NOC
    },
    Method {
        name: "hiz",
        source: "hierarchical Z with a small occluder depth (Greene, Kass, Miller 1993; Arm's Mali SDK sample)",
        modes: &[
            Mode {
                name: "box",
                exactness: Exactness::Approximate,
                ..PLAIN
            },
            Mode {
                name: "sphere",
                exactness: Exactness::Approximate,
                ..PLAIN
            },
        ],
        knobs: &[SIDE],
        make: |parts| {
            let projected = match parts.mode {
                "sphere" => Projected::Sphere,
                _ => Projected::Box,
            };
            let side_px = parts.knobs.get(&SIDE) as u32;
            Box::new(HierarchicalZ::new(
                parts.device,
                parts.scene,
                parts.depth,
                side_px,
                projected,
            ))
        },
        ..NOC
    },
    Method {
        name: "hiz-two-pass",
        source: "two-pass hierarchical Z at full resolution (Haar, Aaltonen, SIGGRAPH 2015)",
        make: |parts| {
            Box::new(TwoPassHierarchicalZ::new(
                parts.device,
                parts.scene,
                parts.depth,
            ))
        },
        ..NOC
    },
    Method {
        name: "woc",
        source: "warping-based occlusion culling, single layer (Lee, Kim, Eisemann, ACM TOG 37(5), 2018)",
        modes: &[
            Mode {
                name: "nearest",
                exactness: Exactness::Approximate,
                ..PLAIN
            },
            Mode {
                name: "neighborhood",
                exactness: Exactness::Approximate,
                ..PLAIN
            },
        ],
        knobs: &[SEEDS, STEPS],
        make: |parts| {
            let options = WocOptions {
                mode: match parts.mode {
                    "neighborhood" => WocMode::Neighborhood,
                    _ => WocMode::Nearest,
                },
                seeds: parts.knobs.get(&SEEDS) as u32,
                steps: parts.knobs.get(&STEPS) as u32,
            };
            Box::new(WarpedOcclusionCulling::new(
                parts.device,
                parts.scene,
                parts.depth,
                options,
            ))
        },
        ..NOC
    },
    Method {
        name: "msoc",
        source: "masked software occlusion culling on the CPU (Hasselgren, Andersson, Akenine-Möller, HPG 2016)",
        modes: &[
            Mode {
                name: "inner",
                ..PLAIN
            },
            Mode {
                name: "paper",
                exactness: Exactness::Approximate,
                ..PLAIN
            },
            Mode {
                name: "full-resolution",
                exactness: Exactness::Approximate,
                ..PLAIN
            },
        ],
        knobs: &[OCCLUDER_TRIANGLES],
        uses_tree: true,
        make: |parts| {
            let mode = match parts.mode {
                "paper" => MsocMode::Paper,
                "full-resolution" => MsocMode::FullResolution,
                _ => MsocMode::Inner,
            };
            let split = &parts.tree().split;
            let triangles = parts.knobs.get(&OCCLUDER_TRIANGLES) as u64;
            Box::new(MaskedSoftware::new(
                parts.device,
                parts.scene,
                parts.baked,
                split,
                parts.depth,
                mode,
                triangles,
            ))
        },
        ..NOC
    },
    Method {
        name: "chc",
        source: "coherent hierarchical culling with occlusion queries (Bittner, Wimmer, Piringer, Purgathofer, Eurographics 2004)",
        modes: &[WAITS],
        uses_tree: true,
        make: |parts| Box::new(coherent(parts, ChcOptions::CHC)),
        ..NOC
    },
    Method {
        name: "chc++",
        source: "CHC++: batches, multi-queries, random re-tests, tighter bounds (Mattausch, Bittner, Wimmer, Eurographics 2008)",
        modes: &[WAITS],
        knobs: &[
            BATCH,
            MULTI_QUERIES,
            ASSUMED_VISIBLE,
            TIGHTER_LEVELS,
            TIGHTER_SURFACE,
            OPEN_LEVELS,
        ],
        uses_tree: true,
        make: |parts| {
            let knob = |knob| parts.knobs.get(knob);
            let options = ChcOptions {
                batch: Some(knob(&BATCH) as usize),
                multi_queries: knob(&MULTI_QUERIES) != 0.0,
                assumed_visible: knob(&ASSUMED_VISIBLE) as u32,
                tighter_levels: knob(&TIGHTER_LEVELS).min(8.0) as u32,
                tighter_surface: knob(&TIGHTER_SURFACE) as f32,
                open_levels: knob(&OPEN_LEVELS).clamp(1.0, 8.0) as u32,
            };
            Box::new(coherent(parts, options))
        },
        ..NOC
    },
    Method {
        name: "nohc",
        source: "near optimal hierarchical culling: queries where they pay (Guthe, Balázs, Klein, EGSR 2006)",
        modes: &[WAITS],
        uses_tree: true,
        make: |parts| Box::new(near_optimal(parts)),
        ..NOC
    },
    Method {
        name: "nohc-optimum",
        source: "what NOHC could reach at best: it is told what shows, and asks only where that pays",
        modes: &[WAITS],
        uses_tree: true,
        is_told: true,
        make: |parts| Box::new(near_optimal(parts).told(parts.recorded.clone())),
        ..NOC
    },
    Method {
        name: "hroc",
        source: "hierarchical raster occlusion culling (Lee, Kwon, Lee, Computer Graphics Forum 40(2), 2021)",
        modes: &[
            hroc_mode(HrocMode::Of),
            hroc_mode(HrocMode::Na),
            hroc_mode(HrocMode::Cr),
            hroc_mode(HrocMode::CrOf),
            hroc_mode(HrocMode::CrLate),
            hroc_mode(HrocMode::CrLateExact),
        ],
        knobs: &[LATE_MARGIN, BOX_COST],
        uses_tree: true,
        groups: true,
        counts_work: true,
        make: |parts| {
            let tree = parts.tree();
            let options = hroc_options(parts);
            Box::new(Hroc::new(parts.device, parts.scene, tree, options))
        },
        ..NOC
    },
    Method {
        name: "auto",
        source: "frustum culling, HROC or ROC behind a Hi-Z test, by the frame: what should take the least time",
        modes: &[Mode {
            host_sync: HostSync::NextFrame,
            ..PLAIN
        }],
        knobs: &[BOX_COST],
        uses_tree: true,
        groups: true,
        make: |parts| {
            let tree = parts.tree();
            let (options, hardware) = (hroc_options(parts), hardware_times(parts));
            Box::new(Auto::new(
                parts.device,
                parts.scene,
                parts.baked,
                tree,
                options,
                hardware,
            ))
        },
        ..NOC
    },
];
