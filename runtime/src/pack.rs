//! `pack`: from a set of objects to a tight list of draw commands in object order, by prefix sum.

use crate::draw::{DrawList, Submission};
use crate::gpu::{self, Access};
use crate::scene::Scene;

const COMMAND_BYTES: u64 = 20;

/// The pipelines; one per device.
#[derive(Clone, Debug)]
pub(crate) struct Pack {
    layout: wgpu::BindGroupLayout,
    scan: wgpu::ComputePipeline,
    emit: wgpu::ComputePipeline,
}

impl Pack {
    pub fn new(device: &wgpu::Device) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let module = gpu::shader(device, "pack");
        let layout = gpu::buffer_layout(
            device,
            "pack",
            wgpu::ShaderStages::COMPUTE,
            &[Read, ReadWrite, ReadWrite, ReadWrite, Read, Read, Uniform],
        );
        Self {
            scan: gpu::compute(device, &module, "pack_scan", &[&layout], &[]),
            emit: gpu::compute(device, &module, "pack_emit", &[&layout], &[]),
            layout,
        }
    }
}

/// The draw list of one set.
#[derive(Debug)]
pub(crate) struct PackedList {
    pipelines: Pack,
    group: wgpu::BindGroup,
    commands: wgpu::Buffer,
    count: wgpu::Buffer,
    bases_bytes: u64,
    words: u32,
    capacity: u32,
    submission: Submission,
}

impl PackedList {
    /// A list of the members of `members` (one bit per object of `scene`).
    pub fn new(
        device: &wgpu::Device,
        pipelines: &Pack,
        scene: &Scene,
        members: &wgpu::Buffer,
        submission: Submission,
    ) -> Self {
        let words = scene.shape.object_words();
        let indirect = wgpu::BufferUsages::INDIRECT;
        let commands = gpu::storage(
            device,
            "draw commands",
            u64::from(scene.shape.object_count) * COMMAND_BYTES,
            indirect,
        );
        let count = gpu::storage(device, "draw count", 4, indirect);
        let bases = gpu::storage(
            device,
            "pack bases",
            u64::from(words) * 4,
            wgpu::BufferUsages::empty(),
        );
        let limits = gpu::uniform(device, "pack words", bytemuck::bytes_of(&[words, 0, 0, 0]));
        let group = gpu::buffer_group(
            device,
            "pack",
            &pipelines.layout,
            &[
                members,
                &bases,
                &count,
                &commands,
                &scene.objects,
                &scene.meshes,
                &limits,
            ],
        );
        Self {
            pipelines: pipelines.clone(),
            group,
            bases_bytes: bases.size(),
            commands,
            count,
            words,
            capacity: scene.shape.object_count,
            submission,
        }
    }

    /// Records the packing.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        if self.words == 0 {
            return;
        }
        if self.submission == Submission::ZeroedTail {
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

    /// What the last `record` wrote.
    pub fn list(&self) -> DrawList<'_> {
        DrawList {
            commands: &self.commands,
            count: &self.count,
            max_count: self.capacity,
            submission: self.submission,
        }
    }

    pub fn memory_bytes(&self) -> u64 {
        self.commands.size() + self.count.size() + self.bases_bytes
    }
}
