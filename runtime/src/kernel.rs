//! Compute passes for methods of your own.

use crate::gpu::{self, Access};
use crate::pipelines::Pipelines;

/// An entry point of a module of hroc-shaders over fixed buffers at `@group(0)`.
#[derive(Clone, Debug)]
pub struct Kernel {
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    /// Of the kernels [over depth](Kernel::over_depth).
    depth_layout: Option<wgpu::BindGroupLayout>,
}

impl Kernel {
    /// `entry` of `module`, with the bindings that it uses of its module's. Compiled once per device and constants.
    ///
    /// # Panics
    /// If hroc-shaders has no such module.
    pub fn new(
        device: &wgpu::Device,
        pipelines: &Pipelines,
        module: &'static str,
        entry: &'static str,
        constants: &[(&str, f64)],
        bindings: &[(u32, Access, &wgpu::Buffer)],
    ) -> Self {
        Self::make(device, pipelines, module, entry, constants, bindings, None)
    }

    /// The same, with a depth texture at `@group(1) @binding(0)` that is given with every dispatch.
    ///
    /// # Panics
    /// If hroc-shaders has no such module.
    pub fn over_depth(
        device: &wgpu::Device,
        pipelines: &Pipelines,
        module: &'static str,
        entry: &'static str,
        constants: &[(&str, f64)],
        bindings: &[(u32, Access, &wgpu::Buffer)],
    ) -> Self {
        let depth = gpu::depth_layout(device, wgpu::ShaderStages::COMPUTE);
        Self::make(
            device,
            pipelines,
            module,
            entry,
            constants,
            bindings,
            Some(depth),
        )
    }

    fn make(
        device: &wgpu::Device,
        pipelines: &Pipelines,
        module: &'static str,
        entry: &'static str,
        constants: &[(&str, f64)],
        bindings: &[(u32, Access, &wgpu::Buffer)],
        depth_layout: Option<wgpu::BindGroupLayout>,
    ) -> Self {
        let access = bindings.iter().map(|&(at, access, _)| (at, access));
        let access = access.collect::<Vec<_>>();
        let stage = wgpu::ShaderStages::COMPUTE;
        let layout = gpu::sparse_buffer_layout(device, entry, stage, &access);
        let buffers = bindings.iter().map(|&(at, _, buffer)| (at, buffer));
        let buffers = buffers.collect::<Vec<_>>();
        let pipeline = pipelines.get(&format!("{module} {entry} {constants:?}"), || {
            let module = gpu::shader(device, module);
            let layouts = [Some(&layout), depth_layout.as_ref()];
            let layouts = layouts.into_iter().flatten().collect::<Vec<_>>();
            gpu::compute(device, &module, entry, &layouts, constants)
        });
        Self {
            pipeline,
            group: gpu::sparse_buffer_group(device, entry, &layout, &buffers),
            depth_layout,
        }
    }

    /// Records a dispatch of `grid` workgroups, see [`gpu::grid`].
    pub fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, grid: [u32; 2]) {
        gpu::dispatch(pass, &self.pipeline, &self.group, grid);
    }

    /// Records a dispatch of as many workgroups as the three u32 at `offset` of `arguments` say.
    pub fn dispatch_indirect(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        arguments: &wgpu::Buffer,
        offset: u64,
    ) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.dispatch_workgroups_indirect(arguments, offset);
    }

    /// Records a dispatch of a kernel over depth.
    ///
    /// # Panics
    /// If it is none.
    pub fn dispatch_over(
        &self,
        device: &wgpu::Device,
        pass: &mut wgpu::ComputePass<'_>,
        depth: &wgpu::TextureView,
        grid: [u32; 2],
    ) {
        let layout = self.depth_layout.as_ref().expect("a kernel over depth");
        pass.set_bind_group(1, &gpu::depth_group(device, layout, depth), &[]);
        self.dispatch(pass, grid);
    }
}
