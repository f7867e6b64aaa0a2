//! Marking what passes the depth test as it is drawn (mark.wgsl).

use crate::draw::Marks;
use crate::gpu;

/// The buffers behind [`Marks`], for one view.
#[derive(Debug)]
pub(crate) struct MarkBuffers {
    layout: wgpu::BindGroupLayout,
    marked: wgpu::Buffer,
    size: [u32; 2],
    nearest: wgpu::Buffer,
    marks: Marks,
}

impl MarkBuffers {
    /// Marks go to `marked`, one bit per object.
    pub fn new(device: &wgpu::Device, marked: &wgpu::Buffer) -> Self {
        let layout = Marks::layout(device);
        let size = [0; 2];
        let (nearest, marks) = sized(device, &layout, marked, size);
        Self {
            layout,
            marked: marked.clone(),
            size,
            nearest,
            marks,
        }
    }

    /// Begins a frame of `size` pixels: nothing is marked, nothing was drawn.
    pub fn begin(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        size: [u32; 2],
    ) {
        if self.size != size {
            (self.nearest, self.marks) = sized(device, &self.layout, &self.marked, size);
            self.size = size;
        }
        encoder.clear_buffer(&self.nearest, 0, None);
        encoder.clear_buffer(&self.marked, 0, None);
    }

    pub fn marks(&self) -> &Marks {
        &self.marks
    }

    pub fn memory_bytes(&self) -> u64 {
        self.nearest.size()
    }
}

fn sized(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    marked: &wgpu::Buffer,
    [width, height]: [u32; 2],
) -> (wgpu::Buffer, Marks) {
    let bytes = 4 * u64::from(width) * u64::from(height);
    let nearest = gpu::storage(device, "nearest", bytes, wgpu::BufferUsages::empty());
    let group = gpu::buffer_group(device, "marks", layout, &[&nearest, marked]);
    (nearest, Marks { group })
}
