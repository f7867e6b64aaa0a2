//! What a finished tree looks like.

use hroc_format::{BvhNode, BvhStats, NO_OBJECT};

/// Surface area of the box; in f64, where squares of f32 lengths neither overflow nor vanish.
fn surface_area(min: [f32; 3], max: [f32; 3]) -> f64 {
    let [x, y, z] = std::array::from_fn(|axis| f64::from(max[axis]) - f64::from(min[axis]));
    2.0 * (x * y + y * z + z * x)
}

/// Surface area of the intersection of two nodes' boxes; zero where they are apart.
fn overlap_area(a: &BvhNode, b: &BvhNode) -> f64 {
    let min: [f32; 3] = std::array::from_fn(|axis| a.min[axis].max(b.min[axis]));
    let max: [f32; 3] = std::array::from_fn(|axis| a.max[axis].min(b.max[axis]));
    if (0..3).any(|axis| min[axis] > max[axis]) {
        0.0
    } else {
        surface_area(min, max)
    }
}

/// Measures a tree whose `nodes` and `parents` are in place.
pub fn measure(nodes: &[BvhNode], parents: &[u32]) -> BvhStats {
    let root_area = surface_area(nodes[0].min, nodes[0].max);
    let share = |area: f64, without_root_area: f64| {
        if root_area > 0.0 {
            area / root_area
        } else {
            without_root_area
        }
    };
    let mut stats = BvhStats {
        depth: 0,
        reserved: 0,
        mean_leaf_depth: 0.0,
        sah_cost: 0.0,
        overlap: 0.0,
    };
    let mut depths = vec![0_u32; nodes.len()];
    let mut leaf_depths = 0_u64;
    for (i, node) in nodes.iter().enumerate() {
        if i > 0 {
            depths[i] = depths[parents[i] as usize] + 1;
        }
        stats.sah_cost += share(surface_area(node.min, node.max), 1.0);
        if node.object == NO_OBJECT {
            let left = &nodes[i + 1];
            let right = &nodes[left.skip as usize];
            stats.overlap += share(overlap_area(left, right), 0.0);
        } else {
            stats.depth = stats.depth.max(depths[i]);
            leaf_depths += u64::from(depths[i]);
        }
    }
    let leaves = nodes.len().div_ceil(2);
    stats.mean_leaf_depth = leaf_depths as f64 / leaves as f64;
    stats
}
