//! `extract_groups`: from the effective occluders to the occludee groups.

use crate::box_pass::BOX_VERTICES;
use crate::camera::DepthConvention;
use crate::device::ASSUMED_BOX_COST;
use crate::gpu::{self, Access};
use crate::kernel::Kernel;
use crate::mutant::Mutant;
use crate::pipelines::Pipelines;
use crate::scene::{SceneShape, Tree};

/// How coarse the groups are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grouping {
    /// Maximal nodes of unknown visibility, as published. Nodes that touch the near plane are replaced by
    /// their children all the same: without that the image is not exact.
    Published,
    /// Nodes that cover more of the screen than pays are replaced by their children too.
    Adaptive {
        /// Cost of rasterizing one more box, in ray-box tests; see
        /// [`DeviceProfile::measure_box_cost`](crate::DeviceProfile::measure_box_cost).
        box_cost: f32,
    },
}

impl Default for Grouping {
    /// Adaptive, with an assumed cost: indoors it needs a tenth of the published form's ray-box tests, and nowhere more.
    fn default() -> Self {
        Self::Adaptive {
            box_cost: ASSUMED_BOX_COST,
        }
    }
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
    pub object_bounds: &'a wgpu::Buffer,
}

/// Pipelines and bindings of one view.
#[derive(Debug)]
pub(crate) struct ExtractGroups {
    choose_threshold: Kernel,
    climb: Kernel,
    collect: Kernel,
    visible_nodes: wgpu::Buffer,
    potentially_visible: wgpu::Buffer,
    group_draw: wgpu::Buffer,
    no_groups: wgpu::Buffer,
    shape: SceneShape,
}

impl ExtractGroups {
    pub fn new(
        device: &wgpu::Device,
        pipelines: &Pipelines,
        depth: DepthConvention,
        grouping: Grouping,
        mutant: Mutant,
        shape: SceneShape,
        buffers: &ExtractBuffers<'_>,
    ) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let b = buffers;
        let all = [
            (Uniform, b.frame),
            (Read, &b.tree.nodes),
            (Read, &b.tree.parents),
            (Read, &b.tree.leaf_of_object),
            (Read, b.potential_occluders),
            (Read, b.effective_occluders),
            (ReadWrite, b.visible_nodes),
            (ReadWrite, b.potentially_visible),
            (ReadWrite, b.groups),
            (ReadWrite, b.group_draw),
            (ReadWrite, b.grouping),
            (Read, b.object_bounds),
        ];
        let constants = [
            depth.constants()[0],
            mutant.constant(),
            ("BOX_COST", grouping.box_cost()),
        ];
        // Each entry point binds what it uses: together they are more than a stage may have.
        let kernel = |entry: &'static str, used: &[u32]| {
            let at = |&binding: &u32| {
                let (access, buffer) = all[binding as usize];
                (binding, access, buffer)
            };
            let bindings = used.iter().map(at).collect::<Vec<_>>();
            Kernel::new(
                device,
                pipelines,
                "extract_groups",
                entry,
                &constants,
                &bindings,
            )
        };
        let no_groups = gpu::storage_with(device, "no groups", &[BOX_VERTICES, 0, 0, 0]);
        Self {
            choose_threshold: kernel("choose_threshold", &[10]),
            climb: kernel("climb", &[0, 2, 3, 5, 6]),
            collect: kernel("collect", &[0, 1, 2, 4, 6, 7, 8, 9, 10, 11]),
            visible_nodes: b.visible_nodes.clone(),
            potentially_visible: b.potentially_visible.clone(),
            group_draw: b.group_draw.clone(),
            no_groups,
            shape,
        }
    }

    pub fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.visible_nodes, 0, None);
        encoder.clear_buffer(&self.potentially_visible, 0, None);
        encoder.copy_buffer_to_buffer(&self.no_groups, 0, &self.group_draw, 0, 16);
        let shape = &self.shape;
        let mut pass = gpu::compute_pass(encoder, "extract_groups");
        self.choose_threshold.dispatch(&mut pass, [1, 1]);
        (self.climb).dispatch(&mut pass, gpu::grid(shape.static_count, 64));
        let nodes = shape.node_count() + shape.moving_capacity();
        (self.collect).dispatch(&mut pass, gpu::grid(nodes, 64));
    }
}
