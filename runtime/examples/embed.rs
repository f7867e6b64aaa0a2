//! The smallest host: its own device, targets, pipelines and camera; hroc decides what is drawn.
//!
//! `cargo run --release -p hroc-runtime --example embed -- SCENE.hroc [--check]`
//!
//! Goes round the scene in 30 frames. With `--check` each frame is drawn a second time with everything in it,
//! and a differing depth buffer ends the program with exit code 1.

use std::error::Error;

use hroc_format::BakedScene;
use hroc_runtime::camera::look_to;
use hroc_runtime::{
    Camera, CullingMethod, DepthConvention, DeviceProfile, Draw, Drawer, FrameContext,
    FrameUniform, Hroc, HrocOptions, Noc, Projection, Scene, Stage, Targets, Tree, device,
    readback,
};

const SIZE: [u32; 2] = [640, 360];
const FRAMES: u32 = 30;

/// The host's own material: the colour of each object, darker with distance. It must write the object's id. Baked files
/// hold no textures, so nothing has holes here; a host that cuts some discards in the same place.
const SHADER: &str = "//!import common/types
//!import object
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var<storage, read> object_bounds: array<ObjectBounds>;
struct Vertex { @builtin(position) position: vec4f, @location(0) @interpolate(flat, either) object: u32 }
struct Pixel { @location(0) color: vec4f, @location(1) item: u32 }
@vertex fn vertex(@location(0) p: vec3f, @builtin(instance_index) object: u32) -> Vertex {
    return Vertex(hroc_clip_position(hroc_relative_position(objects[object], p)), object);
}
@fragment fn fragment(v: Vertex) -> Pixel {
    if (!hroc_keeps(object_bounds[v.object], v.position)) { discard; }
    let base = unpack4x8unorm(objects[v.object].base_color);
    return Pixel(vec4f(base.rgb * (0.3 + 0.7 * v.position.z), base.a), v.object);
}";

/// What the host draws with.
struct Renderer {
    color: wgpu::TextureView,
    solid: Material,
    blended: Material,
    scene: Scene,
}

struct Material {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl Drawer for Renderer {
    fn draw(&mut self, encoder: &mut wgpu::CommandEncoder, draw: &Draw<'_>) {
        let load = if draw.clear {
            wgpu::LoadOp::Clear(wgpu::Color::WHITE)
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
        let material = match draw.stage {
            Stage::RENDER_BLENDED => &self.blended,
            _ => &self.solid,
        };
        pass.set_pipeline(&material.pipeline);
        pass.set_bind_group(0, &material.group, &[]);
        self.scene.bind_geometry(&mut pass);
        draw.list.record(&mut pass);
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments
        .next()
        .ok_or("usage: embed SCENE.hroc [--check]")?;
    let check = arguments
        .next()
        .is_some_and(|argument| argument == "--check");

    // The host's own device and queue, with the features and limits hroc asks for.
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter =
        pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (gpu, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: device::features(&adapter)?,
        required_limits: device::limits(&adapter),
        ..Default::default()
    }))?;

    // Scene, one of its trees, and culling with the history of one view.
    let baked = BakedScene::open_checked(&path)?;
    let profile = DeviceProfile::probe(&gpu, &queue);
    let scene = Scene::upload(&gpu, &profile, baked.scene())?;
    let tree = Tree::upload(&gpu, baked.scene(), "sah")?;
    let depth = DepthConvention::Reversed;
    let mut hroc = Hroc::new(
        &gpu,
        &scene,
        &tree,
        HrocOptions {
            depth,
            ..Default::default()
        },
    );
    let mut everything = Noc::new(&gpu, &scene, depth);

    // The host's own targets and pipelines.
    let texture = |format| {
        gpu.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: SIZE[0],
                height: SIZE[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    };
    let color_format = wgpu::TextureFormat::Rgba8UnormSrgb;
    let textures = [color_format, Targets::ITEM_FORMAT, Targets::DEPTH_FORMAT].map(texture);
    let views = textures
        .each_ref()
        .map(|texture| texture.create_view(&wgpu::TextureViewDescriptor::default()));
    let frame_uniform = gpu.create_buffer(&wgpu::BufferDescriptor {
        label: Some("frame"),
        size: size_of::<FrameUniform>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let material = |blended| material(&gpu, &scene, &frame_uniform, depth, color_format, blended);
    let mut renderer = Renderer {
        color: views[0].clone(),
        solid: material(false),
        blended: material(true),
        scene: scene.clone(),
    };

    let mut wrong_frames = 0;
    for frame in 0..FRAMES {
        let camera = round_the_scene(&scene, f64::from(frame) / f64::from(FRAMES));
        let uniform = FrameUniform::new(&camera, depth, SIZE, &scene.shape)?;
        let mut draw = |method: &mut dyn CullingMethod| -> Result<Vec<u8>, Box<dyn Error>> {
            queue.write_buffer(&frame_uniform, 0, bytemuck::bytes_of(&uniform));
            let mut encoder =
                gpu.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let targets = Targets {
                depth: &views[2],
                item_buffer: &views[1],
                size: SIZE,
            };
            let mut context = FrameContext {
                device: &gpu,
                queue: &queue,
                encoder: &mut encoder,
                scene: &scene,
                camera: &camera,
                targets,
                observer: None,
            };
            method.encode(&mut context, &mut renderer)?;
            queue.submit([encoder.finish()]);
            Ok(if check {
                readback::texture(&gpu, &queue, &textures[2])
            } else {
                Vec::new()
            })
        };
        let culled = draw(&mut hroc)?;
        if check && culled != draw(&mut everything)? {
            eprintln!("frame {frame}: the depth buffer differs from that of drawing everything");
            wrong_frames += 1;
        }
    }
    let drawn = hroc
        .sets()
        .visible
        .map_or(0, |visible| readback::set(&gpu, &queue, visible).len());
    eprintln!(
        "{FRAMES} frames; {drawn} of {} objects show in the last one",
        scene.shape.object_count
    );
    if wrong_frames > 0 {
        Err(format!("{wrong_frames} of {FRAMES} frames are wrong").into())
    } else {
        Ok(())
    }
}

/// A circle round the scene, looking at its centre.
fn round_the_scene(scene: &Scene, turn: f64) -> Camera {
    let radius = scene.shape.radius.max(1e-3);
    let angle = std::f64::consts::TAU * turn;
    let offset = glam::DVec3::new(angle.cos(), 0.4, angle.sin()) * radius;
    Camera {
        position: scene.shape.origin + offset,
        orientation: look_to(-offset, glam::DVec3::Y),
        projection: Projection::Perspective { fov_y_rad: 1.0 },
        near: 1e-3 * radius,
        far: None,
        jitter_px: [0.0; 2],
    }
}

fn material(
    gpu: &wgpu::Device,
    scene: &Scene,
    frame_uniform: &wgpu::Buffer,
    depth: DepthConvention,
    color: wgpu::TextureFormat,
    blended: bool,
) -> Material {
    let wgsl = hroc_shaders::resolve(SHADER).expect("the imports exist");
    let module = gpu.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    });
    let constants = depth.constants();
    let options = wgpu::PipelineCompilationOptions {
        constants: &constants,
        ..Default::default()
    };
    // What is blended writes neither depth nor item buffer: it hides nothing.
    let (blend, item_writes) = if blended {
        let over = wgpu::BlendState::ALPHA_BLENDING;
        (Some(over), wgpu::ColorWrites::empty())
    } else {
        (None, wgpu::ColorWrites::ALL)
    };
    let target = |format, blend, write_mask| {
        Some(wgpu::ColorTargetState {
            format,
            blend,
            write_mask,
        })
    };
    let pipeline = gpu.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("material"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: options.clone(),
            buffers: &[Some(scene.positions_layout())],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: Targets::DEPTH_FORMAT,
            depth_write_enabled: Some(!blended),
            depth_compare: Some(depth.nearer()),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: options.clone(),
            targets: &[
                target(color, blend, wgpu::ColorWrites::ALL),
                target(Targets::ITEM_FORMAT, None, item_writes),
            ],
        }),
        multiview_mask: None,
        cache: None,
    });
    let group = gpu.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("material"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry {
                binding: 0,
                resource: frame_uniform.as_entire_binding(),
            },
            wgpu::BindGroupEntry {
                binding: 1,
                resource: scene.objects.as_entire_binding(),
            },
            wgpu::BindGroupEntry {
                binding: 2,
                resource: scene.object_bounds.as_entire_binding(),
            },
        ],
    });
    Material { pipeline, group }
}
