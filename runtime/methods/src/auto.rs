//! `auto`: frustum culling alone, HROC, or ROC behind a Hi-Z test, frame by frame whichever should take the least
//! time.
//!
//! All three draw the right image, so what is chosen shows in the time alone. How coarse HROC's groups are it
//! chooses itself, on the GPU. Nothing waits for the GPU: the lengths of draw lists come frames later, and the host
//! tells what its frames took ([`CullingMethod::took`]). One that does not gets HROC after the first few.

mod chooser;

use hroc_format::ArchivedScene;
use hroc_runtime::twin::bounds::{in_frustum, nearest_along};
use hroc_runtime::{
    CameraError, Counters, CullingMethod, DepthConvention, Drawer, FilterOccluders, FrameContext,
    FrameUniform, HostSync, Hroc, HrocMode, HrocOptions, Scene, Sets, Stage, Tree,
};

use self::chooser::{Arm, Chooser, InView};
use crate::contents::Contents;
use crate::hardware::HardwareTimes;
use crate::host_tree::{HostTree, Placement};
use crate::roc_hiz::PrerejectedOcclusionCulling;
use crate::vfc::ViewFrustumCulling;

/// Nodes with fewer leaves than this share of all are not opened to see what of them is in view.
const GRAIN: u32 = 1 << 10;

/// The choice among exact methods, for one view.
#[derive(Debug)]
pub struct Auto {
    chooser: Chooser,
    tree: HostTree,
    contents: Contents,
    hardware: HardwareTimes,
    frustum: ViewFrustumCulling,
    groups: Hroc,
    leaves: PrerejectedOcclusionCulling,
    filter: FilterOccluders,
    counters: Counters<2>,
    /// Of the frames whose counters are under way: the objects in view then, or now.
    objects_in_view: f64,
}

impl Auto {
    /// Over `scene`, baked as `baked`, with its hierarchy `tree`, on a device with these `hardware` times. Of HROC's modes
    /// it takes [`HrocMode::Of`], whatever the options say: the one that neither waits nor drops a draw.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        baked: &ArchivedScene,
        tree: &Tree,
        options: HrocOptions,
        hardware: HardwareTimes,
    ) -> Self {
        let host_tree = HostTree::new(baked, &tree.split);
        let options = HrocOptions {
            mode: HrocMode::Of,
            ..options
        };
        Self {
            chooser: Chooser::new(),
            contents: Contents::new(baked, &host_tree),
            tree: host_tree,
            hardware,
            frustum: ViewFrustumCulling::flat(device, scene, options.depth),
            groups: Hroc::new(device, scene, tree, options),
            leaves: PrerejectedOcclusionCulling::new(device, scene, options.depth),
            filter: FilterOccluders::new(device, scene),
            counters: Counters::new(device),
            objects_in_view: 0.0,
        }
    }

    /// What drawing all in view takes: of nodes that are not opened and partly in view, half counts.
    fn in_view(&self, uniform: &FrameUniform) -> InView {
        let (tree, contents) = (&self.tree, &self.contents);
        let count = tree.nodes.len() as u32;
        let grain = count / GRAIN;
        let pixels = f64::from(uniform.size[0]) * f64::from(uniform.size[1]);
        // Whatever is drawn, the image is there.
        let mut fragments = pixels;
        let mut found = InView::default();
        let mut n = 0;
        while n < count {
            let skip = tree.nodes[n as usize].skip;
            let bounds = tree.padded(uniform, n);
            if !in_frustum(uniform, bounds) {
                n = skip;
                continue;
            }
            let mut planes = uniform.planes.iter();
            let is_whole = tree.is_leaf(n)
                || planes.all(|plane| nearest_along((*plane).into(), bounds) >= 0.0);
            if !is_whole && tree.leaf_count(n) > grain {
                n += 1;
                continue;
            }
            let area_px = match tree.placement(uniform, n) {
                Placement::Box { area_px } => f64::from(area_px).min(pixels),
                Placement::Open | Placement::Outside => pixels,
            };
            let share = if is_whole { 1.0 } else { 0.5 };
            let objects = share * f64::from(tree.leaf_count(n));
            found.objects += objects;
            found.geometry_ms += objects * self.hardware.draw_ms
                + share * contents.triangles(tree, n) * self.hardware.triangle_ms;
            fragments += share * contents.coverage(tree, n) * area_px;
            n = skip;
        }
        found.fragments_ms = fragments * self.hardware.fragment_ms;
        found
    }

    fn arm(&self, arm: Arm) -> &dyn CullingMethod {
        match arm {
            Arm::Frustum => &self.frustum,
            Arm::Groups => &self.groups,
            Arm::Leaves => &self.leaves,
        }
    }

    fn last_arm(&self) -> &dyn CullingMethod {
        self.arm(
            self.chooser
                .last_plan()
                .map_or(Arm::Groups, |plan| plan.arm),
        )
    }

    /// What showed in the last frame of an arm that knows; V of its next.
    fn visible(&self, arm: Arm) -> &wgpu::Buffer {
        self.arm(arm)
            .sets()
            .visible
            .expect("it draws what showed first")
    }
}

impl CullingMethod for Auto {
    fn name(&self) -> &'static str {
        "auto"
    }

    fn host_sync(&self) -> HostSync {
        HostSync::NextFrame
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        let size = frame.targets.size;
        let depth = self.groups.depth();
        let uniform = FrameUniform::new(frame.camera, depth, size, &frame.scene.shape)?;
        self.counters.map_submitted();
        if let Some([first, second]) = self.counters.arrived(frame.device) {
            let drawn = f64::from(first) + f64::from(second);
            self.chooser.drew(drawn / self.objects_in_view.max(1.0));
        }
        let in_view = self.in_view(&uniform);
        let last = self.chooser.last_plan();
        let plan = self.chooser.next(in_view);

        let handed = last.filter(|last| last.arm != Arm::Frustum && last.arm != plan.arm);
        if let (Some(last), true) = (handed, plan.arm != Arm::Frustum) {
            let (from, to) = (self.visible(last.arm), self.visible(plan.arm));
            (frame.encoder).copy_buffer_to_buffer(from, 0, to, 0, from.size());
        }
        match plan.arm {
            Arm::Frustum => self.frustum.encode(frame, drawer)?,
            Arm::Groups => self.groups.encode(frame, drawer)?,
            Arm::Leaves => self.leaves.encode(frame, drawer)?,
        }
        if plan.hands_over {
            let (device, targets) = (frame.device, frame.targets);
            let [groups, leaves] = [Arm::Groups, Arm::Leaves].map(|arm| self.visible(arm));
            frame.stage(Stage::FILTER_OCCLUDERS, |encoder| {
                (self.filter).record(device, encoder, &targets, groups);
                encoder.copy_buffer_to_buffer(groups, 0, leaves, 0, groups.size());
            });
        }
        if plan.arm != Arm::Frustum {
            self.objects_in_view = in_view.objects;
            let counts = self
                .arm(plan.arm)
                .sets()
                .draw_counts
                .map(Option::<&_>::cloned);
            if let [Some(first), Some(second)] = counts {
                // Without a free place this frame's are not told, which does no harm.
                (self.counters).record(frame.encoder, [(&first, 0), (&second, 0)]);
            }
        }
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        self.last_arm().sets()
    }

    fn choice(&self) -> Option<&'static str> {
        Some(self.last_arm().name())
    }

    fn took(&mut self, frame: u64, ms: f64) {
        self.chooser.took(frame, ms);
    }

    fn depth(&self) -> DepthConvention {
        self.groups.depth()
    }

    fn reset(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.groups.reset(encoder);
        self.leaves.reset(encoder);
        self.counters.forget();
    }

    fn memory_bytes(&self) -> u64 {
        let arms = Arm::ALL.map(|arm| self.arm(arm).memory_bytes());
        arms.iter().sum::<u64>()
    }
}
