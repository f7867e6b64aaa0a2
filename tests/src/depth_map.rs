//! Depth buffers of chosen contents: nothing but a fragment shader can write them.

use hroc_study::gpu::Gpu;
use wgpu::util::{DeviceExt, TextureDataOrder};

const DRAW: &str = "
@group(0) @binding(0) var depths: texture_2d<f32>;
@vertex fn cover(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.5, 1.0);
}
@fragment fn put(@builtin(position) position: vec4f) -> @builtin(frag_depth) f32 {
    return textureLoad(depths, vec2u(position.xy), 0).x;
}
";

/// Draws depth buffers.
#[derive(Debug)]
pub struct DepthMaps(wgpu::RenderPipeline);

impl DepthMaps {
    /// For a device.
    pub fn new(gpu: &Gpu) -> Self {
        let module = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("depth map"),
                source: wgpu::ShaderSource::Wgsl(DRAW.into()),
            });
        let descriptor = wgpu::RenderPipelineDescriptor {
            label: Some("depth map"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("cover"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("put"),
                compilation_options: Default::default(),
                targets: &[],
            }),
            multiview_mask: None,
            cache: None,
        };
        Self(gpu.device.create_render_pipeline(&descriptor))
    }

    /// A depth buffer with these depths, row by row from the top.
    pub fn draw(&self, gpu: &Gpu, depths: &[f32], [width, height]: [u32; 2]) -> wgpu::Texture {
        let size = wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        };
        let descriptor = |format, usage| wgpu::TextureDescriptor {
            label: Some("depth map"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        };
        let sampled = wgpu::TextureUsages::TEXTURE_BINDING;
        let source = gpu.device.create_texture_with_data(
            &gpu.queue,
            &descriptor(wgpu::TextureFormat::R32Float, sampled),
            TextureDataOrder::LayerMajor,
            bytemuck::cast_slice(depths),
        );
        let usage =
            sampled | wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let map = gpu
            .device
            .create_texture(&descriptor(wgpu::TextureFormat::Depth32Float, usage));
        let view = source.create_view(&Default::default());
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("depth map"),
            layout: &self.0.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view),
            }],
        });
        let mut encoder = gpu.encoder();
        let target = map.create_view(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("depth map"),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &target,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.0);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        map
    }
}
