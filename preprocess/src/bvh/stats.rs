//! What a finished tree looks like.

use glam::DVec3;
use hroc_format::{BvhNode, BvhStats};

/// Surface area of the box; in f64, where squares of f32 lengths neither overflow nor vanish.
#[inline]
fn surface_area(min: [f32; 3], max: [f32; 3]) -> f64 {
    let [x, y, z] = std::array::from_fn(|axis| f64::from(max[axis]) - f64::from(min[axis]));
    2.0 * (x * y + y * z + z * x)
}

/// Surface area of the intersection of two nodes' boxes, which are in one cell; zero where they are apart.
#[inline]
fn overlap_area(a: &BvhNode, b: &BvhNode) -> f64 {
    let min: [f32; 3] = std::array::from_fn(|axis| a.min[axis].max(b.min[axis]));
    let max: [f32; 3] = std::array::from_fn(|axis| a.max[axis].min(b.max[axis]));
    if (0..3).any(|axis| min[axis] > max[axis]) {
        0.0
    } else {
        surface_area(min, max)
    }
}

/// The node with its box in the space of another cell, which lies `shift` from its own, to f32 rounding.
fn moved(node: &BvhNode, shift: DVec3) -> BvhNode {
    let corner = |corner: [f32; 3]| -> [f32; 3] {
        std::array::from_fn(|axis| (f64::from(corner[axis]) + shift[axis]) as f32)
    };
    BvhNode {
        min: corner(node.min),
        max: corner(node.max),
        ..*node
    }
}

/// What is known of a subtree. Sums are added up along the tree, so that they depend on nothing else.
#[derive(Clone, Copy)]
pub struct Subtotal {
    /// Nodes below the root, on the longest way down.
    depth: u32,
    leaves: u64,
    leaf_depths: u64,
    area: f64,
    overlap: f64,
}

impl Subtotal {
    /// A subtree of one leaf.
    #[inline]
    pub fn leaf(node: &BvhNode) -> Self {
        Self {
            depth: 0,
            leaves: 1,
            leaf_depths: 0,
            area: surface_area(node.min, node.max),
            overlap: 0.0,
        }
    }

    /// A subtree of a node and its two children with all below them.
    #[inline]
    pub fn inner(node: &BvhNode, [left, right]: [(&BvhNode, Self); 2]) -> Self {
        let leaves = left.1.leaves + right.1.leaves;
        Self {
            depth: 1 + left.1.depth.max(right.1.depth),
            leaves,
            leaf_depths: leaves + left.1.leaf_depths + right.1.leaf_depths,
            area: surface_area(node.min, node.max) + (left.1.area + right.1.area),
            overlap: overlap_area(left.0, right.0) + (left.1.overlap + right.1.overlap),
        }
    }

    /// The stats of the tree with that root.
    pub fn stats(&self, root: &BvhNode) -> BvhStats {
        let root_area = surface_area(root.min, root.max);
        let nodes = 2 * self.leaves - 1;
        let [sah_cost, overlap] = if root_area > 0.0 {
            [self.area / root_area, self.overlap / root_area]
        } else {
            [nodes as f64, 0.0]
        };
        BvhStats {
            depth: self.depth,
            reserved: 0,
            mean_leaf_depth: self.leaf_depths as f64 / self.leaves as f64,
            sah_cost,
            overlap,
        }
    }
}

/// Measures a tree whose `nodes` are in place, all in one cell.
pub fn measure(nodes: &[BvhNode]) -> BvhStats {
    measure_in_cells(nodes, &[DVec3::ZERO])
}

/// Measures a tree whose `nodes` are in place, in cells with these `origins`.
pub fn measure_in_cells(nodes: &[BvhNode], origins: &[DVec3]) -> BvhStats {
    // Backward, so that the children of a node are the last that were met, the left one on top.
    let mut waiting: Vec<(BvhNode, Subtotal)> = Vec::new();
    for node in nodes.iter().rev() {
        let subtotal = if node.object().is_none() {
            let children = [waiting.pop(), waiting.pop()].map(|child| child.expect("two children"));
            // Areas do not depend on the cell, the overlap needs one space for both.
            let [left, right] = [children[0].0, children[1].0].map(|child: BvhNode| {
                let shift = origins[child.cell() as usize] - origins[node.cell() as usize];
                moved(&child, shift)
            });
            Subtotal::inner(node, [(&left, children[0].1), (&right, children[1].1)])
        } else {
            Subtotal::leaf(node)
        };
        waiting.push((*node, subtotal));
    }
    let (root, total) = waiting[0];
    total.stats(&root)
}
