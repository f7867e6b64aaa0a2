//! Trees that were built elsewhere, brought into our layout.

use hroc_format::{Bounds, Bvh};

use super::stats::measure;
use super::{BLANK, Builder, Subtree, ceil_log2, parent_of};
use crate::split::EqualCount;

/// The tree whose nodes are, depth first, those of `sequence`: the object of a leaf, `None` for an inner
/// node, whose two children follow it. Every object of `bounds` must be there once. Boxes are computed
/// anew from `bounds`, and subtrees that reach deeper than `max_depth` are rebuilt by halving.
///
/// # Panics
/// If `sequence` is no such tree.
pub fn from_depth_first(bounds: &[Bounds], name: &str, sequence: &[Option<u32>]) -> Bvh {
    assert_eq!(
        sequence.len() + 1,
        2 * bounds.len(),
        "a tree has a leaf for each object"
    );
    let builder = Builder::new(bounds, &EqualCount);
    let objects = builder.objects();
    let mut nodes = vec![BLANK; sequence.len()];
    let mut parents = vec![0; sequence.len()];
    // Backward, so that children are there before their parent: where each subtree ends, and its box.
    for i in (0..sequence.len()).rev() {
        nodes[i] = match sequence[i] {
            Some(object) => builder.leaf(&objects[object as usize], i as u32),
            None => {
                let right = nodes[i + 1].skip as usize;
                parents[i + 1] = i as u32;
                parents[right] = i as u32;
                parent_of(&nodes[i + 1], &nodes[right])
            }
        };
    }
    assert_eq!(nodes[0].skip as usize, nodes.len(), "a tree has one root");

    let mut depths = vec![0; nodes.len()];
    let mut i = 0;
    while i < nodes.len() {
        if i > 0 {
            depths[i] = depths[parents[i] as usize] + 1;
        }
        let end = nodes[i].skip as usize;
        let leaves = (end - i).div_ceil(2);
        // Halving from here on ends at the limit; one level deeper it would not.
        if leaves > 2 && depths[i] + ceil_log2(leaves) >= builder.max_depth {
            let below = nodes[i..end].iter();
            let mut objects: Vec<_> = below
                .filter_map(|node| node.object())
                .map(|object| objects[object as usize])
                .collect();
            builder.build_subtree(Subtree {
                objects: &mut objects,
                index: i as u32,
                parent: parents[i],
                depth: depths[i],
                nodes: &mut nodes[i..end],
                parents: &mut parents[i..end],
            });
            i = end;
        } else {
            i += 1;
        }
    }
    Bvh {
        split: name.to_owned(),
        stats: measure(&nodes),
        nodes,
        parents,
        leaf_of_object: builder.into_leaf_of_object(),
    }
}
