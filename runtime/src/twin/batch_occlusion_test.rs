//! Twin of batch_occlusion_test.wgsl: what one fragment of a group's box decides.

use glam::Vec2;
use hroc_format::{ArchivedBvhNode, ObjectBounds};

use super::bounds::{
    Box3, earliest_in, entry, may_show, padded_bounds, padded_node, pixel_ray, shows,
};
use crate::frame_uniform::FrameUniform;

/// What the stage reads of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Tested<'a> {
    /// Nodes of the tree in depth-first order.
    pub nodes: &'a [ArchivedBvhNode],
    /// Bounds of the objects that move, from the first id after the tree's.
    pub moving_bounds: &'a [ObjectBounds],
}

impl Tested<'_> {
    /// The padded bounds of a group: a node, or an object that moves.
    pub fn group_box(&self, frame: &FrameUniform, group: u32) -> Box3 {
        match self.nodes.get(group as usize) {
            Some(node) => padded_node(frame, node),
            None => {
                let bounds = &self.moving_bounds[(group - frame.node_count) as usize];
                padded_bounds(frame, bounds)
            }
        }
    }

    /// Calls `flag` with each object of `group` that the ray through a pixel `position` finds in front of the map's
    /// `depth` there. Without pruning, which leaves out only what was flagged before.
    pub fn test_fragment(
        &self,
        frame: &FrameUniform,
        reversed: bool,
        group: u32,
        position: Vec2,
        depth: f32,
        mut flag: impl FnMut(u32),
    ) {
        let earliest = earliest_in(frame, reversed, self.group_box(frame, group));
        if !shows(reversed, earliest, depth) {
            return;
        }
        let ray = pixel_ray(frame, position);
        let meets = |b: Box3| {
            let t = entry(ray, b, frame.near);
            t >= 0.0 && may_show(frame, reversed, b, t, depth)
        };
        let Some(root) = self.nodes.get(group as usize) else {
            if meets(self.group_box(frame, group)) {
                flag(frame.static_count + group - frame.node_count);
            }
            return;
        };
        let mut n = group;
        while n < root.skip.to_native() {
            let node = &self.nodes[n as usize];
            if !meets(padded_node(frame, node)) {
                n = node.skip.to_native();
                continue;
            }
            if let Some(object) = node.object() {
                flag(object);
            }
            n += 1;
        }
    }
}
