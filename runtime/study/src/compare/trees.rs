//! What is known of the trees before anything is drawn.

use hroc_format::{ArchivedBvh, ArchivedScene};
use serde::{Deserialize, Serialize};

/// The trees of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneTrees {
    /// Name of the scene.
    pub scene: String,
    /// Each tree that was used.
    pub trees: Vec<TreeStatistics>,
}

/// Shape and quality of a tree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TreeStatistics {
    /// The split rule that built it.
    pub split: String,
    /// Number of nodes.
    pub nodes: usize,
    /// Edges from the root to the deepest leaf.
    pub depth: u32,
    /// Mean number of edges from the root to a leaf.
    pub mean_leaf_depth: f64,
    /// The surface area heuristic with both constants 1: boxes, leaves included, that a random ray through the root
    /// meets.
    pub sah_cost: f64,
    /// Surface area that siblings share, over the root's.
    pub overlap: f64,
    /// Interior boxes that a random ray through the root meets. The leaves' share of the cost is the same in every
    /// tree.
    pub expected_boxes: f64,
    /// Ray-box tests of such a ray from the root down: the root, and two children for each interior box it meets.
    pub expected_ray_box_tests: f64,
}

impl SceneTrees {
    /// Those of `splits` that `scene` has.
    pub fn of(name: &str, scene: &ArchivedScene, splits: &[String]) -> Self {
        let wanted = |bvh: &&ArchivedBvh| splits.iter().any(|split| *split == *bvh.split);
        Self {
            scene: name.to_owned(),
            trees: (scene.bvhs.iter().filter(wanted)).map(statistics).collect(),
        }
    }
}

fn statistics(bvh: &ArchivedBvh) -> TreeStatistics {
    let stats = bvh.stats.to_native();
    let area = |min: [f32; 3], max: [f32; 3]| {
        let [x, y, z] = [0, 1, 2].map(|i| f64::from(max[i]) - f64::from(min[i]));
        2.0 * (x * y + y * z + z * x)
    };
    let nodes = || bvh.nodes.iter().map(|node| node.to_native());
    let root = nodes().next().map_or(0.0, |node| area(node.min, node.max));
    let interior = nodes().filter(|node| node.object().is_none());
    // As the stored cost: a root without area counts every node in full.
    let share = |area: f64| if root > 0.0 { area / root } else { 1.0 };
    let expected_boxes = interior
        .map(|node| share(area(node.min, node.max)))
        .sum::<f64>();
    TreeStatistics {
        split: bvh.split.as_str().to_owned(),
        nodes: bvh.nodes.len(),
        depth: stats.depth,
        mean_leaf_depth: stats.mean_leaf_depth,
        sah_cost: stats.sah_cost,
        overlap: stats.overlap,
        expected_boxes,
        expected_ray_box_tests: if bvh.nodes.is_empty() {
            0.0
        } else {
            1.0 + 2.0 * expected_boxes
        },
    }
}
