//! A host that draws a scene into depth and item buffer with its own pipelines, and hands out what every
//! frame left behind. Masked objects have holes; blended ones are drawn over the rest.

use hroc_format::{ArchivedObjectBounds, BakedScene, ObjectBounds};
use hroc_runtime::moving::MovingObjects;
use hroc_runtime::readback::{self, BufferCopy, TextureCopy};
use hroc_runtime::{
    Camera, CullingMethod, DepthConvention, DeviceProfile, Draw, Drawer, FrameContext,
    FrameUniform, Marks, Mutant, Scene, Stage, Targets, Tree,
};
use hroc_study::blended_truth::BlendedTruth;
use hroc_study::drawer::Guard;
use hroc_study::hard_cases::{CaseFrame, CaseScene, Motion};
use hroc_study::image::Image;
use hroc_study::targets::FrameTargets;

use crate::Gpu;

const DRAW: &str = "//!import common/types
//!import object
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var<storage, read> object_bounds: array<ObjectBounds>;
override GUARD: u32 = 0;
struct Vertex {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat, either) object: u32,
    @location(1) place: vec3f,
}
@vertex fn vertex(@location(0) p: vec3f, @builtin(instance_index) object: u32) -> Vertex {
    let place = hroc_relative_position(objects[object], p);
    return Vertex(hroc_clip_position(place), object, place);
}
fn kept(v: Vertex) -> bool {
    if (GUARD == 1) {
        return is_finite(v.position.z);
    }
    return GUARD == 2 || hroc_keeps(object_bounds[v.object], v.position);
}
fn dropped(v: Vertex) -> bool {
    let hole = (objects[v.object].flags & 1u) != 0u && fract(2.0 * dot(hroc_world_position(v.place), vec3f(1.0, 0.9, 0.8))) < 0.5;
    return hole || !kept(v);
}
@fragment fn plain(v: Vertex) -> @location(0) u32 {
    if (dropped(v)) { discard; }
    return v.object;
}
";

const MARKED: &str = "//!import mark
@fragment fn marked(v: Vertex) -> @location(0) u32 {
    if (dropped(v)) { discard; }
    hroc_mark(v.object, v.position);
    return v.object;
}
";

/// A scene on the GPU with all its trees.
#[derive(Debug)]
pub struct World {
    /// The file's contents.
    pub baked: BakedScene,
    /// Geometry and objects, as they are in the current frame.
    pub scene: Scene,
    /// The trees, in the file's order; one empty tree for a scene without objects.
    pub trees: Vec<Tree>,
    motion: Option<(Motion, MovingObjects)>,
}

impl World {
    /// Uploads `baked` and all its trees.
    ///
    /// # Panics
    /// If the device cannot hold it.
    pub fn new(gpu: &Gpu, baked: BakedScene) -> Self {
        Self::with_motion(gpu, &gpu.profile, baked, None)
    }

    /// Bakes and uploads a case, for frames from the first on.
    pub fn of_case(gpu: &Gpu, case: &CaseScene) -> Self {
        Self::of_case_on(gpu, &gpu.profile, case)
    }

    /// The same, with paths forced.
    ///
    /// # Panics
    /// If the case does not bake or the device cannot hold it.
    pub fn of_case_on(gpu: &Gpu, profile: &DeviceProfile, case: &CaseScene) -> Self {
        Self::with_motion(gpu, profile, case.bake().unwrap(), case.motion)
    }

    fn with_motion(
        gpu: &Gpu,
        profile: &DeviceProfile,
        baked: BakedScene,
        motion: Option<Motion>,
    ) -> Self {
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
        let capacity = motion.map_or(0, |motion| motion.capacity);
        let scene = Scene::upload_with_moving(&gpu.device, profile, archived, capacity).unwrap();
        let motion = motion.map(|motion| (motion, MovingObjects::new(archived, &scene)));
        Self {
            scene,
            trees,
            motion,
            baked,
        }
    }

    /// Moves what moves before frame `number`.
    pub fn advance(&mut self, gpu: &Gpu, number: usize) {
        if let Some((motion, moving)) = &mut self.motion {
            motion.advance(
                number,
                self.baked.scene(),
                moving,
                &gpu.queue,
                &mut self.scene,
            );
        }
    }

    /// Bounds of all objects, from the GPU, by id.
    pub fn object_bounds(&self, gpu: &Gpu) -> Vec<ObjectBounds> {
        let words = readback::words(&gpu.device, &gpu.queue, &self.scene.object_bounds);
        let count = self.scene.shape.object_count as usize;
        let stored = bytemuck::cast_slice::<_, ArchivedObjectBounds>(&words[..count * 8]);
        stored.iter().map(|bounds| bounds.to_native()).collect()
    }

    /// Bounds of the objects that move, from the GPU.
    pub fn moving_bounds(&self, gpu: &Gpu) -> Vec<ObjectBounds> {
        self.object_bounds(gpu)
            .split_off(self.scene.shape.static_count as usize)
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
    /// Blended objects that were handed over.
    pub blended: Vec<u32>,
    /// Blended objects that show over this frame's depth.
    pub blended_shown: Vec<u32>,
    /// The bits of V and U that were drawn, of a method that limits them.
    pub draw_limits: Option<[u32; 2]>,
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
    /// V united with U as far as they were drawn, ascending.
    pub fn pvs(&self) -> Vec<u32> {
        let [v, u] = self
            .draw_limits
            .unwrap_or([u32::MAX; 2])
            .map(|n| n as usize);
        let first = |set: &[u32], limit: usize| set[..set.len().min(limit)].to_vec();
        let mut pvs = [
            first(&self.potential_occluders, v),
            first(&self.potentially_visible, u),
        ]
        .concat();
        pvs.sort_unstable();
        pvs.dedup();
        pvs
    }

    /// Depth and item buffer.
    pub fn image(&self) -> Image {
        Image {
            depth_bits: self.depth.iter().map(|depth| depth.to_bits()).collect(),
            items: self.item.clone(),
        }
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

/// Targets and pipelines for one depth convention.
#[derive(Debug)]
pub struct Host<'g> {
    gpu: &'g Gpu,
    /// Of frames that have none of their own.
    size: [u32; 2],
    depth: DepthConvention,
    targets: FrameTargets,
    frame_uniform: wgpu::Buffer,
    plain: wgpu::RenderPipeline,
    marked: wgpu::RenderPipeline,
    blended: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    scene: Scene,
    blended_truth: Option<BlendedTruth>,
}

impl<'g> Host<'g> {
    /// A host for `world`.
    pub fn new(gpu: &'g Gpu, world: &World, size: [u32; 2], depth: DepthConvention) -> Self {
        let mutant = world.scene.profile.mutant.of_host();
        Self::with_guard(gpu, world, size, depth, Guard::Snippet, mutant)
    }

    /// A host that discards by `guard`, in which `hroc_keeps` lacks a safeguard.
    pub fn with_guard(
        gpu: &'g Gpu,
        world: &World,
        size: [u32; 2],
        depth: DepthConvention,
        guard: Guard,
        mutant: Mutant,
    ) -> Self {
        let device = &gpu.device;
        let scene = &world.scene;
        let targets = FrameTargets::new(device, size);
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("draw"),
            entries: &[
                wgpu::BufferBindingType::Uniform,
                wgpu::BufferBindingType::Storage { read_only: true },
                wgpu::BufferBindingType::Storage { read_only: true },
            ]
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
            .collect::<Vec<_>>(),
        });
        let frame_uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: size_of::<FrameUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let buffers = [&frame_uniform, &scene.objects, &scene.object_bounds];
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("draw"),
            layout: &layout,
            entries: &buffers
                .into_iter()
                .zip(0..)
                .map(|(buffer, binding)| wgpu::BindGroupEntry {
                    binding,
                    resource: buffer.as_entire_binding(),
                })
                .collect::<Vec<_>>(),
        });
        let pipeline = |entry| {
            let key = format!(
                "test host {entry} {depth:?} {guard:?} {mutant:?} {}",
                scene.quantized
            );
            let make = || pipeline(device, scene, &layout, depth, guard, mutant, entry);
            scene.profile.pipelines.get(&key, make)
        };
        Self {
            gpu,
            size,
            depth,
            targets,
            frame_uniform,
            plain: pipeline("plain"),
            marked: pipeline("marked"),
            blended: pipeline("blended"),
            group,
            scene: scene.clone(),
            blended_truth: BlendedTruth::new(gpu, world.baked.scene(), scene, depth),
        }
    }

    /// Draws `world` as it is now.
    pub fn follow(&mut self, world: &World) {
        self.scene = world.scene.clone();
    }

    /// Size of the frame that was drawn last, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.targets.targets().size
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
            scene: &self.scene,
            camera,
            targets,
            observer: None,
        };
        method.encode(&mut context, &mut drawer).unwrap();
        let occlusion_map = drawer.occlusion_map.take();
        // All in the frame's own commands: a frame of a small case takes less than the waits of ten readbacks.
        let mut copy = |buffer: &wgpu::Buffer| BufferCopy::record(device, &mut encoder, buffer);
        let sets = method.sets();
        let members = [
            sets.potential_occluders,
            sets.effective_occluders,
            sets.potentially_visible,
            sets.blended,
        ]
        .map(|set| set.map(&mut copy));
        let others = [sets.group_draw, sets.groups, sets.work, sets.grouping]
            .map(|buffer| buffer.map(&mut copy));
        let texels = [&self.targets.depth, &self.targets.item_buffer]
            .map(|texture| TextureCopy::record(device, &mut encoder, texture));
        queue.submit([encoder.finish()]);
        let [depth, item] = texels.map(|copy| copy.wait(device));
        self.gpu.check().unwrap();
        let words =
            |copy: BufferCopy| -> Vec<u32> { bytemuck::pod_collect_to_vec(&copy.wait(device)) };
        let [
            potential_occluders,
            effective_occluders,
            potentially_visible,
            blended,
        ] = members.map(|set| readback::members_of(&set.map_or_else(Vec::new, words)).collect());
        let [group_draw, groups, work, grouping] = others.map(|copy| copy.map(words));
        // The second of the indirect arguments: the number of instances.
        let group_count = group_draw.map_or(0, |arguments| arguments[1]);
        let mut groups = groups.unwrap_or_default();
        groups.truncate(group_count as usize);
        groups.sort_unstable();
        let blended_shown = self.blended_truth.as_ref().map_or_else(Vec::new, |truth| {
            let shown = truth.shown(self.gpu, &self.scene, camera, targets).unwrap();
            shown.iter().collect()
        });
        Frame {
            depth: bytemuck::pod_collect_to_vec(&depth),
            item: bytemuck::pod_collect_to_vec(&item),
            occlusion_map: occlusion_map.map_or_else(Vec::new, |copy| {
                bytemuck::pod_collect_to_vec(&copy.wait(device))
            }),
            potential_occluders,
            effective_occluders,
            potentially_visible,
            blended,
            blended_shown,
            draw_limits: method.draw_limits(),
            group_count,
            groups,
            work: work.map_or([0; 3], |work| [work[0], work[1], work[2]]),
            largest_group_px: grouping.map_or(0.0, |grouping| f32::from_bits(grouping[0])),
        }
    }
}

fn pipeline(
    device: &wgpu::Device,
    scene: &Scene,
    layout: &wgpu::BindGroupLayout,
    depth: DepthConvention,
    guard: Guard,
    mutant: Mutant,
    entry: &str,
) -> wgpu::RenderPipeline {
    let marked = entry == "marked";
    let text = [DRAW, if marked { MARKED } else { "" }].concat();
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("draw"),
        source: wgpu::ShaderSource::Wgsl(hroc_shaders::resolve(&text).unwrap().into()),
    });
    let marks = Marks::layout(device);
    let layouts = if marked {
        vec![Some(layout), None, None, Some(&marks)]
    } else {
        vec![Some(layout)]
    };
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("draw"),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    let constants = [depth.constants()[0], guard.constant(), mutant.constant()];
    let options = wgpu::PipelineCompilationOptions {
        constants: &constants,
        ..Default::default()
    };
    let blended = entry == "blended";
    let mut target = wgpu::ColorTargetState::from(Targets::ITEM_FORMAT);
    if blended {
        target.write_mask = wgpu::ColorWrites::empty();
    }
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("draw"),
        layout: Some(&pipeline_layout),
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
            entry_point: Some(if marked { "marked" } else { "plain" }),
            compilation_options: options,
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Draws, and catches the occlusion map on its way.
struct RecordingDrawer<'h> {
    host: &'h Host<'h>,
    occlusion_map: Option<TextureCopy>,
}

impl Drawer for RecordingDrawer<'_> {
    fn draw(&mut self, encoder: &mut wgpu::CommandEncoder, draw: &Draw<'_>) {
        let host = self.host;
        if draw.stage == Stage::RENDER_OCCLUDEES {
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
        pass.set_bind_group(0, &host.group, &[]);
        match (draw.stage, draw.marks) {
            (Stage::RENDER_BLENDED, _) => pass.set_pipeline(&host.blended),
            (_, Some(marks)) => {
                pass.set_pipeline(&host.marked);
                pass.set_bind_group(Marks::GROUP, &marks.group, &[]);
            }
            (_, None) => pass.set_pipeline(&host.plain),
        }
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
            .count()
            + truth
                .blended_shown
                .iter()
                .filter(|id| frame.blended.binary_search(id).is_err())
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
