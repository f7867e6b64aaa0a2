//! `extract_groups`: from the effective occluders to the occludee groups.

use crate::camera::DepthConvention;
use crate::gpu::{self, Access};
use crate::scene::{SceneShape, Tree};

/// Vertices of a group's box: one strip.
const BOX_VERTICES: u32 = 14;

/// How coarse the groups are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Grouping {
    /// Maximal nodes of unknown visibility, as published. Nodes that touch the near plane are replaced by
    /// their children all the same: without that the image is not exact.
    #[default]
    Published,
    /// Nodes that cover more of the screen than pays are replaced by their children too.
    Adaptive {
        /// Cost of rasterizing one more box, in ray-box tests. Some 30 to 300 on GPUs, 600 on software
        /// rasterizers; an error of four times costs a few percent.
        box_cost: f32,
    },
}

impl Grouping {
    /// `published` or `adaptive`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Published => "published",
            Self::Adaptive { .. } => "adaptive",
        }
    }

    fn box_cost(self) -> f64 {
        match self {
            Self::Published => 0.0,
            // 0 stands for the published form in the shader.
            Self::Adaptive { box_cost } => f64::from(box_cost.max(f32::MIN_POSITIVE)),
        }
    }
}

/// Where the stage reads and writes.
pub(crate) struct ExtractBuffers<'a> {
    pub frame: &'a wgpu::Buffer,
    pub tree: &'a Tree,
    pub potential_occluders: &'a wgpu::Buffer,
    pub effective_occluders: &'a wgpu::Buffer,
    pub visible_nodes: &'a wgpu::Buffer,
    pub potentially_visible: &'a wgpu::Buffer,
    pub groups: &'a wgpu::Buffer,
    pub group_draw: &'a wgpu::Buffer,
    pub grouping: &'a wgpu::Buffer,
}

/// Pipelines and bindings of one view.
#[derive(Debug)]
pub(crate) struct ExtractGroups {
    choose_threshold: wgpu::ComputePipeline,
    climb: wgpu::ComputePipeline,
    collect: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    visible_nodes: wgpu::Buffer,
    potentially_visible: wgpu::Buffer,
    group_draw: wgpu::Buffer,
    no_groups: wgpu::Buffer,
    shape: SceneShape,
}

impl ExtractGroups {
    pub fn new(
        device: &wgpu::Device,
        depth: DepthConvention,
        grouping: Grouping,
        shape: SceneShape,
        buffers: &ExtractBuffers<'_>,
    ) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let module = gpu::shader(device, "extract_groups");
        let access = [
            Uniform, Read, Read, Read, Read, Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite,
            ReadWrite,
        ];
        let layout = gpu::buffer_layout(
            device,
            "extract_groups",
            wgpu::ShaderStages::COMPUTE,
            &access,
        );
        let constants = [depth.constants()[0], ("BOX_COST", grouping.box_cost())];
        let b = buffers;
        let group = gpu::buffer_group(
            device,
            "extract_groups",
            &layout,
            &[
                b.frame,
                &b.tree.nodes,
                &b.tree.parents,
                &b.tree.leaf_of_object,
                b.potential_occluders,
                b.effective_occluders,
                b.visible_nodes,
                b.potentially_visible,
                b.groups,
                b.group_draw,
                b.grouping,
            ],
        );
        let no_groups = gpu::storage(device, "no groups", 16, wgpu::BufferUsages::empty());
        Self {
            choose_threshold: gpu::compute(
                device,
                &module,
                "choose_threshold",
                &[&layout],
                &constants,
            ),
            climb: gpu::compute(device, &module, "climb", &[&layout], &constants),
            collect: gpu::compute(device, &module, "collect", &[&layout], &constants),
            group,
            visible_nodes: b.visible_nodes.clone(),
            potentially_visible: b.potentially_visible.clone(),
            group_draw: b.group_draw.clone(),
            no_groups,
            shape,
        }
    }

    /// Once, before the first frame: the arguments of an empty group draw.
    pub fn initialize(&self, queue: &wgpu::Queue) {
        queue.write_buffer(
            &self.no_groups,
            0,
            bytemuck::bytes_of(&[BOX_VERTICES, 0, 0, 0]),
        );
    }

    pub fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.visible_nodes, 0, None);
        encoder.clear_buffer(&self.potentially_visible, 0, None);
        encoder.copy_buffer_to_buffer(&self.no_groups, 0, &self.group_draw, 0, 16);
        let mut pass = gpu::compute_pass(encoder, "extract_groups");
        gpu::dispatch(&mut pass, &self.choose_threshold, &self.group, [1, 1]);
        gpu::dispatch(
            &mut pass,
            &self.climb,
            &self.group,
            gpu::grid(self.shape.object_count, 64),
        );
        gpu::dispatch(
            &mut pass,
            &self.collect,
            &self.group,
            gpu::grid(self.shape.node_count(), 64),
        );
    }
}
