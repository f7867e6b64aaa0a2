//! What a frame is drawn into.

use hroc_runtime::Targets;

/// Colour, item buffer and depth of one size, each readable by the host.
#[derive(Debug)]
pub struct FrameTargets {
    /// `Rgba8UnormSrgb`.
    pub color: wgpu::Texture,
    /// Ids of the frontmost objects.
    pub item_buffer: wgpu::Texture,
    /// `Depth32Float`.
    pub depth: wgpu::Texture,
    /// View of `color`.
    pub color_view: wgpu::TextureView,
    item_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
}

impl FrameTargets {
    /// Format of the colour target.
    pub const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

    /// Targets of `size` pixels, which the caller has checked against the device's limit.
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        let texture = |label, format| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: size[0],
                    height: size[1],
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let color = texture("color", Self::COLOR_FORMAT);
        let item_buffer = texture("item_buffer", Targets::ITEM_FORMAT);
        let depth = texture("depth", Targets::DEPTH_FORMAT);
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        Self {
            color_view: view(&color),
            item_view: view(&item_buffer),
            depth_view: view(&depth),
            color,
            item_buffer,
            depth,
        }
    }

    /// As culling methods see them.
    pub fn targets(&self) -> Targets<'_> {
        Targets {
            depth: &self.depth_view,
            item_buffer: &self.item_view,
            size: [self.color.width(), self.color.height()],
        }
    }
}
