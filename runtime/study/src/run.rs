//! A run: one method over the frames of a camera path, replayed once per question so that no answer disturbs
//! another. Every replay starts without history.
//!
//! 1. *Timed*: whole frames by the host's clock, nothing else between them.
//! 2. *Staged*: with timestamps of the device ([`GpuStageClock`]) or, where these cannot be trusted, waits
//!    ([`StageClock`]) round each stage.
//! 3. *Observed*: the sets, the images, and the check against the truth.
//! 4. *Counted*: the method with its work counters on, which slow it down; only where it has any.

mod bench;
mod frame_sets;
mod true_frames;

use std::time::Instant;

use hroc_format::{ArchivedScene, BakedScene};
use hroc_runtime::{DepthConvention, DeviceProfile, Grouping, Tree, readback};
use indicatif::ProgressBar;

use self::bench::Bench;
use self::frame_sets::FrameSets;
use self::true_frames::{TrueFrame, TrueFrames};
use crate::camera_path::CameraPath;
use crate::check::FrameCheck;
use crate::error::StudyError;
use crate::frustum::Frustum;
use crate::gpu::Gpu;
use crate::gpu_clock::{ClockChoice, GpuStageClock};
use crate::id_set::IdSet;
use crate::image::{Image, ImageCopy};
use crate::registry::{Knobs, Method, Mode};
use crate::results::{
    AdapterInfo, Frame, Memory, Paths, RunResults, SCHEMA, SceneInfo, WARM_UP_FRAMES, Warning,
};
use crate::stage_clock::StageClock;
use crate::targets::FrameTargets;
use crate::truth::TruthCache;

/// What to run.
#[derive(Debug)]
pub struct RunOptions {
    /// Which method.
    pub method: &'static Method,
    /// One of its modes.
    pub mode: &'static Mode,
    /// The method's knobs.
    pub knobs: Knobs,
    /// The device's paths, as probed or as forced.
    pub profile: DeviceProfile,
    /// How coarse the groups are, for a method that groups.
    pub grouping: Grouping,
    /// The split rule of the tree, for a method that reads one.
    pub split: String,
    /// Where the frames are seen from.
    pub path: CameraPath,
    /// How many, spread evenly over the path.
    pub frames: u32,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// How depth is stored.
    pub depth: DepthConvention,
    /// What times the stages.
    pub clock: ClockChoice,
    /// Compare each frame with the truth.
    pub check: bool,
    /// Leave out the replays that time and count work.
    pub untimed: bool,
    /// Where the truth is kept between runs, if anywhere.
    pub truth_cache: Option<TruthCache>,
}

/// A finished frame of the observed replay.
#[derive(Debug)]
pub struct FrameView<'a> {
    /// Number, from 0.
    pub frame: u32,
    /// Depth and item buffer.
    pub image: &'a Image,
    /// The targets, still as the frame left them.
    pub targets: &'a FrameTargets,
}

/// Runs a method over `baked`; `view` is shown each frame once.
///
/// # Errors
/// If the scene does not fit the method or the device, a camera is degenerate, or the device fails.
pub fn run(
    gpu: &Gpu,
    baked: &BakedScene,
    options: &RunOptions,
    progress: &ProgressBar,
    view: &mut dyn FnMut(&FrameView<'_>) -> Result<(), StudyError>,
) -> Result<RunResults, StudyError> {
    let mut bench = Bench::new(gpu, baked, options)?;
    let counts_work = options.method.counts_work && !options.untimed;
    let replays = if options.untimed {
        1
    } else {
        3 + u64::from(counts_work)
    } + u64::from(options.method.is_told);
    progress.set_length(u64::from(options.frames) * replays);

    let mut frames = vec![Frame::default(); options.frames as usize];
    if options.method.is_told {
        progress.set_message("recording");
        bench.record(progress)?;
    }
    if !options.untimed {
        progress.set_message("timing");
        bench.replay_timed(&mut frames, progress)?;
        progress.set_message("timing stages");
        bench.replay_staged(&mut frames, progress)?;
    }
    progress.set_message(if options.check {
        "checking"
    } else {
        "reading sets"
    });
    let (memory_bytes, mut warnings) = bench.replay_observed(&mut frames, progress, view)?;
    if counts_work {
        progress.set_message("counting work");
        bench.replay_counted(&mut frames, progress)?;
    }
    gpu.check()?;
    warnings.extend(warnings_of(gpu, baked.scene(), options));
    Ok(RunResults {
        schema: SCHEMA,
        scene: SceneInfo {
            name: baked.scene().name.as_str().to_owned(),
            objects: baked.scene().objects.len(),
            triangles: baked.scene().drawn_triangle_count(),
            file_bytes: baked.file_bytes().len() as u64,
        },
        method: options.method.name.to_owned(),
        mode: (!options.mode.name.is_empty()).then(|| options.mode.name.to_owned()),
        knobs: (options.knobs.turned().iter())
            .map(|&(name, value)| (name.to_owned(), value))
            .collect(),
        grouping: (options.method.uses_tree).then(|| options.grouping.name().to_owned()),
        split: options.method.uses_tree.then(|| options.split.clone()),
        size: options.size,
        frames: options.frames,
        depth: options.depth.name().to_owned(),
        adapter: AdapterInfo {
            name: gpu.info.name.clone(),
            driver: format!("{} {}", gpu.info.driver, gpu.info.driver_info)
                .trim()
                .to_owned(),
            backend: gpu.info.backend.to_str().to_owned(),
        },
        paths: Paths {
            submission: options.profile.submission.name().to_owned(),
            early_z: options.profile.early_z.name().to_owned(),
            subpixel_step_px: options.profile.subpixel_step_px,
            clock: if bench.gpu_clock.is_some() {
                "gpu"
            } else {
                "wall"
            }
            .to_owned(),
        },
        memory_bytes,
        warnings,
        per_frame: frames,
    })
}

fn warnings_of(gpu: &Gpu, scene: &ArchivedScene, options: &RunOptions) -> Vec<Warning> {
    let software = gpu.info.device_type == wgpu::DeviceType::Cpu;
    let warnings = [
        software.then(|| Warning::SoftwareAdapter {
            adapter: gpu.info.name.clone(),
        }),
        (options.frames as usize <= WARM_UP_FRAMES).then_some(Warning::NoWarmUp {
            frames: options.frames,
        }),
        scene.objects.is_empty().then_some(Warning::EmptyScene),
    ];
    warnings.into_iter().flatten().collect()
}

impl Bench<'_> {
    /// Fills in `frame_ms`.
    fn replay_timed(
        &mut self,
        frames: &mut [Frame],
        progress: &ProgressBar,
    ) -> Result<(), StudyError> {
        let mut method = self.method(false)?;
        for (number, frame) in (0..).zip(frames) {
            let began = Instant::now();
            let mut encoder = self.gpu.encoder();
            self.encode(&mut *method, number, &mut encoder, None)?;
            self.gpu.submit_and_wait(encoder)?;
            frame.frame_ms = began.elapsed().as_secs_f64() * 1e3;
            progress.inc(1);
        }
        Ok(())
    }

    /// Fills in `stages_ms` and `gpu_ms`.
    fn replay_staged(
        &mut self,
        frames: &mut [Frame],
        progress: &ProgressBar,
    ) -> Result<(), StudyError> {
        let mut method = self.method(false)?;
        // Out of the bench while it encodes.
        let gpu_clock = self.gpu_clock.take();
        for (number, frame) in (0..).zip(frames) {
            let mut encoder = self.gpu.encoder();
            let stages = if let Some(gpu_clock) = &gpu_clock {
                let mut clock = GpuStageClock::new(gpu_clock);
                self.encode(&mut *method, number, &mut encoder, Some(&mut clock))?;
                clock.resolve(&mut encoder);
                self.gpu.submit_and_wait(encoder)?;
                let (stages, gpu_ms) = clock.read(self.gpu);
                frame.gpu_ms = Some(gpu_ms);
                stages
            } else {
                let mut clock = StageClock::new(self.gpu);
                self.encode(&mut *method, number, &mut encoder, Some(&mut clock))?;
                self.gpu.submit_and_wait(encoder)?;
                clock.finish()?
            };
            for (stage, ms) in stages {
                *frame.stages_ms.entry(stage.name().to_owned()).or_default() += ms;
            }
            progress.inc(1);
        }
        self.gpu_clock = gpu_clock;
        Ok(())
    }

    /// Fills in the sets, the counters that follow from them, and the check.
    fn replay_observed(
        &mut self,
        frames: &mut [Frame],
        progress: &ProgressBar,
        view: &mut dyn FnMut(&FrameView<'_>) -> Result<(), StudyError>,
    ) -> Result<(Memory, Vec<Warning>), StudyError> {
        let mut method = self.method(false)?;
        let mut truth = self.options.check.then(|| TrueFrames::new(self));
        for (number, frame) in (0..).zip(frames) {
            // Before the method's own frame, as it is drawn into the same targets.
            let true_frame = truth
                .as_mut()
                .map(|truth| truth.frame(self, number))
                .transpose()?;
            let mut encoder = self.gpu.encoder();
            self.encode(&mut *method, number, &mut encoder, None)?;
            let copy = ImageCopy::record(&self.gpu.device, &mut encoder, &self.targets);
            self.gpu.submit_and_wait(encoder)?;
            let image = copy.wait(&self.gpu.device);

            let sets = FrameSets::read(self.gpu, &*method);
            match &true_frame {
                Some(truth) => {
                    sets.describe(self.baked.scene(), &truth.visible, frame);
                    self.check(number, truth, &image, &sets, frame)?;
                }
                None => sets.describe(self.baked.scene(), &image.visible(), frame),
            }
            view(&FrameView {
                frame: number,
                image: &image,
                targets: &self.targets,
            })?;
            progress.inc(1);
        }
        let [geometry, objects] = self.scene.memory_bytes();
        let memory = Memory {
            geometry,
            objects,
            tree: self.tree.as_ref().map_or(0, Tree::memory_bytes),
            method: method.memory_bytes(),
        };
        Ok((memory, truth.map_or_else(Vec::new, TrueFrames::finish)))
    }

    fn check(
        &self,
        number: u32,
        truth: &TrueFrame,
        image: &Image,
        sets: &FrameSets,
        frame: &mut Frame,
    ) -> Result<(), StudyError> {
        let shape = &self.scene.shape;
        let clip = self
            .camera(number)
            .clip_from_world(
                self.options.depth,
                self.options.size,
                shape.origin,
                shape.radius,
            )
            .map_err(|source| StudyError::Camera {
                frame: number,
                source,
            })?;
        let frustum = Frustum::new(&clip);
        let bounds = self.baked.scene().object_bounds.iter().zip(0..);
        let meeting = bounds.filter(|(bounds, _)| frustum.meets(&bounds.to_native()));
        let in_frustum = meeting.map(|(_, id)| id).collect::<IdSet>();

        let drawn = sets.drawn.all();
        let check = FrameCheck::new(&truth.image, image, &truth.visible, &drawn);
        let hidden = in_frustum.minus(&truth.visible);
        let culled = hidden.minus(&drawn);
        frame.visible = Some(check.visible);
        frame.in_frustum = Some(in_frustum.len());
        frame.wrong_pixels = Some(check.wrong_pixels);
        frame.false_negatives = Some(check.false_negatives);
        frame.depth_ties = Some(check.depth_ties);
        frame.cull_rate = (!hidden.is_empty()).then(|| culled.len() as f64 / hidden.len() as f64);
        Ok(())
    }

    /// Fills in the counters that only an instrumented method has.
    fn replay_counted(
        &mut self,
        frames: &mut [Frame],
        progress: &ProgressBar,
    ) -> Result<(), StudyError> {
        let mut method = self.method(true)?;
        for (number, frame) in (0..).zip(frames) {
            let mut encoder = self.gpu.encoder();
            self.encode(&mut *method, number, &mut encoder, None)?;
            self.gpu.submit_and_wait(encoder)?;
            if let Some(work) = method.sets().work {
                let work = readback::words(&self.gpu.device, &self.gpu.queue, work);
                frame.counters.rays = Some(u64::from(work[0]));
                frame.counters.ray_box_tests = Some(u64::from(work[1]));
            }
            progress.inc(1);
        }
        Ok(())
    }
}
