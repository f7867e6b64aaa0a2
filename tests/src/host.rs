//! A host that draws a scene into depth and item buffer with its own pipeline, and hands out what every
//! frame left behind.

use hroc_format::BakedScene;
use hroc_runtime::readback::{self, TextureCopy};
use hroc_runtime::{
    Camera, CullingMethod, DepthConvention, Draw, Drawer, FrameContext, FrameUniform, Scene, Stage,
    Targets, Tree,
};
use hroc_study::hard_cases::CaseFrame;
use hroc_study::targets::FrameTargets;

use crate::Gpu;

const DRAW: &str = "//!import common/types
//!import object
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var<storage, read> object_bounds: array<Bounds>;
override GUARDED: bool = true;
struct Vertex { @builtin(position) position: vec4f, @location(0) @interpolate(flat, either) object: u32 }
@vertex fn vertex(@location(0) p: vec3f, @builtin(instance_index) object: u32) -> Vertex {
    return Vertex(hroc_clip_position(hroc_world_position(objects[object], p)), object);
}
@fragment fn fragment(v: Vertex) -> @location(0) u32 {
    if (GUARDED && !hroc_keeps(object_bounds[v.object], v.position)) { discard; }
    return v.object;
}";

/// A scene on the GPU with all its trees.
#[derive(Debug)]
pub struct World {
    /// The file's contents.
    pub baked: BakedScene,
    /// Geometry and objects.
    pub scene: Scene,
    /// The trees, in the file's order; one empty tree for a scene without objects.
    pub trees: Vec<Tree>,
}

impl World {
    /// Uploads `baked` and all its trees.
    ///
    /// # Panics
    /// If the device cannot hold it.
    pub fn new(gpu: &Gpu, baked: BakedScene) -> Self {
        let archived = baked.scene();
        let mut splits = archived
            .bvhs
            .iter()
            .map(|bvh| bvh.split.as_str())
            .collect::<Vec<_>>();
        if splits.is_empty() {
            splits.push("sah");
        }
        let trees = splits
            .iter()
            .map(|split| Tree::upload(&gpu.device, archived, split).unwrap())
            .collect();
        Self {
            scene: Scene::upload(&gpu.device, archived).unwrap(),
            trees,
            baked,
        }
    }
}

/// What a frame left behind. Sets are sorted ids; a set the method does not have is empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Depth buffer, row by row from the top.
    pub depth: Vec<f32>,
    /// Item buffer.
    pub item: Vec<u32>,
    /// The depth buffer as it was before the occludees were drawn.
    pub occlusion_map: Vec<f32>,
    /// V.
    pub potential_occluders: Vec<u32>,
    /// O.
    pub effective_occluders: Vec<u32>,
    /// U.
    pub potentially_visible: Vec<u32>,
    /// Number of groups |G|.
    pub group_count: u32,
    /// The groups' nodes, ascending.
    pub groups: Vec<u32>,
    /// Rays, ray-box tests, fragments; zeros unless counted.
    pub work: [u32; 3],
    /// The threshold of adaptive grouping, pixels.
    pub largest_group_px: f32,
}

impl Frame {
    /// V united with U, ascending.
    pub fn pvs(&self) -> Vec<u32> {
        let mut pvs = [
            self.potential_occluders.as_slice(),
            &self.potentially_visible,
        ]
        .concat();
        pvs.sort_unstable();
        pvs.dedup();
        pvs
    }

    /// The distinct ids in the item buffer, ascending.
    pub fn visible(&self) -> Vec<u32> {
        let mut ids = self.item.clone();
        ids.sort_unstable();
        ids.dedup();
        ids.pop_if(|id| *id == hroc_format::NO_OBJECT);
        ids
    }
}

/// Targets and pipeline for one depth convention.
#[derive(Debug)]
pub struct Host<'g> {
    gpu: &'g Gpu,
    /// Of frames that have none of their own.
    size: [u32; 2],
    depth: DepthConvention,
    targets: FrameTargets,
    frame_uniform: wgpu::Buffer,
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    scene: Scene,
}

impl<'g> Host<'g> {
    /// A host for `scene`.
    pub fn new(gpu: &'g Gpu, scene: &Scene, size: [u32; 2], depth: DepthConvention) -> Self {
        Self::with_guard(gpu, scene, size, depth, true)
    }

    /// A host that keeps every fragment (`guarded` false) or those that `hroc_keeps` lets pass.
    pub fn with_guard(
        gpu: &'g Gpu,
        scene: &Scene,
        size: [u32; 2],
        depth: DepthConvention,
        guarded: bool,
    ) -> Self {
        let device = &gpu.device;
        let targets = FrameTargets::new(device, size);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("draw"),
            source: wgpu::ShaderSource::Wgsl(hroc_shaders::resolve(DRAW).unwrap().into()),
        });
        let constants = [
            depth.constants()[0],
            ("GUARDED", f64::from(u8::from(guarded))),
        ];
        let options = wgpu::PipelineCompilationOptions {
            constants: &constants,
            ..Default::default()
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("draw"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: options.clone(),
                buffers: &[Some(Scene::POSITIONS)],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: Targets::DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(depth.nearer()),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: options.clone(),
                targets: &[Some(Targets::ITEM_FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let frame_uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: size_of::<FrameUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("draw"),
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
        Self {
            gpu,
            size,
            depth,
            targets,
            frame_uniform,
            pipeline,
            group,
            scene: scene.clone(),
        }
    }

    /// Runs one frame of a case, in its own size if it has one.
    pub fn render_frame(&mut self, method: &mut dyn CullingMethod, frame: &CaseFrame) -> Frame {
        let size = frame.size.unwrap_or(self.size);
        if self.targets.targets().size != size {
            self.targets = FrameTargets::new(&self.gpu.device, size);
        }
        self.render(method, &frame.camera)
    }

    /// Runs one frame of `method` and reads everything back.
    ///
    /// # Panics
    /// If the camera is degenerate.
    pub fn render(&self, method: &mut dyn CullingMethod, camera: &Camera) -> Frame {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let shape = &self.scene.shape;
        let targets = self.targets.targets();
        let uniform = FrameUniform::new(camera, self.depth, targets.size, shape).unwrap();
        queue.write_buffer(&self.frame_uniform, 0, bytemuck::bytes_of(&uniform));
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut drawer = RecordingDrawer {
            host: self,
            occlusion_map: None,
        };
        let mut context = FrameContext {
            device,
            queue,
            encoder: &mut encoder,
            camera,
            targets,
            observer: None,
        };
        method.encode(&mut context, &mut drawer).unwrap();
        let occlusion_map = drawer.occlusion_map.take();
        let copies = [&self.targets.depth, &self.targets.item_buffer]
            .map(|texture| TextureCopy::record(device, &mut encoder, texture));
        queue.submit([encoder.finish()]);
        let [depth, item] = copies.map(|copy| copy.wait(device));
        let sets = method.sets();
        let set = |buffer: Option<&wgpu::Buffer>| {
            buffer.map_or_else(Vec::new, |buffer| readback::set(device, queue, buffer))
        };
        let group_count = sets
            .group_draw
            .map_or(0, |buffer| readback::words(device, queue, buffer)[1]);
        let mut groups = sets
            .groups
            .map_or_else(Vec::new, |buffer| readback::words(device, queue, buffer));
        groups.truncate(group_count as usize);
        groups.sort_unstable();
        let work = sets.work.map_or_else(
            || vec![0; 3],
            |buffer| readback::words(device, queue, buffer),
        );
        Frame {
            depth: bytemuck::pod_collect_to_vec(&depth),
            item: bytemuck::pod_collect_to_vec(&item),
            occlusion_map: occlusion_map.map_or_else(Vec::new, |copy| {
                bytemuck::pod_collect_to_vec(&copy.wait(device))
            }),
            potential_occluders: set(sets.potential_occluders),
            effective_occluders: set(sets.effective_occluders),
            potentially_visible: set(sets.potentially_visible),
            group_count,
            groups,
            work: [work[0], work[1], work[2]],
            largest_group_px: sets.grouping.map_or(0.0, |buffer| {
                f32::from_bits(readback::words(device, queue, buffer)[0])
            }),
        }
    }
}

/// Draws, and catches the occlusion map on its way.
struct RecordingDrawer<'h> {
    host: &'h Host<'h>,
    occlusion_map: Option<TextureCopy>,
}

impl Drawer for RecordingDrawer<'_> {
    fn draw(&mut self, encoder: &mut wgpu::CommandEncoder, draw: &Draw<'_>) {
        let host = self.host;
        if draw.stage == Stage::RenderOccludees {
            self.occlusion_map = Some(TextureCopy::record(
                &host.gpu.device,
                encoder,
                &host.targets.depth,
            ));
        }
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(draw.stage.name()),
            color_attachments: &[Some(draw.item_attachment())],
            depth_stencil_attachment: Some(draw.depth_attachment()),
            ..Default::default()
        });
        pass.set_pipeline(&host.pipeline);
        pass.set_bind_group(0, &host.group, &[]);
        host.scene.bind_geometry(&mut pass);
        draw.list.record(&mut pass);
    }
}

/// Where a frame differs from the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Difference {
    /// Pixels whose depth bits differ.
    pub wrong_pixels: usize,
    /// Pixels of equal depth and another id.
    pub depth_ties: usize,
    /// Objects of the truth's visible set that were not drawn.
    pub false_negatives: usize,
}

/// Compares a frame with the truth of the same camera.
pub fn difference(truth: &Frame, frame: &Frame) -> Difference {
    let pvs = frame.pvs();
    let mut difference = Difference {
        false_negatives: truth
            .visible()
            .iter()
            .filter(|id| pvs.binary_search(id).is_err())
            .count(),
        ..Default::default()
    };
    assert_eq!(
        truth.depth.len(),
        frame.depth.len(),
        "frames of different sizes"
    );
    for i in 0..truth.depth.len() {
        if truth.depth[i].to_bits() != frame.depth[i].to_bits() {
            difference.wrong_pixels += 1;
        } else if truth.item[i] != frame.item[i] {
            difference.depth_ties += 1;
        }
    }
    difference
}
