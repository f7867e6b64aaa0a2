//! ROC: raster occlusion culling (Kubisch and Tavenrath, "OpenGL 4.4 Scene Rendering Techniques", GTC 2014;
//! Boudier and Kubisch, "GPU-Driven Large Scene Rendering", GTC 2015).
//!
//! A frame: draw what was flagged in the last frame; rasterize the bounds of every object against that depth,
//! where each surviving fragment flags its object; draw those flagged now and not drawn yet. No hierarchy and
//! no read-back: the cost is linear in the number of objects and in the pixels of their boxes.
//!
//! Departures: boxes outside the frustum are left out before they reach the rasterizer; a fragment compares the
//! depth where its ray enters the padded bounds, and not the interpolated depth of the box's face, which no
//! rasterizer gives to the last bit.

use hroc_runtime::gpu::{self, Access};
use hroc_runtime::{
    BOX_VERTICES, BoxPass, BoxShader, CameraError, CullingMethod, DepthConvention, Drawer,
    FrameContext, HostSync, Kernel, Scene, Sets, Stage,
};

use crate::drawn_twice::DrawnTwice;
use crate::view::View;

const SHADER: BoxShader = BoxShader {
    sampled: "roc_test",
    sampled_entry: "raster_test",
    early: "roc_test_early",
    early_entry: "raster_test_early",
};
const RASTER_TEST: Stage = Stage::new("raster_test");

/// Raster occlusion culling, for one view.
#[derive(Debug)]
pub struct RasterOcclusionCulling {
    view: View,
    drawn: DrawnTwice,
    collect_boxes: Kernel,
    raster_test: BoxPass,
    boxes: wgpu::Buffer,
    box_draw: wgpu::Buffer,
    no_boxes: wgpu::Buffer,
    object_count: u32,
}

impl RasterOcclusionCulling {
    /// ROC over `scene`.
    pub fn new(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let (view, drawn) = (
            View::new(device, depth),
            DrawnTwice::new(device, scene, depth),
        );
        let object_count = scene.shape.object_count;
        let none = wgpu::BufferUsages::empty();
        let boxes = gpu::storage(device, "boxes", 4 * u64::from(object_count), none);
        let box_draw = gpu::storage(device, "box_draw", 16, wgpu::BufferUsages::INDIRECT);
        let bindings = [
            (1, Read, &scene.object_bounds),
            (2, ReadWrite, &drawn.found),
            (3, ReadWrite, &boxes),
            (4, ReadWrite, &box_draw),
        ];
        let tested = [
            (Uniform, &view.frame),
            (Read, &scene.object_bounds),
            (ReadWrite, &drawn.found),
            (Read, &boxes),
        ];
        let constants = [scene.profile.mutant.constant()];
        Self {
            collect_boxes: view.kernel(device, scene, "roc", "collect_boxes", &bindings),
            raster_test: BoxPass::new(device, &scene.profile, SHADER, depth, &constants, &tested),
            no_boxes: gpu::storage_with(device, "no boxes", &[BOX_VERTICES, 0, 0, 0]),
            view,
            drawn,
            boxes,
            box_draw,
            object_count,
        }
    }
}

impl CullingMethod for RasterOcclusionCulling {
    fn name(&self) -> &'static str {
        "roc"
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
        let (device, targets) = (frame.device, frame.targets);
        self.drawn.draw_first(frame, drawer);
        frame.stage(RASTER_TEST, |encoder| {
            encoder.clear_buffer(&self.drawn.found, 0, None);
            encoder.copy_buffer_to_buffer(&self.no_boxes, 0, &self.box_draw, 0, 16);
            let mut pass = gpu::compute_pass(encoder, "collect_boxes");
            self.collect_boxes
                .dispatch(&mut pass, gpu::grid(self.object_count, 64));
            drop(pass);
            (self.raster_test).record(device, encoder, &targets, &self.box_draw, 0);
        });
        self.drawn.draw_second(frame, drawer);
        // What was flagged now is drawn first in the next frame.
        let (found, visible) = (&self.drawn.found, &self.drawn.visible);
        frame
            .encoder
            .copy_buffer_to_buffer(found, 0, visible, 0, found.size());
        self.drawn.draw_blended(frame, drawer);
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        Sets {
            group_draw: Some(&self.box_draw),
            ..self.drawn.sets()
        }
    }

    fn depth(&self) -> DepthConvention {
        self.view.depth
    }

    fn reset(&mut self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.drawn.visible, 0, None);
    }

    fn memory_bytes(&self) -> u64 {
        self.view.frame.size()
            + self.drawn.memory_bytes()
            + self.boxes.size()
            + self.box_draw.size()
    }
}
