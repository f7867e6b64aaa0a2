//! Every culling method that the study can run. A new method is one entry of [`METHODS`].

use hroc_format::ArchivedScene;
use hroc_methods::{
    ChcOptions, CoherentCulling, DepthRange, HardwareTimes, HierarchicalZ, IocMode,
    IterativeOcclusionCulling, MaskedSoftware, MsocMode, NearOptimalCulling, Projected,
    RasterOcclusionCulling, Recorded, Reference, TwoPassHierarchicalZ, ViewFrustumCulling,
    WarpedOcclusionCulling, WocMode, WocOptions,
};
use hroc_runtime::{
    CullingMethod, DepthConvention, Grouping, HostSync, Hroc, HrocMode, HrocOptions, Noc, Scene,
    Tree, device,
};
use wgpu::Features;

/// What a method is made of.
#[derive(Clone, Copy)]
pub struct Parts<'a> {
    /// Where it runs.
    pub device: &'a wgpu::Device,
    /// Its queue.
    pub queue: &'a wgpu::Queue,
    /// What it culls.
    pub scene: &'a Scene,
    /// The same on the host, for a method that culls there.
    pub baked: &'a ArchivedScene,
    /// The hierarchy over it; there for every method that [uses](Method::uses_tree) one.
    pub tree: Option<&'a Tree>,
    /// How depth is stored.
    pub depth: DepthConvention,
    /// One of the method's [`modes`](Method::modes); the name of one that has none is empty.
    pub mode: &'a str,
    /// How coarse the groups are, for a method that groups.
    pub grouping: Grouping,
    /// Values of the method's [`knobs`](Method::knobs).
    pub knobs: &'a Knobs,
    /// What shows in the frame to come, for a method that [is told](Method::is_told).
    pub recorded: &'a Recorded,
    /// Counts work where the method can, see [`hroc_runtime::Sets::work`].
    pub count_work: bool,
}

/// Whether a method's image is that of no culling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exactness {
    /// Every visible object is drawn: a wrong pixel is a failure.
    Exact,
    /// May miss objects: its errors are reported.
    Approximate,
}

impl Exactness {
    /// `exact` or `approximate`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Approximate => "approximate",
        }
    }
}

/// A mode of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// Name on the command line and in reports; empty for the one mode of a method without modes.
    pub name: &'static str,
    /// Whether its image is exact.
    pub exactness: Exactness,
    /// Whether the host waits for the GPU.
    pub host_sync: HostSync,
}

impl Mode {
    /// As a column of a table: `-` for the mode of a method without modes.
    pub const fn label(&self) -> &'static str {
        if self.name.is_empty() { "-" } else { self.name }
    }
}

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

/// A number that trades speed against error or work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knob {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What it does, with its unit.
    pub help: &'static str,
    /// Where it stands if nobody turns it.
    pub default: f64,
    /// Where a sweep puts it.
    pub sweep: &'static [f64],
}

/// Values of knobs that differ from their defaults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Knobs(Vec<(&'static str, f64)>);

impl Knobs {
    /// Turns a knob.
    pub fn set(&mut self, knob: &Knob, value: f64) {
        self.0.retain(|(name, _)| *name != knob.name);
        self.0.push((knob.name, value));
    }

    /// Where a knob stands.
    pub fn get(&self, knob: &Knob) -> f64 {
        let set = self.0.iter().find(|(name, _)| *name == knob.name);
        set.map_or(knob.default, |(_, value)| *value)
    }

    /// The knobs that were turned.
    pub fn turned(&self) -> &[(&'static str, f64)] {
        &self.0
    }
}

const BOX_COST: Knob = Knob {
    name: "box-cost",
    help: "adaptive grouping: cost of a box in ray-box tests; measured on the device if not given",
    default: f64::NAN,
    sweep: &[],
};

const FIRST_DEPTH: Knob = Knob {
    name: "first-depth",
    help: "depth of the BVH that the test begins at; 5 less than log2 of the number of objects if not given",
    default: f64::NAN,
    sweep: &[2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0],
};

const DEPTHS: Knob = Knob {
    name: "depths",
    help: "how many depths of the BVH are tested",
    default: 3.0,
    sweep: &[1.0, 2.0, 3.0, 4.0, 6.0, 8.0],
};

const SIDE: Knob = Knob {
    name: "side",
    help: "side of the square occluder depth buffer, pixels",
    default: HierarchicalZ::SIDE_PX as f64,
    sweep: &[64.0, 128.0, 256.0, 512.0, 1024.0, 2048.0],
};

const SEEDS: Knob = Knob {
    name: "seeds",
    help: "starts of the fixed-point iteration per pixel (the paper's N)",
    default: 8.0,
    sweep: &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0],
};

const STEPS: Knob = Knob {
    name: "steps",
    help: "steps of the fixed-point iteration from each start at most",
    default: 3.0,
    sweep: &[1.0, 2.0, 3.0, 5.0, 8.0],
};

const OCCLUDER_TRIANGLES: Knob = Knob {
    name: "occluder-triangles",
    help: "triangles of occluders that are rasterized per frame at most",
    default: 50_000.0,
    sweep: &[0.0, 1_000.0, 10_000.0, 50_000.0, 200_000.0],
};

const BATCH: Knob = Knob {
    name: "batch",
    help: "hidden nodes that are asked about together at most (b; 1000 in the thesis)",
    default: 4000.0,
    sweep: &[16.0, 64.0, 256.0, 1000.0, 4000.0],
};

const MULTI_QUERIES: Knob = Knob {
    name: "multi-queries",
    help: "1: nodes that are likely to stay hidden share a query; 0: each has its own",
    default: 1.0,
    sweep: &[0.0, 1.0],
};

const ASSUMED_VISIBLE: Knob = Knob {
    name: "assumed-visible",
    help: "leaves that show are asked about again after up to so many frames (n_av); 0: in every frame",
    default: 10.0,
    sweep: &[0.0, 5.0, 10.0, 20.0],
};

const TIGHTER_LEVELS: Knob = Knob {
    name: "tighter-levels",
    help: "bounds are the boxes up to so many levels below (d_max); 0: their own",
    default: 4.0,
    sweep: &[0.0, 2.0, 4.0],
};

const TIGHTER_SURFACE: Knob = Knob {
    name: "tighter-surface",
    help: "as long as their surface is no more than so many times the box's own (s_max)",
    default: 1.4,
    sweep: &[1.0, 1.4, 2.0],
};

/// CHC, with or without what CHC++ adds.
fn coherent(parts: &Parts<'_>, options: ChcOptions) -> CoherentCulling {
    let tree = parts.tree.expect("uses_tree is set");
    CoherentCulling::new(
        parts.device,
        parts.scene,
        parts.baked,
        tree,
        parts.depth,
        options,
    )
}

const LATE_MARGIN: Knob = Knob {
    name: "late-margin",
    help: "modes cr-late and cr-late-exact: draws beyond the last count that are allowed, as a share of it",
    default: 0.25,
    sweep: &[0.0, 0.05, 0.25, 1.0, 4.0],
};

/// The modes in which a knob does anything. One that is not listed does so in all.
const KNOB_MODES: &[(&str, &[&str])] = &[(LATE_MARGIN.name, &["cr-late", "cr-late-exact"])];

/// Whether `knob` does anything in `mode`.
pub fn acts_in(knob: &Knob, mode: &Mode) -> bool {
    let listed = KNOB_MODES.iter().find(|(name, _)| *name == knob.name);
    listed.is_none_or(|(_, modes)| modes.contains(&mode.name))
}

/// A culling method as the study knows it.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What it is and where it was published.
    pub source: &'static str,
    /// Device features without which it does not run.
    pub features: Features,
    /// Its modes, the default first.
    pub modes: &'static [Mode],
    /// Its knobs.
    pub knobs: &'static [Knob],
    /// It reads the hierarchy.
    pub uses_tree: bool,
    /// It makes groups of the nodes of the hierarchy, coarse or fine.
    pub groups: bool,
    /// It is told beforehand what shows in each frame.
    pub is_told: bool,
    /// It counts rays and ray-box tests if asked to.
    pub counts_work: bool,
    /// Makes it, with the history of a view that was never drawn.
    pub make: fn(&Parts<'_>) -> Box<dyn CullingMethod>,
}

/// The registry.
pub const METHODS: &[Method] = &[
    Method {
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
    },
    Method {
        name: "vfc",
        source: "view frustum culling, object by object",
        features: device::REQUIRED,
        modes: &[PLAIN],
        knobs: &[],
        uses_tree: false,
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| {
            let Parts {
                device,
                scene,
                depth,
                ..
            } = *parts;
            Box::new(ViewFrustumCulling::flat(device, scene, depth))
        },
    },
    Method {
        name: "vfc-bvh",
        source: "view frustum culling down the hierarchy (Clark 1976)",
        features: device::REQUIRED,
        modes: &[PLAIN],
        knobs: &[],
        uses_tree: true,
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| {
            let Parts {
                device,
                scene,
                depth,
                ..
            } = *parts;
            let tree = parts.tree.expect("uses_tree is set");
            Box::new(ViewFrustumCulling::hierarchical(device, scene, tree, depth))
        },
    },
    Method {
        name: "ref",
        source: "the ideal: what is known to show is drawn, and nothing else (recorded with no culling beforehand)",
        features: device::REQUIRED,
        modes: &[PLAIN],
        knobs: &[],
        uses_tree: false,
        groups: false,
        is_told: true,
        counts_work: false,
        make: |parts| {
            let recorded = parts.recorded.clone();
            Box::new(Reference::new(
                parts.device,
                parts.scene,
                parts.depth,
                recorded,
            ))
        },
    },
    Method {
        name: "roc",
        source: "raster occlusion culling (Kubisch, Tavenrath, GTC 2014; Boudier, Kubisch, GTC 2015)",
        features: device::REQUIRED,
        modes: &[PLAIN],
        knobs: &[],
        uses_tree: false,
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| {
            let Parts {
                device,
                scene,
                depth,
                ..
            } = *parts;
            Box::new(RasterOcclusionCulling::new(device, scene, depth))
        },
    },
    Method {
        name: "ioc",
        source: "iterative raster occlusion culling down a range of BVH depths (Lee, Lee 2020)",
        features: device::REQUIRED,
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
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| {
            let Parts {
                device,
                scene,
                depth,
                ..
            } = *parts;
            let tree = parts.tree.expect("uses_tree is set");
            let mode = match parts.mode {
                "read-back" => IocMode::ReadBack,
                _ => IocMode::Indirect,
            };
            let mut range = DepthRange::of(scene.shape.static_count);
            let first = parts.knobs.get(&FIRST_DEPTH);
            if first.is_finite() {
                range.first = first as u32;
            }
            range.count = parts.knobs.get(&DEPTHS).clamp(1.0, 64.0) as u32;
            Box::new(IterativeOcclusionCulling::new(
                device, scene, tree, depth, mode, range,
            ))
        },
    },
    Method {
        name: "hiz",
        source: "hierarchical Z with a small occluder depth (Greene, Kass, Miller 1993; Arm's Mali SDK sample)",
        features: device::REQUIRED,
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
        uses_tree: false,
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| {
            let Parts {
                device,
                scene,
                depth,
                ..
            } = *parts;
            let projected = match parts.mode {
                "sphere" => Projected::Sphere,
                _ => Projected::Box,
            };
            let side_px = parts.knobs.get(&SIDE) as u32;
            Box::new(HierarchicalZ::new(device, scene, depth, side_px, projected))
        },
    },
    Method {
        name: "hiz-two-pass",
        source: "two-pass hierarchical Z at full resolution (Haar, Aaltonen, SIGGRAPH 2015)",
        features: device::REQUIRED,
        modes: &[PLAIN],
        knobs: &[],
        uses_tree: false,
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| {
            let Parts {
                device,
                scene,
                depth,
                ..
            } = *parts;
            Box::new(TwoPassHierarchicalZ::new(device, scene, depth))
        },
    },
    Method {
        name: "woc",
        source: "warping-based occlusion culling, single layer (Lee, Kim, Eisemann, ACM TOG 37(5), 2018)",
        features: device::REQUIRED,
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
        uses_tree: false,
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| {
            let Parts {
                device,
                scene,
                depth,
                ..
            } = *parts;
            let options = WocOptions {
                mode: match parts.mode {
                    "neighborhood" => WocMode::Neighborhood,
                    _ => WocMode::Nearest,
                },
                seeds: parts.knobs.get(&SEEDS) as u32,
                steps: parts.knobs.get(&STEPS) as u32,
            };
            Box::new(WarpedOcclusionCulling::new(device, scene, depth, options))
        },
    },
    Method {
        name: "msoc",
        source: "masked software occlusion culling on the CPU (Hasselgren, Andersson, Akenine-Möller, HPG 2016)",
        features: device::REQUIRED,
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
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| {
            let Parts {
                device,
                scene,
                baked,
                depth,
                ..
            } = *parts;
            let mode = match parts.mode {
                "paper" => MsocMode::Paper,
                "full-resolution" => MsocMode::FullResolution,
                _ => MsocMode::Inner,
            };
            let split = &parts.tree.expect("uses_tree is set").split;
            let triangles = parts.knobs.get(&OCCLUDER_TRIANGLES) as u64;
            Box::new(MaskedSoftware::new(
                device, scene, baked, split, depth, mode, triangles,
            ))
        },
    },
    Method {
        name: "chc",
        source: "coherent hierarchical culling with occlusion queries (Bittner, Wimmer, Piringer, Purgathofer, Eurographics 2004)",
        features: device::REQUIRED,
        modes: &[WAITS],
        knobs: &[],
        uses_tree: true,
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| Box::new(coherent(parts, ChcOptions::CHC)),
    },
    Method {
        name: "chc++",
        source: "CHC++: batches, multi-queries, random re-tests, tighter bounds (Mattausch, Bittner, Wimmer, Eurographics 2008)",
        features: device::REQUIRED,
        modes: &[WAITS],
        knobs: &[
            BATCH,
            MULTI_QUERIES,
            ASSUMED_VISIBLE,
            TIGHTER_LEVELS,
            TIGHTER_SURFACE,
        ],
        uses_tree: true,
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| {
            let knob = |knob| parts.knobs.get(knob);
            let options = ChcOptions {
                batch: Some(knob(&BATCH) as usize),
                multi_queries: knob(&MULTI_QUERIES) != 0.0,
                assumed_visible: knob(&ASSUMED_VISIBLE) as u32,
                tighter_levels: knob(&TIGHTER_LEVELS).min(8.0) as u32,
                tighter_surface: knob(&TIGHTER_SURFACE) as f32,
            };
            Box::new(coherent(parts, options))
        },
    },
    Method {
        name: "nohc",
        source: "near optimal hierarchical culling: queries where they pay (Guthe, Balázs, Klein, EGSR 2006)",
        features: device::REQUIRED,
        modes: &[WAITS],
        knobs: &[],
        uses_tree: true,
        groups: false,
        is_told: false,
        counts_work: false,
        make: |parts| {
            let Parts {
                device,
                queue,
                scene,
                baked,
                depth,
                ..
            } = *parts;
            let profile = &scene.profile;
            let hardware = (profile.pipelines).get("hardware times", || {
                HardwareTimes::measure(device, queue, profile)
            });
            let tree = parts.tree.expect("uses_tree is set");
            Box::new(NearOptimalCulling::new(
                device, scene, baked, tree, depth, hardware,
            ))
        },
    },
    Method {
        name: "hroc",
        source: "hierarchical raster occlusion culling (Lee, Kwon, Lee, Computer Graphics Forum 40(2), 2021)",
        features: device::REQUIRED,
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
        is_told: false,
        counts_work: true,
        make: |parts| {
            let options = HrocOptions {
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
            };
            let tree = parts.tree.expect("uses_tree is set");
            Box::new(Hroc::new(parts.device, parts.scene, tree, options))
        },
    },
];

/// The method called `name`.
///
/// # Errors
/// A message that lists the ones there are.
pub fn method(name: &str) -> Result<&'static Method, String> {
    METHODS
        .iter()
        .find(|method| method.name == name)
        .ok_or_else(|| {
            let known = METHODS
                .iter()
                .map(|method| method.name)
                .collect::<Vec<_>>()
                .join(", ");
            format!("no culling method '{name}'; there is: {known} (see hroc methods)")
        })
}

impl Method {
    /// The mode to run in: the one asked for, or the default.
    ///
    /// # Errors
    /// A message that lists the modes there are.
    pub fn mode(&self, asked: Option<&str>) -> Result<&'static Mode, String> {
        let Some(asked) = asked else {
            return Ok(&self.modes[0]);
        };
        let named = |mode: &&Mode| !mode.name.is_empty() && mode.name == asked;
        if let Some(mode) = self.modes.iter().find(named) {
            return Ok(mode);
        }
        Err(match self.modes {
            [only] if only.name.is_empty() => format!(
                "method '{}' has no modes; leave out --mode {asked}",
                self.name
            ),
            modes => format!(
                "method '{}' has no mode '{asked}'; there is: {}",
                self.name,
                modes
                    .iter()
                    .map(|mode| mode.name)
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
        })
    }

    /// Knobs turned as `NAME=VALUE` says.
    ///
    /// # Errors
    /// A message that lists the knobs there are.
    pub fn knobs(&self, turned: &[String]) -> Result<Knobs, String> {
        let mut knobs = Knobs::default();
        for text in turned {
            let (name, value) = text
                .split_once('=')
                .ok_or_else(|| format!("--knob {text}: NAME=VALUE is wanted"))?;
            let knob = self
                .knobs
                .iter()
                .find(|knob| knob.name == name)
                .ok_or_else(|| {
                    let known = self.knobs.iter().map(|knob| knob.name).collect::<Vec<_>>();
                    match known.as_slice() {
                        [] => format!(
                            "method '{}' has no knobs; leave out --knob {text}",
                            self.name
                        ),
                        known => format!(
                            "method '{}' has no knob '{name}'; there is: {}",
                            self.name,
                            known.join(", ")
                        ),
                    }
                })?;
            let value = value
                .parse::<f64>()
                .ok()
                .filter(|v| v.is_finite() && *v >= 0.0);
            knobs.set(
                knob,
                value.ok_or_else(|| format!("--knob {text}: a number from 0 up is wanted"))?,
            );
        }
        Ok(knobs)
    }
}

/// How a method waits, for people.
pub const fn host_sync_name(sync: HostSync) -> &'static str {
    match sync {
        HostSync::Never => "never",
        HostSync::NextFrame => "next-frame",
        HostSync::MidFrame => "mid-frame",
    }
}

/// Names of features, for people.
pub fn feature_names(features: Features) -> String {
    features
        .iter_names()
        .map(|(name, _)| name)
        .collect::<Vec<_>>()
        .join(" ")
}

/// The registry as Markdown: a row per mode, then the knobs.
pub fn table() -> String {
    let rows = METHODS.iter().flat_map(|method| {
        method.modes.iter().map(|mode| {
            [
                method.name.to_owned(),
                mode.label().to_owned(),
                mode.exactness.name().to_owned(),
                host_sync_name(mode.host_sync).to_owned(),
                feature_names(method.features),
                method.source.to_owned(),
            ]
        })
    });
    let methods = crate::table::markdown(
        ["method", "mode", "image", "host waits", "needs", "source"],
        rows,
    );
    let rows = METHODS.iter().flat_map(|method| {
        method.knobs.iter().map(|knob| {
            [
                method.name.to_owned(),
                knob.name.to_owned(),
                if knob.default.is_nan() {
                    "see there".to_owned()
                } else {
                    knob.default.to_string()
                },
                knob.help.to_owned(),
            ]
        })
    });
    let knobs = crate::table::markdown(["method", "knob", "default", "what it does"], rows);
    format!("{methods}\n{knobs}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_found() {
        for (i, entry) in METHODS.iter().enumerate() {
            assert_eq!(
                METHODS.iter().position(|other| other.name == entry.name),
                Some(i)
            );
            assert_eq!(method(entry.name).unwrap().name, entry.name);
            assert!(table().contains(entry.source));
        }
        let unknown = method("hrok").unwrap_err();
        assert!(METHODS.iter().all(|entry| unknown.contains(entry.name)));
    }

    #[test]
    fn modes_are_checked() {
        let [noc, hroc] = ["noc", "hroc"].map(|name| method(name).unwrap());
        assert_eq!(hroc.mode(None).unwrap().name, "of");
        assert_eq!(hroc.mode(Some("cr-of")).unwrap().name, "cr-of");
        assert!(hroc.mode(Some("fo")).unwrap_err().contains("of"));
        assert_eq!(noc.mode(None).unwrap().name, "");
        assert!(noc.mode(Some("")).is_err());
        assert!(noc.mode(Some("of")).unwrap_err().contains("leave out"));
    }
    #[test]
    fn knobs_are_checked() {
        let hroc = method("hroc").unwrap();
        let turned = |text: &str| hroc.knobs(&[text.to_owned()]);
        assert_eq!(turned("late-margin=2").unwrap().get(&LATE_MARGIN), 2.0);
        assert_eq!(
            hroc.knobs(&[]).unwrap().get(&LATE_MARGIN),
            LATE_MARGIN.default
        );
        for wrong in [
            "late-margin",
            "late-margin=-1",
            "late-margin=nan",
            "margin=1",
        ] {
            assert!(turned(wrong).is_err(), "{wrong}");
        }
        assert!(turned("margin=1").unwrap_err().contains("late-margin"));
        assert!(
            method("noc")
                .unwrap()
                .knobs(&["a=1".to_owned()])
                .unwrap_err()
                .contains("no knobs")
        );
    }

    #[test]
    fn modes_say_of_themselves_what_the_methods_say() {
        for mode in method("hroc").unwrap().modes {
            let found = HrocMode::ALL
                .into_iter()
                .find(|m| m.name() == mode.name)
                .unwrap();
            assert_eq!(mode.host_sync, found.host_sync());
        }
    }
}
