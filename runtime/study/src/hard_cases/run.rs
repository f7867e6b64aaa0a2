//! Every method over a case, frame by frame beside no culling.

use std::time::Instant;

use hroc_format::{ArchivedObjectBounds, ArchivedScene, BakedScene};
use hroc_methods::Recorded;
use hroc_runtime::moving::MovingObjects;
use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, DeviceProfile, FrameContext, FrameUniform,
    Grouping, Noc, Scene, Tree, readback,
};
use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};

use super::no_culling::{self, CaseFault, CaseNoCulling};
use super::sampling::steps;
use super::{CaseFrame, CaseScene, HardCase, Scale};
use crate::blended_truth::BlendedTruth;
use crate::check::FrameCheck;
use crate::drawer::{Guard, ObjectDrawer};
use crate::drawn::Drawn;
use crate::error::StudyError;
use crate::gpu::Gpu;
use crate::image::{Image, ImageCopy};
use crate::registry::{Exactness, Knobs, Method, Mode, Parts, feature_names};
use crate::results::AdapterInfo;
use crate::sampling::Sampling;
use crate::table;
use crate::targets::FrameTargets;
use crate::unculled::{self, Judgement, Unculled};

/// The JSON's version.
pub const SCHEMA: u32 = 1;

/// What to run.
#[derive(Clone, Debug)]
pub struct HardCaseOptions {
    /// The cases.
    pub cases: Vec<&'static HardCase>,
    /// The methods.
    pub methods: Vec<&'static Method>,
    /// How much of each case.
    pub scale: Scale,
    /// Size of frames that have none of their own, pixels.
    pub size: [u32; 2],
    /// How frames are taken from the lists of the cases.
    pub sampling: Sampling,
    /// Device paths to force, beside both groupings; empty: the device's own path and the default grouping.
    pub paths: Vec<DeviceProfile>,
}

/// What `hroc hard-cases --json` writes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct HardCaseResults {
    pub schema: u32,
    /// `small` or `full`.
    pub scale: String,
    /// Of frames that have no size of their own, pixels.
    pub size: [u32; 2],
    /// How frames were taken from the lists of the cases.
    #[serde(default)]
    pub sampling: Sampling,
    pub adapter: AdapterInfo,
    /// Methods that were left out, and the device features they lack.
    pub skipped: Vec<Skipped>,
    pub cases: Vec<CaseResult>,
}

/// A method that the device cannot run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Skipped {
    pub method: String,
    pub lacks: String,
}

/// A case and what each method made of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct CaseResult {
    pub case: String,
    /// What went wrong in other systems.
    pub failure: String,
    pub objects: usize,
    /// As drawn: a mesh counts for each object that draws it.
    pub triangles: u64,
    /// Number of views.
    pub views: usize,
    /// From nothing to trees, ms.
    pub bake_ms: f64,
    /// No culling itself, in each depth convention.
    #[serde(default)]
    pub no_culling: Vec<CaseNoCulling>,
    pub runs: Vec<MethodResult>,
}

/// A method, in one of its modes, with one tree and one depth convention, over a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct MethodResult {
    pub method: String,
    pub mode: Option<String>,
    pub split: Option<String>,
    /// `published` or `adaptive`; `None` for a method without groups.
    pub grouping: Option<String>,
    /// As in [`Paths`](crate::results::Paths).
    pub submission: String,
    /// As in [`Paths`](crate::results::Paths).
    pub early_z: String,
    /// `standard` or `reversed`.
    pub depth: String,
    /// `exact` or `approximate`.
    pub exactness: String,
    pub frames: u32,
    /// Summed over frames, as the next four.
    pub wrong_pixels: usize,
    pub false_negatives: usize,
    pub depth_ties: usize,
    /// Objects that show.
    pub visible: usize,
    /// Objects drawn.
    pub drawn: usize,
    /// By the host's clock, from the first command until the device is idle; summed.
    pub ms: f64,
    /// The frames with errors.
    pub failures: Vec<Failure>,
}

/// A frame that differs from no culling.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Failure {
    /// Number among the counted frames, from 0.
    pub frame: usize,
    pub size: [u32; 2],
    pub wrong_pixels: usize,
    pub false_negatives: usize,
}

/// Runs the methods over the cases.
///
/// # Errors
/// If a case is refused or does not fit the device, or the device fails.
pub fn run(
    gpu: &Gpu,
    options: &HardCaseOptions,
    progress: &ProgressBar,
) -> Result<HardCaseResults, StudyError> {
    gpu.check_size(options.size)?;
    let missing = |method: &Method| method.features - gpu.device.features();
    let (fit, unfit) = options
        .methods
        .iter()
        .copied()
        .partition::<Vec<_>, _>(|method| missing(method).is_empty());
    progress.set_length(options.cases.len() as u64);
    let cases = options.cases.iter().map(|case| {
        progress.set_message(case.name);
        let result = run_case(gpu, case, &fit, options);
        progress.inc(1);
        result
    });
    Ok(HardCaseResults {
        schema: SCHEMA,
        scale: options.scale.name().to_owned(),
        size: options.size,
        sampling: options.sampling,
        cases: cases.collect::<Result<_, _>>()?,
        adapter: AdapterInfo::of(&gpu.info),
        skipped: unfit
            .into_iter()
            .map(|method| Skipped {
                method: method.name.to_owned(),
                lacks: feature_names(missing(method)),
            })
            .collect(),
    })
}

fn run_case(
    gpu: &Gpu,
    case: &HardCase,
    methods: &[&'static Method],
    options: &HardCaseOptions,
) -> Result<CaseResult, StudyError> {
    let began = Instant::now();
    let generated = (case.make)(options.scale);
    let refused = |source| StudyError::HardCase {
        case: case.name,
        source,
    };
    let baked = generated.bake().map_err(refused)?;
    let bake_ms = began.elapsed().as_secs_f64() * 1e3;
    let stage = Stage::new(gpu, &baked, &generated)?;
    let variants = methods
        .iter()
        .flat_map(|method| stage.variants(method, &options.paths))
        .collect::<Vec<_>>();
    let (mut runs, mut no_culling) = (Vec::new(), Vec::new());
    for depth in DepthConvention::ALL {
        let (found, judged) = stage.run(&generated, &variants, depth, options)?;
        runs.extend(found);
        no_culling.push(judged);
    }
    let scene = baked.scene();
    Ok(CaseResult {
        case: case.name.to_owned(),
        failure: case.failure.to_owned(),
        objects: scene.objects.len(),
        triangles: scene.drawn_triangle_count(),
        views: generated.view_count(),
        bake_ms,
        no_culling,
        runs,
    })
}

/// A method as it is run: in a mode, with a tree.
#[derive(Clone)]
struct Variant<'a> {
    method: &'static Method,
    mode: &'static Mode,
    tree: Option<&'a Tree>,
    profile: DeviceProfile,
    grouping: Grouping,
}

/// A scene on the device with all its trees.
struct Stage<'a> {
    gpu: &'a Gpu,
    baked: &'a BakedScene,
    scene: Scene,
    trees: Vec<Tree>,
}

impl<'a> Stage<'a> {
    fn new(gpu: &'a Gpu, baked: &'a BakedScene, generated: &CaseScene) -> Result<Self, StudyError> {
        let capacity = generated.motion.map_or(0, |motion| motion.capacity);
        let scene = Scene::upload_with_moving(&gpu.device, &gpu.profile, baked.scene(), capacity)?;
        let trees = splits(baked.scene())
            .into_iter()
            .map(|split| Tree::upload(&gpu.device, baked.scene(), split));
        let trees = trees.collect::<Result<_, _>>()?;
        gpu.check()?;
        Ok(Self {
            gpu,
            baked,
            scene,
            trees,
        })
    }

    /// All ways to run `method`.
    fn variants(&self, method: &'static Method, paths: &[DeviceProfile]) -> Vec<Variant<'_>> {
        let groupings = [Grouping::Published, Grouping::Adaptive { box_cost: 64.0 }];
        let (profiles, groupings) = match paths {
            [] => (vec![self.gpu.profile.clone()], vec![Grouping::default()]),
            paths if method.groups => (paths.to_vec(), groupings.to_vec()),
            paths => (paths.to_vec(), vec![Grouping::default()]),
        };
        let trees = if method.uses_tree {
            self.trees.iter().map(Some).collect()
        } else {
            vec![None]
        };
        let mut variants = Vec::new();
        for mode in method.modes {
            for &tree in &trees {
                for profile in &profiles {
                    variants.extend(groupings.iter().map(|&grouping| Variant {
                        method,
                        mode,
                        tree,
                        profile: profile.clone(),
                        grouping,
                    }));
                }
            }
        }
        variants
    }

    /// All variants side by side: only one true image at a time has to be kept.
    fn run(
        &self,
        case: &CaseScene,
        variants: &[Variant<'_>],
        depth: DepthConvention,
        options: &HardCaseOptions,
    ) -> Result<(Vec<MethodResult>, CaseNoCulling), StudyError> {
        let device = &self.gpu.device;
        let size = options.size;
        let steps = steps(case, options.sampling).map_err(StudyError::Usage)?;
        let is_told = (variants.iter()).any(|variant| variant.method.is_told);
        let size_of = |frame: &CaseFrame| frame.size.unwrap_or(size);
        let first_size = case.frames.first().map_or(size, size_of);
        self.gpu.check_size(first_size)?;
        let mut targets = FrameTargets::new(device, first_size);
        let mut drawers = [Guard::Snippet, Guard::Off, Guard::Finite].map(|guard| {
            ObjectDrawer::with_guard(device, &self.scene, &targets, depth, true, guard)
        });
        let mut judged = CaseNoCulling::new(depth);
        let mut truth = Noc::new(device, &self.scene, depth);
        let blended = BlendedTruth::new(self.gpu, self.baked.scene(), &self.scene, depth);
        let recorded = Recorded::default();
        let make = |variant: &Variant<'_>| self.method(variant, depth, &recorded);
        let mut methods = (0..case.view_count())
            .map(|_| variants.iter().map(make).collect::<Vec<_>>())
            .collect::<Vec<_>>();
        self.gpu.check()?;
        let mut results = variants
            .iter()
            .map(|variant| variant.result(depth))
            .collect::<Vec<_>>();
        let mut scene = self.scene.clone();
        let mut moving = MovingObjects::new(self.baked.scene(), &scene);
        let mut counted = 0;
        for (number, step) in steps.iter().enumerate() {
            let frame = &step.frame;
            let size = size_of(frame);
            if targets.targets().size != size {
                self.gpu.check_size(size)?;
                targets = FrameTargets::new(device, size);
                for drawer in &mut drawers {
                    drawer.draw_into(&targets);
                }
            }
            if let Some(motion) = &case.motion {
                let baked = self.baked.scene();
                motion.advance(number, baked, &mut moving, &self.gpu.queue, &mut scene);
            }
            let view = View {
                scene: &scene,
                targets: &targets,
                frame,
                number,
            };
            if step.forgets {
                self.forget(&mut methods[frame.view])?;
            }
            let [drawer, plain, finite] = &mut drawers;
            if !step.counted && !is_told {
                for method in &mut methods[frame.view] {
                    self.draw(&mut **method, drawer, &view)?;
                }
                continue;
            }
            // The truth last: it stays in the targets.
            let (plain, _) = self.draw(&mut truth, plain, &view)?;
            let (finite, _) = self.draw(&mut truth, finite, &view)?;
            let (truth, _) = self.draw(&mut truth, drawer, &view)?;
            if step.counted {
                let images = Unculled {
                    kept: &truth,
                    plain: &plain,
                    finite: &finite,
                };
                judged.add(counted, size, &self.judge(images, &view, depth)?);
            }
            let mut visible = truth.visible();
            if let Some(blended) = &blended {
                let shown = blended.shown(self.gpu, &scene, &frame.camera, targets.targets());
                visible = visible.union(&shown.map_err(|source| view.error(source))?);
            }
            recorded.show(visible.words());
            for (method, result) in methods[frame.view].iter_mut().zip(&mut results) {
                let (image, ms) = self.draw(&mut **method, drawer, &view)?;
                if !step.counted {
                    continue;
                }
                let drawn = Drawn::read(self.gpu, &**method).all();
                let check = FrameCheck::new(&truth, &image, &visible, &drawn);
                result.add(counted, size, check, drawn.len(), ms);
            }
            counted += usize::from(step.counted);
        }
        // What moved out of the tree must be back for the next depth convention.
        self.restore(&mut moving, &mut scene);
        Ok((results, judged))
    }

    /// Judges the images of a frame of no culling.
    fn judge(
        &self,
        images: Unculled<'_>,
        view: &View<'_>,
        depth: DepthConvention,
    ) -> Result<Judgement, StudyError> {
        let size = view.targets.targets().size;
        let uniform = FrameUniform::new(&view.frame.camera, depth, size, &view.scene.shape)
            .map_err(|source| view.error(source))?;
        // From the device: objects that move have bounds nowhere else.
        let words = readback::words(&self.gpu.device, &self.gpu.queue, &view.scene.object_bounds);
        let bounds = bytemuck::cast_slice::<u32, ArchivedObjectBounds>(
            &words[..view.scene.shape.object_count as usize * 8],
        );
        let bounds = bounds.iter().map(|bounds| bounds.to_native());
        Ok(unculled::judge(
            images,
            &uniform,
            depth,
            &bounds.collect::<Vec<_>>(),
        ))
    }

    /// Takes the history of `methods` away, as an application does at a camera cut.
    fn forget(&self, methods: &mut [Box<dyn CullingMethod>]) -> Result<(), StudyError> {
        let mut encoder = self.gpu.encoder();
        for method in methods {
            method.reset(&mut encoder);
        }
        Ok(self.gpu.submit_and_wait(encoder)?)
    }

    /// Shows every object of the bake again and removes all others.
    fn restore(&self, moving: &mut MovingObjects, scene: &mut Scene) {
        *moving = MovingObjects::new(self.baked.scene(), &self.scene);
        moving.rewrite(&self.gpu.queue, scene);
    }

    fn method(
        &self,
        variant: &Variant<'_>,
        depth: DepthConvention,
        recorded: &Recorded,
    ) -> Box<dyn CullingMethod> {
        let scene = Scene {
            profile: variant.profile.clone(),
            ..self.scene.clone()
        };
        (variant.method.make)(&Parts {
            device: &self.gpu.device,
            queue: &self.gpu.queue,
            scene: &scene,
            tree: variant.tree,
            depth,
            mode: variant.mode.name,
            grouping: variant.grouping,
            knobs: &Knobs::default(),
            baked: self.baked.scene(),
            recorded,
            count_work: false,
        })
    }

    /// Draws a frame; the image, and how long it took without reading it.
    fn draw(
        &self,
        method: &mut dyn CullingMethod,
        drawer: &mut ObjectDrawer,
        view: &View<'_>,
    ) -> Result<(Image, f64), StudyError> {
        let gpu = self.gpu;
        let targets = view.targets.targets();
        let (camera, shape) = (&view.frame.camera, &view.scene.shape);
        let began = Instant::now();
        let mut encoder = gpu.encoder();
        drawer
            .set_camera(&gpu.queue, camera, method.depth(), targets.size, shape)
            .map_err(|source| view.error(source))?;
        let mut context = FrameContext {
            device: &gpu.device,
            queue: &gpu.queue,
            encoder: &mut encoder,
            scene: view.scene,
            camera,
            targets,
            observer: None,
        };
        method
            .encode(&mut context, drawer)
            .map_err(|source| view.error(source))?;
        gpu.submit_and_wait(encoder)?;
        let ms = began.elapsed().as_secs_f64() * 1e3;
        method.took(view.number as u64, ms);
        let mut encoder = gpu.encoder();
        let copy = ImageCopy::record(&gpu.device, &mut encoder, view.targets);
        gpu.submit_and_wait(encoder)?;
        Ok((copy.wait(&gpu.device), ms))
    }
}

/// A frame to draw.
struct View<'a> {
    scene: &'a Scene,
    targets: &'a FrameTargets,
    frame: &'a CaseFrame,
    number: usize,
}

impl View<'_> {
    fn error(&self, source: CameraError) -> StudyError {
        StudyError::Camera {
            frame: self.number as u32,
            source,
        }
    }
}

/// The trees to run with; an empty scene has none, and any name gives the empty tree.
fn splits(scene: &ArchivedScene) -> Vec<&str> {
    let splits = scene
        .bvhs
        .iter()
        .map(|bvh| bvh.split.as_str())
        .collect::<Vec<_>>();
    if splits.is_empty() {
        vec!["sah"]
    } else {
        splits
    }
}

impl Variant<'_> {
    fn result(&self, depth: DepthConvention) -> MethodResult {
        MethodResult {
            method: self.method.name.to_owned(),
            mode: (!self.mode.name.is_empty()).then(|| self.mode.name.to_owned()),
            split: self.tree.map(|tree| tree.split.clone()),
            grouping: (self.method.groups).then(|| self.grouping.name().to_owned()),
            submission: self.profile.submission.name().to_owned(),
            early_z: self.profile.early_z.name().to_owned(),
            depth: depth.name().to_owned(),
            exactness: self.mode.exactness.name().to_owned(),
            frames: 0,
            wrong_pixels: 0,
            false_negatives: 0,
            depth_ties: 0,
            visible: 0,
            drawn: 0,
            ms: 0.0,
            failures: Vec::new(),
        }
    }
}

impl MethodResult {
    /// Adds a frame of which so many objects were drawn.
    fn add(&mut self, frame: usize, size: [u32; 2], check: FrameCheck, drawn: usize, ms: f64) {
        let FrameCheck {
            wrong_pixels,
            false_negatives,
            ..
        } = check;
        self.frames += 1;
        self.wrong_pixels += wrong_pixels;
        self.false_negatives += false_negatives;
        self.depth_ties += check.depth_ties;
        self.visible += check.visible;
        self.drawn += drawn;
        self.ms += ms;
        if !check.passed() {
            self.failures.push(Failure {
                frame,
                size,
                wrong_pixels,
                false_negatives,
            });
        }
    }

    /// Errors of a method that may have none.
    pub fn failed(&self) -> bool {
        self.exactness == Exactness::Exact.name() && !self.failures.is_empty()
    }

    /// Method, mode and tree.
    pub fn label(&self) -> String {
        let grouping = self
            .grouping
            .as_ref()
            .filter(|name| *name != Grouping::default().name());
        [
            Some(&self.method),
            self.mode.as_ref(),
            self.split.as_ref(),
            grouping,
        ]
        .into_iter()
        .flatten()
        .map(String::as_str)
        .collect::<Vec<_>>()
        .join(" ")
    }
}

impl HardCaseResults {
    /// A method that claims to be exact was not, or no culling has faults of its own.
    pub fn failed(&self) -> bool {
        let failed = |case: &CaseResult| {
            case.runs.iter().any(MethodResult::failed)
                || (case.no_culling.iter()).any(|judged| !judged.faults.is_empty())
        };
        self.cases.iter().any(failed)
    }

    /// As JSON, with a line's end.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain data") + "\n"
    }

    /// A table of case x method, depth conventions and device paths together, then what failed.
    pub fn markdown(&self) -> String {
        let mut rows = Vec::new();
        for case in &self.cases {
            let mut labels = Vec::new();
            for label in case.runs.iter().map(MethodResult::label) {
                if !labels.contains(&label) {
                    labels.push(label);
                }
            }
            for label in labels {
                let runs = || case.runs.iter().filter(|run| run.label() == label);
                let sum =
                    |part: fn(&MethodResult) -> usize| runs().map(part).sum::<usize>().to_string();
                let frames = runs().map(|run| run.frames).sum::<u32>();
                let ms = runs().map(|run| run.ms).sum::<f64>() / f64::from(frames.max(1));
                rows.push([
                    case.case.clone(),
                    label.clone(),
                    sum(|run| run.wrong_pixels),
                    sum(|run| run.false_negatives),
                    sum(|run| run.depth_ties),
                    frames.to_string(),
                    case.objects.to_string(),
                    sum(|run| run.drawn),
                    sum(|run| run.visible),
                    format!("{ms:.2}"),
                ]);
            }
        }
        let head = [
            "case",
            "method",
            "wrong pixels",
            "false negatives",
            "depth ties",
            "frames",
            "objects",
            "drawn",
            "visible",
            "ms/frame",
        ];
        let mut text = table::markdown(head, rows) + &no_culling::table(&self.cases);
        if self.sampling != Sampling::Spread {
            text += &format!(
                "\n--sampling {}: the listed frames of a case are the keys of a camera path, one each second; cases whose \
                 objects move keep their own frames\n",
                self.sampling.name()
            );
        }
        for skipped in &self.skipped {
            text += &format!(
                "\nleft out: {} needs {}, which this device lacks\n",
                skipped.method, skipped.lacks
            );
        }
        for case in &self.cases {
            for judged in &case.no_culling {
                if let Some(CaseFault { frame, size, fault }) = judged.faults.first() {
                    text += &format!(
                        "\nFAILED: {} without culling ({} depth): {} frames have faults, first frame {frame} at {}x{}, {fault}\n",
                        case.case,
                        judged.depth,
                        judged.faults.len(),
                        size[0],
                        size[1],
                    );
                }
            }
            for run in case.runs.iter().filter(|run| run.failed()) {
                let Failure {
                    frame,
                    size,
                    wrong_pixels,
                    false_negatives,
                } = run.failures[0];
                text += &format!(
                    "\nFAILED: {} by {} ({} depth, {}, {}): {} of {} frames differ from no culling, first frame {frame} at {}x{}: {wrong_pixels} wrong pixels, {false_negatives} false negatives\n",
                    case.case,
                    run.label(),
                    run.depth,
                    run.submission,
                    run.early_z,
                    run.failures.len(),
                    run.frames,
                    size[0],
                    size[1],
                );
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id_set::IdSet;
    use crate::unculled::{Fault, FaultKind, Removed};
    use hroc_format::NO_OBJECT;
    use hroc_runtime::{EarlyZ, Mutant, Submission};

    fn image(depth: f32, item: u32) -> Image {
        Image {
            depth_bits: vec![depth.to_bits()],
            items: vec![item],
        }
    }

    #[test]
    fn a_lost_object_fails_an_exact_method_and_is_reported_of_an_approximate_one() {
        let method = |name| crate::registry::method(name).unwrap();
        let variant = |method| Variant {
            method,
            mode: &method.modes[0],
            tree: None,
            profile: DeviceProfile {
                submission: Submission::IndirectCount,
                early_z: EarlyZ::Forced,
                subpixel_step_px: 0.0625,
                mutant: Mutant::None,
                pipelines: Default::default(),
            },
            grouping: Grouping::default(),
        };
        let mut run = variant(method("hroc")).result(DepthConvention::Reversed);
        let (truth, lost) = (image(0.5, 3), image(0.0, NO_OBJECT));
        let visible = truth.visible();
        let right = FrameCheck::new(&truth, &truth, &visible, &visible);
        run.add(0, [1, 1], right, 1, 1.0);
        assert!(!run.failed());
        let wrong = FrameCheck::new(&truth, &lost, &visible, &IdSet::default());
        run.add(1, [1, 1], wrong, 0, 1.0);
        assert!(run.failed());
        assert_eq!((run.frames, run.visible, run.drawn), (2, 2, 1));
        let mut results = HardCaseResults {
            schema: SCHEMA,
            scale: Scale::Small.name().to_owned(),
            size: [1, 1],
            sampling: Sampling::Spread,
            adapter: AdapterInfo {
                name: String::new(),
                driver: String::new(),
                backend: String::new(),
            },
            skipped: Vec::new(),
            cases: vec![CaseResult {
                case: "two-objects".to_owned(),
                failure: String::new(),
                objects: 2,
                triangles: 24,
                views: 1,
                bake_ms: 1.0,
                no_culling: Vec::new(),
                runs: vec![run],
            }],
        };
        assert!(results.failed());
        let told = "FAILED: two-objects by hroc of (reversed depth, indirect-count, forced): 1 of 2 frames differ from no culling, first frame 1 at 1x1: 1 wrong pixels, 1 false negatives";
        assert!(results.markdown().contains(told), "{}", results.markdown());
        let again = serde_json::from_str::<HardCaseResults>(&results.to_json()).unwrap();
        assert_eq!(again, results);

        results.cases[0].runs[0].exactness = Exactness::Approximate.name().to_owned();
        assert!(!results.failed() && !results.markdown().contains("FAILED"));
        assert_eq!(results.cases[0].runs[0].wrong_pixels, 1);

        // A fault of no culling fails the case, whatever the methods claim.
        let mut judged = CaseNoCulling::new(DepthConvention::Standard);
        judged.add(0, [8, 4], &Judgement::default());
        results.cases[0].no_culling.push(judged);
        assert!(!results.failed());
        let fault = Fault {
            kind: FaultKind::TrueRemoved,
            pixel: [3, 2],
            object: 1,
        };
        let judgement = Judgement {
            removed: Removed {
                true_: 1,
                ..Default::default()
            },
            first_fault: Some(fault),
            ..Default::default()
        };
        results.cases[0].no_culling[0].add(1, [8, 4], &judgement);
        assert!(results.failed());
        let told = "FAILED: two-objects without culling (standard depth): 1 frames have faults, first frame 1 at 8x4, pixel (3, 2), object 1";
        assert!(results.markdown().contains(told), "{}", results.markdown());
        let table = results.markdown().replace(' ', "");
        assert!(
            table.contains("|two-objects|standard|0|0|1|0|0|"),
            "{table}"
        );
    }
}
