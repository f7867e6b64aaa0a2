//! Occlusion queries in batches. wgpu resolves queries into buffers, so an answer costs a submit and a wait: all
//! questions that can be asked together are, in one pass.

use hroc_runtime::gpu::{self, Access};
use hroc_runtime::{BOX_VERTICES, FrameContext, Scene, Stage, Targets, Tree};

use crate::view::View;

/// Queries in one set at most.
pub(crate) const MOST_QUERIES: usize = 4096;
pub(crate) const QUERY: Stage = Stage::new("query");

/// A query: the boxes of some nodes, all of them together.
pub(crate) type Boxes = Vec<u32>;

/// The pass, its query set, and the way back.
#[derive(Debug)]
pub(crate) struct Queries {
    pipeline: wgpu::RenderPipeline,
    map_layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    boxes: wgpu::Buffer,
    most_boxes: usize,
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    staging: wgpu::Buffer,
}

impl Queries {
    pub fn new(device: &wgpu::Device, scene: &Scene, tree: &Tree, view: &View) -> Self {
        use Access::{Read, Uniform};
        let most_boxes = MOST_QUERIES * 16;
        let none = wgpu::BufferUsages::empty();
        let boxes = gpu::storage(device, "query boxes", 4 * most_boxes as u64, none);
        let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
        let layout = gpu::buffer_layout(device, "query", stages, &[Uniform, Read, Read]);
        let map_layout = gpu::depth_layout(device, wgpu::ShaderStages::FRAGMENT);
        let constants = view.constants(scene);
        let key = format!("query_boxes {constants:?}");
        let pipelines = &scene.profile.pipelines;
        let pipeline = pipelines.get(&key, || {
            pipeline(device, view, &constants, &[&layout, &map_layout])
        });
        let bytes = 8 * MOST_QUERIES as u64;
        Self {
            group: gpu::buffer_group(
                device,
                "query",
                &layout,
                &[&view.frame, &tree.nodes, &boxes],
            ),
            pipeline,
            map_layout,
            boxes,
            most_boxes,
            set: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("occlusion queries"),
                ty: wgpu::QueryType::Occlusion,
                count: MOST_QUERIES as u32,
            }),
            resolved: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("query results"),
                size: bytes,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            staging: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("query results read"),
                size: bytes,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        }
    }

    /// How many of `questions` fit into one pass.
    pub fn fitting(&self, questions: &[Boxes]) -> usize {
        let mut boxes = 0;
        let fits = questions.iter().take(MOST_QUERIES).take_while(|question| {
            boxes += question.len();
            boxes <= self.most_boxes
        });
        fits.count()
    }

    /// Asks, submits and waits: whether any box of each of `questions` shows against the depth so far. No more than
    /// are [fitting](Self::fitting).
    pub fn ask(&self, frame: &mut FrameContext<'_>, questions: &[Boxes]) -> Vec<bool> {
        let flat = questions.concat();
        let (device, targets) = (frame.device, frame.targets);
        // Nothing was submitted since the last write but what this belongs to.
        frame
            .queue
            .write_buffer(&self.boxes, 0, bytemuck::cast_slice(&flat));
        let count = questions.len() as u32;
        let bytes = 8 * u64::from(count);
        frame.stage(QUERY, |encoder| {
            self.record(device, encoder, &targets, questions);
            encoder.resolve_query_set(&self.set, 0..count, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.staging, 0, bytes);
        });
        let submitted = frame.submit();
        let slice = self.staging.slice(..bytes);
        slice.map_async(wgpu::MapMode::Read, |_| {});
        let waited = device.poll(wgpu::PollType::Wait {
            submission_index: Some(submitted),
            timeout: None,
        });
        // A device that fails shows nothing either way: draw what was asked about.
        let words: Vec<u64> = match (waited, slice.get_mapped_range()) {
            (Ok(_), Ok(view)) => bytemuck::pod_collect_to_vec(&view),
            _ => vec![1; questions.len()],
        };
        self.staging.unmap();
        words.into_iter().map(|samples| samples != 0).collect()
    }

    fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets<'_>,
        questions: &[Boxes],
    ) {
        let map = gpu::depth_group(device, &self.map_layout, targets.depth);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(QUERY.name()),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: targets.item_buffer,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Load,
                    store: wgpu::StoreOp::Store,
                },
            })],
            // Without operations it is read-only, and may be sampled as well.
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: targets.depth,
                depth_ops: None,
                stencil_ops: None,
            }),
            occlusion_query_set: Some(&self.set),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_bind_group(1, &map, &[]);
        let mut first = 0;
        for (question, query) in questions.iter().zip(0..) {
            let end = first + question.len() as u32;
            pass.begin_occlusion_query(query);
            pass.draw(0..BOX_VERTICES, first..end);
            pass.end_occlusion_query();
            first = end;
        }
    }

    pub fn memory_bytes(&self) -> u64 {
        self.boxes.size() + self.resolved.size() + self.staging.size()
    }
}

fn pipeline(
    device: &wgpu::Device,
    view: &View,
    constants: &[(&str, f64)],
    layouts: &[&wgpu::BindGroupLayout],
) -> wgpu::RenderPipeline {
    let module = gpu::shader(device, "query_boxes");
    let layouts = layouts
        .iter()
        .map(|layout| Some(*layout))
        .collect::<Vec<_>>();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("query"),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants,
        ..Default::default()
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("query"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("box_vertex"),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            cull_mode: Some(wgpu::Face::Back),
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: Targets::DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            depth_compare: Some(view.depth.nearer_or_equal()),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("query"),
            compilation_options,
            targets: &[Some(wgpu::ColorTargetState {
                format: Targets::ITEM_FORMAT,
                blend: None,
                write_mask: wgpu::ColorWrites::empty(),
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
