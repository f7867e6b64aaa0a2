//! All ways to run the methods of the registry on a scene.

use hroc_methods::Recorded;
use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FrameContext, Grouping, HostSync,
    QueryCounts, Scene, Sets, Tree,
};
use hroc_study::registry::{Exactness, Knobs, METHODS, Method, Mode, Parts};

use crate::Gpu;
use crate::host::World;

/// A method that is told that its frames took any time at all: one that goes by it does all that it can do.
struct Restless {
    method: Box<dyn CullingMethod>,
    frame: u64,
    rng: fastrand::Rng,
}

impl CullingMethod for Restless {
    fn name(&self) -> &'static str {
        self.method.name()
    }

    fn host_sync(&self) -> HostSync {
        self.method.host_sync()
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        self.method.encode(frame, drawer)?;
        self.method.took(self.frame, self.rng.f64());
        self.frame += 1;
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        self.method.sets()
    }

    fn draw_limits(&self) -> Option<[u32; 2]> {
        self.method.draw_limits()
    }

    fn queries(&self) -> Option<QueryCounts> {
        self.method.queries()
    }

    fn choice(&self) -> Option<&'static str> {
        self.method.choice()
    }

    fn depth(&self) -> DepthConvention {
        self.method.depth()
    }

    fn reset(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.method.reset(encoder);
    }

    fn memory_bytes(&self) -> u64 {
        self.method.memory_bytes()
    }
}

/// Every exact method of the registry in every exact mode: HROC with every tree, the others with the one whose turn it
/// is (`hroc hard-cases` runs all with all); groupings and device paths in turn. One that is told what shows is no test
/// of anything.
pub fn exact_methods(
    gpu: &Gpu,
    world: &World,
    depth: DepthConvention,
    turn: usize,
) -> Vec<(String, Box<dyn CullingMethod>)> {
    let in_turn = turn % world.trees.len();
    let trees = |method: &Method| match (method.uses_tree, method.groups) {
        (true, true) => &world.trees[..],
        (true, false) => &world.trees[in_turn..=in_turn],
        (false, _) => &world.trees[..1],
    };
    made(gpu, world, depth, turn, usize::MAX, trees)
}

/// Every exact method of the registry once, in its first exact mode, with the first tree.
pub fn each_exact_method(
    gpu: &Gpu,
    world: &World,
    depth: DepthConvention,
) -> Vec<(String, Box<dyn CullingMethod>)> {
    made(gpu, world, depth, 0, 1, |_| &world.trees[..1])
}

/// `most` modes of each method, with its `trees`.
fn made<'w>(
    gpu: &Gpu,
    world: &'w World,
    depth: DepthConvention,
    turn: usize,
    most: usize,
    trees: impl Fn(&Method) -> &'w [Tree],
) -> Vec<(String, Box<dyn CullingMethod>)> {
    let adaptive = Grouping::Adaptive { box_cost: 64.0 };
    let mut groupings = [Grouping::Published, adaptive].into_iter().cycle();
    let paths = gpu.profile.every_path(gpu.device.features());
    let mut paths = paths.into_iter().cycle().skip(turn);
    let mut methods = Vec::new();
    for method in METHODS.iter().filter(|method| !method.is_told) {
        let exact = |mode: &&Mode| mode.exactness == Exactness::Exact;
        for mode in method.modes.iter().filter(exact).take(most) {
            // Seven combinations of paths and groupings beside three trees: all of them meet.
            groupings.next();
            for tree in trees(method) {
                let grouping = groupings.next().unwrap();
                let profile = paths.next().unwrap();
                let scene = Scene {
                    profile,
                    ..world.scene.clone()
                };
                let made = (method.make)(&Parts {
                    device: &gpu.device,
                    queue: &gpu.queue,
                    scene: &scene,
                    baked: world.baked.scene(),
                    tree: Some(tree),
                    depth,
                    mode: mode.name,
                    grouping,
                    knobs: &Knobs::default(),
                    recorded: &Recorded::default(),
                    count_work: false,
                });
                assert_eq!(
                    made.name(),
                    method.name,
                    "the registry makes another method"
                );
                let name = format!(
                    "{} {} {} {} {} {}",
                    method.name,
                    mode.label(),
                    tree.split,
                    grouping.name(),
                    scene.profile.submission.name(),
                    scene.profile.early_z.name()
                );
                let made = Restless {
                    method: made,
                    frame: 0,
                    rng: fastrand::Rng::with_seed(1),
                };
                methods.push((name, Box::new(made) as _));
            }
        }
    }
    methods
}
