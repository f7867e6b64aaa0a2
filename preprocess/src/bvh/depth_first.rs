//! Trees that were built elsewhere, brought into our layout.

use hroc_format::{Bounds, Bvh, BvhNode, NO_OBJECT};

use super::{Builder, ObjectBox, Subtree, ceil_log2, finish, max_depth};
use crate::split::EqualCount;

/// The tree whose nodes are, depth first, those of `sequence`: the object of a leaf, `None` for an inner
/// node, whose two children follow it. Every object of `bounds` must be there once. Boxes are computed
/// anew from `bounds`, and subtrees that reach deeper than [`max_depth`] are rebuilt by halving.
///
/// # Panics
/// If `sequence` is no such tree.
pub fn from_depth_first(bounds: &[Bounds], name: &str, sequence: &[Option<u32>]) -> Bvh {
    assert_eq!(
        sequence.len() + 1,
        2 * bounds.len(),
        "a tree has a leaf for each object"
    );
    let empty = BvhNode {
        min: [0.0; 3],
        skip: 0,
        max: [0.0; 3],
        object: NO_OBJECT,
    };
    let mut nodes = vec![empty; sequence.len()];
    let mut parents = vec![0; sequence.len()];
    // Backward, so that children are there before their parent: where each subtree ends, and its box.
    for i in (0..sequence.len()).rev() {
        nodes[i] = match sequence[i] {
            Some(object) => {
                let Bounds { min, max } = bounds[object as usize];
                BvhNode {
                    min,
                    skip: i as u32 + 1,
                    max,
                    object,
                }
            }
            None => {
                let left = nodes[i + 1];
                let right_index = left.skip as usize;
                let right = nodes[right_index];
                parents[i + 1] = i as u32;
                parents[right_index] = i as u32;
                BvhNode {
                    min: std::array::from_fn(|axis| left.min[axis].min(right.min[axis])),
                    skip: right.skip,
                    max: std::array::from_fn(|axis| left.max[axis].max(right.max[axis])),
                    object: NO_OBJECT,
                }
            }
        };
    }
    assert_eq!(nodes[0].skip as usize, nodes.len(), "a tree has one root");

    let builder = Builder {
        rule: &EqualCount,
        max_depth: max_depth(bounds.len()),
    };
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
            let mut objects: Vec<_> = nodes[i..end]
                .iter()
                .filter(|node| node.object != NO_OBJECT)
                .map(|leaf| ObjectBox::new(leaf.object, &bounds[leaf.object as usize]))
                .collect();
            builder.build_subtree(Subtree {
                scratch: &mut objects.clone(),
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
    finish(bounds.len(), name, nodes, parents)
}
