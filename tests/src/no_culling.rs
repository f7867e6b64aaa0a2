//! No culling, judged: is what `hroc_keeps` removes outside its object's bounds, and is what it keeps inside them?

use hroc_runtime::{DepthConvention, FrameUniform, Mutant, Noc};
use hroc_study::drawer::Guard;
use hroc_study::hard_cases::CaseFrame;
use hroc_study::unculled::{Judgement, Removed, Unculled, judge};

use crate::Gpu;
use crate::host::{Frame, Host, World};

/// Draws no culling with `hroc_keeps`, without it, and without what has no finite depth.
#[derive(Debug)]
pub struct NoCulling<'g> {
    gpu: &'g Gpu,
    depth: DepthConvention,
    noc: Noc,
    /// With `hroc_keeps`: the truth.
    pub kept: Host<'g>,
    plain: Host<'g>,
    finite: Host<'g>,
}

impl<'g> NoCulling<'g> {
    /// For frames of `world`.
    pub fn new(gpu: &'g Gpu, world: &World, size: [u32; 2], depth: DepthConvention) -> Self {
        Self::with_mutant(gpu, world, size, depth, Mutant::None)
    }

    /// The same, where `hroc_keeps` lacks a safeguard.
    pub fn with_mutant(
        gpu: &'g Gpu,
        world: &World,
        size: [u32; 2],
        depth: DepthConvention,
        mutant: Mutant,
    ) -> Self {
        let host = |guard| Host::with_guard(gpu, world, size, depth, guard, mutant);
        Self {
            gpu,
            depth,
            noc: Noc::new(&gpu.device, &world.scene, depth),
            kept: host(Guard::Snippet),
            plain: host(Guard::Off),
            finite: host(Guard::Finite),
        }
    }

    /// Draws and judges one frame of `world` as it is now; also the frames with `hroc_keeps` and without it.
    ///
    /// # Panics
    /// If the camera is degenerate.
    pub fn judge(&mut self, world: &World, frame: &CaseFrame) -> (Judgement, Frame, Frame) {
        for host in [&mut self.kept, &mut self.plain, &mut self.finite] {
            host.follow(world);
        }
        let kept = self.kept.render_frame(&mut self.noc, frame);
        let plain = self.plain.render_frame(&mut self.noc, frame);
        let finite = self.finite.render_frame(&mut self.noc, frame);
        let size = self.kept.size();
        let shape = &world.scene.shape;
        let uniform = FrameUniform::new(&frame.camera, self.depth, size, shape).unwrap();
        let images = Unculled {
            kept: &kept.image(),
            plain: &plain.image(),
            finite: &finite.image(),
        };
        let bounds = world.object_bounds(self.gpu);
        let judgement = judge(images, &uniform, self.depth, &bounds);
        (judgement, kept, plain)
    }
}

/// Judgements, summed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sums {
    /// Pixels that `hroc_keeps` changes.
    pub removed: Removed,
    /// Pixels that show strays without it.
    pub strays: usize,
    /// Pixels that show strays in spite of it.
    pub kept_strays: usize,
}

impl Sums {
    /// Adds a frame.
    pub fn add(&mut self, judgement: Judgement) {
        self.removed += judgement.removed;
        self.strays += judgement.strays;
        self.kept_strays += judgement.kept_strays;
    }
}
