//! Which blended objects show: those with a fragment in front of the final opaque depth.
//!
//! They write no depth, so the depth buffer cannot reveal that one is missing. Each is drawn against the
//! depth that a frame left behind, which is the truth's if the frame has no wrong pixel.

use hroc_format::{ArchivedScene, object_flags};
use hroc_runtime::{Camera, CameraError, DepthConvention, FrameUniform, Scene, Targets, readback};

use crate::gpu::Gpu;
use crate::id_set::IdSet;

const WGSL: &str = include_str!("wgsl/blended_truth.wgsl");

/// Finds the blended objects of the bake that show.
#[derive(Debug)]
pub struct BlendedTruth {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    frame: wgpu::Buffer,
    shown: wgpu::Buffer,
    depth: DepthConvention,
    /// Id, first index, index count, first vertex.
    draws: Vec<[u32; 4]>,
}

impl BlendedTruth {
    /// `None` for a scene without blended objects.
    pub fn new(
        gpu: &Gpu,
        baked: &ArchivedScene,
        scene: &Scene,
        depth: DepthConvention,
    ) -> Option<Self> {
        let draws = baked.objects.iter().zip(0u32..).filter_map(|(object, id)| {
            let mesh = &baked.meshes[object.mesh.to_native() as usize];
            (object.flags.to_native() & object_flags::BLENDED != 0).then(|| {
                [
                    id,
                    mesh.first_index.to_native(),
                    mesh.index_count.to_native(),
                    mesh.first_vertex.to_native(),
                ]
            })
        });
        let draws = draws.collect::<Vec<_>>();
        if draws.is_empty() {
            return None;
        }
        let device = &gpu.device;
        let wgsl = hroc_shaders::resolve(WGSL).expect("the crate's own imports exist");
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("blended_truth"),
            source: wgpu::ShaderSource::Wgsl(wgsl.into()),
        });
        let constants = depth.constants();
        let options = wgpu::PipelineCompilationOptions {
            constants: &constants,
            ..Default::default()
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("blended_truth"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("blended_vertex"),
                compilation_options: options.clone(),
                buffers: &[Some(scene.positions_layout())],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("mark_shown"),
                compilation_options: options,
                // A pass needs an attachment.
                targets: &[Some(wgpu::ColorTargetState {
                    format: Targets::ITEM_FORMAT,
                    blend: None,
                    write_mask: wgpu::ColorWrites::empty(),
                })],
            }),
            multiview_mask: None,
            cache: None,
        });
        let buffer = |label, size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            })
        };
        let frame = buffer(
            "frame",
            size_of::<FrameUniform>() as u64,
            wgpu::BufferUsages::UNIFORM,
        );
        let words = u64::from(scene.shape.object_words().max(1));
        let shown = buffer("shown", 4 * words, wgpu::BufferUsages::STORAGE);
        let entries = [&frame, &scene.objects, &scene.object_bounds, &shown]
            .into_iter()
            .zip(0..)
            .map(|(buffer, binding)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect::<Vec<_>>();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("blended_truth"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        Some(Self {
            pipeline,
            group,
            frame,
            shown,
            depth,
            draws,
        })
    }

    /// Those that show over the depth in `targets`, seen from `camera`.
    ///
    /// # Errors
    /// If the camera is degenerate.
    pub fn shown(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        camera: &Camera,
        targets: Targets<'_>,
    ) -> Result<IdSet, CameraError> {
        let uniform = FrameUniform::new(camera, self.depth, targets.size, &scene.shape)?;
        gpu.queue
            .write_buffer(&self.frame, 0, bytemuck::bytes_of(&uniform));
        let depth = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("opaque_depth"),
            layout: &self.pipeline.get_bind_group_layout(1),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(targets.depth),
            }],
        });
        let mut encoder = gpu.encoder();
        encoder.clear_buffer(&self.shown, 0, None);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("blended_truth"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: targets.item_buffer,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Load,
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_bind_group(1, &depth, &[]);
        scene.bind_geometry(&mut pass);
        for &[id, first, count, vertex] in &self.draws {
            pass.draw_indexed(first..first + count, vertex as i32, id..id + 1);
        }
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        let words = readback::words(&gpu.device, &gpu.queue, &self.shown);
        Ok(IdSet::from_words(words))
    }
}
