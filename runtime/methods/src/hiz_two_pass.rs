//! Two-pass Hi-Z: draw what showed last, build the depth pyramid of the whole image, test every object's screen
//! rectangle against it, draw those that pass and were not drawn yet (Haar and Aaltonen, "GPU-Driven Rendering
//! Pipelines", SIGGRAPH 2015; widely used since).
//!
//! Exact, as the pyramid has full resolution and its texels hold the farthest depth of all pixels below.
//!
//! Departures: what showed last is read from the item buffer; each level of the pyramid is half the one before
//! rounded up, so that images of any size are covered; bounds and depths are padded as everywhere.

use hroc_runtime::gpu;
use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FilterOccluders, FrameContext, HostSync,
    Scene, Sets, Stage,
};

use crate::depth_pyramid::{DEPTH_PYRAMID, DepthPyramid, HIZ_TEST, HizTest, Projected};
use crate::drawn_twice::DrawnTwice;
use crate::view::View;

/// Two-pass Hi-Z, for one view.
#[derive(Debug)]
pub struct TwoPassHierarchicalZ {
    view: View,
    drawn: DrawnTwice,
    /// Of the size of the last frame's targets.
    sized: Option<(DepthPyramid, HizTest)>,
    filter: FilterOccluders,
    limits: wgpu::Buffer,
}

impl TwoPassHierarchicalZ {
    /// Two-pass Hi-Z over `scene`.
    pub fn new(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        let limits = [scene.shape.object_count, 0, 0, 0];
        Self {
            view: View::new(device, depth),
            drawn: DrawnTwice::new(device, scene, depth),
            sized: None,
            filter: FilterOccluders::of(device, &scene.profile.pipelines),
            limits: gpu::uniform(device, "object count", bytemuck::bytes_of(&limits)),
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
        let (device, targets, scene) = (frame.device, frame.targets, frame.scene);
        let (view, found) = (&self.view, &self.drawn.found);
        self.sized
            .take_if(|(pyramid, _)| pyramid.size != targets.size);
        let (pyramid, test) = self.sized.get_or_insert_with(|| {
            let pyramid = DepthPyramid::new(device, scene, view.depth, targets.size);
            let test = HizTest::new(device, scene, view, &pyramid, found, Projected::Box);
            (pyramid, test)
        });
        self.drawn.draw_first(frame, drawer);
        frame.stage(DEPTH_PYRAMID, |encoder| {
            pyramid.copy(device, encoder, targets.depth);
            pyramid.reduce(encoder);
        });
        frame.stage(HIZ_TEST, |encoder| test.record(encoder));
        self.drawn.draw_second(frame, drawer);
        frame.stage(Stage::FILTER_OCCLUDERS, |encoder| {
            let visible = &self.drawn.visible;
            (self.filter).record(device, encoder, &targets, visible, &self.limits);
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
        let sized = self.sized.as_ref();
        self.view.frame.size()
            + self.drawn.memory_bytes()
            + sized.map_or(0, |(pyramid, _)| pyramid.memory_bytes())
    }
}
