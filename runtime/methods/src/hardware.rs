//! The hardware model of NOHC (Guthe, Balázs, Klein 2006, Table 2): what draws and queries cost on a device, measured
//! on made-up frames.

use std::time::Instant;

use hroc_runtime::gpu::{self, Access};
use hroc_runtime::{DeviceProfile, Targets};

const SIDE_PX: u32 = 512;
const REPEATS: usize = 7;
/// Draws, triangles, queries per measurement.
const MANY: u32 = 512;
/// Full images per measurement.
const LAYERS: u32 = 16;

/// Milliseconds. The names of the paper's Table 2 stand in brackets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HardwareTimes {
    /// Per draw (T_r^s).
    pub draw_ms: f64,
    /// Per triangle drawn (T_r^triangle).
    pub triangle_ms: f64,
    /// Per fragment drawn (T_r^f).
    pub fragment_ms: f64,
    /// Per occlusion query (T_o^s).
    pub query_ms: f64,
    /// Per fragment of the bounds in a query (T_o^f).
    pub query_fragment_ms: f64,
    /// From recording one small query to its answer on the host (T_o^l).
    pub query_latency_ms: f64,
    /// Per query round something that is drawn anyhow (T_o^o).
    pub query_overhead_ms: f64,
}

/// What to record.
#[derive(Clone, Copy)]
struct Load {
    draws: u32,
    triangles_per_draw: u32,
    size: f32,
    queries: bool,
}

/// A device with what is drawn on it.
struct Bench<'a> {
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    item_buffer: wgpu::TextureView,
    depth: wgpu::TextureView,
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    staging: wgpu::Buffer,
}

const KEY: &str = "hardware times";

impl HardwareTimes {
    /// Those of the device of `profile`, measured the first time they are asked for.
    pub fn of(device: &wgpu::Device, queue: &wgpu::Queue, profile: &DeviceProfile) -> Self {
        (profile.pipelines).get(KEY, || Self::measure(device, queue))
    }

    /// Those of the device of `profile`, if they were ever asked for.
    pub fn known(profile: &DeviceProfile) -> Option<Self> {
        profile.pipelines.find(KEY)
    }

    /// Measures `device`. Takes a few tenths of a second; submits and waits.
    pub fn measure(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let bench = Bench::new(device, queue);
        let pixel = 1.0 / SIDE_PX as f32;
        let load = |draws, triangles_per_draw, size, queries| Load {
            draws,
            triangles_per_draw,
            size,
            queries,
        };
        let none = bench.time(load(0, 0, pixel, false));
        let per = |load: Load, count: u32| (bench.time(load) - none).max(0.0) / f64::from(count);
        let triangle_ms = per(load(1, 64 * MANY, pixel, false), 64 * MANY);
        let draw_ms = (per(load(MANY, 1, pixel, false), MANY) - triangle_ms).max(0.0);
        let fragments = LAYERS * SIDE_PX * SIDE_PX;
        let fragment_ms = per(load(LAYERS, 1, 1.0, false), fragments);
        let latency = bench.time(load(1, 1, pixel, true));
        let query =
            |load: Load, count: u32| (bench.time(load) - latency).max(0.0) / f64::from(count);
        let query_ms = query(load(MANY, 12, pixel, true), MANY);
        let query_fragment_ms = query(load(LAYERS, 1, 1.0, true), fragments);
        Self {
            draw_ms,
            triangle_ms,
            fragment_ms,
            query_ms,
            query_fragment_ms,
            query_latency_ms: latency,
            query_overhead_ms: (query_ms - draw_ms - 12.0 * triangle_ms).max(0.0),
        }
    }
}

impl<'a> Bench<'a> {
    fn new(device: &'a wgpu::Device, queue: &'a wgpu::Queue) -> Self {
        let texture = |format| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("hardware times"),
                size: wgpu::Extent3d {
                    width: SIDE_PX,
                    height: SIDE_PX,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let stages = wgpu::ShaderStages::VERTEX;
        let layout = gpu::buffer_layout(device, "hardware times", stages, &[Access::Uniform]);
        let pipeline = pipeline(device, &layout);
        let bytes = 8 * u64::from(MANY);
        let buffer = |label, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage: usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            })
        };
        Self {
            device,
            queue,
            pipeline,
            layout,
            item_buffer: texture(Targets::ITEM_FORMAT),
            depth: texture(Targets::DEPTH_FORMAT),
            set: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("hardware times"),
                ty: wgpu::QueryType::Occlusion,
                count: MANY,
            }),
            resolved: buffer("query results", wgpu::BufferUsages::QUERY_RESOLVE),
            staging: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("query results read"),
                size: bytes,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        }
    }

    /// Median milliseconds from recording to the end, and with queries to their answer.
    fn time(&self, load: Load) -> f64 {
        let placed = [load.size, 0.5, 0.0, 0.0];
        let uniform = gpu::uniform(self.device, "placed", bytemuck::bytes_of(&placed));
        let group = gpu::buffer_group(self.device, "placed", &self.layout, &[&uniform]);
        self.run(load, &group);
        let mut times = (0..REPEATS)
            .map(|_| {
                let began = Instant::now();
                self.run(load, &group);
                began.elapsed().as_secs_f64() * 1e3
            })
            .collect::<Vec<_>>();
        times.sort_by(f64::total_cmp);
        times[REPEATS / 2]
    }

    fn run(&self, load: Load, group: &wgpu::BindGroup) {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("hardware times"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.item_buffer,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            occlusion_query_set: load.queries.then_some(&self.set),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        for draw in 0..load.draws {
            if load.queries {
                pass.begin_occlusion_query(draw);
            }
            pass.draw(0..3 * load.triangles_per_draw, 0..1);
            if load.queries {
                pass.end_occlusion_query();
            }
        }
        drop(pass);
        if !load.queries {
            let submitted = self.queue.submit([encoder.finish()]);
            self.wait(submitted);
            return;
        }
        let bytes = 8 * u64::from(load.draws);
        encoder.resolve_query_set(&self.set, 0..load.draws, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.staging, 0, bytes);
        let submitted = self.queue.submit([encoder.finish()]);
        self.staging
            .slice(..bytes)
            .map_async(wgpu::MapMode::Read, |_| {});
        self.wait(submitted);
        self.staging.unmap();
    }

    fn wait(&self, submitted: wgpu::SubmissionIndex) {
        // A device that fails takes no time; it fails again where that is told.
        let _ = self.device.poll(wgpu::PollType::Wait {
            submission_index: Some(submitted),
            timeout: None,
        });
    }
}

fn pipeline(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
    let module = gpu::shader(device, "hardware");
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("hardware times"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("hardware times"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("placed_vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: Targets::DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            // Every layer is shaded.
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("placed_fragment"),
            compilation_options: Default::default(),
            targets: &[Some(Targets::ITEM_FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
