//! The stages of a frame, by the paper's names.

/// A stage. Its [`name`](Stage::name) is the same in Rust, WGSL, pass labels and reports.
///
/// A method that has stages of its own names them by [`Stage::new`]; two of one name are one stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Stage(&'static str);

impl Stage {
    /// A set of objects becomes a tight list of draw commands.
    pub const PACK: Self = Self("pack");
    /// The potential occluders are drawn; their depth is the occlusion map.
    pub const OCCLUSION_MAP: Self = Self("occlusion_map");
    /// The item buffer is reduced to the set of objects in it.
    pub const FILTER_OCCLUDERS: Self = Self("filter_occluders");
    /// The maximal BVH nodes of unknown visibility are found.
    pub const EXTRACT_GROUPS: Self = Self("extract_groups");
    /// Their bounds are rasterized and rays find the objects inside.
    pub const BATCH_OCCLUSION_TEST: Self = Self("batch_occlusion_test");
    /// The potentially visible occludees are drawn.
    pub const RENDER_OCCLUDEES: Self = Self("render_occludees");
    /// All that a method without a second draw shows is drawn.
    pub const DRAW_ALL: Self = Self("draw_all");
    /// The blended objects that may show are drawn, after all others.
    pub const RENDER_BLENDED: Self = Self("render_blended");

    /// A stage of a method's own.
    pub const fn new(name: &'static str) -> Self {
        Self(name)
    }

    /// Name in labels and reports.
    pub const fn name(self) -> &'static str {
        self.0
    }
}

/// Told where each stage begins and ends, to time it. It may write timestamps into the encoder, or, if the
/// host lets it, finish and submit the encoder and put a fresh one in its place.
pub trait StageObserver {
    /// Before the first command of a stage.
    fn begin(&mut self, stage: Stage, encoder: &mut wgpu::CommandEncoder);
    /// After its last command.
    fn end(&mut self, stage: Stage, encoder: &mut wgpu::CommandEncoder);
}
