//! Small pieces every pass is made of, for methods of your own: see the crate hroc-methods for how they serve.

use wgpu::BufferUsages as Usage;

/// A zeroed storage buffer of at least 64 bytes, clearable and readable.
pub fn storage(device: &wgpu::Device, label: &str, bytes: u64, extra: Usage) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.next_multiple_of(4).max(64),
        usage: Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST | extra,
        mapped_at_creation: false,
    })
}

/// A storage buffer that holds `words`.
pub fn storage_with(device: &wgpu::Device, label: &str, words: &[u32]) -> wgpu::Buffer {
    let bytes = bytemuck::cast_slice(words);
    let size = (bytes.len() as u64).max(64);
    let usage = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
    buffer_with(device, label, bytes, size, usage)
}

/// A uniform buffer that holds `contents`.
pub fn uniform(device: &wgpu::Device, label: &str, contents: &[u8]) -> wgpu::Buffer {
    let usage = Usage::UNIFORM | Usage::COPY_DST;
    buffer_with(device, label, contents, contents.len() as u64, usage)
}

/// A buffer of `size` bytes (a multiple of 4) that begins with `contents` and holds zeros beyond.
pub fn buffer_with(
    device: &wgpu::Device,
    label: &str,
    contents: &[u8],
    size: u64,
    usage: Usage,
) -> wgpu::Buffer {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: true,
    });
    buffer
        .slice(..)
        .get_mapped_range_mut()
        .expect("mapped at creation")
        .slice(..contents.len())
        .copy_from_slice(contents);
    buffer.unmap();
    buffer
}

/// The module `name` of hroc-shaders.
///
/// # Panics
/// If there is no such module.
pub fn shader(device: &wgpu::Device, name: &'static str) -> wgpu::ShaderModule {
    let wgsl = hroc_shaders::source(name).expect("the module is in hroc-shaders");
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    })
}

/// A boolean as a pipeline constant.
pub fn flag(value: bool) -> f64 {
    f64::from(u8::from(value))
}

/// How a stage sees a buffer.
#[derive(Clone, Copy, Debug)]
pub enum Access {
    /// A uniform.
    Uniform,
    /// Storage that is only read.
    Read,
    /// Storage that is also written.
    ReadWrite,
}

/// A bind group layout of buffers at bindings 0, 1, 2, ...
pub fn buffer_layout(
    device: &wgpu::Device,
    label: &str,
    visibility: wgpu::ShaderStages,
    access: &[Access],
) -> wgpu::BindGroupLayout {
    let bindings = (0..).zip(access.iter().copied()).collect::<Vec<_>>();
    sparse_buffer_layout(device, label, visibility, &bindings)
}

/// A bind group layout of buffers at some bindings: those that an entry point uses of its module.
pub fn sparse_buffer_layout(
    device: &wgpu::Device,
    label: &str,
    visibility: wgpu::ShaderStages,
    bindings: &[(u32, Access)],
) -> wgpu::BindGroupLayout {
    let entries = bindings
        .iter()
        .map(|&(binding, access)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: match access {
                // WebGPU lets no vertex stage write.
                Access::ReadWrite => visibility - wgpu::ShaderStages::VERTEX,
                _ => visibility,
            },
            ty: wgpu::BindingType::Buffer {
                ty: match access {
                    Access::Uniform => wgpu::BufferBindingType::Uniform,
                    Access::Read => wgpu::BufferBindingType::Storage { read_only: true },
                    Access::ReadWrite => wgpu::BufferBindingType::Storage { read_only: false },
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        })
        .collect::<Vec<_>>();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &entries,
    })
}

/// A bind group of whole buffers at bindings 0, 1, 2, ...
pub fn buffer_group(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let bindings = (0..).zip(buffers.iter().copied()).collect::<Vec<_>>();
    sparse_buffer_group(device, label, layout, &bindings)
}

/// A bind group of whole buffers at some bindings.
pub fn sparse_buffer_group(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    buffers: &[(u32, &wgpu::Buffer)],
) -> wgpu::BindGroup {
    let entries = buffers
        .iter()
        .map(|&(binding, buffer)| wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        })
        .collect::<Vec<_>>();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    })
}

/// A compute pipeline for `entry` of `module`.
pub fn compute(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    entry: &'static str,
    layouts: &[&wgpu::BindGroupLayout],
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let layouts = layouts
        .iter()
        .map(|layout| Some(*layout))
        .collect::<Vec<_>>();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(&layout),
        module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants,
            ..Default::default()
        },
        cache: None,
    })
}

/// Workgroups for `count` invocations of `width` each. A second dimension where one would pass the limit of
/// 65,535; the shaders compute `id.x + id.y * grid.x * width`.
pub fn grid(count: u32, width: u32) -> [u32; 2] {
    let groups = count.div_ceil(width);
    let rows = groups.div_ceil(65_535).max(1);
    [groups.div_ceil(rows), rows]
}

/// Records one dispatch.
pub fn dispatch(
    pass: &mut wgpu::ComputePass<'_>,
    pipeline: &wgpu::ComputePipeline,
    group: &wgpu::BindGroup,
    [x, y]: [u32; 2],
) {
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.dispatch_workgroups(x, y, 1);
}

/// Begins a compute pass.
pub fn compute_pass<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    label: &'static str,
) -> wgpu::ComputePass<'e> {
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(label),
        timestamp_writes: None,
    })
}

/// The layout of a group that holds a depth texture at binding 0.
pub fn depth_layout(
    device: &wgpu::Device,
    visibility: wgpu::ShaderStages,
) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("depth"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Depth,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        }],
    })
}

/// A group of that layout.
pub fn depth_group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    depth: &wgpu::TextureView,
) -> wgpu::BindGroup {
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("depth"),
        layout,
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::TextureView(depth),
        }],
    })
}
