//! NOC: no culling. Draws every object in order of their ids. The truth that all others are held against.

use crate::camera::{CameraError, DepthConvention};
use crate::draw::{Draw, Drawer};
use crate::gpu;
use crate::method::{CullingMethod, FrameContext, HostSync, Sets};
use crate::pack::PackedList;
use crate::scene::Scene;
use crate::stage::Stage;

/// No culling, for one view.
#[derive(Debug)]
pub struct Noc {
    opaque: PackedList,
    blended: PackedList,
    everything: wgpu::Buffer,
    /// The state of the scene that the lists hold.
    packed: Option<u64>,
    depth: DepthConvention,
}

impl Noc {
    /// Draws all of `scene`.
    pub fn new(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        let words = vec![u32::MAX; scene.shape.object_words() as usize];
        let everything = gpu::storage_with(device, "everything", &words);
        let list = |class| PackedList::new(device, scene, &everything, class);
        Self {
            opaque: list(&scene.opaque),
            blended: list(&scene.blended),
            everything,
            packed: None,
            depth,
        }
    }
}

impl CullingMethod for Noc {
    fn name(&self) -> &'static str {
        "noc"
    }

    fn host_sync(&self) -> HostSync {
        HostSync::Never
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        let scene = frame.scene;
        let shape = &scene.shape;
        frame
            .camera
            .clip_from_world(self.depth, frame.targets.size, shape.origin, shape.radius)?;
        if self.packed != Some(scene.revision) {
            frame.stage(Stage::PACK, |encoder| {
                self.opaque.record(encoder);
                self.blended.record(encoder);
            });
            self.packed = Some(scene.revision);
        }
        let draw = Draw {
            stage: Stage::DRAW_ALL,
            clear: true,
            list: self.opaque.list(),
            targets: frame.targets,
            depth: self.depth,
            marks: None,
        };
        frame.stage(Stage::DRAW_ALL, |encoder| drawer.draw(encoder, &draw));
        if scene.has_blended {
            let blended = Draw {
                stage: Stage::RENDER_BLENDED,
                clear: false,
                list: self.blended.list(),
                ..draw
            };
            frame.stage(Stage::RENDER_BLENDED, |encoder| {
                drawer.draw(encoder, &blended)
            });
        }
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        Sets {
            potential_occluders: Some(self.opaque.packed()),
            blended: Some(self.blended.packed()),
            ..Sets::default()
        }
    }

    fn depth(&self) -> DepthConvention {
        self.depth
    }

    fn reset(&mut self, _encoder: &mut wgpu::CommandEncoder) {}

    fn memory_bytes(&self) -> u64 {
        self.opaque.memory_bytes() + self.blended.memory_bytes() + self.everything.size()
    }
}
