//! `filter_occluders`: the set of objects in the item buffer.

use crate::draw::Targets;
use crate::gpu;
use crate::scene::Scene;

/// The pipeline; one per device.
#[derive(Clone, Debug)]
struct Filter {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// The stage over one scene.
#[derive(Debug)]
pub struct FilterOccluders {
    filter: Filter,
    limits: wgpu::Buffer,
}

impl FilterOccluders {
    /// For `scene`.
    pub fn new(device: &wgpu::Device, scene: &Scene) -> Self {
        let limits = [scene.shape.object_count, 0, 0, 0];
        Self {
            filter: (scene.profile.pipelines).get("filter_occluders", || Filter::new(device)),
            limits: gpu::uniform(device, "object count", bytemuck::bytes_of(&limits)),
        }
    }

    /// Makes `visible` (one bit per object) the set of the scene's ids in the item buffer.
    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets<'_>,
        visible: &wgpu::Buffer,
    ) {
        self.filter
            .record(device, encoder, targets, visible, &self.limits);
    }

    /// GPU memory, bytes.
    pub fn memory_bytes(&self) -> u64 {
        self.limits.size()
    }
}

impl Filter {
    fn new(device: &wgpu::Device) -> Self {
        let module = gpu::shader(device, "filter_occluders");
        let texture = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let buffer = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("filter_occluders"),
            entries: &[
                texture,
                buffer(1, wgpu::BufferBindingType::Storage { read_only: false }),
                buffer(2, wgpu::BufferBindingType::Uniform),
            ],
        });
        Self {
            pipeline: gpu::compute(device, &module, "filter_occluders", &[&layout], &[]),
            layout,
        }
    }

    /// Ids from the object count in `limits` up are left out.
    fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets<'_>,
        visible: &wgpu::Buffer,
        limits: &wgpu::Buffer,
    ) {
        encoder.clear_buffer(visible, 0, None);
        // The host may hand over other targets in every frame, so the group is made anew.
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("filter_occluders"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(targets.item_buffer),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: visible.as_entire_binding(),
                },
                wgpu::BindGroupEntry {
                    binding: 2,
                    resource: limits.as_entire_binding(),
                },
            ],
        });
        let mut pass = gpu::compute_pass(encoder, "filter_occluders");
        gpu::dispatch(
            &mut pass,
            &self.pipeline,
            &group,
            targets.size.map(|n| n.div_ceil(8)),
        );
    }
}
