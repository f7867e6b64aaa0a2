//! Hierarchical raster occlusion culling (Lee, Kwon, Lee, 2021), with packing.
//!
//! A frame: `pack` last frame's visible objects V and draw them (`occlusion_map`); reduce the item buffer to
//! those of them that still show, O (`filter_occluders`); find the maximal BVH nodes without a member of O,
//! G (`extract_groups`); rasterize their bounds and cast a ray per surviving pixel to find the objects U
//! that may show (`batch_occlusion_test`); draw them (`pack`, `render_occludees`); reduce the item buffer to
//! the next frame's V (`filter_occluders`); draw the blended objects that may show (`render_blended`).
//! [`HrocMode`] has the variants.
//!
//! Departures from the paper, all in favour of the exact image: groups come from the order-free form of its
//! Algorithm 1; nodes that touch the near plane are replaced by their children and such leaves are drawn
//! untested; rays end at the occlusion map; the first frame starts from an empty V, so it draws what lies
//! in the frustum instead of everything. With occluder filtering O is read from the item buffer and not by early-Z
//! marks, which makes it the members of V that show, not those that showed when they were drawn. Marks,
//! where they are used, come from a depth test repeated in the shader (mark.wgsl). Visited subtrees are
//! told by flags of their own that are set only when all below is flagged.

use crate::batch_occlusion_test::{BatchOcclusionTest, TestBuffers, TestOptions};
use crate::camera::{CameraError, DepthConvention};
use crate::counters::{Counters, CountersCopy};
use crate::draw::{Draw, DrawRange, Drawer};
use crate::extract_groups::{ExtractBuffers, ExtractGroups, Grouping};
use crate::filter_occluders::FilterOccluders;
use crate::frame_uniform::FrameUniform;
use crate::gpu;
use crate::mark::MarkBuffers;
use crate::method::{CullingMethod, FrameContext, HostSync, Sets};
use crate::mutant::Mutant;
use crate::pack::PackedList;
use crate::scene::{Scene, Tree, bytes_of};
use crate::stage::Stage;

/// The variants of the paper's section 4, and two of its suggestion to read counters late.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum HrocMode {
    /// No acceleration: V holds what passed the depth test when it was drawn; lists are submitted at their
    /// capacity.
    Na,
    /// Counter read-back: the host waits for the lengths of V's and U's lists, and submits no more.
    Cr,
    /// Occluder filtering: V holds what the item buffer shows. Nothing is read back.
    #[default]
    Of,
    /// Both.
    CrOf,
    /// Occluder filtering, and the lengths of the last lists that have arrived, with a margin, as limits. Never
    /// waits; drops what exceeds the limits, so the image may be wrong.
    CrLate,
    /// The same, but checks the limits while the GPU draws and makes up for what exceeded them.
    CrLateExact,
}

/// How a mode limits its draws.
#[derive(Clone, Copy, PartialEq)]
enum Limits {
    Capacity,
    ReadBack,
    Late,
    LateChecked,
}

impl HrocMode {
    /// Every mode.
    pub const ALL: [Self; 6] = [
        Self::Na,
        Self::Cr,
        Self::Of,
        Self::CrOf,
        Self::CrLate,
        Self::CrLateExact,
    ];

    /// Name on the command line and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Na => "na",
            Self::Cr => "cr",
            Self::Of => "of",
            Self::CrOf => "cr-of",
            Self::CrLate => "cr-late",
            Self::CrLateExact => "cr-late-exact",
        }
    }

    /// Whether the host waits.
    pub const fn host_sync(self) -> HostSync {
        match self {
            Self::Na | Self::Of => HostSync::Never,
            Self::CrLate => HostSync::NextFrame,
            Self::Cr | Self::CrOf | Self::CrLateExact => HostSync::MidFrame,
        }
    }

    /// Whether the image is always that of drawing everything.
    pub const fn is_exact(self) -> bool {
        !matches!(self, Self::CrLate)
    }

    const fn filters_occluders(self) -> bool {
        !matches!(self, Self::Na | Self::Cr)
    }

    const fn limits(self) -> Limits {
        match self {
            Self::Na | Self::Of => Limits::Capacity,
            Self::Cr | Self::CrOf => Limits::ReadBack,
            Self::CrLate => Limits::Late,
            Self::CrLateExact => Limits::LateChecked,
        }
    }
}

/// What an [`Hroc`] is made with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HrocOptions {
    /// Which variant.
    pub mode: HrocMode,
    /// How the host's depth target is used.
    pub depth: DepthConvention,
    /// How coarse the occludee groups are.
    pub grouping: Grouping,
    /// Modes with late counters: the limit is the last count that has arrived, and this share of it more, but at
    /// least [`SMALLEST_LATE_MARGIN`] objects.
    pub late_margin: f32,
    /// Rays skip subtrees all of whose objects are flagged. Makes counts of ray-box tests depend on timing.
    pub prune: bool,
    /// Counts rays and ray-box tests (see [`Sets::work`]). Costs time; for measuring work, not speed.
    pub count_work: bool,
}

/// See [`HrocOptions::late_margin`].
pub const SMALLEST_LATE_MARGIN: u32 = 16;

impl Default for HrocOptions {
    fn default() -> Self {
        Self {
            mode: HrocMode::default(),
            depth: DepthConvention::default(),
            grouping: Grouping::default(),
            late_margin: 0.25,
            prune: true,
            count_work: false,
        }
    }
}

/// HROC for one view.
#[derive(Debug)]
pub struct Hroc {
    options: HrocOptions,
    mutant: Mutant,
    frame: wgpu::Buffer,
    effective_occluders: wgpu::Buffer,
    potentially_visible: wgpu::Buffer,
    visible: wgpu::Buffer,
    visible_nodes: wgpu::Buffer,
    flagged_nodes: wgpu::Buffer,
    groups: wgpu::Buffer,
    group_draw: wgpu::Buffer,
    work: wgpu::Buffer,
    grouping: wgpu::Buffer,
    occluder_list: PackedList,
    occludee_list: PackedList,
    blended_list: PackedList,
    marks: Option<MarkBuffers>,
    counters: Option<Counters<2>>,
    /// Of the last frame, in the mode that drops what exceeds them.
    draw_limits: Option<[u32; 2]>,
    filter: FilterOccluders,
    extract: ExtractGroups,
    test: BatchOcclusionTest,
}

impl Hroc {
    /// HROC over `scene` with the hierarchy `tree`, both on `device`.
    pub fn new(device: &wgpu::Device, scene: &Scene, tree: &Tree, options: HrocOptions) -> Self {
        let shape = scene.shape.clone();
        let none = wgpu::BufferUsages::empty();
        let words = |label, words: u32| gpu::storage(device, label, u64::from(words) * 4, none);
        let set = |label| words(label, shape.object_words());
        let node_set = |label| words(label, shape.node_count().div_ceil(32));
        let frame = gpu::uniform(device, "frame", &[0; size_of::<FrameUniform>()]);
        let effective_occluders = set("effective_occluders");
        let potentially_visible = set("potentially_visible");
        let visible = set("visible");
        let visible_nodes = node_set("visible_nodes");
        let flagged_nodes = node_set("flagged_nodes");
        // Groups are disjoint subtrees and objects that move: no more than there are objects.
        let groups = words("occludee_groups", shape.object_count);
        let group_draw = gpu::storage(device, "group_draw", 16, wgpu::BufferUsages::INDIRECT);
        let work = gpu::storage(device, "work", 16, none);
        let grouping = gpu::storage(device, "grouping", 16, none);

        let mutant = scene.profile.mutant;
        let pipelines = &scene.profile.pipelines;
        let list = |members, class| PackedList::new(device, scene, members, class);
        let occluder_list = list(&visible, &scene.opaque);
        let extract_buffers = ExtractBuffers {
            frame: &frame,
            tree,
            potential_occluders: occluder_list.packed(),
            effective_occluders: &effective_occluders,
            visible_nodes: &visible_nodes,
            potentially_visible: &potentially_visible,
            groups: &groups,
            group_draw: &group_draw,
            grouping: &grouping,
            object_bounds: &scene.object_bounds,
        };
        let test_buffers = TestBuffers {
            frame: &frame,
            tree,
            groups: &groups,
            potential_occluders: occluder_list.packed(),
            potentially_visible: &potentially_visible,
            work: &work,
            grouping: &grouping,
            flagged_nodes: &flagged_nodes,
            object_bounds: &scene.object_bounds,
        };
        let test_options = TestOptions {
            depth: options.depth,
            prune: options.prune,
            count_work: options.count_work,
        };
        let marks = (!options.mode.filters_occluders()).then(|| MarkBuffers::new(device, &visible));
        let counters = (options.mode.limits() != Limits::Capacity).then(|| Counters::new(device));
        Self {
            filter: FilterOccluders::new(device, scene),
            extract: ExtractGroups::new(
                device,
                pipelines,
                options.depth,
                options.grouping,
                mutant,
                shape,
                &extract_buffers,
            ),
            test: BatchOcclusionTest::new(device, &scene.profile, test_options, &test_buffers),
            occludee_list: list(&potentially_visible, &scene.opaque),
            blended_list: list(&potentially_visible, &scene.blended),
            occluder_list,
            options,
            mutant,
            frame,
            effective_occluders,
            potentially_visible,
            visible,
            visible_nodes,
            flagged_nodes,
            groups,
            group_draw,
            work,
            grouping,
            marks,
            counters,
            draw_limits: None,
        }
    }

    /// A limit from late counters: the last count with its margin.
    fn late_limit(&self, count: u32) -> u32 {
        let margin = (count as f32 * self.options.late_margin).ceil() as u32;
        count
            .saturating_add(margin.max(SMALLEST_LATE_MARGIN))
            .min(self.occluder_list.capacity())
    }

    /// How many commands of V's and of U's list the frame may submit, as far as is known before it begins.
    fn draw_limits_now(&mut self, device: &wgpu::Device) -> [u32; 2] {
        let late = self.counters.as_mut().and_then(|counters| {
            counters.map_submitted();
            counters.latest(device)
        });
        let late = late.map(|counts| counts.map(|count| self.late_limit(count)));
        let capacity = [self.occluder_list.capacity(); 2];
        match self.options.mode.limits() {
            Limits::Capacity | Limits::ReadBack => capacity,
            Limits::Late | Limits::LateChecked => late.unwrap_or(capacity),
        }
    }

    /// What to submit of V's or U's list, which was just packed: all that it holds, in modes that wait to read how much
    /// that is, else no more than `limit`.
    fn range(&mut self, frame: &mut FrameContext<'_>, which: usize, limit: u32) -> DrawRange {
        if self.options.mode.limits() != Limits::ReadBack {
            return DrawRange::AtMost(limit);
        }
        let counts = [&self.occluder_list, &self.occludee_list].map(|list| (list.count(), 0));
        let counters = self.counters.as_mut().expect("the mode reads back");
        let copied = counters.record(frame.encoder, counts);
        let submitted = frame.submit();
        let read = copied.and_then(|copy| counters.wait(frame.device, copy, submitted));
        read.map_or(DrawRange::AtMost(limit), |counts| DrawRange::Exactly {
            first: 0,
            end: counts[which].min(limit),
        })
    }

    /// One pass of the host's.
    fn draw(
        &self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
        stage: Stage,
        list: &PackedList,
        range: DrawRange,
    ) {
        let marks = self.marks.as_ref();
        let draw = Draw {
            stage,
            clear: stage == Stage::OCCLUSION_MAP,
            list: list.range(range),
            targets: frame.targets,
            depth: self.options.depth,
            // What is blended never occludes.
            marks: marks
                .filter(|_| stage != Stage::RENDER_BLENDED)
                .map(MarkBuffers::marks),
        };
        frame.stage(stage, |encoder| drawer.draw(encoder, &draw));
    }

    /// Draws V.
    fn draw_occluders(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
        limit: u32,
    ) {
        frame.stage(Stage::PACK, |encoder| self.occluder_list.record(encoder));
        let range = self.range(frame, 0, limit);
        if let Some(marks) = &mut self.marks {
            marks.begin(frame.device, frame.encoder, frame.targets.size);
        }
        let (stage, list) = (Stage::OCCLUSION_MAP, &self.occluder_list);
        self.draw(frame, drawer, stage, list, range);
    }

    /// From what was drawn to U and what is blended.
    fn find_occludees(&self, frame: &mut FrameContext<'_>) {
        let (device, targets) = (frame.device, frame.targets);
        frame.stage(Stage::FILTER_OCCLUDERS, |encoder| {
            if self.marks.is_some() {
                let size = self.visible.size();
                encoder.copy_buffer_to_buffer(&self.visible, 0, &self.effective_occluders, 0, size);
            } else {
                self.filter
                    .record(device, encoder, &targets, &self.effective_occluders);
            }
        });
        frame.stage(Stage::EXTRACT_GROUPS, |encoder| {
            self.extract.record(encoder)
        });
        frame.stage(Stage::BATCH_OCCLUSION_TEST, |encoder| {
            if self.options.count_work {
                encoder.clear_buffer(&self.work, 0, None);
            }
            self.test
                .record(device, encoder, &targets, &self.group_draw);
        });
        let has_blended = frame.scene.has_blended;
        frame.stage(Stage::PACK, |encoder| {
            self.occludee_list.record(encoder);
            if has_blended {
                self.blended_list.record(encoder);
            }
        });
    }

    /// Draws U. The counts to wait for, in the mode that checks its limits.
    fn draw_occludees(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
        limit: u32,
    ) -> Option<Counted> {
        let range = self.range(frame, 1, limit);
        let limits = self.options.mode.limits();
        let counts = [&self.occluder_list, &self.occludee_list].map(|list| (list.count(), 0));
        // The counters of a mode that checks them go with what comes before the draw that they may break.
        let copy = match limits {
            Limits::Late | Limits::LateChecked => self
                .counters
                .as_mut()
                .and_then(|counters| counters.record(frame.encoder, counts)),
            Limits::Capacity | Limits::ReadBack => None,
        };
        let counted = (limits == Limits::LateChecked).then(|| Counted {
            copy,
            submitted: frame.submit(),
        });
        let (stage, list) = (Stage::RENDER_OCCLUDEES, &self.occludee_list);
        self.draw(frame, drawer, stage, list, range);
        counted
    }

    /// Draws what exceeded the limits.
    fn make_up(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
        counted: Counted,
        limits: [u32; 2],
    ) {
        // The GPU draws while the host waits for what came before.
        frame.submit();
        let counters = self.counters.as_mut().expect("the mode reads back");
        let copy = counted.copy;
        let read = copy.and_then(|copy| counters.wait(frame.device, copy, counted.submitted));
        if self.mutant == Mutant::Fallback {
            return;
        }
        let lists = [&self.occluder_list, &self.occludee_list];
        for (which, list) in lists.into_iter().enumerate() {
            let (first, capacity) = (limits[which], list.capacity());
            let (range, end) = match read {
                Some(counts) => {
                    let end = counts[which];
                    (DrawRange::Exactly { first, end }, end)
                }
                // Of a list of unknown length all is drawn once more: that changes nothing of what was drawn before.
                None => (DrawRange::AtMost(capacity), capacity),
            };
            if end > first {
                self.draw(frame, drawer, Stage::RENDER_OCCLUDEES, list, range);
            }
        }
    }

    /// The next frame's V, and what is blended over the image.
    fn finish(&self, frame: &mut FrameContext<'_>, drawer: &mut dyn Drawer) {
        let (device, targets) = (frame.device, frame.targets);
        if self.marks.is_none() {
            frame.stage(Stage::FILTER_OCCLUDERS, |encoder| {
                self.filter.record(device, encoder, &targets, &self.visible);
            });
        }
        if frame.scene.has_blended {
            let list = &self.blended_list;
            let range = DrawRange::AtMost(list.capacity());
            self.draw(frame, drawer, Stage::RENDER_BLENDED, list, range);
        }
    }
}

/// The lengths of V's and U's lists, under way.
struct Counted {
    copy: Option<CountersCopy>,
    submitted: wgpu::SubmissionIndex,
}

impl CullingMethod for Hroc {
    fn name(&self) -> &'static str {
        "hroc"
    }

    fn host_sync(&self) -> HostSync {
        self.options.mode.host_sync()
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        let (size, depth) = (frame.targets.size, self.options.depth);
        let shape = &frame.scene.shape;
        let uniform = FrameUniform::new(frame.camera, depth, size, shape)?;
        frame.queue.write_buffer(&self.frame, 0, bytes_of(&uniform));
        let limits = self.draw_limits_now(frame.device);
        self.draw_occluders(frame, drawer, limits[0]);
        if shape.object_count == 0 {
            return Ok(());
        }
        self.find_occludees(frame);
        if let Some(counted) = self.draw_occludees(frame, drawer, limits[1]) {
            self.make_up(frame, drawer, counted, limits);
        }
        self.finish(frame, drawer);
        self.draw_limits = (self.options.mode == HrocMode::CrLate).then_some(limits);
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        Sets {
            potential_occluders: Some(self.occluder_list.packed()),
            effective_occluders: Some(&self.effective_occluders),
            potentially_visible: Some(self.occludee_list.packed()),
            blended: Some(self.blended_list.packed()),
            visible: Some(&self.visible),
            group_draw: Some(&self.group_draw),
            groups: Some(&self.groups),
            work: self.options.count_work.then_some(&self.work),
            grouping: Some(&self.grouping),
            draw_counts: [&self.occluder_list, &self.occludee_list].map(|list| Some(list.count())),
        }
    }

    fn draw_limits(&self) -> Option<[u32; 2]> {
        self.draw_limits
    }

    fn depth(&self) -> DepthConvention {
        self.options.depth
    }

    fn reset(&mut self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.visible, 0, None);
        // V is empty now, and U is what V was: limits by what was counted before would drop most of it.
        if let Some(counters) = &mut self.counters {
            counters.forget();
        }
    }

    fn memory_bytes(&self) -> u64 {
        let buffers = [
            &self.frame,
            &self.effective_occluders,
            &self.potentially_visible,
            &self.visible,
            &self.visible_nodes,
            &self.flagged_nodes,
            &self.groups,
            &self.group_draw,
            &self.work,
            &self.grouping,
        ];
        let lists = [&self.occluder_list, &self.occludee_list, &self.blended_list];
        buffers.iter().map(|buffer| buffer.size()).sum::<u64>()
            + self.filter.memory_bytes()
            + lists.iter().map(|list| list.memory_bytes()).sum::<u64>()
            + self.marks.as_ref().map_or(0, MarkBuffers::memory_bytes)
    }
}
