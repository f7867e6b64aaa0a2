//! Hierarchical raster occlusion culling (Lee, Kwon, Lee, 2021), with packing and occluder filtering.
//!
//! A frame: `pack` last frame's visible objects V and draw them (`occlusion_map`); reduce the item buffer to
//! those of them that still show, O (`filter_occluders`); find the maximal BVH nodes without a member of O,
//! G (`extract_groups`); rasterize their bounds and cast a ray per surviving pixel to find the objects U
//! that may show (`batch_occlusion_test`); draw them (`pack`, `render_occludees`); reduce the item buffer to
//! the next frame's V (`filter_occluders`). Nothing is read back.
//!
//! Departures from the paper, all in favour of the exact image: groups come from the order-free form of its
//! Algorithm 1; nodes that touch the near plane are replaced by their children and such leaves are drawn
//! untested; rays end at the occlusion map; the first frame starts from an empty V, so it draws what lies
//! in the frustum instead of everything. O is read from the item buffer and not by early-Z marks, which
//! makes it the members of V that show, not those that showed when they were drawn.

use crate::batch_occlusion_test::{BatchOcclusionTest, TestBuffers};
use crate::camera::{CameraError, DepthConvention};
use crate::draw::{Draw, Drawer, Submission};
use crate::extract_groups::{ExtractBuffers, ExtractGroups, Grouping};
use crate::filter_occluders::FilterOccluders;
use crate::frame_uniform::FrameUniform;
use crate::gpu;
use crate::method::{CullingMethod, FrameContext, HostSync, Sets};
use crate::pack::{Pack, PackedList};
use crate::scene::{Scene, SceneShape, Tree, bytes_of};
use crate::stage::Stage;

/// What an [`Hroc`] is made with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HrocOptions {
    /// How the host's depth target is used.
    pub depth: DepthConvention,
    /// How coarse the occludee groups are.
    pub grouping: Grouping,
    /// Counts rays and ray-box tests (see [`Sets::work`]). Costs time; for measuring work, not speed.
    pub count_work: bool,
    /// How draw lists are submitted; `None`: the best the device offers.
    pub submission: Option<Submission>,
}

/// HROC for one view.
#[derive(Debug)]
pub struct Hroc {
    shape: SceneShape,
    depth: DepthConvention,
    frame: wgpu::Buffer,
    limits: wgpu::Buffer,
    potential_occluders: wgpu::Buffer,
    effective_occluders: wgpu::Buffer,
    potentially_visible: wgpu::Buffer,
    visible: wgpu::Buffer,
    visible_nodes: wgpu::Buffer,
    groups: wgpu::Buffer,
    group_draw: wgpu::Buffer,
    work: wgpu::Buffer,
    grouping: wgpu::Buffer,
    count_work: bool,
    occluder_list: PackedList,
    occludee_list: PackedList,
    filter: FilterOccluders,
    extract: ExtractGroups,
    test: BatchOcclusionTest,
}

impl Hroc {
    /// HROC over `scene` with the hierarchy `tree`, both on `device`.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        tree: &Tree,
        options: HrocOptions,
    ) -> Self {
        let shape = scene.shape;
        let none = wgpu::BufferUsages::empty();
        let set = |label| gpu::storage(device, label, u64::from(shape.object_words()) * 4, none);
        let frame = gpu::uniform(device, "frame", &[0; size_of::<FrameUniform>()]);
        let limits = gpu::uniform(
            device,
            "object count",
            bytes_of(&[shape.object_count, 0, 0, 0]),
        );
        let potential_occluders = set("potential_occluders");
        let effective_occluders = set("effective_occluders");
        let potentially_visible = set("potentially_visible");
        let visible = set("visible");
        let visible_nodes = gpu::storage(
            device,
            "visible_nodes",
            u64::from(shape.node_count().div_ceil(32)) * 4,
            none,
        );
        // Groups are disjoint subtrees: no more than there are leaves.
        let groups = gpu::storage(
            device,
            "occludee_groups",
            u64::from(shape.object_count) * 4,
            none,
        );
        let group_draw = gpu::storage(device, "group_draw", 16, wgpu::BufferUsages::INDIRECT);
        let work = gpu::storage(device, "work", 16, none);
        let grouping = gpu::storage(device, "grouping", 16, none);

        let submission = options
            .submission
            .unwrap_or_else(|| Submission::of(device.features()));
        let pack = Pack::new(device);
        let extract_buffers = ExtractBuffers {
            frame: &frame,
            tree,
            potential_occluders: &potential_occluders,
            effective_occluders: &effective_occluders,
            visible_nodes: &visible_nodes,
            potentially_visible: &potentially_visible,
            groups: &groups,
            group_draw: &group_draw,
            grouping: &grouping,
        };
        let test_buffers = TestBuffers {
            frame: &frame,
            tree,
            groups: &groups,
            potential_occluders: &potential_occluders,
            potentially_visible: &potentially_visible,
            work: &work,
            grouping: &grouping,
        };
        let extract = ExtractGroups::new(
            device,
            options.depth,
            options.grouping,
            shape,
            &extract_buffers,
        );
        extract.initialize(queue);
        Self {
            occluder_list: PackedList::new(device, &pack, scene, &potential_occluders, submission),
            occludee_list: PackedList::new(device, &pack, scene, &potentially_visible, submission),
            filter: FilterOccluders::new(device),
            extract,
            test: BatchOcclusionTest::new(device, options.depth, options.count_work, &test_buffers),
            shape,
            depth: options.depth,
            frame,
            limits,
            potential_occluders,
            effective_occluders,
            potentially_visible,
            visible,
            visible_nodes,
            groups,
            group_draw,
            work,
            grouping,
            count_work: options.count_work,
        }
    }
}

impl CullingMethod for Hroc {
    fn name(&self) -> &'static str {
        "hroc"
    }

    fn host_sync(&self) -> HostSync {
        HostSync::Never
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        let (targets, device) = (frame.targets, frame.device);
        let uniform = FrameUniform::new(frame.camera, self.depth, targets.size, &self.shape)?;
        frame.queue.write_buffer(&self.frame, 0, bytes_of(&uniform));
        let occluders = Draw {
            stage: Stage::OcclusionMap,
            clear: true,
            list: self.occluder_list.list(),
            targets,
            depth: self.depth,
        };
        let occludees = Draw {
            stage: Stage::RenderOccludees,
            clear: false,
            list: self.occludee_list.list(),
            ..occluders
        };

        frame.stage(Stage::Pack, |encoder| {
            encoder.copy_buffer_to_buffer(
                &self.visible,
                0,
                &self.potential_occluders,
                0,
                self.visible.size(),
            );
            self.occluder_list.record(encoder);
        });
        frame.stage(Stage::OcclusionMap, |encoder| {
            drawer.draw(encoder, &occluders)
        });
        if self.shape.object_count == 0 {
            return Ok(());
        }
        frame.stage(Stage::FilterOccluders, |encoder| {
            self.filter.record(
                device,
                encoder,
                &targets,
                &self.effective_occluders,
                &self.limits,
            );
        });
        frame.stage(Stage::ExtractGroups, |encoder| self.extract.record(encoder));
        frame.stage(Stage::BatchOcclusionTest, |encoder| {
            if self.count_work {
                encoder.clear_buffer(&self.work, 0, None);
            }
            self.test
                .record(device, encoder, &targets, &self.group_draw);
        });
        frame.stage(Stage::Pack, |encoder| self.occludee_list.record(encoder));
        frame.stage(Stage::RenderOccludees, |encoder| {
            drawer.draw(encoder, &occludees)
        });
        frame.stage(Stage::FilterOccluders, |encoder| {
            self.filter
                .record(device, encoder, &targets, &self.visible, &self.limits);
        });
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        Sets {
            potential_occluders: Some(&self.potential_occluders),
            effective_occluders: Some(&self.effective_occluders),
            potentially_visible: Some(&self.potentially_visible),
            visible: Some(&self.visible),
            group_draw: Some(&self.group_draw),
            groups: Some(&self.groups),
            work: self.count_work.then_some(&self.work),
            grouping: Some(&self.grouping),
        }
    }

    fn depth(&self) -> DepthConvention {
        self.depth
    }

    fn reset(&mut self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.visible, 0, None);
    }

    fn memory_bytes(&self) -> u64 {
        let sets = [
            &self.potential_occluders,
            &self.effective_occluders,
            &self.potentially_visible,
            &self.visible,
        ];
        let others = [
            &self.frame,
            &self.limits,
            &self.visible_nodes,
            &self.groups,
            &self.group_draw,
            &self.work,
            &self.grouping,
        ];
        sets.iter()
            .chain(&others)
            .map(|buffer| buffer.size())
            .sum::<u64>()
            + self.occluder_list.memory_bytes()
            + self.occludee_list.memory_bytes()
    }
}
