//! What every culling method is to its host.

use crate::camera::{Camera, CameraError, DepthConvention};
use crate::draw::{Drawer, Targets};
use crate::scene::Scene;
use crate::stage::{Stage, StageObserver};

/// One frame of one view, as the host hands it to a method.
pub struct FrameContext<'a> {
    /// The host's device.
    pub device: &'a wgpu::Device,
    /// The host's queue. Methods write uniforms through it, which take effect at the next submit; those that
    /// sync with their host ([`HostSync::MidFrame`]) submit to it.
    pub queue: &'a wgpu::Queue,
    /// The host's encoder. Do not record two frames of the same view into one submit. Methods that sync with
    /// their host within the frame submit it, with what the host has recorded, and leave a fresh one.
    pub encoder: &'a mut wgpu::CommandEncoder,
    /// What is drawn, as it is in this frame.
    pub scene: &'a Scene,
    /// Where the frame is seen from.
    pub camera: &'a Camera,
    /// Depth target and item buffer.
    pub targets: Targets<'a>,
    /// Told about stages; `None` where nobody measures.
    pub observer: Option<&'a mut dyn StageObserver>,
}

impl FrameContext<'_> {
    /// Records `stage` through `record`, between the observer's calls.
    pub fn stage(&mut self, stage: Stage, record: impl FnOnce(&mut wgpu::CommandEncoder)) {
        if let Some(observer) = self.observer.as_deref_mut() {
            observer.begin(stage, self.encoder);
        }
        record(self.encoder);
        if let Some(observer) = self.observer.as_deref_mut() {
            observer.end(stage, self.encoder);
        }
    }

    /// Submits what was recorded so far.
    pub fn submit(&mut self) -> wgpu::SubmissionIndex {
        let fresh = self.device.create_command_encoder(&Default::default());
        let recorded = std::mem::replace(self.encoder, fresh);
        self.queue.submit([recorded.finish()])
    }
}

/// Whether a method needs its host to wait for the GPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostSync {
    /// Never reads back.
    Never,
    /// Reads results of an earlier frame without waiting for this one.
    NextFrame,
    /// Submits and waits within the frame.
    MidFrame,
}

/// The sets of a frame, in GPU buffers: one bit per object, 32 to a word. Valid after the frame was
/// submitted, until the next one is. `None`: the method has no such set.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sets<'a> {
    /// V: drawn first, as they were visible in the last frame.
    pub potential_occluders: Option<&'a wgpu::Buffer>,
    /// O: members of V that show in the occlusion map.
    pub effective_occluders: Option<&'a wgpu::Buffer>,
    /// U: opaque objects that the test could not rule out; disjoint from V.
    pub potentially_visible: Option<&'a wgpu::Buffer>,
    /// Blended objects that the test could not rule out.
    pub blended: Option<&'a wgpu::Buffer>,
    /// What the item buffer holds at the end of the frame, or what was marked in it; V of the next.
    pub visible: Option<&'a wgpu::Buffer>,
    /// The indirect arguments of the groups' boxes; the second u32 is the number of groups |G|.
    pub group_draw: Option<&'a wgpu::Buffer>,
    /// The groups' node indices; an object that moves stands as its id, less the ids in the tree, plus the nodes.
    pub groups: Option<&'a wgpu::Buffer>,
    /// `WorkCounters` of batch_occlusion_test.wgsl: rays, ray-box tests, fragments. Only of an
    /// instrumented method.
    pub work: Option<&'a wgpu::Buffer>,
    /// `Grouping` of common/grouping.wgsl; the first word is the f32 threshold of the frame's groups.
    pub grouping: Option<&'a wgpu::Buffer>,
    /// The lengths of the draw lists of V and U, one u32 each.
    pub draw_counts: [Option<&'a wgpu::Buffer>; 2],
}

/// Occlusion queries of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueryCounts {
    /// Queries issued.
    pub queries: u32,
    /// Of them, those that found visible what waited to be found hidden: they spared nothing.
    pub wasted: u32,
    /// Times that the host waited for answers.
    pub waits: u32,
    /// Boxes rasterized.
    pub boxes: u32,
}

/// A culling method with the history of one view. Make one per view.
pub trait CullingMethod {
    /// Name on the command line and in reports.
    fn name(&self) -> &'static str;

    /// Whether `encode` waits for the GPU.
    fn host_sync(&self) -> HostSync;

    /// Records a frame: the method's own passes into the context's encoder, the geometry through `drawer`.
    ///
    /// # Errors
    /// If the camera or the target size is degenerate; nothing was recorded then.
    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError>;

    /// The sets of the last frame.
    fn sets(&self) -> Sets<'_>;

    /// Of an approximate method that limits its draws: no more than this many objects of V and of U were drawn
    /// in the last frame, the first ones by id. What exceeds a limit was dropped.
    fn draw_limits(&self) -> Option<[u32; 2]> {
        None
    }

    /// Of a method that asks occlusion queries: those of the last frame.
    fn queries(&self) -> Option<QueryCounts> {
        None
    }

    /// Of a method that chooses among several: the name of the one that drew the last frame.
    fn choice(&self) -> Option<&'static str> {
        None
    }

    /// For a method that goes by it: the device took `ms` milliseconds for a frame. `frame` counts the calls of
    /// [`encode`](Self::encode) that succeeded, from 0. Frames may be told late, or not at all.
    fn took(&mut self, _frame: u64, _ms: f64) {}

    /// The depth convention the method was made for.
    fn depth(&self) -> DepthConvention;

    /// Forgets the view's history, as after a camera cut. Never needed for a right image.
    fn reset(&mut self, encoder: &mut wgpu::CommandEncoder);

    /// GPU memory of the method beyond scene and tree, bytes.
    fn memory_bytes(&self) -> u64;
}
