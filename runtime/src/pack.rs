//! `pack`: from a set of objects to a tight list of draw commands in object order, by prefix sum.

use crate::draw::{DrawList, DrawRange, Submission};
use crate::gpu::{self, Access};
use crate::pipelines::Pipelines;
use crate::scene::Scene;

const COMMAND_BYTES: u64 = 20;

/// The pipelines; one per device.
#[derive(Clone, Debug)]
struct Pack {
    layout: wgpu::BindGroupLayout,
    scan: wgpu::ComputePipeline,
    emit: wgpu::ComputePipeline,
}

impl Pack {
    fn of(device: &wgpu::Device, pipelines: &Pipelines) -> Self {
        pipelines.get("pack", || Self::new(device))
    }

    fn new(device: &wgpu::Device) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let module = gpu::shader(device, "pack");
        let layout = gpu::buffer_layout(
            device,
            "pack",
            wgpu::ShaderStages::COMPUTE,
            &[
                Read, Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite, Read, Read, Uniform,
            ],
        );
        Self {
            scan: gpu::compute(device, &module, "pack_scan", &[&layout], &[]),
            emit: gpu::compute(device, &module, "pack_emit", &[&layout], &[]),
            layout,
        }
    }
}

/// The draw list of one set, as far as it is in one class.
#[derive(Debug)]
pub struct PackedList {
    pipelines: Pack,
    group: wgpu::BindGroup,
    packed: wgpu::Buffer,
    commands: wgpu::Buffer,
    count: wgpu::Buffer,
    bases_bytes: u64,
    words: u32,
    capacity: u32,
    submission: Submission,
}

impl PackedList {
    /// A list of those in `members` that are in `object_class` (one bit per object of `scene` each).
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        members: &wgpu::Buffer,
        object_class: &wgpu::Buffer,
    ) -> Self {
        let pipelines = Pack::of(device, &scene.profile.pipelines);
        let none = wgpu::BufferUsages::empty();
        let words = scene.shape.object_words();
        let indirect = wgpu::BufferUsages::INDIRECT;
        let commands = gpu::storage(
            device,
            "draw commands",
            u64::from(scene.shape.object_count) * COMMAND_BYTES,
            indirect,
        );
        let count = gpu::storage(device, "draw count", 4, indirect);
        let packed = gpu::storage(device, "packed", u64::from(words) * 4, none);
        let bases = gpu::storage(device, "pack bases", u64::from(words) * 4, none);
        let limits = gpu::uniform(device, "pack words", bytemuck::bytes_of(&[words, 0, 0, 0]));
        let group = gpu::buffer_group(
            device,
            "pack",
            &pipelines.layout,
            &[
                members,
                object_class,
                &packed,
                &bases,
                &count,
                &commands,
                &scene.objects,
                &scene.meshes,
                &limits,
            ],
        );
        Self {
            pipelines,
            group,
            packed,
            bases_bytes: bases.size(),
            commands,
            count,
            words,
            capacity: scene.shape.object_count,
            submission: scene.profile.submission,
        }
    }

    /// Records the packing. The lists of a frame stand in the order of object ids, so that surfaces of equal depth
    /// are drawn in the same order whatever a method leaves out.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        if self.words == 0 {
            return;
        }
        if self.submission != Submission::IndirectCount {
            encoder.clear_buffer(&self.commands, 0, None);
        }
        let mut pass = gpu::compute_pass(encoder, "pack");
        gpu::dispatch(&mut pass, &self.pipelines.scan, &self.group, [1, 1]);
        gpu::dispatch(
            &mut pass,
            &self.pipelines.emit,
            &self.group,
            [self.words.div_ceil(64), 1],
        );
    }

    /// The set that the last `record` packed.
    pub fn packed(&self) -> &wgpu::Buffer {
        &self.packed
    }

    /// What the last `record` wrote: all of it.
    pub fn list(&self) -> DrawList<'_> {
        self.range(DrawRange::AtMost(self.capacity))
    }

    /// What the last `record` wrote: part of it.
    pub fn range(&self, range: DrawRange) -> DrawList<'_> {
        DrawList {
            commands: &self.commands,
            count: &self.count,
            range,
            submission: self.submission,
        }
    }

    /// One u32: the length of the list.
    pub fn count(&self) -> &wgpu::Buffer {
        &self.count
    }

    /// No list is longer.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// GPU memory, bytes.
    pub fn memory_bytes(&self) -> u64 {
        self.commands.size() + self.count.size() + self.packed.size() + self.bases_bytes
    }
}
