//! VFC: view frustum culling, object by object or down a BVH, on the GPU; what is left is drawn packed.
//!
//! The flat form tests every object's bounds against the six planes. The hierarchical form (Clark 1976; Assarsson
//! and Möller 2000) skips subtrees outside and takes those inside untested.
//!
//! Departures: on the GPU the hierarchical form is not one traversal but one per run of 64 nodes, which begins with
//! the ancestors of the run's first node; no plane masks are handed down.

use hroc_runtime::gpu::{self, Access};
use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FrameContext, HostSync, Kernel, Scene,
    Sets, Stage, Tree,
};

use crate::drawn_once::DrawnOnce;
use crate::view::View;

/// Objects per workgroup of either form.
const WIDTH: u32 = 64;
/// `RUN` of vfc_bvh.wgsl.
const NODES_PER_INVOCATION: u32 = 64;

/// View frustum culling, for one view.
#[derive(Debug)]
pub struct ViewFrustumCulling {
    name: &'static str,
    view: View,
    drawn: DrawnOnce,
    frustum_test: Kernel,
    /// Invocations.
    count: u32,
    /// The test sets bits and clears none.
    clears: bool,
}

const FRUSTUM_TEST: Stage = Stage::new("frustum_test");

impl ViewFrustumCulling {
    /// Every object by itself.
    pub fn flat(device: &wgpu::Device, scene: &Scene, depth: DepthConvention) -> Self {
        let (view, drawn) = (
            View::new(device, depth),
            DrawnOnce::new(device, scene, depth),
        );
        let bindings = [
            (1, Access::Read, &scene.object_bounds),
            (2, Access::ReadWrite, &drawn.members),
        ];
        Self {
            name: "vfc",
            frustum_test: view.kernel(device, scene, "vfc", "frustum_test", &bindings),
            view,
            drawn,
            count: scene.shape.object_count,
            clears: false,
        }
    }

    /// Down `tree`.
    pub fn hierarchical(
        device: &wgpu::Device,
        scene: &Scene,
        tree: &Tree,
        depth: DepthConvention,
    ) -> Self {
        let (view, drawn) = (
            View::new(device, depth),
            DrawnOnce::new(device, scene, depth),
        );
        let bindings = [
            (1, Access::Read, &scene.object_bounds),
            (2, Access::ReadWrite, &drawn.members),
            (3, Access::Read, &tree.nodes),
            (4, Access::Read, &tree.parents),
        ];
        let runs = scene.shape.node_count().div_ceil(NODES_PER_INVOCATION);
        Self {
            name: "vfc-bvh",
            frustum_test: view.kernel(device, scene, "vfc_bvh", "frustum_test", &bindings),
            view,
            drawn,
            count: runs + scene.shape.moving_capacity(),
            clears: true,
        }
    }
}

impl CullingMethod for ViewFrustumCulling {
    fn name(&self) -> &'static str {
        self.name
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
        frame.stage(FRUSTUM_TEST, |encoder| {
            if self.clears {
                encoder.clear_buffer(&self.drawn.members, 0, None);
            }
            let mut pass = gpu::compute_pass(encoder, FRUSTUM_TEST.name());
            self.frustum_test
                .dispatch(&mut pass, gpu::grid(self.count, WIDTH));
        });
        self.drawn.draw(frame, drawer);
        self.drawn.draw_blended(frame, drawer);
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        self.drawn.sets()
    }

    fn depth(&self) -> DepthConvention {
        self.view.depth
    }

    fn reset(&mut self, _encoder: &mut wgpu::CommandEncoder) {}

    fn memory_bytes(&self) -> u64 {
        self.view.frame.size() + self.drawn.memory_bytes()
    }
}
