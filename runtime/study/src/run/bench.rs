//! What all replays of a run share.

use hroc_format::BakedScene;
use hroc_methods::Recorded;
use hroc_runtime::{Camera, CullingMethod, FrameContext, Scene, StageObserver, Tree};

use indicatif::ProgressBar;

use super::RunOptions;
use super::true_frames::TrueFrames;
use crate::camera_path::Cameras;
use crate::drawer::ObjectDrawer;
use crate::error::StudyError;
use crate::gpu::{Gpu, GpuError};
use crate::gpu_clock::GpuClock;
use crate::id_set::IdSet;
use crate::registry::{Parts, feature_names};
use crate::targets::FrameTargets;

/// A scene on the device, with targets and rendering: what all replays share.
pub(super) struct Bench<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) baked: &'a BakedScene,
    pub(super) options: &'a RunOptions,
    pub(super) scene: Scene,
    pub(super) tree: Option<Tree>,
    pub(super) targets: FrameTargets,
    pub(super) drawer: ObjectDrawer,
    pub(super) gpu_clock: Option<GpuClock>,
    /// For a method that is told what shows: the sets of all frames, and the one it reads.
    recording: Vec<IdSet>,
    recorded: Recorded,
}

impl<'a> Bench<'a> {
    pub(super) fn new(
        gpu: &'a Gpu,
        baked: &'a BakedScene,
        options: &'a RunOptions,
    ) -> Result<Self, StudyError> {
        let missing = options.method.features - gpu.device.features();
        if !missing.is_empty() {
            return Err(StudyError::Gpu(GpuError::MethodUnfit {
                method: options.method.name,
                features: feature_names(missing),
                adapter: gpu.info.name.clone(),
            }));
        }
        gpu.check_size(options.size)?;
        let upload_tree = || Tree::upload(&gpu.device, baked.scene(), &options.split);
        let tree = options.method.uses_tree.then(upload_tree).transpose()?;
        let scene = Scene::upload(&gpu.device, &options.profile, baked.scene())?;
        let targets = FrameTargets::new(&gpu.device, options.size);
        let drawer = ObjectDrawer::new(&gpu.device, &scene, &targets, options.depth);
        let gpu_clock = GpuClock::choose(gpu, options.clock)?;
        gpu.check()?;
        Ok(Self {
            gpu,
            baked,
            options,
            scene,
            tree,
            targets,
            drawer,
            gpu_clock,
            recording: Vec::new(),
            recorded: Recorded::default(),
        })
    }

    /// The method, without history.
    pub(super) fn method(&self, count_work: bool) -> Result<Box<dyn CullingMethod>, StudyError> {
        let method = (self.options.method.make)(&Parts {
            device: &self.gpu.device,
            scene: &self.scene,
            tree: self.tree.as_ref(),
            depth: self.options.depth,
            mode: self.options.mode.name,
            grouping: self.options.grouping,
            knobs: &self.options.knobs,
            baked: self.baked.scene(),
            recorded: &self.recorded,
            count_work,
        });
        self.gpu.check()?;
        Ok(method)
    }

    /// Finds out what shows in each frame of the path.
    pub(super) fn record(&mut self, progress: &ProgressBar) -> Result<(), StudyError> {
        let mut truth = TrueFrames::new(self);
        let recording = (0..self.options.frames).map(|frame| {
            progress.inc(1);
            Ok(truth.frame(self, frame)?.visible)
        });
        self.recording = recording.collect::<Result<_, StudyError>>()?;
        Ok(())
    }

    /// Where frame `frame` is seen from.
    pub(super) fn camera(&self, frame: u32) -> Camera {
        self.options.path.frame(frame, self.options.frames)
    }

    /// Records frame `frame` of the path by `method` into `encoder`.
    pub(super) fn encode(
        &mut self,
        method: &mut dyn CullingMethod,
        frame: u32,
        encoder: &mut wgpu::CommandEncoder,
        observer: Option<&mut dyn StageObserver>,
    ) -> Result<(), StudyError> {
        let at = |source| StudyError::Camera { frame, source };
        let camera = self.camera(frame);
        let Self { gpu, options, .. } = self;
        if let Some(visible) = self.recording.get(frame as usize) {
            self.recorded.show(visible.words());
        }
        self.drawer
            .set_camera(
                &gpu.queue,
                &camera,
                options.depth,
                options.size,
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
        method.encode(&mut context, &mut self.drawer).map_err(at)
    }
}
