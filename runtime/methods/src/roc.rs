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

use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FrameContext, HostSync, Scene, Sets,
};

use crate::drawn_twice::DrawnTwice;
use crate::raster_test::{RasterTest, Tested};
use crate::view::View;

/// Raster occlusion culling, for one view.
#[derive(Debug)]
pub struct RasterOcclusionCulling {
    view: View,
    drawn: DrawnTwice,
    raster_test: RasterTest,
}

impl RasterOcclusionCulling {
    /// ROC over `scene`.
    pub fn new(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        let (view, drawn) = (
            View::new(device, depth),
            DrawnTwice::new(device, scene, depth),
        );
        Self {
            raster_test: RasterTest::new(device, scene, &view, Tested::All, &drawn.found),
            view,
            drawn,
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
        self.drawn.draw_first(frame, drawer);
        self.raster_test.record(frame, &self.drawn.found);
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
            group_draw: Some(self.raster_test.box_draw()),
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
        self.view.frame.size() + self.drawn.memory_bytes() + self.raster_test.memory_bytes()
    }
}
