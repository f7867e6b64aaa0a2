//! REF: the ideal. Draws what is known to show, and nothing else. No method that draws the right image can draw
//! fewer objects.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FrameContext, HostSync, Scene, Sets,
};

use crate::drawn_once::DrawnOnce;

/// What shows in the frame to come, one bit per object, blended objects that show included. Clones share it: whoever
/// replays a recording changes it before each frame.
#[derive(Clone, Debug, Default)]
pub struct Recorded(Arc<Mutex<Vec<u32>>>);

impl Recorded {
    /// Puts the set of the next frame in place.
    pub fn show(&self, visible: &[u32]) {
        let mut words = self.lock();
        words.clear();
        words.extend_from_slice(visible);
    }

    /// The set.
    pub(crate) fn words(&self) -> Vec<u32> {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<u32>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The ideal reference, for one view.
///
/// The papers record the visible sets with the item buffer of NOC; so does whoever makes the recording
/// here. Uploading a set counts to its frame, as packing it does.
#[derive(Debug)]
pub struct Reference {
    drawn: DrawnOnce,
    recorded: Recorded,
    depth: DepthConvention,
}

impl Reference {
    /// Draws what is `recorded`.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        depth: DepthConvention,
        recorded: Recorded,
    ) -> Self {
        Self {
            drawn: DrawnOnce::new(device, scene, depth),
            recorded,
            depth,
        }
    }
}

impl CullingMethod for Reference {
    fn name(&self) -> &'static str {
        "ref"
    }

    fn host_sync(&self) -> HostSync {
        HostSync::Never
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        let shape = &frame.scene.shape;
        (frame.camera).clip_from_world(
            self.depth,
            frame.targets.size,
            shape.origin,
            shape.radius,
        )?;
        // A recording of fewer objects knows nothing of the rest.
        let mut visible = self.recorded.words();
        visible.resize(shape.object_words() as usize, 0);
        (frame.queue).write_buffer(&self.drawn.members, 0, bytemuck::cast_slice(&visible));
        self.drawn.draw(frame, drawer);
        self.drawn.draw_blended(frame, drawer);
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        self.drawn.sets()
    }

    fn depth(&self) -> DepthConvention {
        self.depth
    }

    fn reset(&mut self, _encoder: &mut wgpu::CommandEncoder) {}

    fn memory_bytes(&self) -> u64 {
        self.drawn.memory_bytes()
    }
}
