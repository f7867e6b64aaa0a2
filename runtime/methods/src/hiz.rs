//! Hi-Z: occluders into a small depth buffer, its pyramid, and every object's screen rectangle against it, as in
//! Arm's sample "Occlusion Culling with Hierarchical-Z" (Mali SDK; the pyramid: Greene, Kass, Miller 1993). What
//! passes is drawn, in one pass.
//!
//! Approximate: a pixel of the small depth buffer holds the depth at its centre, and stands for many of the image.
//!
//! Departures: the sample's occluders are chosen by hand; here they are what showed in the last frame, less what is
//! blended or has holes. Sizes need not be powers of two. The sample's levels of detail are left out: they change the
//! image. Bounds are padded as everywhere, and nearest depths are compared in clip depth with its tolerance.

use hroc_runtime::gpu::{self, Access};
use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FilterOccluders, FrameContext, HostSync,
    PackedList, Scene, Sets, Stage,
};

use crate::depth_pyramid::{DEPTH_PYRAMID, DepthPyramid, HIZ_TEST, HizTest};
use crate::drawn_once::DrawnOnce;
use crate::view::View;

pub use crate::depth_pyramid::Projected;

const RENDER_OCCLUDERS: Stage = Stage::new("render_occluders");
const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Hi-Z with a small occluder depth, for one view.
#[derive(Debug)]
pub struct HierarchicalZ {
    view: View,
    drawn: DrawnOnce,
    occluders: PackedList,
    visible: wgpu::Buffer,
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    depth_buffer: wgpu::TextureView,
    pyramid: DepthPyramid,
    test: HizTest,
    filter: FilterOccluders,
}

impl HierarchicalZ {
    /// Side of the occluder depth buffer in the sample, pixels.
    pub const SIDE_PX: u32 = 256;

    /// Hi-Z over `scene` with an occluder depth buffer of `side_px` squared.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        depth: DepthConvention,
        side_px: u32,
        projected: Projected,
    ) -> Self {
        use Access::{Read, Uniform};
        let (view, drawn) = (
            View::new(device, depth),
            DrawnOnce::new(device, scene, depth),
        );
        let side = side_px.clamp(1, device.limits().max_texture_dimension_2d);
        let none = wgpu::BufferUsages::empty();
        let words = 4 * u64::from(scene.shape.object_words());
        let visible = gpu::storage(device, "visible", words, none);
        let stages = wgpu::ShaderStages::VERTEX;
        let layout = gpu::buffer_layout(device, "hiz", stages, &[Uniform, Read]);
        let pipelines = &scene.profile.pipelines;
        let key = format!("hiz {depth:?} {}", scene.quantized);
        let pipeline = pipelines.get(&key, || occluder_pipeline(device, scene, depth, &layout));
        let depth_buffer = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("occluder depth"),
            size: wgpu::Extent3d {
                width: side,
                height: side,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: DEPTH_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let pyramid = DepthPyramid::new(device, scene, depth, [side; 2]);
        Self {
            occluders: PackedList::new(device, scene, &visible, &scene.opaque),
            group: gpu::buffer_group(device, "hiz", &layout, &[&view.frame, &scene.objects]),
            depth_buffer: depth_buffer.create_view(&Default::default()),
            test: HizTest::new(device, scene, &view, &pyramid, &drawn.members, projected),
            filter: FilterOccluders::new(device, scene),
            visible,
            pipeline,
            pyramid,
            view,
            drawn,
        }
    }

    fn render_occluders(&self, scene: &Scene, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(RENDER_OCCLUDERS.name()),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth_buffer,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(self.view.depth.clear_value()),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        scene.bind_geometry(&mut pass);
        self.occluders.list().record(&mut pass);
    }
}

fn occluder_pipeline(
    device: &wgpu::Device,
    scene: &Scene,
    depth: DepthConvention,
    layout: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    let module = gpu::shader(device, "hiz");
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("hiz"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("hiz"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("occluder_vertex"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &depth.constants(),
                ..Default::default()
            },
            buffers: &[Some(scene.positions_layout())],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(depth.nearer()),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}

impl CullingMethod for HierarchicalZ {
    fn name(&self) -> &'static str {
        "hiz"
    }

    fn host_sync(&self) -> HostSync {
        HostSync::Never
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        self.view.begin(frame)?;
        let (device, targets, scene) = (frame.device, frame.targets, frame.scene);
        frame.stage(Stage::PACK, |encoder| self.occluders.record(encoder));
        frame.stage(RENDER_OCCLUDERS, |encoder| {
            self.render_occluders(scene, encoder);
        });
        frame.stage(DEPTH_PYRAMID, |encoder| {
            self.pyramid.copy(device, encoder, &self.depth_buffer);
            self.pyramid.reduce(encoder);
        });
        frame.stage(HIZ_TEST, |encoder| self.test.record(encoder));
        self.drawn.draw(frame, drawer);
        frame.stage(Stage::FILTER_OCCLUDERS, |encoder| {
            (self.filter).record(device, encoder, &targets, &self.visible);
        });
        self.drawn.draw_blended(frame, drawer);
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        Sets {
            visible: Some(&self.visible),
            ..self.drawn.sets()
        }
    }

    fn depth(&self) -> DepthConvention {
        self.view.depth
    }

    fn reset(&mut self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.visible, 0, None);
    }

    fn memory_bytes(&self) -> u64 {
        let [width, height] = self.pyramid.size.map(u64::from);
        self.view.frame.size()
            + self.drawn.memory_bytes()
            + self.occluders.memory_bytes()
            + self.visible.size()
            + self.pyramid.memory_bytes()
            + 4 * width * height
    }
}
