//! Two-pass Hi-Z: draw what showed last, build the depth pyramid of the whole image, test every object's screen
//! rectangle against it, draw those that pass and were not drawn yet (Haar and Aaltonen, "GPU-Driven Rendering
//! Pipelines", SIGGRAPH 2015; widely used since).
//!
//! Exact, as the pyramid has full resolution and its texels hold the farthest depth of all pixels below.
//!
//! Departures: what showed last is read from the item buffer; each level of the pyramid is half the one before
//! rounded up, so that images of any size are covered; bounds and depths are padded as everywhere.

use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FilterOccluders, FrameContext, HostSync,
    Scene, Sets, Stage,
};

use crate::depth_pyramid::FullResolutionTest;
use crate::drawn_twice::DrawnTwice;
use crate::view::View;

/// Two-pass Hi-Z, for one view.
#[derive(Debug)]
pub struct TwoPassHierarchicalZ {
    view: View,
    drawn: DrawnTwice,
    hiz_test: FullResolutionTest,
    filter: FilterOccluders,
}

impl TwoPassHierarchicalZ {
    /// Two-pass Hi-Z over `scene`.
    pub fn new(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        Self {
            view: View::new(device, depth),
            drawn: DrawnTwice::new(device, scene, depth),
            hiz_test: FullResolutionTest::default(),
            filter: FilterOccluders::new(device, scene),
        }
    }
}

impl CullingMethod for TwoPassHierarchicalZ {
    fn name(&self) -> &'static str {
        "hiz-two-pass"
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
        self.hiz_test.record(frame, &self.view, &self.drawn.found);
        self.drawn.draw_second(frame, drawer);
        frame.stage(Stage::FILTER_OCCLUDERS, |encoder| {
            let visible = &self.drawn.visible;
            (self.filter).record(device, encoder, &targets, visible);
        });
        self.drawn.draw_blended(frame, drawer);
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        self.drawn.sets()
    }

    fn depth(&self) -> DepthConvention {
        self.view.depth
    }

    fn reset(&mut self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.drawn.visible, 0, None);
    }

    fn memory_bytes(&self) -> u64 {
        self.view.frame.size() + self.drawn.memory_bytes() + self.hiz_test.memory_bytes()
    }
}
