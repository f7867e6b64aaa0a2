//! How finely the rasterizer places vertices.
//!
//! A row of squares is drawn, one per pixel, whose far edge lies by a known fraction of a pixel before or
//! beyond the pixel's centre. In exact arithmetic the centre is covered where the edge lies beyond it; the
//! largest fraction at which that goes wrong tells how far the edge was moved. Once for each axis.

use crate::gpu;
use crate::readback;

/// The coarsest subpixel grid that Vulkan, Direct3D 12 and Metal allow, pixels.
pub const COARSEST_SUBPIXEL_STEP_PX: f64 = 1.0 / 16.0;
/// Assumed of a rasterizer that seems finer: f32 window coordinates are not.
const FINEST_SUBPIXEL_STEP_PX: f64 = 1.0 / 1024.0;

/// Squares, and pixels along the row.
const SQUARES: u32 = 1024;
/// Resolution of the edges' places. The squares span a whole coarsest step on either side of the centre.
const EDGE_STEP_PX: f64 = 2.0 * COARSEST_SUBPIXEL_STEP_PX / SQUARES as f64;

const WGSL: &str = "
override ALONG_Y: bool = false;
@vertex fn square(@builtin(vertex_index) vertex: u32, @builtin(instance_index) i: u32) -> @builtin(position) vec4f {
    let far = vec2<bool>((vertex & 1u) != 0u, (vertex & 2u) != 0u);
    let edge = f32(i) + 0.5 + (f32(i) - 511.5) / 8192.0;
    let along = select(f32(i), edge, select(far.x, far.y, ALONG_Y));
    let across = select(-1.0, 2.0, select(far.y, far.x, ALONG_Y));
    let px = select(vec2f(along, across), vec2f(across, along), ALONG_Y);
    let size = select(vec2f(1024.0, 1.0), vec2f(1.0, 1024.0), ALONG_Y);
    return vec4f(px.x / size.x * 2.0 - 1.0, 1.0 - px.y / size.y * 2.0, 0.5, 1.0);
}
@fragment fn covered() -> @location(0) u32 { return 1u; }";

/// The device's subpixel step, pixels: a power of two, between the finest believed and the coarsest
/// allowed. At least twice the largest displacement that was seen.
pub(super) fn subpixel_step_px(device: &wgpu::Device, queue: &wgpu::Queue) -> f64 {
    let seen = [false, true].map(|along_y| displacement_px(device, queue, along_y));
    let [Some(x), Some(y)] = seen else {
        return COARSEST_SUBPIXEL_STEP_PX;
    };
    let step = (2.0 * x.max(y)).log2().ceil().exp2();
    step.clamp(FINEST_SUBPIXEL_STEP_PX, COARSEST_SUBPIXEL_STEP_PX)
}

/// By how much edges are moved, pixels; `None` if that cannot be told.
fn displacement_px(device: &wgpu::Device, queue: &wgpu::Queue, along_y: bool) -> Option<f64> {
    let covered = row(device, queue, along_y);
    // Edges are moved by less than half of what the row spans, or nothing can be said.
    if covered[0] || !covered[SQUARES as usize - 1] {
        return None;
    }
    let wrong = covered.iter().enumerate().filter_map(|(i, &covered)| {
        let beyond_px = (i as f64 - 511.5) * EDGE_STEP_PX;
        (covered != (beyond_px > 0.0)).then_some(beyond_px.abs())
    });
    // The edge that goes wrong first lies within half a step of the last one seen to.
    Some(wrong.fold(0.0, f64::max) + 0.5 * EDGE_STEP_PX)
}

/// Whether each square covers the centre of its pixel.
fn row(device: &wgpu::Device, queue: &wgpu::Queue, along_y: bool) -> Vec<bool> {
    let [width, height] = if along_y { [1, SQUARES] } else { [SQUARES, 1] };
    let format = wgpu::TextureFormat::R32Uint;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("subpixel step"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("subpixel step"),
        source: wgpu::ShaderSource::Wgsl(WGSL.into()),
    });
    let constants = [("ALONG_Y", gpu::flag(along_y))];
    let options = wgpu::PipelineCompilationOptions {
        constants: &constants,
        ..Default::default()
    };
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("subpixel step"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("square"),
            compilation_options: options,
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("covered"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("subpixel step"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    // One draw per square would be slow, and one for all lets a square that reaches into its neighbour's
    // pixel hide what that one does: they reach at most 1/16 px beyond the centre of their own.
    pass.draw(0..4, 0..SQUARES);
    drop(pass);
    queue.submit([encoder.finish()]);
    let texels = readback::texture(device, queue, &texture);
    bytemuck::pod_collect_to_vec::<u8, u32>(&texels)
        .into_iter()
        .map(|texel| texel != 0)
        .collect()
}
