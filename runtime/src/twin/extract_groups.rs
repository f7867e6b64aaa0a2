//! Twin of extract_groups.wgsl.

use hroc_format::{ArchivedBvhNode, NO_OBJECT};

use super::bounds::{Box3, in_frustum, padded, screen_area, touches_near};
use super::{contains, insert};
use crate::frame_uniform::FrameUniform;

/// A tree as the stage reads it.
#[derive(Clone, Copy, Debug)]
pub struct TreeView<'a> {
    /// Nodes in depth-first order.
    pub nodes: &'a [ArchivedBvhNode],
    /// Parent of each node.
    pub parents: &'a [u32],
    /// Leaf of each object.
    pub leaf_of_object: &'a [u32],
}

/// What the stage finds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Groups {
    /// One bit per node: has an effective occluder below it.
    pub visible_nodes: Vec<u32>,
    /// The groups' nodes in ascending order (the shader appends them in any order).
    pub groups: Vec<u32>,
    /// One bit per object: leaves that touch the near plane and go to U untested.
    pub untested: Vec<u32>,
}

/// Runs the stage on sets of one bit per object. `largest_group_px` is the frame's threshold of adaptive
/// grouping.
pub fn extract_groups(
    frame: &FrameUniform,
    tree: TreeView<'_>,
    potential_occluders: &[u32],
    effective_occluders: &[u32],
    largest_group_px: f32,
) -> Groups {
    let mut visible_nodes = vec![0; tree.nodes.len().div_ceil(32)];
    for object in crate::readback::members_of(effective_occluders) {
        let mut n = tree.leaf_of_object[object as usize];
        while !insert(&mut visible_nodes, n) && n != 0 {
            n = tree.parents[n as usize];
        }
    }
    let box_of = |n: u32| {
        let node = &tree.nodes[n as usize];
        padded(
            frame,
            node.min.map(|x| x.to_native()),
            node.max.map(|x| x.to_native()),
        )
    };
    let refine = |b: Box3| touches_near(frame, b) || screen_area(frame, b) > largest_group_px;
    let mut groups = Vec::new();
    let mut untested = vec![0; potential_occluders.len()];
    for n in 0..tree.nodes.len() as u32 {
        if contains(&visible_nodes, n) {
            continue;
        }
        let parent = tree.parents[n as usize];
        if n != 0 && !contains(&visible_nodes, parent) && !refine(box_of(parent)) {
            continue;
        }
        let b = box_of(n);
        if !in_frustum(frame, b) {
            continue;
        }
        let object = tree.nodes[n as usize].object.to_native();
        if object == NO_OBJECT {
            if !refine(b) {
                groups.push(n);
            }
        } else if !touches_near(frame, b) {
            groups.push(n);
        } else if !contains(potential_occluders, object) {
            insert(&mut untested, object);
        }
    }
    Groups {
        visible_nodes,
        groups,
        untested,
    }
}
