//! A BVH on the host, for methods that walk it there.

use hroc_format::ArchivedScene;
use hroc_runtime::FrameUniform;
use hroc_runtime::twin::bounds::{
    Box3, LARGEST_NDC, footprint, in_frustum, nearest_along, padded, rasterized, relative,
    touches_near,
};

/// A node, in depth-first order: the first child follows its parent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HostNode {
    min: [f32; 3],
    cell: u32,
    max: [f32; 3],
    /// One past the last node below.
    pub skip: u32,
    /// `None` for an interior node.
    pub object: Option<u32>,
    pub parent: u32,
}

/// How the bounds of a node lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Placement {
    Outside,
    /// No rasterized box can stand for it: it touches the near plane or reaches far out of the image.
    Open,
    /// Pixels of the rectangle round its box.
    Box {
        area_px: f32,
    },
}

/// The nodes of one tree.
#[derive(Debug)]
pub(crate) struct HostTree {
    pub nodes: Vec<HostNode>,
}

impl HostTree {
    pub fn new(baked: &ArchivedScene, split: &str) -> Self {
        let tree = baked.bvhs.iter().find(|bvh| bvh.split == split);
        let nodes = tree.map_or_else(Vec::new, |bvh| {
            let parents = bvh.parents.iter();
            let node = |(node, parent): (&hroc_format::ArchivedBvhNode, &rend::u32_le)| HostNode {
                min: node.min.map(|x| x.to_native()),
                cell: node.cell(),
                max: node.max.map(|x| x.to_native()),
                skip: node.skip.to_native(),
                object: node.object(),
                parent: parent.to_native(),
            };
            bvh.nodes.iter().zip(parents).map(node).collect()
        });
        Self { nodes }
    }

    pub fn is_leaf(&self, n: u32) -> bool {
        self.nodes[n as usize].object.is_some()
    }

    /// Of an interior node.
    pub fn children(&self, n: u32) -> [u32; 2] {
        [n + 1, self.nodes[n as usize + 1].skip]
    }

    /// Leaves below a node; a binary tree has one more of them than interior nodes.
    pub fn leaf_count(&self, n: u32) -> u32 {
        (self.nodes[n as usize].skip - n).div_ceil(2)
    }

    /// The bounds, grown by what rasterization may move.
    pub fn padded(&self, frame: &FrameUniform, n: u32) -> Box3 {
        padded(frame, self.bounds(frame, n))
    }

    pub fn placement(&self, frame: &FrameUniform, n: u32) -> Placement {
        let bounds = self.padded(frame, n);
        if !in_frustum(frame, bounds) {
            return Placement::Outside;
        }
        let outer = rasterized(frame, bounds);
        if touches_near(frame, outer) {
            return Placement::Open;
        }
        let footprint = footprint(frame, outer);
        if footprint.farthest_ndc > LARGEST_NDC {
            return Placement::Open;
        }
        Placement::Box {
            area_px: footprint.area_px,
        }
    }

    /// View depth of the nearest point of the bounds.
    pub fn distance(&self, frame: &FrameUniform, n: u32) -> f32 {
        nearest_along(frame.forward.into(), self.padded(frame, n))
    }

    /// The bounds as baked, eye-relative.
    pub fn bounds(&self, frame: &FrameUniform, n: u32) -> Box3 {
        let node = &self.nodes[n as usize];
        relative(frame, node.cell, node.min, node.max)
    }

    /// Calls `mark` on a leaf that shows and on what is above it, up to the first node that says it was marked before.
    pub fn pull_up(&self, leaf: u32, mut mark: impl FnMut(u32) -> bool) {
        let mut n = leaf;
        loop {
            let was_marked = mark(n);
            if n == 0 || (was_marked && n != leaf) {
                return;
            }
            n = self.nodes[n as usize].parent;
        }
    }

    /// Surface area of the bounds.
    pub fn surface(&self, n: u32) -> f32 {
        let node = &self.nodes[n as usize];
        let [x, y, z] = [0, 1, 2].map(|axis| node.max[axis] - node.min[axis]);
        2.0 * (x * y + y * z + z * x)
    }
}

/// A vertex in object space, as the vertex fetch decodes it.
pub(crate) fn position(baked: &ArchivedScene, vertex: usize) -> [f32; 3] {
    match baked.quantized_positions.get(vertex) {
        Some(p) => [0, 1, 2].map(|axis| f32::from(p[axis].to_native()) / 65535.0),
        None => baked.positions[vertex].map(|x| x.to_native()),
    }
}

/// A node in a queue, the nearest first; equal ones by number, so that the order is always the same.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Queued {
    pub distance: f32,
    pub node: u32,
}

impl Ord for Queued {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let nearer = other.distance.total_cmp(&self.distance);
        nearer.then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Queued {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Queued {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Queued {}
