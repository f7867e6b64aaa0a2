//! All ways to run the methods of the registry on a scene.

use hroc_runtime::{CullingMethod, DepthConvention, Grouping};
use hroc_study::registry::{Exactness, METHODS, Parts};

use crate::Gpu;
use crate::host::World;

/// Both forms of grouping.
pub const GROUPINGS: [Grouping; 2] = [Grouping::Published, Grouping::Adaptive { box_cost: 64.0 }];

/// Every exact method that the device can run, in every mode, with every tree, groupings in turn; with a name
/// to tell it by.
pub fn exact_methods(
    gpu: &Gpu,
    world: &World,
    depth: DepthConvention,
) -> Vec<(String, Box<dyn CullingMethod>)> {
    let mut methods = Vec::new();
    let fit = |features: wgpu::Features| gpu.device.features().contains(features);
    let exact = METHODS
        .iter()
        .filter(|m| m.exactness == Exactness::Exact && fit(m.features));
    for method in exact {
        let modes = if method.modes.is_empty() {
            &[""]
        } else {
            method.modes
        };
        let trees = if method.uses_tree {
            &world.trees[..]
        } else {
            &world.trees[..1]
        };
        for mode in modes {
            for (tree, grouping) in trees.iter().zip(GROUPINGS.into_iter().cycle()) {
                let made = (method.make)(&Parts {
                    device: &gpu.device,
                    queue: &gpu.queue,
                    scene: &world.scene,
                    tree: Some(tree),
                    depth,
                    mode,
                    grouping,
                    count_work: false,
                });
                let name = format!("{} {mode} {} {}", method.name, tree.split, grouping.name());
                methods.push((name, made));
            }
        }
    }
    methods
}
