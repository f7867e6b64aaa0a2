//! ROC of what a depth pyramid does not hide: draw what showed last, build the depth pyramid of the image, test every
//! object's screen rectangle against it, and rasterize the bounds of those alone that pass and are not drawn yet.
//!
//! Either test loses nothing that shows, so both together lose nothing. A rectangle costs a fraction of a box, a box
//! finds more hidden than its rectangle does: the pyramid is there to spare boxes, the boxes to spare draws.
//!
//! What showed is read from the item buffer, as in HROC with occluder filtering.

use hroc_runtime::gpu;
use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FilterOccluders, FrameContext, HostSync,
    Scene, Sets, Stage,
};

use crate::depth_pyramid::FullResolutionTest;
use crate::drawn_twice::DrawnTwice;
use crate::raster_test::{RasterTest, Tested};
use crate::view::View;

/// ROC behind a Hi-Z test, for one view.
#[derive(Debug)]
pub struct PrerejectedOcclusionCulling {
    view: View,
    drawn: DrawnTwice,
    /// One bit per object: what the pyramid does not hide.
    candidates: wgpu::Buffer,
    hiz_test: FullResolutionTest,
    raster_test: RasterTest,
    filter: FilterOccluders,
}

impl PrerejectedOcclusionCulling {
    /// ROC behind a Hi-Z test over `scene`.
    pub fn new(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        let (view, drawn) = (
            View::new(device, depth),
            DrawnTwice::new(device, scene, depth),
        );
        let bytes = 4 * u64::from(scene.shape.object_words());
        let candidates = gpu::storage(device, "candidates", bytes, wgpu::BufferUsages::empty());
        let tested = Tested::Undrawn {
            candidates: &candidates,
            drawn: drawn.drawn_first(),
        };
        Self {
            raster_test: RasterTest::new(device, scene, &view, tested, &drawn.found),
            view,
            drawn,
            candidates,
            hiz_test: FullResolutionTest::default(),
            filter: FilterOccluders::new(device, scene),
        }
    }
}

impl CullingMethod for PrerejectedOcclusionCulling {
    fn name(&self) -> &'static str {
        "roc-hiz"
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
        self.hiz_test.record(frame, &self.view, &self.candidates);
        self.raster_test.record(frame, &self.drawn.found);
        self.drawn.draw_second(frame, drawer);
        frame.stage(Stage::FILTER_OCCLUDERS, |encoder| {
            let visible = &self.drawn.visible;
            (self.filter).record(device, encoder, &targets, visible);
        });
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
        self.view.frame.size()
            + self.drawn.memory_bytes()
            + self.candidates.size()
            + self.raster_test.memory_bytes()
            + self.hiz_test.memory_bytes()
    }
}
