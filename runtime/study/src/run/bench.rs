//! What all contenders of a run share on the device.

use std::collections::BTreeMap;

use hroc_format::BakedScene;
use hroc_methods::Recorded;
use hroc_runtime::{Camera, CullingMethod, FrameContext, Scene, StageObserver, Tree};

use super::contender::{Contender, Course};
use super::overdraw::OverdrawTarget;
use crate::camera_path::Cameras;
use crate::drawer::ObjectDrawer;
use crate::error::StudyError;
use crate::gpu::{Gpu, GpuError};
use crate::gpu_clock::GpuClock;
use crate::hash;
use crate::id_set::IdSet;
use crate::registry::{Parts, feature_names};
use crate::sampling::{Schedule, Step};
use crate::targets::FrameTargets;

/// A scene on the device with its trees, targets and rendering. There is one of each, whoever draws.
pub(super) struct Bench<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) baked: &'a BakedScene,
    pub(super) course: &'a Course,
    /// All frames that each replay draws.
    pub(super) schedule: Schedule,
    /// Of the baked file.
    pub(super) scene_hash: u128,
    pub(super) scene: Scene,
    trees: BTreeMap<String, Tree>,
    pub(super) targets: FrameTargets,
    drawer: ObjectDrawer,
    pub(super) overdraw: Option<OverdrawTarget>,
    pub(super) gpu_clock: Option<GpuClock>,
    /// For methods that are told what shows: the sets of all frames drawn so far, and the one they read.
    pub(super) recording: Vec<IdSet>,
    recorded: Recorded,
}

/// How a frame is drawn.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Output {
    Color,
    /// Into the target that counts fragments.
    FragmentCount,
}

impl<'a> Bench<'a> {
    pub(super) fn new(
        gpu: &'a Gpu,
        baked: &'a BakedScene,
        course: &'a Course,
    ) -> Result<Self, StudyError> {
        let schedule = Schedule::new(course.sampling, course.frames, &course.path)
            .map_err(StudyError::Usage)?;
        gpu.check_size(course.size)?;
        let scene = Scene::upload(&gpu.device, &course.profile, baked.scene())?;
        let targets = FrameTargets::new(&gpu.device, course.size);
        let drawer = ObjectDrawer::new(&gpu.device, &scene, &targets, course.depth);
        let overdraw = course
            .overdraw_frame
            .map(|_| OverdrawTarget::new(&gpu.device, &scene, course));
        let gpu_clock = GpuClock::choose(gpu, course.clock)?;
        gpu.check()?;
        Ok(Self {
            gpu,
            baked,
            course,
            schedule,
            scene_hash: hash::scene(baked),
            scene,
            trees: BTreeMap::new(),
            targets,
            drawer,
            overdraw,
            gpu_clock,
            recording: Vec::new(),
            recorded: Recorded::default(),
        })
    }

    /// Makes sure that `contender` can run here, and that its tree is on the device.
    pub(super) fn admit(&mut self, contender: &Contender) -> Result<(), StudyError> {
        let missing = contender.method.features - self.gpu.device.features();
        if !missing.is_empty() {
            return Err(StudyError::Gpu(GpuError::MethodUnfit {
                method: contender.method.name,
                features: feature_names(missing),
                adapter: self.gpu.info.name.clone(),
            }));
        }
        if contender.method.uses_tree && !self.trees.contains_key(&contender.split) {
            let tree = Tree::upload(&self.gpu.device, self.baked.scene(), &contender.split)?;
            self.trees.insert(contender.split.clone(), tree);
        }
        Ok(self.gpu.check()?)
    }

    /// The tree of a contender that reads one.
    pub(super) fn tree(&self, contender: &Contender) -> Option<&Tree> {
        let uses_tree = contender.method.uses_tree;
        uses_tree.then(|| self.trees.get(&contender.split))?
    }

    /// The method of `contender`, without history.
    pub(super) fn method(
        &self,
        contender: &Contender,
        count_work: bool,
    ) -> Result<Box<dyn CullingMethod>, StudyError> {
        let method = (contender.method.make)(&Parts {
            device: &self.gpu.device,
            queue: &self.gpu.queue,
            scene: &self.scene,
            baked: self.baked.scene(),
            tree: self.tree(contender),
            depth: self.course.depth,
            mode: contender.mode.name,
            grouping: contender.grouping,
            knobs: &contender.knobs,
            recorded: &self.recorded,
            count_work,
        });
        self.gpu.check()?;
        Ok(method)
    }

    /// Where a frame is seen from.
    pub(super) fn camera(&self, step: &Step) -> Camera {
        self.course.path.camera_at(step.t_s)
    }

    /// Makes `visible` what methods that are told read from now on. `number` counts the steps.
    pub(super) fn show_recorded(&self, number: usize) {
        if let Some(visible) = self.recording.get(number) {
            self.recorded.show(visible.words());
        }
    }

    /// Records a frame by `method` into `encoder`.
    pub(super) fn encode(
        &mut self,
        method: &mut dyn CullingMethod,
        step: &Step,
        encoder: &mut wgpu::CommandEncoder,
        output: Output,
        observer: Option<&mut dyn StageObserver>,
    ) -> Result<(), StudyError> {
        let at = |source| StudyError::Camera {
            frame: step.frame,
            source,
        };
        let camera = self.camera(step);
        let Self { gpu, course, .. } = self;
        let drawer = match (output, &mut self.overdraw) {
            (Output::FragmentCount, Some(overdraw)) => &mut overdraw.drawer,
            _ => &mut self.drawer,
        };
        drawer
            .set_camera(
                &gpu.queue,
                &camera,
                course.depth,
                course.size,
                &self.scene.shape,
            )
            .map_err(at)?;
        let mut context = FrameContext {
            device: &gpu.device,
            queue: &gpu.queue,
            encoder,
            scene: &self.scene,
            camera: &camera,
            targets: self.targets.targets(),
            // Shortens the lifetime inside the option, which only a direct reference allows.
            observer: match observer {
                Some(observer) => Some(observer),
                None => None,
            },
        };
        method.encode(&mut context, drawer).map_err(at)
    }
}
