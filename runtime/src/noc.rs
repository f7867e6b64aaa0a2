//! NOC: no culling. Draws every object in order of their ids. The truth that all others are held against.

use crate::camera::{CameraError, DepthConvention};
use crate::draw::{Draw, Drawer, Submission};
use crate::gpu;
use crate::method::{CullingMethod, FrameContext, HostSync, Sets};
use crate::pack::{Pack, PackedList};
use crate::scene::Scene;
use crate::stage::Stage;

/// No culling, for one view.
#[derive(Debug)]
pub struct Noc {
    list: PackedList,
    everything: wgpu::Buffer,
    packed: bool,
    depth: DepthConvention,
    scene: Scene,
}

impl Noc {
    /// Draws all of `scene`.
    pub fn new(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        let everything = gpu::storage(
            device,
            "everything",
            u64::from(scene.shape.object_words()) * 4,
            wgpu::BufferUsages::empty(),
        );
        let submission = Submission::of(device.features());
        let list = PackedList::new(device, &Pack::new(device), scene, &everything, submission);
        Self {
            list,
            everything,
            packed: false,
            depth,
            scene: scene.clone(),
        }
    }

    /// All objects as a set, 32 to a word.
    fn all(&self) -> Vec<u32> {
        let count = self.scene.shape.object_count;
        (0..self.scene.shape.object_words())
            .map(|word| match count - word * 32 {
                0..32 => (1 << (count - word * 32)) - 1,
                _ => u32::MAX,
            })
            .collect()
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
        let shape = &self.scene.shape;
        frame
            .camera
            .clip_from_world(self.depth, frame.targets.size, shape.origin, shape.radius)?;
        if !self.packed {
            frame
                .queue
                .write_buffer(&self.everything, 0, bytemuck::cast_slice(&self.all()));
            frame.stage(Stage::Pack, |encoder| self.list.record(encoder));
            self.packed = true;
        }
        let draw = Draw {
            stage: Stage::DrawAll,
            clear: true,
            list: self.list.list(),
            targets: frame.targets,
            depth: self.depth,
        };
        frame.stage(Stage::DrawAll, |encoder| drawer.draw(encoder, &draw));
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        Sets {
            potential_occluders: Some(&self.everything),
            ..Sets::default()
        }
    }

    fn depth(&self) -> DepthConvention {
        self.depth
    }

    fn reset(&mut self, _encoder: &mut wgpu::CommandEncoder) {}

    fn memory_bytes(&self) -> u64 {
        self.list.memory_bytes() + self.everything.size()
    }
}
