//! The seam between a culling method and the host's own rendering.

use crate::camera::DepthConvention;
use crate::stage::Stage;

/// How draw lists are submitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Submission {
    /// One multi-draw whose count the GPU reads from a buffer.
    IndirectCount,
    /// One multi-draw over the whole capacity, with the commands past the count zeroed.
    ZeroedTail,
    /// One indirect draw per command of the whole capacity, with the commands past the count zeroed.
    DrawLoop,
}

impl Submission {
    /// Every path, the best first.
    pub const ALL: [Self; 3] = [Self::IndirectCount, Self::ZeroedTail, Self::DrawLoop];

    /// The best that a device with `features` offers. Multi-draws are there on every device: where the API
    /// has none, wgpu records the loop itself.
    pub fn of(features: wgpu::Features) -> Self {
        if features.contains(wgpu::Features::MULTI_DRAW_INDIRECT_COUNT) {
            Self::IndirectCount
        } else {
            Self::ZeroedTail
        }
    }

    /// `indirect-count`, `zeroed-tail` or `draw-loop`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::IndirectCount => "indirect-count",
            Self::ZeroedTail => "zeroed-tail",
            Self::DrawLoop => "draw-loop",
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
    /// One u32: how many commands there are, from the first of the buffer.
    pub count: &'a wgpu::Buffer,
    /// Which commands to submit.
    pub range: DrawRange,
    /// How to submit them.
    pub submission: Submission,
}

/// What the host knows of a list's length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawRange {
    /// No more commands than this; only the GPU knows how many.
    AtMost(u32),
    /// Exactly these commands, numbered from 0; every one draws something.
    Exactly {
        /// The first one.
        first: u32,
        /// One past the last one.
        end: u32,
    },
}

const COMMAND_BYTES: u64 = size_of::<wgpu::util::DrawIndexedIndirectArgs>() as u64;

impl DrawList<'_> {
    /// Records the draws; pipeline, bind groups, vertex and index buffers are already set.
    pub fn record(&self, pass: &mut wgpu::RenderPass<'_>) {
        let (first, end) = match self.range {
            DrawRange::AtMost(end) => (0, end),
            DrawRange::Exactly { first, end } => (first, end),
        };
        let offset = |command: u32| u64::from(command) * COMMAND_BYTES;
        if first >= end {
            return;
        }
        match (self.submission, self.range) {
            (Submission::IndirectCount, DrawRange::AtMost(max)) => {
                pass.multi_draw_indexed_indirect_count(self.commands, 0, self.count, 0, max);
            }
            (Submission::DrawLoop, _) => {
                for command in first..end {
                    pass.draw_indexed_indirect(self.commands, offset(command));
                }
            }
            _ => pass.multi_draw_indexed_indirect(self.commands, offset(first), end - first),
        }
    }
}

/// Where a pass marks what passes the depth test as it is drawn (mark.wgsl).
#[derive(Clone, Debug)]
pub struct Marks {
    /// The bind group of `@group(3)` of mark.wgsl.
    pub group: wgpu::BindGroup,
}

impl Marks {
    /// The index of the bind group.
    pub const GROUP: u32 = 3;

    /// The layout of the bind group.
    pub fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
        use crate::gpu::Access::ReadWrite;
        let stage = wgpu::ShaderStages::FRAGMENT;
        crate::gpu::buffer_layout(device, "marks", stage, &[ReadWrite, ReadWrite])
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
    /// Where to mark objects, in modes that ask for it; then the pass draws with a pipeline that includes
    /// mark.wgsl. A host that cannot do so and ignores it gets the right image, and no occluders.
    pub marks: Option<&'a Marks>,
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
/// arithmetic. The tolerance of depth comparisons is derived for the whole depth range, 0 to 1 (that of the viewport),
/// no depth bias, and primitives that are clipped (`unclipped_depth: false`); with anything else methods may hide what
/// shows. No fragment shader forces the early depth test, as it discards: see mark.wgsl. Objects that an
/// alpha test cuts holes into are in the same lists and discard likewise.
///
/// [`Stage::RENDER_BLENDED`] is different: its objects are blended over the rest, with the same comparison of
/// depth, but write neither depth nor item buffer.
pub trait Drawer {
    /// Records a pass that draws `draw.list`. Called even if the list may turn out empty on the GPU, since
    /// the clear must happen.
    fn draw(&mut self, encoder: &mut wgpu::CommandEncoder, draw: &Draw<'_>);
}
