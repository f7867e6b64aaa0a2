//! WOC: warping-based occlusion culling (Lee, Kim, Eisemann, "Iterative Depth Warping", ACM TOG 37(5), 2018), single
//! layer.
//!
//! A frame: warp last frame's depth to this frame's camera, backward and by fixed-point iteration from several
//! starts per pixel; where none converges is a hole, which hides nothing; build the pyramid of farthest depths
//! and draw the objects whose screen rectangle it does not hide.
//!
//! Approximate: what converged may be the wrong surface, places are rounded to pixels, and what moved is where it was.
//! [`WocMode::Neighborhood`] takes the farthest of the four pixels round a place, which errs less.
//!
//! Departures: starts beyond the first are points of Halton's sequence in the rectangle of possible sources, which
//! comes from bounds of the motion found by the same descent; the paper's deferred pipeline is not needed, as
//! hosts shade how they like.

use glam::DMat4;
use hroc_runtime::gpu::{self, Access};
use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FrameContext, HostSync, Kernel, Scene,
    Sets, Stage,
};

use crate::depth_pyramid::{DEPTH_PYRAMID, DepthPyramid, HIZ_TEST, HizTest, Projected};
use crate::drawn_once::DrawnOnce;
use crate::view::View;

const WARP: Stage = Stage::new("warp");
const KEEP_DEPTH: Stage = Stage::new("keep_depth");
/// Side of the squares whose motion is bounded together, pixels; `TILE` of woc.wgsl.
const TILE: u32 = 8;
const LANDING_BYTES: u64 = 16;

/// What depth a place between pixels has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WocMode {
    /// That of the nearest pixel.
    #[default]
    Nearest,
    /// The farthest of the two by two round it.
    Neighborhood,
}

/// Parameters of the warp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WocOptions {
    /// What depth a place between pixels has.
    pub mode: WocMode,
    /// Starts per pixel: N, 8 in the paper.
    pub seeds: u32,
    /// Steps from each at most: T.
    pub steps: u32,
}

impl Default for WocOptions {
    fn default() -> Self {
        Self {
            mode: WocMode::default(),
            seeds: 8,
            steps: 3,
        }
    }
}

/// `Warp` of woc.wgsl.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct WarpUniform {
    clip_from_last: [[f32; 4]; 4],
    size: [u32; 2],
    seeds: u32,
    steps: u32,
    has_last: u32,
    neighborhood: u32,
    tile_levels: u32,
    reserved: u32,
}

/// What depends on the size of the targets.
#[derive(Debug)]
struct Sized {
    pyramid: DepthPyramid,
    test: HizTest,
    keep_depth: Kernel,
    land: Kernel,
    bound_motion: Vec<(Kernel, [u32; 2])>,
    warp_back: Kernel,
    tile_levels: u32,
    bytes: u64,
}

/// Warping-based occlusion culling, for one view.
#[derive(Debug)]
pub struct WarpedOcclusionCulling {
    options: WocOptions,
    view: View,
    drawn: DrawnOnce,
    warp: wgpu::Buffer,
    sized: Option<Sized>,
    /// Last frame's camera, if its depth was kept.
    clip_from_world_last: Option<DMat4>,
}

impl WarpedOcclusionCulling {
    /// WOC over `scene`.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        depth: DepthConvention,
        options: WocOptions,
    ) -> Self {
        Self {
            options,
            view: View::new(device, depth),
            drawn: DrawnOnce::new(device, scene, depth),
            warp: gpu::uniform(device, "warp", &[0; size_of::<WarpUniform>()]),
            sized: None,
            clip_from_world_last: None,
        }
    }
}

impl Sized {
    fn new(
        device: &wgpu::Device,
        scene: &Scene,
        view: &View,
        warp: &wgpu::Buffer,
        members: &wgpu::Buffer,
        size: [u32; 2],
    ) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let none = wgpu::BufferUsages::empty();
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let last_depth = gpu::storage(device, "last depth", 4 * pixels, none);
        let landings = gpu::storage(device, "landings", LANDING_BYTES * pixels, none);
        let mut level_size = size.map(|n| n.div_ceil(TILE));
        let (mut table, mut sizes, mut first) = (Vec::new(), Vec::new(), 0);
        loop {
            let [width, height] = level_size;
            table.extend([first, width, height, 0]);
            sizes.push(level_size);
            first += width * height;
            if level_size == [1, 1] {
                break;
            }
            level_size = level_size.map(|n| n.div_ceil(2));
        }
        let tiles = gpu::storage(device, "motion tiles", 16 * u64::from(first), none);
        let tile_levels = gpu::storage_with(device, "motion tile levels", &table);
        let pyramid = DepthPyramid::new(device, scene, view.depth, size);
        let constants = view.constants(scene);
        let pipelines = &scene.profile.pipelines;
        let kernel = |entry, bindings: &[(u32, Access, &wgpu::Buffer)]| {
            let bindings = [&[(1, Uniform, warp)], bindings].concat();
            Kernel::new(device, pipelines, "woc", entry, &constants, &bindings)
        };
        let levels = sizes.iter().zip(0u32..).skip(1);
        let bound_motion = levels.map(|(size, number)| {
            let words = [number, 0, 0, 0];
            let made = gpu::uniform(device, "made level", bytemuck::bytes_of(&words));
            let bindings = [
                (4, ReadWrite, &tiles),
                (5, Read, &tile_levels),
                (6, Uniform, &made),
            ];
            let entry = "bound_motion";
            let kernel = Kernel::new(device, pipelines, "woc", entry, &constants, &bindings);
            (kernel, size.map(|n| n.div_ceil(8)))
        });
        let bound_motion = bound_motion.collect();
        let keep = [(1, Uniform, warp), (2, ReadWrite, &last_depth)];
        Self {
            test: HizTest::new(device, scene, view, &pyramid, members, Projected::Box),
            keep_depth: Kernel::over_depth(
                device,
                pipelines,
                "woc",
                "keep_depth",
                &constants,
                &keep,
            ),
            land: kernel(
                "land",
                &[
                    (2, ReadWrite, &last_depth),
                    (3, ReadWrite, &landings),
                    (4, ReadWrite, &tiles),
                    (5, Read, &tile_levels),
                ],
            ),
            bound_motion,
            warp_back: kernel(
                "warp_back",
                &[
                    (3, ReadWrite, &landings),
                    (4, ReadWrite, &tiles),
                    (5, Read, &tile_levels),
                    (7, ReadWrite, &pyramid.depths),
                ],
            ),
            tile_levels: sizes.len() as u32,
            bytes: last_depth.size() + landings.size() + tiles.size() + pyramid.memory_bytes(),
            pyramid,
        }
    }
}

impl CullingMethod for WarpedOcclusionCulling {
    fn name(&self) -> &'static str {
        "woc"
    }

    fn host_sync(&self) -> HostSync {
        HostSync::Never
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        self.view.begin(frame)?;
        let (device, targets, scene) = (frame.device, frame.targets, frame.scene);
        let (shape, size) = (&scene.shape, targets.size);
        let clip_from_world =
            (frame.camera).clip_from_world(self.view.depth, size, shape.origin, shape.radius)?;
        if self
            .sized
            .take_if(|sized| sized.pyramid.size != size)
            .is_some()
        {
            self.clip_from_world_last = None;
        }
        let (view, warp, members) = (&self.view, &self.warp, &self.drawn.members);
        let sized = self
            .sized
            .get_or_insert_with(|| Sized::new(device, scene, view, warp, members, size));
        let last = self.clip_from_world_last.replace(clip_from_world);
        // In f64, as the product of two matrices that far from each other in f32 would move pixels.
        let clip_from_last = last.map(|last| clip_from_world * last.inverse());
        let clip_from_last = clip_from_last.filter(|clip| clip.is_finite());
        let uniform = WarpUniform {
            clip_from_last: clip_from_last
                .unwrap_or_default()
                .as_mat4()
                .to_cols_array_2d(),
            size,
            seeds: self.options.seeds,
            steps: self.options.steps,
            has_last: clip_from_last.is_some().into(),
            neighborhood: (self.options.mode == WocMode::Neighborhood).into(),
            tile_levels: sized.tile_levels,
            reserved: 0,
        };
        (frame.queue).write_buffer(&self.warp, 0, bytemuck::bytes_of(&uniform));
        let grid = size.map(|n| n.div_ceil(TILE));
        frame.stage(WARP, |encoder| {
            let mut pass = gpu::compute_pass(encoder, WARP.name());
            sized.land.dispatch(&mut pass, grid);
            for (kernel, grid) in &sized.bound_motion {
                kernel.dispatch(&mut pass, *grid);
            }
            sized.warp_back.dispatch(&mut pass, grid);
        });
        frame.stage(DEPTH_PYRAMID, |encoder| sized.pyramid.reduce(encoder));
        frame.stage(HIZ_TEST, |encoder| sized.test.record(encoder));
        self.drawn.draw(frame, drawer);
        frame.stage(KEEP_DEPTH, |encoder| {
            let mut pass = gpu::compute_pass(encoder, KEEP_DEPTH.name());
            (sized.keep_depth).dispatch_over(device, &mut pass, targets.depth, grid);
        });
        self.drawn.draw_blended(frame, drawer);
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        self.drawn.sets()
    }

    fn depth(&self) -> DepthConvention {
        self.view.depth
    }

    fn reset(&mut self, _encoder: &mut wgpu::CommandEncoder) {
        self.clip_from_world_last = None;
    }

    fn memory_bytes(&self) -> u64 {
        self.view.frame.size()
            + self.warp.size()
            + self.drawn.memory_bytes()
            + self.sized.as_ref().map_or(0, |sized| sized.bytes)
    }
}
