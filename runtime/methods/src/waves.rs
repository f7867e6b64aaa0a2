//! Drawing piece by piece, for methods that decide on the host while they draw.

use hroc_runtime::gpu;
use hroc_runtime::{
    DepthConvention, DrawRange, Drawer, FrameContext, PackedList, Scene, Sets, Stage,
};

use crate::view::pass;

/// What a frame has drawn, and what it draws next.
#[derive(Debug)]
pub(crate) struct Waves {
    /// One bit per object: the objects of the current piece.
    members: wgpu::Buffer,
    list: PackedList,
    /// One bit per object: all that the frame drew, for the report and for what is blended.
    drawn: wgpu::Buffer,
    opaque: PackedList,
    blended: PackedList,
    words: Vec<u32>,
    all: Vec<u32>,
    /// The piece to draw next.
    next: Vec<u32>,
    is_clear: bool,
    depth: DepthConvention,
}

impl Waves {
    pub fn new(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        let bytes = 4 * u64::from(scene.shape.object_words());
        let none = wgpu::BufferUsages::empty();
        let members = gpu::storage(device, "members", bytes, none);
        let drawn = gpu::storage(device, "drawn", bytes, none);
        let words = vec![0; scene.shape.object_words() as usize];
        Self {
            list: PackedList::new(device, scene, &members, &scene.opaque),
            opaque: PackedList::new(device, scene, &drawn, &scene.opaque),
            blended: PackedList::new(device, scene, &drawn, &scene.blended),
            members,
            drawn,
            all: words.clone(),
            words,
            next: Vec::new(),
            is_clear: false,
            depth,
        }
    }

    /// Begins a frame. What the host moves is unknown to the tree, so it is drawn untested.
    pub fn begin(&mut self, scene: &Scene) {
        self.all.fill(0);
        self.next.clear();
        self.is_clear = false;
        for object in scene.shape.static_count..scene.shape.object_count {
            self.add(object);
        }
    }

    /// An object to be drawn with the next piece.
    pub fn add(&mut self, object: u32) {
        let (word, bit) = ((object >> 5) as usize, 1 << (object & 31));
        if self.all[word] & bit == 0 {
            self.all[word] |= bit;
            self.next.push(object);
        }
    }

    /// Draws the opaque objects that were added since the last time. The frame has to be submitted before the next.
    pub fn draw(&mut self, frame: &mut FrameContext<'_>, drawer: &mut dyn Drawer) {
        if self.next.is_empty() && self.is_clear {
            return;
        }
        self.words.fill(0);
        for &object in &self.next {
            self.words[(object >> 5) as usize] |= 1 << (object & 31);
        }
        frame
            .queue
            .write_buffer(&self.members, 0, bytemuck::cast_slice(&self.words));
        frame.stage(Stage::PACK, |encoder| self.list.record(encoder));
        let range = DrawRange::AtMost(self.next.len() as u32);
        let (list, clear) = (self.list.range(range), !self.is_clear);
        let draw = pass(Stage::DRAW_ALL, clear, list, frame.targets, self.depth);
        frame.stage(Stage::DRAW_ALL, |encoder| drawer.draw(encoder, &draw));
        self.is_clear = true;
        self.next.clear();
    }

    /// Ends the frame: draws the blended objects that were added in it.
    pub fn end(&mut self, frame: &mut FrameContext<'_>, drawer: &mut dyn Drawer) {
        frame
            .queue
            .write_buffer(&self.drawn, 0, bytemuck::cast_slice(&self.all));
        frame.stage(Stage::PACK, |encoder| {
            self.opaque.record(encoder);
            if frame.scene.has_blended {
                self.blended.record(encoder);
            }
        });
        if frame.scene.has_blended {
            let list = self.blended.list();
            let draw = pass(
                Stage::RENDER_BLENDED,
                false,
                list,
                frame.targets,
                self.depth,
            );
            frame.stage(Stage::RENDER_BLENDED, |encoder| drawer.draw(encoder, &draw));
        }
    }

    pub fn sets(&self) -> Sets<'_> {
        Sets {
            potentially_visible: Some(self.opaque.packed()),
            blended: Some(self.blended.packed()),
            ..Sets::default()
        }
    }

    pub fn memory_bytes(&self) -> u64 {
        let lists = [&self.list, &self.opaque, &self.blended];
        self.members.size()
            + self.drawn.size()
            + lists.iter().map(|list| list.memory_bytes()).sum::<u64>()
    }
}
