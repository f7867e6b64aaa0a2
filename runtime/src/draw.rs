//! The seam between a culling method and the host's own rendering.

use crate::camera::DepthConvention;
use crate::stage::Stage;

/// How draw lists are submitted, the best the device can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Submission {
    /// One multi-draw whose count the GPU reads from a buffer.
    IndirectCount,
    /// One multi-draw over the whole capacity, with the commands past the count zeroed.
    ZeroedTail,
}

impl Submission {
    /// The best that a device with `features` offers.
    pub fn of(features: wgpu::Features) -> Self {
        if features.contains(wgpu::Features::MULTI_DRAW_INDIRECT_COUNT) {
            Self::IndirectCount
        } else {
            Self::ZeroedTail
        }
    }

    /// `indirect-count` or `zeroed-tail`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::IndirectCount => "indirect-count",
            Self::ZeroedTail => "zeroed-tail",
        }
    }
}

/// The render targets that culling reads. The host owns them; both are of the same size.
///
/// `depth`: `Depth32Float`, usages `RENDER_ATTACHMENT | TEXTURE_BINDING`. `item_buffer`: `R32Uint`, the same
/// usages; the host's fragment shader writes the object's id (the draw's instance index) to it.
#[derive(Clone, Copy, Debug)]
pub struct Targets<'a> {
    /// Depth attachment of every pass; the occlusion map is what it holds after the first one.
    pub depth: &'a wgpu::TextureView,
    /// The frontmost object's id per pixel, `0xFFFFFFFF` where there is none.
    pub item_buffer: &'a wgpu::TextureView,
    /// In pixels.
    pub size: [u32; 2],
}

impl Targets<'_> {
    /// Format of the depth target.
    pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
    /// Format of the item buffer.
    pub const ITEM_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
}

/// Indirect draw commands on the GPU; `first_instance` of each is the object's id.
#[derive(Clone, Copy, Debug)]
pub struct DrawList<'a> {
    /// `DrawIndexedIndirectArgs`, 20 bytes each, in object order.
    pub commands: &'a wgpu::Buffer,
    /// One u32: how many commands there are.
    pub count: &'a wgpu::Buffer,
    /// No more commands than this.
    pub max_count: u32,
    /// How to submit them.
    pub submission: Submission,
}

impl DrawList<'_> {
    /// Records the draws; pipeline, bind groups, vertex and index buffers are already set.
    pub fn record(&self, pass: &mut wgpu::RenderPass<'_>) {
        if self.max_count == 0 {
            return;
        }
        match self.submission {
            Submission::IndirectCount => {
                pass.multi_draw_indexed_indirect_count(
                    self.commands,
                    0,
                    self.count,
                    0,
                    self.max_count,
                );
            }
            Submission::ZeroedTail => {
                pass.multi_draw_indexed_indirect(self.commands, 0, self.max_count)
            }
        }
    }
}

/// One pass over a list of objects that the host must record.
#[derive(Clone, Copy, Debug)]
pub struct Draw<'a> {
    /// Which stage asks; also the label to give the pass.
    pub stage: Stage,
    /// The first pass of a frame: clear colour, depth and item buffer. Later ones load all three.
    pub clear: bool,
    /// What to draw.
    pub list: DrawList<'a>,
    /// Where to: attach both, beside the host's own colour targets.
    pub targets: Targets<'a>,
    /// Clear value and comparison of the depth attachment.
    pub depth: DepthConvention,
}

impl<'a> Draw<'a> {
    /// The depth attachment of the host's pass.
    pub fn depth_attachment(&self) -> wgpu::RenderPassDepthStencilAttachment<'a> {
        let load = if self.clear {
            wgpu::LoadOp::Clear(self.depth.clear_value())
        } else {
            wgpu::LoadOp::Load
        };
        wgpu::RenderPassDepthStencilAttachment {
            view: self.targets.depth,
            depth_ops: Some(wgpu::Operations {
                load,
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }
    }

    /// The item buffer as a colour attachment of the host's pass.
    pub fn item_attachment(&self) -> wgpu::RenderPassColorAttachment<'a> {
        // A clear colour is f64 and holds every u32 exactly.
        let background = wgpu::Color {
            r: f64::from(hroc_format::NO_OBJECT),
            ..wgpu::Color::TRANSPARENT
        };
        let load = if self.clear {
            wgpu::LoadOp::Clear(background)
        } else {
            wgpu::LoadOp::Load
        };
        wgpu::RenderPassColorAttachment {
            view: self.targets.item_buffer,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load,
                store: wgpu::StoreOp::Store,
            },
        }
    }
}

/// The host's rendering: it records one pass per call, with its own pipelines and materials.
///
/// The shaders include `object.wgsl` of hroc-shaders: the vertex shader transforms by its functions, the
/// fragment shader discards what `hroc_keeps` refuses and writes the object's id to the item buffer. Depth
/// is compared by [`DepthConvention::nearer`] and written. Every pass of a frame uses the same pipeline
/// arithmetic.
pub trait Drawer {
    /// Records a pass that draws `draw.list`. Called even if the list may turn out empty on the GPU, since
    /// the clear must happen.
    fn draw(&mut self, encoder: &mut wgpu::CommandEncoder, draw: &Draw<'_>);
}
