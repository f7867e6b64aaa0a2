//! What methods have in common that draw what showed last and test the rest against it.

use hroc_runtime::gpu;
use hroc_runtime::{
    DepthConvention, Draw, Drawer, FrameContext, PackedList, Scene, Sets, Stage, Targets,
};

use crate::view::pass;

/// The sets of such a frame, and their lists.
#[derive(Debug)]
pub(crate) struct DrawnTwice {
    /// One bit per object: what is drawn first.
    pub visible: wgpu::Buffer,
    /// One bit per object: what the test found. What of it was not drawn first is drawn second.
    pub found: wgpu::Buffer,
    /// The opaque objects of `found` that were not drawn first, one bit each.
    rest: wgpu::Buffer,
    minus: hroc_runtime::Kernel,
    first: PackedList,
    second: PackedList,
    blended: PackedList,
    words: u32,
    depth: DepthConvention,
}

impl DrawnTwice {
    pub fn new(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        use gpu::Access::{Read, ReadWrite};
        let words = scene.shape.object_words();
        let set = |label| {
            let none = wgpu::BufferUsages::empty();
            gpu::storage(device, label, 4 * u64::from(words), none)
        };
        let [visible, found, rest] = ["visible", "found", "rest"].map(set);
        let first = PackedList::new(device, scene, &visible, &scene.opaque);
        let bindings = [
            (0, Read, &found),
            (1, Read, first.packed()),
            (2, ReadWrite, &rest),
        ];
        let pipelines = &scene.profile.pipelines;
        let minus = hroc_runtime::Kernel::new(device, pipelines, "minus", "minus", &[], &bindings);
        Self {
            second: PackedList::new(device, scene, &rest, &scene.opaque),
            blended: PackedList::new(device, scene, &found, &scene.blended),
            first,
            visible,
            found,
            rest,
            minus,
            words,
            depth,
        }
    }

    /// One bit per object: what [`draw_first`](Self::draw_first) drew.
    pub fn drawn_first(&self) -> &wgpu::Buffer {
        self.first.packed()
    }

    /// Draws what showed last: the occlusion map.
    pub fn draw_first(&self, frame: &mut FrameContext<'_>, drawer: &mut dyn Drawer) {
        frame.stage(Stage::PACK, |encoder| self.first.record(encoder));
        let draw = self.pass(frame.targets, Stage::OCCLUSION_MAP, &self.first);
        frame.stage(Stage::OCCLUSION_MAP, |encoder| drawer.draw(encoder, &draw));
    }

    /// Draws what the test found beyond that.
    pub fn draw_second(&self, frame: &mut FrameContext<'_>, drawer: &mut dyn Drawer) {
        frame.stage(Stage::PACK, |encoder| {
            let mut pass = gpu::compute_pass(encoder, "minus");
            self.minus.dispatch(&mut pass, gpu::grid(self.words, 64));
            drop(pass);
            self.second.record(encoder);
            if frame.scene.has_blended {
                self.blended.record(encoder);
            }
        });
        let draw = self.pass(frame.targets, Stage::RENDER_OCCLUDEES, &self.second);
        frame.stage(Stage::RENDER_OCCLUDEES, |encoder| {
            drawer.draw(encoder, &draw)
        });
    }

    /// Draws the blended objects that the test found.
    pub fn draw_blended(&self, frame: &mut FrameContext<'_>, drawer: &mut dyn Drawer) {
        if frame.scene.has_blended {
            let draw = self.pass(frame.targets, Stage::RENDER_BLENDED, &self.blended);
            frame.stage(Stage::RENDER_BLENDED, |encoder| drawer.draw(encoder, &draw));
        }
    }

    fn pass<'a>(&self, targets: Targets<'a>, stage: Stage, list: &'a PackedList) -> Draw<'a> {
        let clear = stage == Stage::OCCLUSION_MAP;
        pass(stage, clear, list.list(), targets, self.depth)
    }

    pub fn sets(&self) -> Sets<'_> {
        Sets {
            potential_occluders: Some(self.first.packed()),
            potentially_visible: Some(self.second.packed()),
            blended: Some(self.blended.packed()),
            visible: Some(&self.visible),
            draw_counts: [&self.first, &self.second].map(|list| Some(list.count())),
            ..Sets::default()
        }
    }

    pub fn memory_bytes(&self) -> u64 {
        let sets = [&self.visible, &self.found, &self.rest];
        let lists = [&self.first, &self.second, &self.blended];
        sets.iter().map(|set| set.size()).sum::<u64>()
            + lists.iter().map(|list| list.memory_bytes()).sum::<u64>()
    }
}
