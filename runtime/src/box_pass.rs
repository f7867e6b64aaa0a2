//! Rasterizing bounds against the occlusion map, for methods of your own.

use crate::camera::DepthConvention;
use crate::device::{DeviceProfile, EarlyZ};
use crate::draw::Targets;
use crate::gpu::{self, Access};

/// Vertices of a box: one strip.
pub const BOX_VERTICES: u32 = 14;

/// The shader of a [`BoxPass`].
#[derive(Clone, Copy, Debug)]
pub struct BoxShader {
    /// The module of hroc-shaders that samples the map. Its vertex shader is `box_vertex` (see common/raster_box),
    /// the depth texture stands at `@group(1) @binding(0)`.
    pub sampled: &'static str,
    /// Its fragment shader.
    pub sampled_entry: &'static str,
    /// The module whose fragment shader forces the early depth test.
    pub early: &'static str,
    /// Its fragment shader.
    pub early_entry: &'static str,
}

/// A pass that draws boxes, 14 vertices each, against the depth target, and writes nothing but storage.
#[derive(Clone, Debug)]
pub struct BoxPass {
    label: &'static str,
    pipeline: BoxPipeline,
    group: wgpu::BindGroup,
    early_z: EarlyZ,
}

#[derive(Clone, Debug)]
struct BoxPipeline {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    map_layout: wgpu::BindGroupLayout,
}

impl BoxPass {
    /// `shader` over `buffers`, which stand at `@group(0)`, bindings 0, 1, 2, ... Compiled once per device
    /// and constants.
    ///
    /// # Panics
    /// If hroc-shaders has no such modules.
    pub fn new(
        device: &wgpu::Device,
        profile: &DeviceProfile,
        shader: BoxShader,
        depth: DepthConvention,
        constants: &[(&str, f64)],
        buffers: &[(Access, &wgpu::Buffer)],
    ) -> Self {
        let early_z = profile.early_z;
        let constants = [constants, &depth.constants()].concat();
        let access = buffers.iter().map(|&(access, _)| access);
        let access = access.collect::<Vec<_>>();
        let key = format!("{} {early_z:?} {constants:?}", shader.sampled);
        let pipeline = (profile.pipelines).get(&key, || {
            BoxPipeline::new(device, shader, early_z, depth, &constants, &access)
        });
        let buffers = buffers.iter().map(|&(_, buffer)| buffer);
        let buffers = buffers.collect::<Vec<_>>();
        let group = gpu::buffer_group(device, shader.sampled, &pipeline.layout, &buffers);
        Self {
            label: shader.sampled,
            pipeline,
            group,
            early_z,
        }
    }

    /// Records a pass over the boxes of the indirect arguments at `offset` of `arguments`.
    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets<'_>,
        arguments: &wgpu::Buffer,
        offset: u64,
    ) {
        // The host may hand over other targets in every frame, so the group is made anew.
        let map = gpu::depth_group(device, &self.pipeline.map_layout, targets.depth);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(self.label),
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
            depth_stencil_attachment: (self.early_z == EarlyZ::Forced).then_some(
                wgpu::RenderPassDepthStencilAttachment {
                    view: targets.depth,
                    depth_ops: None,
                    stencil_ops: None,
                },
            ),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_bind_group(1, &map, &[]);
        pass.draw_indirect(arguments, offset);
    }
}

impl BoxPipeline {
    fn new(
        device: &wgpu::Device,
        shader: BoxShader,
        early_z: EarlyZ,
        depth: DepthConvention,
        constants: &[(&str, f64)],
        access: &[Access],
    ) -> Self {
        let (name, entry_point) = match early_z {
            EarlyZ::Forced => (shader.early, shader.early_entry),
            EarlyZ::Sampled => (shader.sampled, shader.sampled_entry),
        };
        let module = gpu::shader(device, name);
        let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
        let layout = gpu::buffer_layout(device, shader.sampled, stages, access);
        let map_layout = gpu::depth_layout(device, wgpu::ShaderStages::FRAGMENT);
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(shader.sampled),
            bind_group_layouts: &[Some(&layout), Some(&map_layout)],
            immediate_size: 0,
        });
        // Equality passes: what decides is in the shader.
        let depth_stencil = wgpu::DepthStencilState {
            format: Targets::DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            depth_compare: Some(depth.nearer_or_equal()),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        };
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants,
            ..Default::default()
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(shader.sampled),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("box_vertex"),
                compilation_options: compilation_options.clone(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                front_face: wgpu::FrontFace::Ccw,
                // No box contains the eye, so front faces cover each of its pixels once.
                cull_mode: Some(wgpu::Face::Back),
                ..Default::default()
            },
            depth_stencil: (early_z == EarlyZ::Forced).then_some(depth_stencil),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(entry_point),
                compilation_options,
                // A pass needs an attachment; the map is one on some paths only.
                targets: &[Some(wgpu::ColorTargetState {
                    format: Targets::ITEM_FORMAT,
                    blend: None,
                    write_mask: wgpu::ColorWrites::empty(),
                })],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self {
            pipeline,
            layout,
            map_layout,
        }
    }
}
