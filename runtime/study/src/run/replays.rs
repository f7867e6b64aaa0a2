//! The replays of a run.

use glam::DVec3;
use std::time::Instant;

use hroc_runtime::{CullingMethod, readback};
use indicatif::ProgressBar;

use super::bench::{Bench, Output};
use super::contender::{Contender, Course};
use super::entrant::Entrant;
use super::frame_sets::FrameSets;
use super::true_frames::{TrueFrame, TrueFrames};
use super::{FrameView, View};
use crate::check::FrameCheck;
use crate::error::StudyError;
use crate::frustum::Frustum;
use crate::gpu::GpuError;
use crate::gpu_clock::GpuStageClock;
use crate::id_set::IdSet;
use crate::image::{Image, ImageCopy};
use crate::results::{Frame, Warning};
use crate::sampling::Step;
use crate::stage_clock::StageClock;

/// How often all contenders go over the path.
pub(super) fn count(course: &Course, contenders: &[Contender]) -> u64 {
    let counted = contenders.iter().any(|contender| counts(course, contender));
    1 + 2 * u64::from(course.repeats) + u64::from(counted)
}

/// Whether a contender has anything to count.
fn counts(course: &Course, contender: &Contender) -> bool {
    let map = overdraw_frame(course, contender).is_some();
    course.repeats > 0 && (contender.method.counts_work || map)
}

/// The frame of which a contender gets a map.
fn overdraw_frame(course: &Course, contender: &Contender) -> Option<u32> {
    course
        .overdraw_frame
        .filter(|_| contender.knobs.turned().is_empty())
}

/// The places of `count` contenders in the order they draw frame `number` in: everyone begins equally often.
fn order(count: usize, number: usize, round: u32) -> impl Iterator<Item = usize> {
    let first = number + round as usize;
    (0..count).map(move |place| (first + place) % count)
}

/// What became of a frame: an error of the contender's own, or one that ends the run.
enum Ended {
    Contender(StudyError),
    Run(StudyError),
}

impl From<StudyError> for Ended {
    fn from(error: StudyError) -> Self {
        Self::Contender(error)
    }
}

impl From<GpuError> for Ended {
    fn from(error: GpuError) -> Self {
        Self::Contender(error.into())
    }
}

impl Bench<'_> {
    /// Draws frame `number` of the schedule by all entrants that have not failed, through `draw`.
    fn frame(
        &mut self,
        entrants: &mut [Entrant<'_>],
        number: usize,
        round: u32,
        progress: &ProgressBar,
        mut draw: impl FnMut(&mut Self, &mut dyn CullingMethod, &mut Entrant<'_>) -> Result<(), Ended>,
    ) -> Result<(), StudyError> {
        self.show_recorded(number);
        for place in order(entrants.len(), number, round) {
            let entrant = &mut entrants[place];
            progress.inc(1);
            let Some(mut method) = entrant.method.take() else {
                continue;
            };
            let ended = draw(self, &mut *method, entrant).and_then(|()| Ok(self.gpu.check()?));
            match ended {
                Ok(()) => entrant.method = Some(method),
                Err(Ended::Contender(error)) => entrant.fail(self.gpu, error)?,
                Err(Ended::Run(error)) => return Err(error),
            }
        }
        Ok(())
    }

    /// Starts a replay at its first frame with new methods, and takes everyone's history away where another frame
    /// begins a new one.
    fn start(
        &self,
        number: usize,
        step: &Step,
        entrants: &mut [Entrant<'_>],
        count_work: impl Fn(&Contender) -> bool,
    ) -> Result<(), StudyError> {
        if step.age > 0 {
            return Ok(());
        }
        for entrant in entrants {
            if number == 0 {
                entrant.start(self, count_work(entrant.contender))?;
            } else {
                entrant.forget(self)?;
            }
        }
        Ok(())
    }

    /// Takes a sample of `frame_ms`.
    pub(super) fn replay_timed(
        &mut self,
        entrants: &mut [Entrant<'_>],
        round: u32,
        progress: &ProgressBar,
    ) -> Result<(), StudyError> {
        progress.set_message("timing");
        for (number, step) in self.schedule.steps().enumerate() {
            self.start(number, &step, entrants, |_| false)?;
            self.frame(
                entrants,
                number,
                round,
                progress,
                |bench, method, entrant| {
                    let began = Instant::now();
                    let mut encoder = bench.gpu.encoder();
                    bench.encode(method, &step, &mut encoder, Output::Color, None)?;
                    bench.gpu.submit_and_wait(encoder)?;
                    let ms = began.elapsed().as_secs_f64() * 1e3;
                    method.took(number as u64, ms);
                    if step.counted {
                        let frame = entrant.frame(step.frame);
                        frame.frame_samples_ms.push(ms);
                        frame.choice = method.choice().map(str::to_owned);
                    }
                    Ok(())
                },
            )?;
        }
        Ok(())
    }

    /// Takes a sample of `gpu_ms`, and of `stages_ms`, whose mean over the repeats it makes.
    pub(super) fn replay_staged(
        &mut self,
        entrants: &mut [Entrant<'_>],
        round: u32,
        progress: &ProgressBar,
    ) -> Result<(), StudyError> {
        progress.set_message("timing stages");
        // Out of the bench while it encodes.
        let gpu_clock = self.gpu_clock.take();
        let share = 1.0 / f64::from(self.course.repeats);
        for (number, step) in self.schedule.steps().enumerate() {
            self.start(number, &step, entrants, |_| false)?;
            self.frame(
                entrants,
                number,
                round,
                progress,
                |bench, method, entrant| {
                    let gpu = bench.gpu;
                    let began = Instant::now();
                    let mut encoder = gpu.encoder();
                    let stages = if let Some(gpu_clock) = &gpu_clock {
                        let mut clock = GpuStageClock::new(gpu_clock);
                        let observer = Some(&mut clock as _);
                        bench.encode(method, &step, &mut encoder, Output::Color, observer)?;
                        clock.resolve(&mut encoder);
                        gpu.submit_and_wait(encoder)?;
                        let read = clock.read(gpu);
                        if let (true, Some((_, gpu_ms))) = (step.counted, &read) {
                            entrant.frame(step.frame).gpu_samples_ms.push(*gpu_ms);
                        }
                        read.map_or_else(Vec::new, |(stages, _)| stages)
                    } else {
                        let mut clock = StageClock::new(gpu);
                        let observer = Some(&mut clock as _);
                        bench.encode(method, &step, &mut encoder, Output::Color, observer)?;
                        gpu.submit_and_wait(encoder)?;
                        clock.finish()?
                    };
                    method.took(number as u64, began.elapsed().as_secs_f64() * 1e3);
                    for (stage, ms) in stages.into_iter().filter(|_| step.counted) {
                        let stages_ms = &mut entrant.frame(step.frame).stages_ms;
                        *stages_ms.entry(stage.name().to_owned()).or_default() += share * ms;
                    }
                    Ok(())
                },
            )?;
        }
        self.gpu_clock = gpu_clock;
        Ok(())
    }

    /// Fills in the sets, the counters that follow from them, and the check. Records what shows for those that are
    /// told.
    pub(super) fn replay_observed(
        &mut self,
        entrants: &mut [Entrant<'_>],
        progress: &ProgressBar,
        view: &mut View<'_>,
    ) -> Result<Vec<Warning>, StudyError> {
        let check = self.course.check;
        progress.set_message(if check { "checking" } else { "reading sets" });
        let is_told = (entrants.iter()).any(|entrant| entrant.contender.method.is_told);
        let mut truth = (check || is_told).then(|| TrueFrames::new(self));
        for (number, step) in self.schedule.steps().enumerate() {
            self.start(number, &step, entrants, |_| false)?;
            // Before the contenders' own frames, as it is drawn into the same targets.
            let true_frame = (truth.as_mut().filter(|_| is_told || step.counted))
                .map(|truth| truth.frame(self, &step))
                .transpose()?;
            let in_frustum = (check && step.counted)
                .then(|| self.in_frustum(&step))
                .transpose()?;
            if let (true, Some(truth)) = (is_told, &true_frame) {
                self.recording.push(truth.visible.clone());
            }
            self.frame(entrants, number, 0, progress, |bench, method, entrant| {
                let device = &bench.gpu.device;
                let began = Instant::now();
                let mut encoder = bench.gpu.encoder();
                bench.encode(method, &step, &mut encoder, Output::Color, None)?;
                let copy = step
                    .counted
                    .then(|| ImageCopy::record(device, &mut encoder, &bench.targets));
                bench.gpu.submit_and_wait(encoder)?;
                method.took(number as u64, began.elapsed().as_secs_f64() * 1e3);
                let Some(copy) = copy else {
                    return Ok(());
                };
                let image = copy.wait(device);
                let sets = FrameSets::read(bench.gpu, method);
                let scene = bench.baked.scene();
                let mut visible = image.visible();
                let frame = entrant.frame(step.frame);
                match (&true_frame, &in_frustum) {
                    (Some(truth), Some(in_frustum)) => {
                        sets.describe(scene, &truth.visible, frame);
                        compare(truth, in_frustum, &image, &sets, frame);
                        visible = truth.visible.clone();
                    }
                    _ => sets.describe(scene, &visible, frame),
                }
                // Only the check tells whether a blended object shows.
                let blended = sets
                    .drawn
                    .blended
                    .as_ref()
                    .is_some_and(|set| !set.is_empty());
                let unknown = true_frame.is_none() && blended;
                entrant.empty_frames += u32::from(visible.is_empty() && !unknown);
                view(&FrameView {
                    frame: step.frame,
                    image: &image,
                    targets: &bench.targets,
                })
                .map_err(Ended::Run)
            })?;
        }
        for entrant in entrants {
            let method = entrant.method.as_ref();
            entrant.method_bytes = method.map_or(0, |method| method.memory_bytes());
        }
        Ok(truth.map_or_else(Vec::new, TrueFrames::finish))
    }

    /// The objects whose bounds meet the view volume.
    fn in_frustum(&self, step: &Step) -> Result<IdSet, StudyError> {
        let shape = &self.scene.shape;
        let clip = self
            .camera(step)
            .clip_from_world(
                self.course.depth,
                self.course.size,
                shape.origin,
                shape.radius,
            )
            .map_err(|source| StudyError::Camera {
                frame: step.frame,
                source,
            })?;
        let frustum = Frustum::new(&clip);
        let bounds = self.baked.scene().object_bounds.iter().zip(0..);
        let meeting = bounds.filter(|(bounds, _)| {
            let bounds = bounds.to_native();
            let zero = shape.cells[bounds.cell as usize] - shape.origin;
            let [min, max] =
                [bounds.min, bounds.max].map(|corner| DVec3::from(corner.map(f64::from)) + zero);
            frustum.meets(min, max)
        });
        Ok(meeting.map(|(_, id)| id).collect())
    }

    /// Fills in the counters that only an instrumented method has, and the overdraw of the frame that is asked for.
    pub(super) fn replay_counted(
        &mut self,
        entrants: &mut [Entrant<'_>],
        progress: &ProgressBar,
    ) -> Result<(), StudyError> {
        let course = self.course;
        if !(entrants.iter()).any(|entrant| counts(course, entrant.contender)) {
            return Ok(());
        }
        progress.set_message("counting work");
        // A map alone needs no more than its frame with the history that leads to it.
        let map_step = self
            .schedule
            .steps()
            .find(|step| step.counted && Some(step.frame) == course.overdraw_frame);
        let leads_to_map = |step: &Step| {
            map_step.is_some_and(|map| step.history == map.history && step.age <= map.age)
        };
        for (number, step) in self.schedule.steps().enumerate() {
            self.start(number, &step, entrants, |contender| {
                contender.method.counts_work
            })?;
            self.frame(entrants, number, 0, progress, |bench, method, entrant| {
                let contender = entrant.contender;
                let has_map = overdraw_frame(course, contender).is_some();
                if !(contender.method.counts_work || (has_map && leads_to_map(&step))) {
                    return Ok(());
                }
                let mut encoder = bench.gpu.encoder();
                let map = has_map && map_step == Some(step);
                let output = if map {
                    Output::FragmentCount
                } else {
                    Output::Color
                };
                bench.encode(method, &step, &mut encoder, output, None)?;
                bench.gpu.submit_and_wait(encoder)?;
                if let (true, Some(work)) = (step.counted, method.sets().work) {
                    let work = readback::words(&bench.gpu.device, &bench.gpu.queue, work);
                    let counters = &mut entrant.frame(step.frame).counters;
                    counters.rays = Some(u64::from(work[0]));
                    counters.ray_box_tests = Some(u64::from(work[1]));
                }
                if let (true, Some(target)) = (map, &bench.overdraw) {
                    entrant.overdraw = Some(target.read(bench.gpu, step.frame));
                }
                Ok(())
            })?;
        }
        Ok(())
    }
}

/// Holds a frame against the truth.
fn compare(
    truth: &TrueFrame,
    in_frustum: &IdSet,
    image: &Image,
    sets: &FrameSets,
    frame: &mut Frame,
) {
    let drawn = sets.drawn.all();
    let check = FrameCheck::new(&truth.image, image, &truth.visible, &drawn);
    let hidden = in_frustum.minus(&truth.visible);
    let culled = hidden.minus(&drawn);
    frame.visible = Some(check.visible);
    frame.in_frustum = Some(in_frustum.len());
    frame.wrong_pixels = Some(check.wrong_pixels);
    frame.false_negatives = Some(check.false_negatives);
    frame.depth_ties = Some(check.depth_ties);
    if let Some(judgement) = truth.judgement {
        frame.removed = Some(judgement.removed);
        frame.strays = Some(judgement.strays);
        frame.kept_strays = Some(judgement.kept_strays);
        frame.fault = judgement.first_fault;
    }
    // Where nothing is visible, an occlusion test has no occluder, and the rate says nothing.
    let tells = !hidden.is_empty() && !truth.visible.is_empty();
    frame.cull_rate = tells.then(|| culled.len() as f64 / hidden.len() as f64);
}

#[cfg(test)]
mod tests {
    use super::order;

    #[test]
    fn everyone_begins_equally_often_and_draws_once_a_frame() {
        let mut begins = [0; 3];
        for frame in 0..9 {
            let mut places = order(3, frame, 1).collect::<Vec<_>>();
            begins[places[0]] += 1;
            places.sort_unstable();
            assert_eq!(places, [0, 1, 2]);
        }
        assert_eq!(begins, [3, 3, 3]);
        assert_ne!(order(3, 0, 0).next(), order(3, 0, 1).next());
    }
}
