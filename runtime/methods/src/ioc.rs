//! IOC: iterative raster occlusion culling over a range of BVH depths (Lee and Lee 2020, as the HROC paper
//! describes it).
//!
//! A frame: draw what showed last; rasterize the bounds of the nodes at the first depth (leaves above it count as
//! nodes) against that depth buffer; hand the children of those that survive to the next depth, down to the last one;
//! draw the objects below the nodes that survive there. Objects are not tested one by one.
//!
//! Departures: the depth a fragment compares is that of its ray's entry, as in ROC here; nodes outside the frustum are
//! left out before they are rasterized; what showed last is read from the item buffer, as the nodes at the last depth
//! say little about single objects; each depth is an indirect dispatch and draw by default. [`IocMode::ReadBack`] is
//! the published way, where the host reads the number of surviving nodes back at every depth.

use hroc_runtime::gpu::{self, Access};
use hroc_runtime::{
    BoxPass, BoxShader, CameraError, CullingMethod, DepthConvention, Drawer, FilterOccluders,
    FrameContext, HostSync, Kernel, Scene, Sets, Stage, Tree, readback,
};

use crate::drawn_twice::DrawnTwice;
use crate::view::View;

const SHADER: BoxShader = BoxShader {
    sampled: "ioc_test",
    sampled_entry: "iterative_test",
    early: "ioc_test_early",
    early_entry: "iterative_test_early",
};
const ITERATIVE_TEST: Stage = Stage::new("iterative_test");
/// Sizes of `Level` and `LevelArguments` of ioc.wgsl, and where the dispatch stands in the latter.
const LEVEL_BYTES: u64 = 16;
const ARGUMENTS_BYTES: u64 = 32;
const ARGUMENTS_GRID: u64 = 16;

/// Who knows how many nodes survived a depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IocMode {
    /// The GPU alone.
    #[default]
    Indirect,
    /// The host: it waits at every depth, and stops where nothing survived.
    ReadBack,
}

/// The depths to test, from the root's 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthRange {
    /// Where to begin.
    pub first: u32,
    /// How many depths, at least 1.
    pub count: u32,
}

impl DepthRange {
    /// The range in the middle of those that the HROC paper found best for its scenes: relative to the depth
    /// log2(N) of a balanced tree these are -6.9 to -4.9, -4.5 to -2.5, -7.2 to -5.2 and -2.9 to +0.1.
    pub fn of(object_count: u32) -> Self {
        Self {
            first: object_count.max(1).ilog2().saturating_sub(5),
            count: 3,
        }
    }
}

/// The kernels that know their level.
#[derive(Debug)]
struct Level {
    seal: Kernel,
    descend: Kernel,
}

/// Iterative raster occlusion culling, for one view.
#[derive(Debug)]
pub struct IterativeOcclusionCulling {
    mode: IocMode,
    view: View,
    drawn: DrawnTwice,
    find: [(Kernel, u32); 2],
    /// Depths and cuts are known.
    found_depths: bool,
    seed: Kernel,
    per_level: Vec<Level>,
    spread: Kernel,
    iterative_test: BoxPass,
    filter: FilterOccluders,
    flagged: wgpu::Buffer,
    appended: wgpu::Buffer,
    levels: wgpu::Buffer,
    arguments: wgpu::Buffer,
    buffers_bytes: u64,
    seed_count: u32,
    object_count: u32,
}

impl IterativeOcclusionCulling {
    /// IOC over `scene` with the hierarchy `tree`.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        tree: &Tree,
        depth: DepthConvention,
        mode: IocMode,
        range: DepthRange,
    ) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let (view, drawn) = (
            View::new(device, depth),
            DrawnTwice::new(device, scene, depth),
        );
        let shape = &scene.shape;
        let none = wgpu::BufferUsages::empty();
        let indirect = wgpu::BufferUsages::INDIRECT;
        let tested = shape.node_count() + shape.moving_capacity();
        let level_count = range.count.max(1);
        let words = |label, words: u32| gpu::storage(device, label, 4 * u64::from(words), none);
        let cut_of_object = words("cut_of_object", shape.static_count);
        let depth_of_node = words("depth_of_node", shape.node_count());
        let candidates = words("candidates", shape.node_count());
        let boxes = words("boxes", tested);
        let flagged = words("flagged nodes", tested.div_ceil(32));
        let appended = words("appended", 4);
        let per_level = |bytes: u64| bytes * u64::from(level_count);
        let levels = gpu::storage(device, "levels", per_level(LEVEL_BYTES), none);
        let bytes = per_level(ARGUMENTS_BYTES);
        let arguments = gpu::storage(device, "level arguments", bytes, indirect);
        let last = range.first.saturating_add(level_count - 1);
        let info = |level: u32| {
            let words = [level, range.first, last, 0];
            gpu::uniform(device, "level", bytemuck::bytes_of(&words))
        };
        let first_info = info(0);
        let test_node = [
            (1, Read, &tree.nodes),
            (7, ReadWrite, &candidates),
            (8, ReadWrite, &boxes),
            (9, ReadWrite, &appended),
            (11, ReadWrite, &flagged),
        ];
        let kernel = |entry: &'static str, bindings: &[(u32, Access, &wgpu::Buffer)]| {
            view.kernel(device, scene, "ioc", entry, bindings)
        };
        let find_cut = kernel(
            "find_cut",
            &[
                (2, Read, &tree.parents),
                (3, Read, &tree.leaf_of_object),
                (4, Uniform, &first_info),
                (5, ReadWrite, &cut_of_object),
            ],
        );
        let find_depths = kernel(
            "find_depths",
            &[(2, Read, &tree.parents), (6, ReadWrite, &depth_of_node)],
        );
        let seed_bindings = [
            (4, Uniform, &first_info),
            (6, ReadWrite, &depth_of_node),
            (13, Read, &scene.object_bounds),
        ];
        let per_level = (0..level_count).map(|number| {
            let info = info(number);
            let level = [(4, Uniform, &info), (10, ReadWrite, &levels)];
            Level {
                seal: kernel(
                    "seal",
                    &[
                        level[0],
                        test_node[3],
                        level[1],
                        (14, ReadWrite, &arguments),
                    ],
                ),
                descend: kernel("descend", &[&level[..], &test_node[..]].concat()),
            }
        });
        let constants = [scene.profile.mutant.constant()];
        let rasterized = [
            (Uniform, &view.frame),
            (Read, &tree.nodes),
            (Read, &boxes),
            (ReadWrite, &flagged),
            (Read, &scene.object_bounds),
        ];
        let kept = [&cut_of_object, &depth_of_node, &candidates, &boxes];
        let buffers_bytes = kept.iter().map(|buffer| buffer.size()).sum();
        Self {
            mode,
            find: [
                (find_cut, shape.static_count),
                (find_depths, shape.node_count()),
            ],
            found_depths: false,
            seed: kernel("seed", &[&seed_bindings[..], &test_node[..]].concat()),
            per_level: per_level.collect(),
            spread: kernel(
                "spread",
                &[
                    (5, ReadWrite, &cut_of_object),
                    (11, ReadWrite, &flagged),
                    (12, ReadWrite, &drawn.found),
                ],
            ),
            iterative_test: BoxPass::new(
                device,
                &scene.profile,
                SHADER,
                depth,
                &constants,
                &rasterized,
            ),
            filter: FilterOccluders::new(device, scene),
            flagged,
            appended,
            levels,
            arguments,
            buffers_bytes,
            seed_count: tested,
            object_count: shape.object_count,
            view,
            drawn,
        }
    }

    /// Tests one depth after the other.
    fn test(&self, frame: &mut FrameContext<'_>) {
        let (device, targets) = (frame.device, frame.targets);
        frame.stage(ITERATIVE_TEST, |encoder| {
            encoder.clear_buffer(&self.drawn.found, 0, None);
            encoder.clear_buffer(&self.flagged, 0, None);
            encoder.clear_buffer(&self.appended, 0, None);
            let mut pass = gpu::compute_pass(encoder, "seed");
            self.seed
                .dispatch(&mut pass, gpu::grid(self.seed_count, 64));
        });
        for (level, number) in self.per_level.iter().zip(0u64..) {
            frame.stage(ITERATIVE_TEST, |encoder| {
                let mut pass = gpu::compute_pass(encoder, "seal");
                level.seal.dispatch(&mut pass, [1, 1]);
            });
            if self.mode == IocMode::ReadBack {
                frame.submit();
                let words = readback::words(device, frame.queue, &self.levels);
                let [_, candidates, _, boxes] = words[4 * number as usize..][..4] else {
                    unreachable!("four words per level");
                };
                // Candidates that touch the near plane have no box, but children.
                if candidates == 0 && boxes == 0 {
                    break;
                }
            }
            let at = number * ARGUMENTS_BYTES;
            frame.stage(ITERATIVE_TEST, |encoder| {
                let arguments = &self.arguments;
                (self.iterative_test).record(device, encoder, &targets, arguments, at);
                if number + 1 < self.per_level.len() as u64 {
                    let mut pass = gpu::compute_pass(encoder, "descend");
                    (level.descend).dispatch_indirect(&mut pass, arguments, at + ARGUMENTS_GRID);
                }
            });
        }
        frame.stage(ITERATIVE_TEST, |encoder| {
            let mut pass = gpu::compute_pass(encoder, "spread");
            self.spread
                .dispatch(&mut pass, gpu::grid(self.object_count, 64));
        });
    }
}

impl CullingMethod for IterativeOcclusionCulling {
    fn name(&self) -> &'static str {
        "ioc"
    }

    fn host_sync(&self) -> HostSync {
        match self.mode {
            IocMode::Indirect => HostSync::Never,
            IocMode::ReadBack => HostSync::MidFrame,
        }
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        self.view.begin(frame)?;
        let (device, targets) = (frame.device, frame.targets);
        if !self.found_depths {
            let mut pass = gpu::compute_pass(frame.encoder, "find_depths");
            for (kernel, count) in &self.find {
                kernel.dispatch(&mut pass, gpu::grid(*count, 64));
            }
            self.found_depths = true;
        }
        self.drawn.draw_first(frame, drawer);
        if self.object_count == 0 {
            return Ok(());
        }
        self.test(frame);
        self.drawn.draw_second(frame, drawer);
        frame.stage(Stage::FILTER_OCCLUDERS, |encoder| {
            let visible = &self.drawn.visible;
            (self.filter).record(device, encoder, &targets, visible);
        });
        self.drawn.draw_blended(frame, drawer);
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        Sets {
            group_draw: Some(&self.appended),
            ..self.drawn.sets()
        }
    }

    fn depth(&self) -> DepthConvention {
        self.view.depth
    }

    fn reset(&mut self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.drawn.visible, 0, None);
    }

    fn memory_bytes(&self) -> u64 {
        let own = [
            &self.view.frame,
            &self.flagged,
            &self.appended,
            &self.levels,
        ];
        own.iter().map(|buffer| buffer.size()).sum::<u64>()
            + self.buffers_bytes
            + self.drawn.memory_bytes()
    }
}
