//! What methods have in common that decide first and draw then: one set of objects, drawn once.

use hroc_runtime::{
    DepthConvention, Draw, Drawer, FrameContext, PackedList, Scene, Sets, Stage, Targets, gpu,
};

use crate::view::pass;

/// The set a frame draws, and its lists.
#[derive(Debug)]
pub(crate) struct DrawnOnce {
    /// One bit per object: what the method decides to draw.
    pub members: wgpu::Buffer,
    opaque: PackedList,
    blended: PackedList,
    depth: DepthConvention,
}

impl DrawnOnce {
    pub fn new(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        let bytes = 4 * u64::from(scene.shape.object_words());
        let members = gpu::storage(device, "members", bytes, wgpu::BufferUsages::empty());
        let list = |class| PackedList::new(device, scene, &members, class);
        Self {
            opaque: list(&scene.opaque),
            blended: list(&scene.blended),
            members,
            depth,
        }
    }

    /// Packs the members and draws those that are not blended.
    pub fn draw(&self, frame: &mut FrameContext<'_>, drawer: &mut dyn Drawer) {
        frame.stage(Stage::PACK, |encoder| {
            self.opaque.record(encoder);
            if frame.scene.has_blended {
                self.blended.record(encoder);
            }
        });
        let draw = self.pass(frame.targets, Stage::DRAW_ALL, &self.opaque);
        frame.stage(Stage::DRAW_ALL, |encoder| drawer.draw(encoder, &draw));
    }

    /// Draws the blended members, after [`draw`](Self::draw).
    pub fn draw_blended(&self, frame: &mut FrameContext<'_>, drawer: &mut dyn Drawer) {
        if frame.scene.has_blended {
            let draw = self.pass(frame.targets, Stage::RENDER_BLENDED, &self.blended);
            frame.stage(Stage::RENDER_BLENDED, |encoder| drawer.draw(encoder, &draw));
        }
    }

    fn pass<'a>(&self, targets: Targets<'a>, stage: Stage, list: &'a PackedList) -> Draw<'a> {
        let clear = stage == Stage::DRAW_ALL;
        pass(stage, clear, list.list(), targets, self.depth)
    }

    pub fn sets(&self) -> Sets<'_> {
        Sets {
            potentially_visible: Some(self.opaque.packed()),
            blended: Some(self.blended.packed()),
            ..Sets::default()
        }
    }

    pub fn memory_bytes(&self) -> u64 {
        self.members.size() + self.opaque.memory_bytes() + self.blended.memory_bytes()
    }
}
