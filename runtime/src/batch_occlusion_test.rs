//! `batch_occlusion_test`: rasterize the groups' bounds, cast a ray per fragment the map does not hide.

use crate::camera::DepthConvention;
use crate::device::EarlyZ;
use crate::draw::Targets;
use crate::gpu::{self, Access};
use crate::mutant::Mutant;
use crate::pipelines::Pipelines;
use crate::scene::Tree;

/// Where the stage reads and writes.
pub(crate) struct TestBuffers<'a> {
    pub frame: &'a wgpu::Buffer,
    pub tree: &'a Tree,
    pub groups: &'a wgpu::Buffer,
    pub potential_occluders: &'a wgpu::Buffer,
    pub potentially_visible: &'a wgpu::Buffer,
    pub work: &'a wgpu::Buffer,
    pub grouping: &'a wgpu::Buffer,
    pub flagged_nodes: &'a wgpu::Buffer,
    pub object_bounds: &'a wgpu::Buffer,
}

/// Variants of the stage.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TestOptions {
    pub depth: DepthConvention,
    pub early_z: EarlyZ,
    pub prune: bool,
    pub count_work: bool,
    pub mutant: Mutant,
}

/// The pipeline of a variant.
#[derive(Clone)]
struct TestPipeline {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    map_layout: wgpu::BindGroupLayout,
}

impl TestPipeline {
    fn new(device: &wgpu::Device, options: TestOptions) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let (name, entry_point) = match options.early_z {
            EarlyZ::Forced => ("batch_occlusion_test_early", "cast_ray_early"),
            EarlyZ::Sampled => ("batch_occlusion_test", "cast_ray"),
        };
        let module = gpu::shader(device, name);
        let layout = gpu::buffer_layout(
            device,
            "batch_occlusion_test",
            wgpu::ShaderStages::VERTEX_FRAGMENT,
            &[
                Uniform, Read, Read, Read, ReadWrite, ReadWrite, ReadWrite, Read, ReadWrite, Read,
            ],
        );
        let map_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("occlusion_map"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Depth,
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            }],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("batch_occlusion_test"),
            bind_group_layouts: &[Some(&layout), Some(&map_layout)],
            immediate_size: 0,
        });
        let constants = [
            options.depth.constants()[0],
            options.mutant.constant(),
            ("COUNT_WORK", gpu::flag(options.count_work)),
            ("PRUNE", gpu::flag(options.prune)),
        ];
        // Equality passes: what decides is in the shader.
        let depth_stencil = wgpu::DepthStencilState {
            format: Targets::DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            depth_compare: Some(options.depth.nearer_or_equal()),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        };
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants: &constants,
            ..Default::default()
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("batch_occlusion_test"),
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
                // No group contains the eye, so front faces cover each pixel of a box once.
                cull_mode: Some(wgpu::Face::Back),
                ..Default::default()
            },
            depth_stencil: (options.early_z == EarlyZ::Forced).then_some(depth_stencil),
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

/// Pipeline and bindings of one view.
#[derive(Debug)]
pub(crate) struct BatchOcclusionTest {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    map_layout: wgpu::BindGroupLayout,
    flagged_nodes: wgpu::Buffer,
    early_z: EarlyZ,
}

impl BatchOcclusionTest {
    pub fn new(
        device: &wgpu::Device,
        pipelines: &Pipelines,
        options: TestOptions,
        buffers: &TestBuffers<'_>,
    ) -> Self {
        let key = format!("batch_occlusion_test {options:?}");
        let TestPipeline {
            pipeline,
            layout,
            map_layout,
        } = pipelines.get(&key, || TestPipeline::new(device, options));
        let b = buffers;
        let group = gpu::buffer_group(
            device,
            "batch_occlusion_test",
            &layout,
            &[
                b.frame,
                &b.tree.nodes,
                b.groups,
                b.potential_occluders,
                b.potentially_visible,
                b.work,
                b.grouping,
                &b.tree.parents,
                b.flagged_nodes,
                b.object_bounds,
            ],
        );
        Self {
            pipeline,
            group,
            map_layout,
            flagged_nodes: b.flagged_nodes.clone(),
            early_z: options.early_z,
        }
    }

    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets<'_>,
        group_draw: &wgpu::Buffer,
    ) {
        encoder.clear_buffer(&self.flagged_nodes, 0, None);
        // The host may hand over other targets in every frame, so the group is made anew.
        let map = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("occlusion_map"),
            layout: &self.map_layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(targets.depth),
            }],
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("batch_occlusion_test"),
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
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_bind_group(1, &map, &[]);
        pass.draw_indirect(group_draw, 0);
    }
}
