//! A run: one method over the frames of a camera path, replayed once per question so that no answer disturbs
//! another. Every replay starts without history.
//!
//! 1. *Timed*: whole frames by the host's clock, nothing else between them.
//! 2. *Staged*: with timestamps of the device ([`GpuStageClock`]) or, where these cannot be trusted, waits
//!    ([`StageClock`]) round each stage.
//! 3. *Observed*: the sets, the images, and the check against the truth.
//! 4. *Counted*: the method with its work counters on, which slow it down; only where it has any.

use std::time::Instant;

use hroc_format::{ArchivedScene, BakedScene};
use hroc_runtime::{
    Camera, CullingMethod, DepthConvention, FrameContext, FrameUniform, Noc, Scene, StageObserver,
    Submission, Tree, readback,
};
use indicatif::ProgressBar;

use crate::camera_path::CameraPath;
use crate::check::FrameCheck;
use crate::drawer::ObjectDrawer;
use crate::error::StudyError;
use crate::frustum::Frustum;
use crate::gpu::{Gpu, GpuError};
use crate::gpu_clock::{ClockChoice, GpuClock, GpuStageClock};
use crate::id_set::IdSet;
use crate::image::{Image, ImageCopy};
use crate::registry::{Method, Parts, feature_names};
use crate::results::{
    AdapterInfo, Counters, Frame, Memory, Paths, RunResults, SCHEMA, SceneInfo, SetSizes,
    WARM_UP_FRAMES, Warning,
};
use crate::stage_clock::StageClock;
use crate::targets::FrameTargets;
use crate::truth::{TruthCache, TruthKey};

/// What to run.
#[derive(Debug)]
pub struct RunOptions {
    /// Which method.
    pub method: &'static Method,
    /// One of its modes, if it has any.
    pub mode: Option<&'static str>,
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
    let replays = 3 + u64::from(options.method.counts_work);
    progress.set_length(u64::from(options.frames) * replays);

    let mut frames = vec![Frame::default(); options.frames as usize];
    progress.set_message("timing");
    let memory_bytes = bench.replay_timed(&mut frames, progress)?;
    progress.set_message("timing stages");
    bench.replay_staged(&mut frames, progress)?;
    progress.set_message(if options.check {
        "checking"
    } else {
        "reading sets"
    });
    let mut warnings = bench.replay_observed(&mut frames, progress, view)?;
    if options.method.counts_work {
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
        mode: options.mode.map(str::to_owned),
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
            submission: Submission::of(gpu.device.features()).name().to_owned(),
            early_z: "item-buffer".to_owned(),
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

/// A scene on the device, with targets and rendering: what all replays share.
struct Bench<'a> {
    gpu: &'a Gpu,
    baked: &'a BakedScene,
    options: &'a RunOptions,
    scene: Scene,
    tree: Option<Tree>,
    targets: FrameTargets,
    drawer: ObjectDrawer,
    gpu_clock: Option<GpuClock>,
}

impl<'a> Bench<'a> {
    fn new(
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
        let scene = Scene::upload(&gpu.device, baked.scene())?;
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
        })
    }

    /// The method, without history.
    fn method(&self, count_work: bool) -> Result<Box<dyn CullingMethod>, StudyError> {
        let method = (self.options.method.make)(&Parts {
            device: &self.gpu.device,
            queue: &self.gpu.queue,
            scene: &self.scene,
            tree: self.tree.as_ref(),
            depth: self.options.depth,
            mode: self.options.mode.unwrap_or_default(),
            count_work,
        });
        self.gpu.check()?;
        Ok(method)
    }

    fn camera(&self, frame: u32) -> Camera {
        self.options.path.frame(frame, self.options.frames)
    }

    fn encode(
        &mut self,
        method: &mut dyn CullingMethod,
        frame: u32,
        encoder: &mut wgpu::CommandEncoder,
        observer: Option<&mut dyn StageObserver>,
    ) -> Result<(), StudyError> {
        let at = |source| StudyError::Camera { frame, source };
        let camera = self.camera(frame);
        let Self { gpu, options, .. } = self;
        self.drawer
            .set_camera(&gpu.queue, &camera, options.depth, options.size)
            .map_err(at)?;
        let mut context = FrameContext {
            device: &gpu.device,
            queue: &gpu.queue,
            encoder,
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

    /// Fills in `frame_ms`.
    fn replay_timed(
        &mut self,
        frames: &mut [Frame],
        progress: &ProgressBar,
    ) -> Result<Memory, StudyError> {
        let mut method = self.method(false)?;
        for (number, frame) in (0..).zip(frames) {
            let began = Instant::now();
            let mut encoder = self.gpu.encoder();
            self.encode(&mut *method, number, &mut encoder, None)?;
            self.gpu.submit_and_wait(encoder)?;
            frame.frame_ms = began.elapsed().as_secs_f64() * 1e3;
            progress.inc(1);
        }
        let [geometry, objects] = self.scene.memory_bytes();
        let tree = self.tree.as_ref().map_or(0, Tree::memory_bytes);
        Ok(Memory {
            geometry,
            objects,
            tree,
            method: method.memory_bytes(),
        })
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
    ) -> Result<Vec<Warning>, StudyError> {
        let mut method = self.method(false)?;
        let mut truth = self.options.check.then(|| Truth::new(self));
        for (number, frame) in (0..).zip(frames) {
            // Before the method's own frame, as it is drawn into the same targets.
            let true_image = truth
                .as_mut()
                .map(|truth| truth.image(self, number))
                .transpose()?;
            let mut encoder = self.gpu.encoder();
            self.encode(&mut *method, number, &mut encoder, None)?;
            let copy = ImageCopy::record(&self.gpu.device, &mut encoder, &self.targets);
            self.gpu.submit_and_wait(encoder)?;
            let image = copy.wait(&self.gpu.device);

            let sets = FrameSets::read(self.gpu, &*method);
            let visible = true_image
                .as_ref()
                .map_or_else(|| image.visible(), Image::visible);
            sets.describe(self.baked.scene(), &visible, frame);
            if let Some(true_image) = &true_image {
                self.check(number, true_image, &image, &sets, frame)?;
            }
            view(&FrameView {
                frame: number,
                image: &image,
                targets: &self.targets,
            })?;
            progress.inc(1);
        }
        Ok(truth.map_or_else(Vec::new, Truth::finish))
    }

    fn check(
        &self,
        number: u32,
        truth: &Image,
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

        let drawn = sets.drawn();
        let check = FrameCheck::new(truth, image, &drawn);
        let hidden = in_frustum.minus(&truth.visible());
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

/// The sets of a frame on the host.
struct FrameSets {
    potential_occluders: Option<IdSet>,
    effective_occluders: Option<IdSet>,
    potentially_visible: Option<IdSet>,
    group_count: Option<u32>,
}

impl FrameSets {
    fn read(gpu: &Gpu, method: &dyn CullingMethod) -> Self {
        let words = |buffer: &wgpu::Buffer| readback::words(&gpu.device, &gpu.queue, buffer);
        let set =
            |buffer: Option<&wgpu::Buffer>| buffer.map(|buffer| IdSet::from_words(words(buffer)));
        let sets = method.sets();
        Self {
            potential_occluders: set(sets.potential_occluders),
            effective_occluders: set(sets.effective_occluders),
            potentially_visible: set(sets.potentially_visible),
            // The second of the indirect arguments: the number of instances.
            group_count: sets.group_draw.map(|arguments| words(arguments)[1]),
        }
    }

    /// V united with U.
    fn drawn(&self) -> IdSet {
        let none = IdSet::default();
        let [v, u] = [&self.potential_occluders, &self.potentially_visible]
            .map(|set| set.as_ref().unwrap_or(&none));
        v.union(u)
    }

    fn describe(&self, scene: &ArchivedScene, visible: &IdSet, frame: &mut Frame) {
        let len = |set: &Option<IdSet>| set.as_ref().map(IdSet::len);
        let groups = self.group_count.map(|count| count as usize);
        frame.sets = SetSizes {
            v: len(&self.potential_occluders),
            o: len(&self.effective_occluders),
            g: groups,
            u: len(&self.potentially_visible),
            d: self
                .potentially_visible
                .as_ref()
                .map(|set| set.intersection(visible).len()),
        };
        let drawn = self.drawn();
        let triangles = |id: u32| {
            let mesh = scene.objects[id as usize].mesh.to_native();
            u64::from(scene.meshes[mesh as usize].index_count.to_native() / 3)
        };
        frame.pvs = Some(drawn.len());
        frame.counters = Counters {
            draws: Some(drawn.len() as u64),
            triangles: Some(drawn.iter().map(triangles).sum()),
            groups: groups.map(|count| count as u64),
            boxes_rasterized: groups.map(|count| count as u64),
            ..Counters::default()
        };
    }
}

/// Makes or finds the truth of each frame.
struct Truth<'a> {
    noc: Noc,
    cache: Option<&'a TruthCache>,
    key: TruthKey,
    stored: bool,
    warning: Option<Warning>,
}

impl<'a> Truth<'a> {
    fn new(bench: &Bench<'a>) -> Self {
        let (gpu, options) = (bench.gpu, bench.options);
        let info = &gpu.info;
        let key = TruthKey::new(
            options.size,
            &[
                &xxhash_rust::xxh3::xxh3_128(bench.baked.file_bytes()).to_le_bytes(),
                ObjectDrawer::wgsl().as_bytes(),
                options.depth.name().as_bytes(),
                info.name.as_bytes(),
                info.driver.as_bytes(),
                info.driver_info.as_bytes(),
                info.backend.to_str().as_bytes(),
            ],
        );
        let noc = Noc::new(&gpu.device, &bench.scene, options.depth);
        Self {
            noc,
            cache: options.truth_cache.as_ref(),
            key,
            stored: false,
            warning: None,
        }
    }

    fn image(&mut self, bench: &mut Bench<'_>, number: u32) -> Result<Image, StudyError> {
        let (gpu, options) = (bench.gpu, bench.options);
        let camera = bench.camera(number);
        let uniform = FrameUniform::new(&camera, options.depth, options.size, &bench.scene.shape)
            .map_err(|source| StudyError::Camera {
            frame: number,
            source,
        })?;
        let frame = bytemuck::bytes_of(&uniform);
        if let Some(image) = self.cache.and_then(|cache| cache.load(&self.key, frame)) {
            return Ok(image);
        }
        let mut encoder = gpu.encoder();
        bench.encode(&mut self.noc, number, &mut encoder, None)?;
        let copy = ImageCopy::record(&gpu.device, &mut encoder, &bench.targets);
        gpu.submit_and_wait(encoder)?;
        let image = copy.wait(&gpu.device);
        // After the first failure there is no point in trying again for every frame.
        if let (Some(cache), None) = (self.cache, &self.warning) {
            match cache.store(&self.key, frame, &image) {
                Ok(()) => self.stored = true,
                Err(reason) => self.warning = Some(Warning::TruthNotCached { reason }),
            }
        }
        Ok(image)
    }

    fn finish(self) -> Vec<Warning> {
        if let (Some(cache), true) = (self.cache, self.stored) {
            cache.evict();
        }
        self.warning.into_iter().collect()
    }
}
