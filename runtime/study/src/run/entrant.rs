//! A contender while it runs.

use hroc_runtime::CullingMethod;

use super::bench::Bench;
use super::contender::Contender;
use crate::error::StudyError;
use crate::gpu::{Gpu, GpuError};
use crate::results::{Frame, Overdraw};
use crate::sampling::Schedule;
use crate::statistics::median;

/// A contender, what it has found so far, and why it no longer runs if it failed.
pub(super) struct Entrant<'a> {
    pub(super) contender: &'a Contender,
    /// Of the replay that is going on. A failed one has none.
    pub(super) method: Option<Box<dyn CullingMethod>>,
    pub(super) frames: Vec<Frame>,
    /// Counted frames that show no object.
    pub(super) empty_frames: u32,
    pub(super) overdraw: Option<Overdraw>,
    /// GPU memory beyond scene and tree, bytes.
    pub(super) method_bytes: u64,
    failure: Option<StudyError>,
}

impl<'a> Entrant<'a> {
    pub(super) fn new(contender: &'a Contender, schedule: &Schedule) -> Self {
        let counted = schedule.steps().filter(|step| step.counted);
        Self {
            contender,
            method: None,
            frames: counted
                .map(|step| Frame {
                    window: schedule.window(&step),
                    t_s: Some(step.t_s),
                    ..Frame::default()
                })
                .collect(),
            empty_frames: 0,
            overdraw: None,
            method_bytes: 0,
            failure: None,
        }
    }

    /// What was found of frame `number`.
    pub(super) fn frame(&mut self, number: u32) -> &mut Frame {
        &mut self.frames[number as usize]
    }

    /// Takes the contender out of the run.
    ///
    /// # Errors
    /// If that is no help to the others.
    pub(super) fn fail(&mut self, gpu: &Gpu, error: StudyError) -> Result<(), GpuError> {
        self.method = None;
        self.failure = Some(error);
        gpu.recover()
    }

    /// Starts a replay: gives the contender a new method, without history.
    pub(super) fn start(&mut self, bench: &Bench<'_>, count_work: bool) -> Result<(), GpuError> {
        if self.failure.is_some() {
            return Ok(());
        }
        match bench.method(self.contender, count_work) {
            Ok(method) => {
                self.method = Some(method);
                Ok(())
            }
            Err(error) => self.fail(bench.gpu, error),
        }
    }

    /// Takes the method's history away, as an application does at a camera cut.
    pub(super) fn forget(&mut self, bench: &Bench<'_>) -> Result<(), GpuError> {
        let Some(method) = &mut self.method else {
            return Ok(());
        };
        let mut encoder = bench.gpu.encoder();
        method.reset(&mut encoder);
        match bench.gpu.submit_and_wait(encoder) {
            Ok(()) => Ok(()),
            Err(error) => self.fail(bench.gpu, error.into()),
        }
    }

    /// Ends the run: the results, or why there are none.
    pub(super) fn finish<R>(mut self, results: impl FnOnce(Self) -> R) -> Result<R, StudyError> {
        match self.failure.take() {
            Some(failure) => Err(failure),
            None => {
                self.summarize();
                Ok(results(self))
            }
        }
    }

    /// Makes one number of the samples of each frame. One sample is the number.
    fn summarize(&mut self) {
        for frame in &mut self.frames {
            frame.frame_ms = median(&frame.frame_samples_ms).unwrap_or(0.0);
            frame.gpu_ms = median(&frame.gpu_samples_ms);
            for samples in [&mut frame.frame_samples_ms, &mut frame.gpu_samples_ms] {
                if samples.len() < 2 {
                    samples.clear();
                }
            }
        }
    }
}
