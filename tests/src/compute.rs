//! Shaders as functions from buffers to buffers.

use hroc_study::gpu::Gpu;

/// A buffer that shaders read or write, and that can be read back.
pub fn buffer(gpu: &Gpu, bytes: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: bytes.len() as u64,
        usage: usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// A storage buffer.
pub fn storage<T: bytemuck::NoUninit>(gpu: &Gpu, contents: &[T]) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::STORAGE;
    buffer(gpu, bytemuck::cast_slice(contents), usage)
}

/// A uniform buffer.
pub fn uniform<T: bytemuck::NoUninit>(gpu: &Gpu, contents: &T) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::UNIFORM;
    buffer(gpu, bytemuck::bytes_of(contents), usage)
}

/// An entry point with the layout that it implies.
#[derive(Debug)]
pub struct Kernel(wgpu::ComputePipeline);

impl Kernel {
    /// Compiles `entry` of `wgsl`, imports resolved.
    pub fn new(gpu: &Gpu, wgsl: &str, entry: &str, constants: &[(&str, f64)]) -> Self {
        let module = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(entry),
                source: wgpu::ShaderSource::Wgsl(wgsl.into()),
            });
        let descriptor = wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout: None,
            module: &module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                ..Default::default()
            },
            cache: None,
        };
        Self(gpu.device.create_compute_pipeline(&descriptor))
    }

    /// Runs it on what is bound to group 0, group 1 and so on.
    pub fn run(&self, gpu: &Gpu, groups: &[&[(u32, wgpu::BindingResource<'_>)]], [x, y]: [u32; 2]) {
        let mut encoder = gpu.encoder();
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&self.0);
        for (bound, index) in groups.iter().zip(0..) {
            let entries = bound
                .iter()
                .map(|(binding, resource)| wgpu::BindGroupEntry {
                    binding: *binding,
                    resource: resource.clone(),
                })
                .collect::<Vec<_>>();
            let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &self.0.get_bind_group_layout(index),
                entries: &entries,
            });
            pass.set_bind_group(index, &group, &[]);
        }
        pass.dispatch_workgroups(x, y, 1);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    }

    /// Runs it on whole buffers, all in group 0.
    pub fn run_on(&self, gpu: &Gpu, buffers: &[(u32, &wgpu::Buffer)], workgroups: u32) {
        let bound = buffers
            .iter()
            .map(|(binding, buffer)| (*binding, buffer.as_entire_binding()))
            .collect::<Vec<_>>();
        self.run(gpu, &[&bound], [workgroups, 1]);
    }
}
