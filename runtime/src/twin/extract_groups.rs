//! Twin of extract_groups.wgsl.

use hroc_format::{ArchivedBvhNode, ObjectBounds};

use super::bounds::{
    Box3, LARGEST_NDC, footprint, in_frustum, padded_bounds, padded_node, rasterized, touches_near,
};
use super::{contains, insert};
use crate::frame_uniform::FrameUniform;

/// `SMALLEST_THRESHOLD_PX` of extract_groups.wgsl.
const SMALLEST_THRESHOLD_PX: f32 = 16.0;
/// `LARGEST_THRESHOLD_PX` there.
const LARGEST_THRESHOLD_PX: f32 = 1e9;

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

/// Runs the stage on sets of one bit per object. `moving_bounds`: bounds of the objects that move, from
/// the first id after the tree's; `largest_group_px`: the frame's threshold of adaptive grouping.
pub fn extract_groups(
    frame: &FrameUniform,
    tree: TreeView<'_>,
    moving_bounds: &[ObjectBounds],
    potential_occluders: &[u32],
    effective_occluders: &[u32],
    largest_group_px: f32,
) -> Groups {
    let mut visible_nodes = vec![0; tree.nodes.len().div_ceil(32)];
    for object in crate::readback::members_of(effective_occluders) {
        let Some(&leaf) = tree.leaf_of_object.get(object as usize) else {
            continue;
        };
        let mut n = leaf;
        while !insert(&mut visible_nodes, n) && n != 0 {
            n = tree.parents[n as usize];
        }
    }
    let box_of = |n: u32| padded_node(frame, &tree.nodes[n as usize]);
    // Of a padded box; `None` where no rasterized box can stand for it.
    let area_px = |b: Box3| {
        let outer = rasterized(frame, b);
        if touches_near(frame, outer) {
            return None;
        }
        let footprint = footprint(frame, outer);
        (footprint.farthest_ndc <= LARGEST_NDC).then_some(footprint.area_px)
    };
    let refine = |b: Box3| area_px(b).is_none_or(|px| px > largest_group_px);
    let mut groups = Vec::new();
    let mut untested = vec![0; potential_occluders.len()];
    let mut test_object = |object: u32, n: u32, b: Box3| {
        if area_px(b).is_some() {
            groups.push(n);
        } else if !contains(potential_occluders, object) {
            insert(&mut untested, object);
        }
    };
    let mut interior = Vec::new();
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
        if let Some(object) = tree.nodes[n as usize].object() {
            test_object(object, n, b);
        } else if !refine(b) {
            interior.push(n);
        }
    }
    for (bounds, slot) in moving_bounds.iter().zip(0..) {
        let object = frame.static_count + slot;
        let b = padded_bounds(frame, bounds);
        let empty = bounds.min[0] > bounds.max[0];
        if !empty && !contains(potential_occluders, object) && in_frustum(frame, b) {
            test_object(object, frame.node_count + slot, b);
        }
    }
    groups.extend(interior);
    groups.sort_unstable();
    Groups {
        visible_nodes,
        groups,
        untested,
    }
}

/// The threshold of a frame's groups, pixels, from the last one's (0: there was none) and from the fragments and
/// survivors that the last batch occlusion test sampled. A `box_cost` of 0 stands for the published grouping.
pub fn choose_threshold(last_px: f32, fragments: u32, survivors: u32, box_cost: f32) -> f32 {
    if box_cost == 0.0 {
        return LARGEST_THRESHOLD_PX;
    }
    if fragments == 0 {
        return if last_px == 0.0 {
            16.0 * box_cost
        } else {
            last_px
        };
    }
    let share = (survivors as f32 + 0.5) / fragments as f32;
    let wanted = (box_cost / (2.0 * share)).clamp(SMALLEST_THRESHOLD_PX, LARGEST_THRESHOLD_PX);
    let before = if last_px == 0.0 { wanted } else { last_px };
    let ratio = wanted / before;
    if (0.5..=2.0).contains(&ratio) {
        before
    } else {
        (before * wanted).sqrt()
    }
}
