//! A run: contenders over the frames of a camera path, replayed once per question so that no answer disturbs
//! another. Every replay draws all frames of the [`Schedule`], begins with new methods, and resets them where another
//! history begins.
//! Uncounted frames are drawn like the others and enter no result.
//!
//! 1. *Observed*: the sets, the images, and the check against the truth.
//! 2. *Timed*: whole frames by the host's clock, nothing else between them.
//! 3. *Staged*: with timestamps of the device ([`GpuStageClock`]) or, where these cannot be trusted, waits
//!    ([`StageClock`]) round each stage.
//! 4. *Counted*: the method with its work counters on, which slow it down, and the overdraw of one frame; only where
//!    there is anything to count.
//!
//! In every replay all contenders draw a frame, each with a history of its own, before any draws the next one: a
//! machine that gets slower hurts all of them alike. Who begins changes from frame to frame.
//!
//! [`Schedule`]: crate::sampling::Schedule
//! [`GpuStageClock`]: crate::gpu_clock::GpuStageClock
//! [`StageClock`]: crate::stage_clock::StageClock

mod bench;
mod contender;
mod entrant;
mod frame_sets;
pub(crate) mod overdraw;
mod replays;
mod true_frames;

use hroc_format::{ArchivedScene, BakedScene};
use hroc_methods::HardwareTimes;
use hroc_runtime::Grouping;
use indicatif::ProgressBar;

pub(crate) use self::contender::label;
pub use self::contender::{Contender, Course};

use self::bench::Bench;
use self::entrant::Entrant;
use crate::error::StudyError;
use crate::gpu::Gpu;
use crate::hash;
use crate::image::Image;
use crate::results::{
    AdapterInfo, Hardware, Memory, NoCulling, Paths, RunResults, SCHEMA, SceneInfo, WARM_UP_FRAMES,
    Warning,
};
use crate::sampling::Sampling;
use crate::targets::FrameTargets;

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

/// Shown each frame of the observed replay.
pub type View<'a> = dyn FnMut(&FrameView<'_>) -> Result<(), StudyError> + 'a;

/// Runs one contender over `baked`; `view` is shown each frame once.
///
/// # Errors
/// If the scene does not fit the method or the device, a camera is degenerate, or the device fails.
pub fn run(
    gpu: &Gpu,
    baked: &BakedScene,
    course: &Course,
    contender: &Contender,
    progress: &ProgressBar,
    view: &mut View<'_>,
) -> Result<RunResults, StudyError> {
    let contenders = std::slice::from_ref(contender);
    let mut results = run_all(gpu, baked, course, contenders, progress, view)?;
    results.pop().expect("a result for each contender")
}

/// Runs contenders side by side over `baked`. One that cannot run or fails has its reason in the place of its results,
/// and the others go on.
///
/// # Errors
/// If nobody can run: the scene does not fit the device, a camera is degenerate, `view` fails, or the device is lost.
pub fn run_all(
    gpu: &Gpu,
    baked: &BakedScene,
    course: &Course,
    contenders: &[Contender],
    progress: &ProgressBar,
    view: &mut View<'_>,
) -> Result<Vec<Result<RunResults, StudyError>>, StudyError> {
    let mut bench = Bench::new(gpu, baked, course)?;
    let mut entrants = Vec::new();
    for contender in contenders {
        let mut entrant = Entrant::new(contender, &bench.schedule);
        if let Err(error) = bench.admit(contender) {
            entrant.fail(gpu, error)?;
        }
        entrants.push(entrant);
    }
    progress.set_length(
        replays::count(course, contenders) * bench.schedule.len() * contenders.len() as u64,
    );
    progress.set_position(0);

    let mut warnings = bench.replay_observed(&mut entrants, progress, view)?;
    for round in 0..course.repeats {
        bench.replay_timed(&mut entrants, round, progress)?;
        bench.replay_staged(&mut entrants, round, progress)?;
    }
    bench.replay_counted(&mut entrants, progress)?;
    gpu.check()?;

    warnings.extend(warnings_of(gpu, baked.scene(), &bench));
    let finish =
        |entrant: Entrant<'_>| entrant.finish(|entrant| results(&bench, &warnings, entrant));
    Ok(entrants.into_iter().map(finish).collect())
}

fn results(bench: &Bench<'_>, warnings: &[Warning], entrant: Entrant<'_>) -> RunResults {
    let (gpu, course, contender) = (bench.gpu, bench.course, entrant.contender);
    let scene = bench.baked.scene();
    let [geometry, objects] = bench.scene.memory_bytes();
    let tree = bench.tree(contender);
    let mut warnings = warnings.to_vec();
    if entrant.empty_frames > 0 && !scene.objects.is_empty() {
        warnings.push(Warning::NothingVisible {
            frames: entrant.empty_frames,
            of: course.frames,
        });
    }
    RunResults {
        schema: SCHEMA,
        scene: SceneInfo {
            name: course.scene_name.clone(),
            objects: scene.objects.len(),
            triangles: scene.drawn_triangle_count(),
            file_bytes: bench.baked.file_bytes().len() as u64,
            hash: Some(hash::text(bench.scene_hash)),
        },
        path: course.path_name.clone(),
        path_hash: Some(hash::text(hash::path(&course.path))),
        method: contender.method.name.to_owned(),
        mode: (!contender.mode.name.is_empty()).then(|| contender.mode.name.to_owned()),
        exactness: contender.mode.exactness.name().to_owned(),
        knobs: (contender.knobs.turned().iter())
            .map(|&(name, value)| (name.to_owned(), value))
            .collect(),
        grouping: (contender.method.groups).then(|| contender.grouping.name().to_owned()),
        box_cost: match contender.grouping {
            Grouping::Adaptive { box_cost } if contender.method.groups => Some(box_cost.into()),
            _ => None,
        },
        hardware: HardwareTimes::known(&bench.scene.profile).map(Hardware::from),
        split: tree.map(|_| contender.split.clone()),
        size: course.size,
        sampling: course.sampling,
        frames: course.frames,
        repeats: course.repeats,
        depth: course.depth.name().to_owned(),
        adapter: AdapterInfo::of(&gpu.info),
        paths: Paths {
            submission: course.profile.submission.name().to_owned(),
            early_z: course.profile.early_z.name().to_owned(),
            subpixel_step_px: course.profile.subpixel_step_px,
            clock: if bench.gpu_clock.is_some() {
                "gpu"
            } else {
                "wall"
            }
            .to_owned(),
        },
        memory_bytes: Memory {
            geometry,
            objects,
            tree: tree.map_or(0, hroc_runtime::Tree::memory_bytes),
            method: entrant.method_bytes,
        },
        no_culling: NoCulling::of(&entrant.frames),
        warnings,
        overdraw: entrant.overdraw,
        per_frame: entrant.frames,
    }
}

fn warnings_of(gpu: &Gpu, scene: &ArchivedScene, bench: &Bench<'_>) -> Vec<Warning> {
    let course = bench.course;
    let software = gpu.info.device_type == wgpu::DeviceType::Cpu;
    let warnings = [
        software.then(|| Warning::SoftwareAdapter {
            adapter: gpu.info.name.clone(),
        }),
        (course.sampling == Sampling::Spread && course.frames as usize <= WARM_UP_FRAMES)
            .then_some(Warning::NoWarmUp {
                frames: course.frames,
            }),
        bench
            .schedule
            .too_long_s()
            .map(|windows_s| Warning::ShortPath {
                path_s: course.path.duration_s(),
                windows_s,
            }),
        scene.objects.is_empty().then_some(Warning::EmptyScene),
    ];
    warnings.into_iter().flatten().collect()
}
