//! The study's own rendering behind the runtime's [`Drawer`] seam: one arithmetic for every pass of a frame.

use hroc_runtime::{
    Camera, CameraError, DepthConvention, Draw, Drawer, FrameUniform, Marks, Scene, SceneShape,
    Stage, Targets,
};

use crate::targets::FrameTargets;

/// Behind the scene: a blue grey between the light and the dark of what is in front, linear.
const BACKGROUND: wgpu::Color = wgpu::Color {
    r: 0.40,
    g: 0.47,
    b: 0.55,
    a: 1.0,
};

/// The shaders' text before their imports are resolved.
const WGSL: &str = include_str!("wgsl/object_color.wgsl");
const MARKED_WGSL: &str = include_str!("wgsl/object_color_marked.wgsl");
const COUNT_WGSL: &str = include_str!("wgsl/fragment_count.wgsl");
const COUNT_MARKED_WGSL: &str = include_str!("wgsl/fragment_count_marked.wgsl");

/// What the first target takes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Output {
    Color,
    /// One for each fragment that passes the depth test, added up.
    FragmentCount,
}

impl Output {
    const fn format(self) -> wgpu::TextureFormat {
        match self {
            Self::Color => FrameTargets::COLOR_FORMAT,
            Self::FragmentCount => ObjectDrawer::COUNT_FORMAT,
        }
    }

    const fn background(self) -> wgpu::Color {
        match self {
            Self::Color => BACKGROUND,
            Self::FragmentCount => wgpu::Color::TRANSPARENT,
        }
    }
}

/// Which fragments a drawer discards, beside those in holes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Guard {
    /// Those that `hroc_keeps` refuses.
    #[default]
    Snippet,
    /// Those whose depth is infinite or NaN.
    Finite,
    /// None.
    Off,
}

impl Guard {
    /// The pipeline constant, `GUARD`, of the shaders that discard by it.
    pub const fn constant(self) -> (&'static str, f64) {
        let number = match self {
            Self::Snippet => 0.0,
            Self::Finite => 1.0,
            Self::Off => 2.0,
        };
        ("GUARD", number)
    }
}

/// What makes one drawer draw other pixels than another.
#[derive(Clone, Copy, Debug)]
struct Look {
    depth: DepthConvention,
    holes: bool,
    guard: Guard,
    output: Output,
}

/// Draws objects with their base colour and their id.
#[derive(Debug)]
pub struct ObjectDrawer {
    plain: wgpu::RenderPipeline,
    marked: wgpu::RenderPipeline,
    blended: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    frame: wgpu::Buffer,
    eye: wgpu::Buffer,
    scene: Scene,
    output: Output,
    color: wgpu::TextureView,
}

impl ObjectDrawer {
    /// Format of the target of [`counting`](Self::counting): the count twice, as read-backs take four bytes a texel.
    pub const COUNT_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;

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
        Self::with_guard(device, scene, targets, depth, false, Guard::Snippet)
    }

    /// A drawer that writes depth and item buffer as ever, and adds up in `count`, instead of colour, the
    /// fragments of each pixel that pass the depth test as they are drawn: those that are shaded where hidden
    /// ones are turned away early. Counts are exact up to 2048.
    pub fn counting(
        device: &wgpu::Device,
        scene: &Scene,
        count: &wgpu::TextureView,
        depth: DepthConvention,
    ) -> Self {
        let look = Look {
            depth,
            holes: false,
            guard: Guard::Snippet,
            output: Output::FragmentCount,
        };
        Self::make(device, scene, count, look)
    }

    /// A drawer of `scene` into `targets` that discards by `guard`. With `holes`, masked objects get holes: for tests, as
    /// baked scenes hold no textures.
    pub fn with_guard(
        device: &wgpu::Device,
        scene: &Scene,
        targets: &FrameTargets,
        depth: DepthConvention,
        holes: bool,
        guard: Guard,
    ) -> Self {
        let look = Look {
            depth,
            holes,
            guard,
            output: Output::Color,
        };
        Self::make(device, scene, &targets.color_view, look)
    }

    fn make(device: &wgpu::Device, scene: &Scene, color: &wgpu::TextureView, look: Look) -> Self {
        let layout = bind_group_layout(device);
        let pipeline = |variant| {
            let key = format!(
                "object_color {variant:?} {look:?} {:?} {} {}",
                scene.profile.mutant.of_host(),
                scene.normals.is_some(),
                scene.quantized
            );
            let make = || pipeline(device, scene, &layout, look, variant);
            scene.profile.pipelines.get(&key, make)
        };
        let uniform = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let frame = uniform("frame", size_of::<FrameUniform>() as u64);
        let eye = uniform("eye", 16);
        let entries = [&frame, &scene.objects, &scene.object_bounds, &eye]
            .into_iter()
            .zip(0..)
            .map(|(buffer, binding)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect::<Vec<_>>();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("object_color"),
            layout: &layout,
            entries: &entries,
        });
        Self {
            plain: pipeline(Variant::Plain),
            marked: pipeline(Variant::Marked),
            blended: pipeline(Variant::Blended),
            group,
            frame,
            eye,
            scene: scene.clone(),
            output: look.output,
            color: color.clone(),
        }
    }

    /// Draws into `targets` from now on.
    pub fn draw_into(&mut self, targets: &FrameTargets) {
        self.color = targets.color_view.clone();
    }

    /// Where the next submitted frame is seen from; `shape`: the scene's in that frame.
    ///
    /// # Errors
    /// If the camera is degenerate.
    pub fn set_camera(
        &self,
        queue: &wgpu::Queue,
        camera: &Camera,
        depth: DepthConvention,
        size: [u32; 2],
        shape: &SceneShape,
    ) -> Result<(), CameraError> {
        let frame = FrameUniform::new(camera, depth, size, shape)?;
        let eye = (camera.position - frame.zero()).extend(1.0).as_vec4();
        queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));
        queue.write_buffer(&self.eye, 0, bytemuck::bytes_of(&eye));
        Ok(())
    }
}

impl Drawer for ObjectDrawer {
    fn draw(&mut self, encoder: &mut wgpu::CommandEncoder, draw: &Draw<'_>) {
        let load = if draw.clear {
            wgpu::LoadOp::Clear(self.output.background())
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
        pass.set_bind_group(0, &self.group, &[]);
        match (draw.stage, draw.marks) {
            (Stage::RENDER_BLENDED, _) => pass.set_pipeline(&self.blended),
            (_, Some(marks)) => {
                pass.set_pipeline(&self.marked);
                pass.set_bind_group(Marks::GROUP, &marks.group, &[]);
            }
            (_, None) => pass.set_pipeline(&self.plain),
        }
        self.scene.bind_geometry(&mut pass);
        draw.list.record(&mut pass);
    }
}

/// The ways to draw objects.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Variant {
    Plain,
    /// Marks what passes the depth test.
    Marked,
    /// Over the rest, half transparent; writes neither depth nor item buffer.
    Blended,
}

fn pipeline(
    device: &wgpu::Device,
    scene: &Scene,
    layout: &wgpu::BindGroupLayout,
    look: Look,
    variant: Variant,
) -> wgpu::RenderPipeline {
    let Look {
        depth,
        holes,
        guard,
        output,
    } = look;
    let marked = variant == Variant::Marked;
    let text = match (output, marked) {
        (Output::Color, false) => WGSL.to_owned(),
        (Output::Color, true) => [WGSL, MARKED_WGSL].concat(),
        (Output::FragmentCount, false) => [WGSL, COUNT_WGSL].concat(),
        (Output::FragmentCount, true) => [WGSL, COUNT_MARKED_WGSL].concat(),
    };
    let wgsl = hroc_shaders::resolve(&text).expect("the crate's own imports exist");
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("object_color"),
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    });
    let marks_layout = marked.then(|| Marks::layout(device));
    let mut layouts = vec![Some(layout)];
    if let Some(marks_layout) = &marks_layout {
        layouts.resize(Marks::GROUP as usize, None);
        layouts.push(Some(marks_layout));
    }
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("object_color"),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    let constants = [
        depth.constants()[0],
        ("HOLES", f64::from(u8::from(holes))),
        guard.constant(),
        scene.profile.mutant.of_host().constant(),
    ];
    let options = wgpu::PipelineCompilationOptions {
        constants: &constants,
        ..Default::default()
    };
    let with_normals = [Some(scene.positions_layout()), Some(Scene::NORMALS)];
    let (entry_point, buffers) = match scene.normals {
        Some(_) => ("object_vertex_with_normal", &with_normals[..]),
        None => ("object_vertex", &with_normals[..1]),
    };
    let blended = variant == Variant::Blended;
    const SUM: wgpu::BlendComponent = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    let color = wgpu::ColorTargetState {
        blend: match output {
            Output::Color => blended.then_some(wgpu::BlendState::ALPHA_BLENDING),
            Output::FragmentCount => Some(wgpu::BlendState {
                color: SUM,
                alpha: SUM,
            }),
        },
        ..output.format().into()
    };
    let mut item = wgpu::ColorTargetState::from(Targets::ITEM_FORMAT);
    if blended {
        item.write_mask = wgpu::ColorWrites::empty();
    }
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("object_color"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: options.clone(),
            buffers,
        },
        // Both faces: no cull mode.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: Targets::DEPTH_FORMAT,
            depth_write_enabled: Some(!blended),
            depth_compare: Some(depth.nearer()),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(match (output, variant) {
                (Output::Color, Variant::Plain) => "object_color",
                (Output::Color, Variant::Marked) => "object_color_marked",
                (Output::Color, Variant::Blended) => "object_color_blended",
                (Output::FragmentCount, Variant::Marked) => "fragment_count_marked",
                (Output::FragmentCount, _) => "fragment_count",
            }),
            compilation_options: options,
            targets: &[Some(color), Some(item)],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn bind_group_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let storage = wgpu::BufferBindingType::Storage { read_only: true };
    let uniform = wgpu::BufferBindingType::Uniform;
    let entries = [uniform, storage, storage, uniform]
        .into_iter()
        .zip(0..)
        .map(|(ty, binding)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        })
        .collect::<Vec<_>>();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("object_color"),
        entries: &entries,
    })
}
