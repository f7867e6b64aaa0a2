//! The stages of a frame, by the paper's names.

/// A stage. Its [`name`](Stage::name) is the same in Rust, WGSL, pass labels and reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// A set of objects becomes a tight list of draw commands.
    Pack,
    /// The potential occluders are drawn; their depth is the occlusion map.
    OcclusionMap,
    /// The item buffer is reduced to the set of objects in it.
    FilterOccluders,
    /// The maximal BVH nodes of unknown visibility are found.
    ExtractGroups,
    /// Their bounds are rasterized and rays find the objects inside.
    BatchOcclusionTest,
    /// The potentially visible occludees are drawn.
    RenderOccludees,
    /// Everything is drawn (no culling).
    DrawAll,
    /// The blended objects that may show are drawn, after all others.
    RenderBlended,
}

impl Stage {
    /// Every stage, in the order of their first use in a frame.
    pub const ALL: [Self; 8] = [
        Self::Pack,
        Self::OcclusionMap,
        Self::FilterOccluders,
        Self::ExtractGroups,
        Self::BatchOcclusionTest,
        Self::RenderOccludees,
        Self::DrawAll,
        Self::RenderBlended,
    ];

    /// Name in labels and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pack => "pack",
            Self::OcclusionMap => "occlusion_map",
            Self::FilterOccluders => "filter_occluders",
            Self::ExtractGroups => "extract_groups",
            Self::BatchOcclusionTest => "batch_occlusion_test",
            Self::RenderOccludees => "render_occludees",
            Self::DrawAll => "draw_all",
            Self::RenderBlended => "render_blended",
        }
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
