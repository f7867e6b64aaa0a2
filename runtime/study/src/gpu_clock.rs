//! Times each stage of a frame with the device's own timestamps, where these can be trusted.

use std::time::Instant;

use hroc_runtime::{Stage, StageObserver, readback};

use crate::gpu::{Gpu, GpuError};

/// Timestamps per frame. Methods that wait within a frame have a few stages for each wait, and up to about a hundred
/// waits.
const CAPACITY: u32 = wgpu::QUERY_SET_MAX_QUERIES;
/// Work of which host and device agree on the duration must last this long, so that the submission, about
/// 0.1 ms, does not count.
const PROBE_MS: f64 = 10.0;
/// The device's share of the host's time that passes as right.
const PLAUSIBLE: std::ops::Range<f64> = 0.5..1.1;

/// A chain of dependent operations in each of 64 x 64 invocations.
const PROBE: &str = "
@group(0) @binding(0) var<storage, read_write> words: array<u32>;
@group(0) @binding(1) var<uniform> steps: vec4u;
@compute @workgroup_size(64) fn probe(@builtin(global_invocation_id) id: vec3u) {
    var x = id.x;
    for (var i = 0u; i < steps.x; i++) { x = x * 1664525u + 1013904223u; }
    words[id.x] = x;
}";

/// Which clock the stages are timed by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ClockChoice {
    /// The device's if it passes a test, else the host's.
    #[default]
    Auto,
    /// The host's, with a wait at each stage.
    Wall,
    /// The device's, right or wrong.
    Gpu,
}

/// The device's clock.
#[derive(Debug)]
pub struct GpuClock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    tick_ms: f64,
}

impl GpuClock {
    /// Features without which there is none.
    pub const FEATURES: wgpu::Features =
        wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

    /// The clock to time stages by; `None` is the host's.
    ///
    /// # Errors
    /// If the device's is wanted and there is none, or the device failed meanwhile.
    pub fn choose(gpu: &Gpu, choice: ClockChoice) -> Result<Option<Self>, GpuError> {
        let exists = gpu.device.features().contains(Self::FEATURES);
        match choice {
            ClockChoice::Gpu if exists => Ok(Some(Self::new(gpu))),
            ClockChoice::Gpu => Err(GpuError::NoClock(gpu.info.name.clone())),
            ClockChoice::Auto if exists => {
                // On some drivers compute passes seem to take no time.
                let clock = Self::new(gpu);
                Ok(clock.is_right(gpu)?.then_some(clock))
            }
            ClockChoice::Auto | ClockChoice::Wall => Ok(None),
        }
    }

    fn new(gpu: &Gpu) -> Self {
        let queries = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("timestamps"),
            ty: wgpu::QueryType::Timestamp,
            count: CAPACITY,
        });
        let resolved = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("timestamps"),
            size: u64::from(CAPACITY) * 8,
            usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let tick_ms = f64::from(gpu.queue.get_timestamp_period()) * 1e-6;
        Self {
            queries,
            resolved,
            tick_ms,
        }
    }

    fn is_right(&self, gpu: &Gpu) -> Result<bool, GpuError> {
        let device = &gpu.device;
        let buffer = |size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("probe"),
                size,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let words = buffer(64 * 64 * 4, wgpu::BufferUsages::STORAGE);
        let steps = buffer(16, wgpu::BufferUsages::UNIFORM);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("probe"),
            source: wgpu::ShaderSource::Wgsl(PROBE.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("probe"),
            layout: None,
            module: &module,
            entry_point: Some("probe"),
            compilation_options: Default::default(),
            cache: None,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("probe"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: words.as_entire_binding(),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: steps.as_entire_binding(),
                },
            ],
        });
        // Twice the work until it lasts; at worst a second or so.
        for doubling in 10..31 {
            gpu.queue
                .write_buffer(&steps, 0, bytemuck::bytes_of(&[1u32 << doubling, 0, 0, 0]));
            gpu.queue.submit([]);
            gpu.wait()?;
            let began = Instant::now();
            let mut encoder = gpu.encoder();
            encoder.write_timestamp(&self.queries, 0);
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(64, 1, 1);
            drop(pass);
            encoder.write_timestamp(&self.queries, 1);
            self.resolve(&mut encoder, 2);
            gpu.submit_and_wait(encoder)?;
            let host_ms = began.elapsed().as_secs_f64() * 1e3;
            if host_ms >= PROBE_MS {
                let times = self.read(gpu, 2);
                return Ok(PLAUSIBLE.contains(&((times[1] - times[0]) / host_ms)));
            }
        }
        Ok(false)
    }

    fn resolve(&self, encoder: &mut wgpu::CommandEncoder, count: u32) {
        if count > 0 {
            encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
        }
    }

    /// Milliseconds since the first of the timestamps that were resolved.
    fn read(&self, gpu: &Gpu, count: u32) -> Vec<f64> {
        let bytes = readback::buffer(&gpu.device, &gpu.queue, &self.resolved);
        let ticks = bytemuck::pod_collect_to_vec::<u8, u64>(&bytes[..count as usize * 8]);
        let first = ticks.first().copied().unwrap_or(0);
        // A clock that runs backward shows as 0 and not as centuries.
        ticks
            .iter()
            .map(|tick| tick.saturating_sub(first) as f64 * self.tick_ms)
            .collect()
    }
}

/// Writes timestamps round the stages of one frame, which stays one submission.
#[derive(Debug)]
pub struct GpuStageClock<'a> {
    clock: &'a GpuClock,
    stages: Vec<Stage>,
    /// A stage found no more place.
    overflowed: bool,
}

impl<'a> GpuStageClock<'a> {
    /// For one frame.
    pub const fn new(clock: &'a GpuClock) -> Self {
        Self {
            clock,
            stages: Vec::new(),
            overflowed: false,
        }
    }

    /// Records the end of the frame.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        self.clock.resolve(encoder, self.written());
    }

    /// Milliseconds of each stage in the order they ran, and from the first one's begin to the last one's end;
    /// once the frame was submitted. `None` of a frame with more stages than the clock can time.
    pub fn read(self, gpu: &Gpu) -> Option<(Vec<(Stage, f64)>, f64)> {
        if self.overflowed {
            return None;
        }
        let times = self.clock.read(gpu, self.written());
        let stages = self.stages.iter().zip(times.chunks_exact(2));
        let stages = stages
            .map(|(&stage, span)| (stage, (span[1] - span[0]).max(0.0)))
            .collect();
        Some((stages, times.last().copied().unwrap_or(0.0)))
    }

    /// Timestamps so far, which are no more than there is place for.
    fn written(&self) -> u32 {
        2 * self.stages.len() as u32
    }
}

impl StageObserver for GpuStageClock<'_> {
    fn begin(&mut self, _stage: Stage, encoder: &mut wgpu::CommandEncoder) {
        if self.written() < CAPACITY {
            encoder.write_timestamp(&self.clock.queries, self.written());
        }
    }

    fn end(&mut self, stage: Stage, encoder: &mut wgpu::CommandEncoder) {
        if self.written() < CAPACITY {
            encoder.write_timestamp(&self.clock.queries, self.written() + 1);
            self.stages.push(stage);
        } else {
            self.overflowed = true;
        }
    }
}
