//! The study's own rendering behind the runtime's [`Drawer`] seam: one pipeline for every pass of a frame.

use bytemuck::{Pod, Zeroable};
use hroc_runtime::{
    Camera, CameraError, DepthConvention, Draw, Drawer, Scene, SceneShape, Targets,
};

use crate::targets::FrameTargets;

/// Behind the scene: a light overcast grey, linear.
const BACKGROUND: wgpu::Color = wgpu::Color {
    r: 0.70,
    g: 0.76,
    b: 0.82,
    a: 1.0,
};

/// The shader's text before its imports are resolved.
const WGSL: &str = include_str!("wgsl/object_color.wgsl");

/// The uniform `View` of object_color.wgsl.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct View {
    clip_from_world: [[f32; 4]; 4],
    eye: [f32; 4],
}

/// Draws objects with their base colour and their id.
#[derive(Debug)]
pub struct ObjectDrawer {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    view: wgpu::Buffer,
    scene: Scene,
    color: wgpu::TextureView,
}

impl ObjectDrawer {
    /// The full text of the shader, on which the pixels depend.
    pub fn wgsl() -> String {
        hroc_shaders::resolve(WGSL).expect("the crate's own imports exist")
    }

    /// A drawer of `scene` into `targets`.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        targets: &FrameTargets,
        depth: DepthConvention,
    ) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("object_color"),
            source: wgpu::ShaderSource::Wgsl(Self::wgsl().into()),
        });
        let layout = bind_group_layout(device);
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("object_color"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let with_normals = [Some(Scene::POSITIONS), Some(Scene::NORMALS)];
        let (entry_point, buffers) = match scene.normals {
            Some(_) => ("object_vertex_with_normal", &with_normals[..]),
            None => ("object_vertex", &with_normals[..1]),
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("object_color"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                buffers,
            },
            // Both faces: no cull mode.
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: Targets::DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(depth.nearer()),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("object_color"),
                compilation_options: Default::default(),
                targets: &[
                    Some(FrameTargets::COLOR_FORMAT.into()),
                    Some(Targets::ITEM_FORMAT.into()),
                ],
            }),
            multiview_mask: None,
            cache: None,
        });
        let view = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("view"),
            size: size_of::<View>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("object_color"),
            layout: &layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: view.as_entire_binding(),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: scene.objects.as_entire_binding(),
                },
            ],
        });
        Self {
            pipeline,
            group,
            view,
            scene: scene.clone(),
            color: targets.color_view.clone(),
        }
    }

    /// Where the next submitted frame is seen from.
    ///
    /// # Errors
    /// If the camera is degenerate.
    pub fn set_camera(
        &self,
        queue: &wgpu::Queue,
        camera: &Camera,
        depth: DepthConvention,
        size: [u32; 2],
    ) -> Result<(), CameraError> {
        let shape = &self.scene.shape;
        let view = View {
            clip_from_world: clip_from_world(camera, depth, size, shape)?,
            eye: (camera.position - shape.origin)
                .extend(1.0)
                .as_vec4()
                .to_array(),
        };
        queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
        Ok(())
    }
}

/// The matrix that geometry is drawn with, as the GPU gets it.
///
/// # Errors
/// If the camera or the size is degenerate.
pub fn clip_from_world(
    camera: &Camera,
    depth: DepthConvention,
    size: [u32; 2],
    shape: &SceneShape,
) -> Result<[[f32; 4]; 4], CameraError> {
    let clip = camera.clip_from_world(depth, size, shape.origin, shape.radius)?;
    Ok(clip.as_mat4().to_cols_array_2d())
}

impl Drawer for ObjectDrawer {
    fn draw(&mut self, encoder: &mut wgpu::CommandEncoder, draw: &Draw<'_>) {
        let load = if draw.clear {
            wgpu::LoadOp::Clear(BACKGROUND)
        } else {
            wgpu::LoadOp::Load
        };
        let color = wgpu::RenderPassColorAttachment {
            view: &self.color,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load,
                store: wgpu::StoreOp::Store,
            },
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(draw.stage.name()),
            color_attachments: &[Some(color), Some(draw.item_attachment())],
            depth_stencil_attachment: Some(draw.depth_attachment()),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        self.scene.bind_geometry(&mut pass);
        draw.list.record(&mut pass);
    }
}

fn bind_group_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("object_color"),
        entries: &[
            entry(0, stages, wgpu::BufferBindingType::Uniform),
            entry(
                1,
                stages,
                wgpu::BufferBindingType::Storage { read_only: true },
            ),
        ],
    })
}
