//! A frame's depth and item buffer on the host.

use hroc_format::NO_OBJECT;
use hroc_runtime::readback::TextureCopy;

use crate::id_set::IdSet;
use crate::targets::FrameTargets;

/// Depth and item buffer, rows from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Bits of the depth buffer's f32, one per pixel.
    pub depth_bits: Vec<u32>,
    /// The frontmost object's id per pixel, `NO_OBJECT` where there is none.
    pub items: Vec<u32>,
}

impl Image {
    /// The objects that show.
    pub fn visible(&self) -> IdSet {
        self.items
            .iter()
            .copied()
            .filter(|&id| id != NO_OBJECT)
            .collect()
    }
}

/// An image on its way to the host.
#[derive(Debug)]
pub struct ImageCopy {
    depth: TextureCopy,
    items: TextureCopy,
}

impl ImageCopy {
    /// Records the copies, so that the targets are caught as they are at this point of the frame.
    pub fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        targets: &FrameTargets,
    ) -> Self {
        Self {
            depth: TextureCopy::record(device, encoder, &targets.depth),
            items: TextureCopy::record(device, encoder, &targets.item_buffer),
        }
    }

    /// The image, once the encoder was submitted.
    pub fn wait(self, device: &wgpu::Device) -> Image {
        Image {
            depth_bits: bytemuck::pod_collect_to_vec(&self.depth.wait(device)),
            items: bytemuck::pod_collect_to_vec(&self.items.wait(device)),
        }
    }
}
