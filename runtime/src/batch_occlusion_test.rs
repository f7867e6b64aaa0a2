//! `batch_occlusion_test`: rasterize the groups' bounds, cast a ray per fragment the map does not hide.

use crate::box_pass::{BoxPass, BoxShader};
use crate::camera::DepthConvention;
use crate::device::DeviceProfile;
use crate::draw::Targets;
use crate::gpu::{self, Access};
use crate::scene::Tree;

/// Where the stage reads and writes.
pub(crate) struct TestBuffers<'a> {
    pub frame: &'a wgpu::Buffer,
    pub tree: &'a Tree,
    pub groups: &'a wgpu::Buffer,
    pub potential_occluders: &'a wgpu::Buffer,
    pub potentially_visible: &'a wgpu::Buffer,
    pub work: &'a wgpu::Buffer,
    pub grouping: &'a wgpu::Buffer,
    pub flagged_nodes: &'a wgpu::Buffer,
    pub object_bounds: &'a wgpu::Buffer,
}

/// Variants of the stage.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TestOptions {
    pub depth: DepthConvention,
    pub prune: bool,
    pub count_work: bool,
}

const SHADER: BoxShader = BoxShader {
    sampled: "batch_occlusion_test",
    sampled_entry: "cast_ray",
    early: "batch_occlusion_test_early",
    early_entry: "cast_ray_early",
};

/// Pipeline and bindings of one view.
#[derive(Debug)]
pub(crate) struct BatchOcclusionTest {
    pass: BoxPass,
    flagged_nodes: wgpu::Buffer,
}

impl BatchOcclusionTest {
    pub fn new(
        device: &wgpu::Device,
        profile: &DeviceProfile,
        options: TestOptions,
        buffers: &TestBuffers<'_>,
    ) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let b = buffers;
        let constants = [
            profile.mutant.constant(),
            ("COUNT_WORK", gpu::flag(options.count_work)),
            ("PRUNE", gpu::flag(options.prune)),
        ];
        let buffers = [
            (Uniform, b.frame),
            (Read, &b.tree.nodes),
            (Read, b.groups),
            (Read, b.potential_occluders),
            (ReadWrite, b.potentially_visible),
            (ReadWrite, b.work),
            (ReadWrite, b.grouping),
            (Read, &b.tree.parents),
            (ReadWrite, b.flagged_nodes),
            (Read, b.object_bounds),
        ];
        Self {
            pass: BoxPass::new(device, profile, SHADER, options.depth, &constants, &buffers),
            flagged_nodes: b.flagged_nodes.clone(),
        }
    }

    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets<'_>,
        group_draw: &wgpu::Buffer,
    ) {
        encoder.clear_buffer(&self.flagged_nodes, 0, None);
        self.pass.record(device, encoder, targets, group_draw, 0);
    }
}
