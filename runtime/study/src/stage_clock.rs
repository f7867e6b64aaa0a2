//! Times each stage of a frame with the host's clock.

use std::time::Instant;

use hroc_runtime::{Stage, StageObserver};

use crate::gpu::{Gpu, GpuError};

/// Submits and waits at every stage's begin and end, so that the time between is that stage's alone. It holds
/// what the device does in it and the cost of one submission.
#[derive(Debug)]
pub struct StageClock<'a> {
    gpu: &'a Gpu,
    began: Instant,
    stages: Vec<(Stage, f64)>,
    result: Result<(), GpuError>,
}

impl<'a> StageClock<'a> {
    /// A clock for one frame.
    pub fn new(gpu: &'a Gpu) -> Self {
        Self {
            gpu,
            began: Instant::now(),
            stages: Vec::new(),
            result: Ok(()),
        }
    }

    /// Milliseconds of each stage, in the order they ran.
    ///
    /// # Errors
    /// If the device failed meanwhile.
    pub fn finish(self) -> Result<Vec<(Stage, f64)>, GpuError> {
        self.result.map(|()| self.stages)
    }

    fn flush(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let recorded = std::mem::replace(encoder, self.gpu.encoder());
        let result = self.gpu.submit_and_wait(recorded);
        if self.result.is_ok() {
            self.result = result;
        }
    }
}

impl StageObserver for StageClock<'_> {
    fn begin(&mut self, _stage: Stage, encoder: &mut wgpu::CommandEncoder) {
        self.flush(encoder);
        self.began = Instant::now();
    }

    fn end(&mut self, stage: Stage, encoder: &mut wgpu::CommandEncoder) {
        self.flush(encoder);
        self.stages
            .push((stage, self.began.elapsed().as_secs_f64() * 1e3));
    }
}
