//! What a run found, as data: schema 1 of the JSON that `hroc run --json` writes. README.md lists the fields
//! with their units.

use std::collections::BTreeMap;

use hroc_methods::HardwareTimes;
use serde::{Deserialize, Serialize};

use crate::sampling::Sampling;
use crate::unculled::{Fault, Removed};

/// The JSON's version.
pub const SCHEMA: u32 = 1;
/// Frames at the start that averages over spread frames leave out, as in the paper: caches and history are cold.
pub const WARM_UP_FRAMES: usize = 4;

/// A run of one method over one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct RunResults {
    pub schema: u32,
    pub scene: SceneInfo,
    /// Camera path: `walk-in`, `orbit` or a file's name.
    #[serde(default)]
    pub path: String,
    /// Of the camera path, see [`hash`](crate::hash); `None` in results of before there was one.
    #[serde(default)]
    pub path_hash: Option<String>,
    pub method: String,
    /// `None` for a method without modes.
    pub mode: Option<String>,
    /// What the method claims in this mode: `exact` or `approximate`.
    #[serde(default)]
    pub exactness: String,
    /// The method's knobs that were turned.
    pub knobs: BTreeMap<String, f64>,
    /// `published` or `adaptive`; `None` for a method without groups.
    pub grouping: Option<String>,
    /// Of adaptive grouping: the cost of a box in ray-box tests, as measured on the device.
    #[serde(default)]
    pub box_cost: Option<f64>,
    /// What draws and queries cost on the device, where a method of the run goes by it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardware: Option<Hardware>,
    /// `None` for a method that reads no tree.
    pub split: Option<String>,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// How frames were taken from the path; `spread` in results of before there was a choice.
    #[serde(default)]
    pub sampling: Sampling,
    /// Counted frames.
    pub frames: u32,
    /// How often every frame was timed.
    #[serde(default = "once")]
    pub repeats: u32,
    /// `standard` or `reversed`.
    pub depth: String,
    pub adapter: AdapterInfo,
    pub paths: Paths,
    pub memory_bytes: Memory,
    pub warnings: Vec<Warning>,
    /// Fragments per pixel of one frame; only where they were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overdraw: Option<Overdraw>,
    /// What is wrong with no culling itself; `None` in a run without the check.
    #[serde(default)]
    pub no_culling: Option<NoCulling>,
    pub per_frame: Vec<Frame>,
}

/// What the fragments of no culling say about `hroc_keeps`, summed over the frames. See [`crate::unculled`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NoCulling {
    /// Pixels where `hroc_keeps` changes what shows, by what it removes.
    pub removed: Removed,
    /// Pixels that show a fragment outside its object's padded bounds where nothing is discarded.
    pub strays: usize,
    /// Pixels that show such a fragment in spite of `hroc_keeps`.
    pub kept_strays: usize,
    /// Frames with a fault: a true fragment was removed, or a stray was kept.
    pub faulty_frames: usize,
}

impl NoCulling {
    /// The sums; `None` where a frame was not judged.
    pub fn of(frames: &[Frame]) -> Option<Self> {
        let mut sums = Self::default();
        for frame in frames {
            sums.removed += frame.removed?;
            sums.strays += frame.strays?;
            sums.kept_strays += frame.kept_strays?;
            sums.faulty_frames += usize::from(frame.fault.is_some());
        }
        Some(sums)
    }
}

const fn once() -> u32 {
    1
}

/// Fragments of the geometry that passed the depth test when they were drawn, per pixel of one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overdraw {
    /// Which frame, from 0.
    pub frame: u32,
    /// Fragments of the frame.
    pub fragments: u64,
    /// Pixels with any.
    pub covered_pixels: u64,
    /// Width and height of the map, cells.
    pub map_size: [u32; 2],
    /// Pixels along an edge of a cell.
    pub cell_px: u32,
    /// The map: a greyscale PNG of 16 bits in base64. A value is the cell's mean number of fragments per pixel,
    /// times 16.
    pub map_png_base64: String,
}

/// The scene of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct SceneInfo {
    pub name: String,
    pub objects: usize,
    /// As drawn: a mesh counts for each object that draws it.
    pub triangles: u64,
    pub file_bytes: u64,
    /// Of the baked file, see [`hash`](crate::hash); `None` in results of before there was one.
    #[serde(default)]
    pub hash: Option<String>,
}

/// What a run ran on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct AdapterInfo {
    pub name: String,
    pub driver: String,
    pub backend: String,
}

impl AdapterInfo {
    /// Of an open device.
    pub fn of(info: &wgpu::AdapterInfo) -> Self {
        Self {
            name: info.name.clone(),
            driver: format!("{} {}", info.driver, info.driver_info)
                .trim()
                .to_owned(),
            backend: info.backend.to_str().to_owned(),
        }
    }
}

/// What draws and queries cost on a device, milliseconds: [`HardwareTimes`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Hardware {
    pub draw_ms: f64,
    pub triangle_ms: f64,
    pub fragment_ms: f64,
    pub query_ms: f64,
    pub query_fragment_ms: f64,
    pub query_latency_ms: f64,
    pub query_overhead_ms: f64,
}

impl From<HardwareTimes> for Hardware {
    fn from(times: HardwareTimes) -> Self {
        Self {
            draw_ms: times.draw_ms,
            triangle_ms: times.triangle_ms,
            fragment_ms: times.fragment_ms,
            query_ms: times.query_ms,
            query_fragment_ms: times.query_fragment_ms,
            query_latency_ms: times.query_latency_ms,
            query_overhead_ms: times.query_overhead_ms,
        }
    }
}

/// Which of several ways a run took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Paths {
    /// How draw lists were submitted: `indirect-count`, `zeroed-tail` or `draw-loop`.
    pub submission: String,
    /// How hidden fragments of bounds were turned away: `forced`, before the shader, or `sampled`, in it.
    pub early_z: String,
    /// The grid that the rasterizer moves vertices to, pixels, as probed or assumed.
    pub subpixel_step_px: f64,
    /// The clock of `stages_ms`: `gpu` or `wall`. `frame_ms` is always the host's.
    pub clock: String,
}

/// GPU memory, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Vertices and indices.
    pub geometry: u64,
    /// Objects and meshes.
    pub objects: u64,
    /// The hierarchy; 0 for a method that reads none.
    pub tree: u64,
    /// The method's own buffers.
    pub method: u64,
}

/// Something to know when reading the figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Warning {
    /// The adapter is a CPU: milliseconds say little about GPUs, counters do.
    SoftwareAdapter {
        /// Its name.
        adapter: String,
    },
    /// No more frames than the warm-up: the averages hold all of them.
    NoWarmUp {
        /// Frames in the run.
        frames: u32,
    },
    /// The truth could not be kept for the next run.
    TruthNotCached {
        /// Why.
        reason: String,
    },
    /// The scene has no objects.
    EmptyScene,
    /// Some frames show no object.
    NothingVisible {
        /// How many frames.
        frames: u32,
        /// Frames in the run.
        of: u32,
    },
    /// The camera path has no room for the windows.
    ShortPath {
        /// Duration of the path, seconds.
        path_s: f64,
        /// Duration of all windows, seconds.
        windows_s: f64,
    },
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::SoftwareAdapter { adapter } => {
                write!(
                    f,
                    "'{adapter}' runs on the CPU: compare counters rather than milliseconds"
                )
            }
            Self::NoWarmUp { frames } => write!(
                f,
                "only {frames} frames: averages include the first {WARM_UP_FRAMES}, use --frames {} or more",
                WARM_UP_FRAMES + 1
            ),
            Self::TruthNotCached { reason } => f.write_str(reason),
            Self::EmptyScene => f.write_str("the scene has no objects"),
            Self::NothingVisible { frames, of } => write!(
                f,
                "no object is visible in {frames} of {of} frames, and C/R leaves them out; check the camera path"
            ),
            Self::ShortPath { path_s, windows_s } => write!(
                f,
                "the windows last {windows_s:.3} s together and the camera path {path_s:.3} s, so windows overlap or \
                 the camera rests after the last key; use fewer frames, or --sampling spread"
            ),
        }
    }
}

/// One frame. The fields of the check are `None` in a run without it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Number of the window, from 0; `None` without windows.
    #[serde(default)]
    pub window: Option<u32>,
    /// Seconds after the first key of the camera path; `None` in results of before it was written.
    #[serde(default)]
    pub t_s: Option<f64>,
    /// Objects that show.
    pub visible: Option<usize>,
    /// Objects whose bounds meet the view volume.
    pub in_frustum: Option<usize>,
    /// Objects drawn: V united with U.
    pub pvs: Option<usize>,
    /// Pixels whose depth bits are not the truth's.
    pub wrong_pixels: Option<usize>,
    /// Visible objects that were not drawn.
    pub false_negatives: Option<usize>,
    /// Pixels of right depth with another object's id.
    pub depth_ties: Option<usize>,
    /// Pixels where no culling shows something else without `hroc_keeps`, by what was removed.
    #[serde(default)]
    pub removed: Option<Removed>,
    /// Pixels of no culling without `hroc_keeps` whose fragment lies outside its object's padded bounds.
    #[serde(default)]
    pub strays: Option<usize>,
    /// Pixels of no culling with `hroc_keeps` whose fragment does.
    #[serde(default)]
    pub kept_strays: Option<usize>,
    /// The first fragment of no culling that `hroc_keeps` judged wrongly, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<Fault>,
    /// Hidden objects in the view volume that were not drawn, as a share of the hidden objects in it;
    /// `None` also where none is hidden.
    pub cull_rate: Option<f64>,
    /// Of a method that chooses among several: the one that drew the frame when it was timed last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub choice: Option<String>,
    /// Sizes of the sets.
    pub sets: SetSizes,
    /// From the first command recorded to the last one done, milliseconds.
    ///
    /// The median, where a frame was timed several times.
    pub frame_ms: f64,
    /// From the first stage's begin to the last one's end by the device's clock; `None` where it is not used.
    pub gpu_ms: Option<f64>,
    /// What `frame_ms` is the median of, in the order it was measured; empty where the frame was timed once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frame_samples_ms: Vec<f64>,
    /// What `gpu_ms` is the median of, likewise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gpu_samples_ms: Vec<f64>,
    /// Milliseconds per stage, from a replay that waits at each stage unless the device's clock is used; the mean of
    /// several such replays.
    pub stages_ms: BTreeMap<String, f64>,
    /// Work done.
    pub counters: Counters,
}

/// Sizes of the sets of a frame; `None`: the method has no such set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub struct SetSizes {
    /// Potential occluders: drawn first.
    pub v: Option<usize>,
    /// Effective occluders: those of V that show in the occlusion map.
    pub o: Option<usize>,
    /// Occludee groups.
    pub g: Option<usize>,
    /// Potentially visible occludees: drawn second.
    pub u: Option<usize>,
    /// Those of U that show.
    pub d: Option<usize>,
}

/// Work of a frame, from an instrumented replay; `None`: the method does no such work or cannot count it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Counters {
    pub draws: Option<u64>,
    pub triangles: Option<u64>,
    pub groups: Option<u64>,
    pub boxes_rasterized: Option<u64>,
    pub rays: Option<u64>,
    pub ray_box_tests: Option<u64>,
    /// Occlusion queries issued, those that spared nothing, and the waits for their answers.
    #[serde(default)]
    pub queries: Option<u64>,
    #[serde(default)]
    pub wasted_queries: Option<u64>,
    #[serde(default)]
    pub waits: Option<u64>,
}

impl RunResults {
    /// Method and mode in words, then what is not as by default: grouping, tree, knobs.
    pub fn label(&self) -> String {
        crate::run::label(
            &self.method,
            self.mode.as_deref(),
            self.grouping.as_deref(),
            self.split.as_deref(),
            (self.knobs.iter()).map(|(name, value)| (name.as_str(), *value)),
        )
    }

    /// The [`label`](Self::label) without knobs: what the settings of a sweep have in common.
    pub fn series(&self) -> String {
        crate::run::label(
            &self.method,
            self.mode.as_deref(),
            self.grouping.as_deref(),
            self.split.as_deref(),
            std::iter::empty(),
        )
    }

    /// Whether the method claims to draw the right image.
    pub fn is_exact(&self) -> bool {
        self.exactness == crate::registry::Exactness::Exact.name()
    }

    /// The faults of no culling, a line for each frame that has one.
    pub fn faults(&self) -> impl Iterator<Item = String> {
        let frames = self.per_frame.iter().enumerate();
        frames.filter_map(|(number, frame)| Some(format!("frame {number}, {}", frame.fault?)))
    }

    /// The JSON text.
    pub fn to_json(&self) -> String {
        let mut json = serde_json::to_string_pretty(self).expect("results become JSON");
        json.push('\n');
        json
    }

    /// The frames that averages are made of.
    ///
    /// Spread frames begin with a warm-up; other frames come after uncounted ones.
    pub fn steady_frames(&self) -> &[Frame] {
        if self.sampling == Sampling::Spread && self.per_frame.len() > WARM_UP_FRAMES {
            &self.per_frame[WARM_UP_FRAMES..]
        } else {
            &self.per_frame
        }
    }

    /// Wrong pixels and false negatives of all frames; `None` for a run without the check.
    pub fn errors(&self) -> Option<[usize; 2]> {
        let frames = self.per_frame.iter();
        frames
            .map(|frame| Some([frame.wrong_pixels?, frame.false_negatives?]))
            .try_fold([0; 2], |sum, frame| {
                let frame = frame?;
                Some([sum[0] + frame[0], sum[1] + frame[1]])
            })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::unculled::FaultKind;

    pub(crate) fn sample() -> RunResults {
        let frame = |frame_ms| Frame {
            window: None,
            t_s: Some(frame_ms),
            visible: Some(4),
            in_frustum: Some(8),
            pvs: Some(5),
            wrong_pixels: Some(0),
            false_negatives: Some(0),
            depth_ties: Some(1),
            removed: Some(Removed {
                stray: 2,
                ..Default::default()
            }),
            strays: Some(3),
            kept_strays: Some(0),
            fault: None,
            cull_rate: Some(0.75),
            sets: SetSizes {
                v: Some(4),
                u: Some(1),
                ..Default::default()
            },
            choice: None,
            frame_ms,
            gpu_ms: None,
            frame_samples_ms: Vec::new(),
            gpu_samples_ms: Vec::new(),
            stages_ms: [("pack".to_owned(), 0.25)].into(),
            counters: Counters {
                draws: Some(5),
                ..Default::default()
            },
        };
        let frames = [100.0, 100.0, 100.0, 100.0, 2.0, 4.0].map(frame).to_vec();
        RunResults {
            schema: SCHEMA,
            scene: SceneInfo {
                name: "room".into(),
                objects: 10,
                triangles: 120,
                file_bytes: 4096,
                hash: Some(crate::hash::text(1)),
            },
            path: "walk-in".into(),
            path_hash: Some(crate::hash::text(2)),
            method: "hroc".into(),
            mode: Some("of".into()),
            exactness: "exact".into(),
            knobs: [("late-margin".to_owned(), 0.5)].into(),
            grouping: Some("adaptive".into()),
            box_cost: Some(60.5),
            hardware: None,
            split: Some("sah".into()),
            size: [64, 36],
            sampling: Sampling::Spread,
            frames: 6,
            repeats: 1,
            depth: "reversed".into(),
            adapter: AdapterInfo {
                name: "a".into(),
                driver: "d".into(),
                backend: "vulkan".into(),
            },
            paths: Paths {
                submission: "indirect-count".into(),
                early_z: "sampled".into(),
                subpixel_step_px: 0.00390625,
                clock: "wall".into(),
            },
            memory_bytes: Memory {
                geometry: 1,
                objects: 2,
                tree: 3,
                method: 4,
            },
            warnings: vec![Warning::EmptyScene, Warning::NoWarmUp { frames: 2 }],
            overdraw: None,
            no_culling: NoCulling::of(&frames),
            per_frame: frames,
        }
    }

    #[test]
    fn json_round_trip_with_the_documented_names() {
        let results = sample();
        let json = results.to_json();
        assert_eq!(serde_json::from_str::<RunResults>(&json).unwrap(), results);
        let value: serde_json::Value = serde_json::from_str(&json).unwrap();
        let names = |value: &serde_json::Value| {
            value
                .as_object()
                .unwrap()
                .keys()
                .cloned()
                .collect::<Vec<_>>()
        };
        let sorted = |list: &str| {
            let mut list = list
                .split_whitespace()
                .map(str::to_owned)
                .collect::<Vec<_>>();
            list.sort();
            list
        };
        for (at, expected) in [
            (
                "",
                "schema scene path path_hash method mode exactness knobs grouping box_cost split size sampling frames repeats depth adapter paths memory_bytes warnings no_culling per_frame",
            ),
            ("/scene", "name objects triangles file_bytes hash"),
            ("/adapter", "name driver backend"),
            ("/paths", "submission early_z subpixel_step_px clock"),
            ("/no_culling", "removed strays kept_strays faulty_frames"),
            ("/per_frame/0/removed", "stray not_finite true"),
            ("/per_frame/0/sets", "V O G U D"),
            (
                "/per_frame/0/counters",
                "draws triangles groups boxes_rasterized rays ray_box_tests queries wasted_queries waits",
            ),
            (
                "/per_frame/0",
                "window t_s visible in_frustum pvs wrong_pixels false_negatives depth_ties removed strays kept_strays cull_rate sets frame_ms gpu_ms stages_ms counters",
            ),
        ] {
            let mut found = names(value.pointer(at).unwrap());
            found.sort();
            assert_eq!(found, sorted(expected), "{at}");
        }
        assert!(value["per_frame"][0]["sets"]["O"].is_null());
        // Results of before there were hashes, and before no culling was judged.
        let mut old = value.clone();
        old.as_object_mut().unwrap().remove("path_hash");
        old.as_object_mut().unwrap().remove("no_culling");
        for name in ["removed", "strays", "kept_strays"] {
            let frame = &mut old["per_frame"][0];
            frame.as_object_mut().unwrap().remove(name);
        }
        old["scene"].as_object_mut().unwrap().remove("hash");
        let old = serde_json::from_value::<RunResults>(old).unwrap();
        assert_eq!((old.path_hash, old.scene.hash), (None, None));
        assert_eq!((old.no_culling, old.per_frame[0].removed), (None, None));
        assert_eq!(value["warnings"][1]["kind"], "no_warm_up");
    }

    #[test]
    fn the_warm_up_is_left_out_and_errors_add_up() {
        let mut results = sample();
        assert_eq!(
            results
                .steady_frames()
                .iter()
                .map(|frame| frame.frame_ms)
                .collect::<Vec<_>>(),
            [2.0, 4.0]
        );
        assert_eq!(results.errors(), Some([0, 0]));
        results.per_frame[1].wrong_pixels = Some(3);
        assert_eq!(results.errors(), Some([3, 0]));
        let fault = Fault {
            kind: FaultKind::TrueRemoved,
            pixel: [5, 6],
            object: 7,
        };
        results.per_frame[3].fault = Some(fault);
        let sums = NoCulling::of(&results.per_frame).unwrap();
        assert_eq!((sums.removed.all(), sums.strays), (12, 18));
        assert_eq!((sums.kept_strays, sums.faulty_frames), (0, 1));
        let lines = results.faults().collect::<Vec<_>>();
        assert_eq!(lines, [format!("frame 3, {fault}")]);
        results.per_frame[0].removed = None;
        assert_eq!(NoCulling::of(&results.per_frame), None);
        results.per_frame[2].wrong_pixels = None;
        assert_eq!(results.errors(), None);
        results.per_frame.truncate(3);
        assert_eq!(results.steady_frames().len(), 3);
    }
}
