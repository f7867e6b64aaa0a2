//! A tree: that following it visits every object once and ends, and that its boxes nest.

use super::{CellBox, Result, ensure, is_box, same_count};
use crate::types::{ArchivedBvh, ArchivedObjectBounds, BvhNode};

/// Why this is enough: every interior node `i` has its left child at `i + 1`, its right child at the
/// end of the left, and the right ends where `i` does; so each subtree `i..skip` is the node and its two
/// children's subtrees, end to end, and all nodes are in the root's. A binary tree of 2N-1 nodes has N
/// leaves, and no two leaves have the same object, since `leaf_of_object` can name only one of them.
pub(super) fn check(
    bvh: &ArchivedBvh,
    object_bounds: &[ArchivedObjectBounds],
    origins: &[[f64; 3]],
) -> Result {
    let nodes = bvh.nodes.as_slice();
    let part = |part: &str| format!("tree {}, {part}", bvh.split);
    same_count(
        &part("nodes"),
        nodes.len(),
        (2 * object_bounds.len()).saturating_sub(1),
    )?;
    same_count(&part("parents"), bvh.parents.len(), nodes.len())?;
    same_count(
        &part("leaf of object"),
        bvh.leaf_of_object.len(),
        object_bounds.len(),
    )?;
    let Some(root) = nodes.first() else {
        return ensure(
            false,
            || format!("tree {}", bvh.split),
            || "is over no objects".into(),
        );
    };
    let (parents, leaf_of_object) = (bvh.parents(), bvh.leaf_of_object());
    let end = root.skip.to_native() as usize;
    ensure(
        end == nodes.len(),
        || part("node 0"),
        || format!("ends at {end} of {}", nodes.len()),
    )?;
    ensure(
        parents[0] == 0,
        || part("node 0"),
        || format!("parent {}, should be itself", parents[0]),
    )?;

    for (i, stored) in nodes.iter().enumerate() {
        let at = || part(&format!("node {i}"));
        let node = stored.to_native();
        // At most `nodes.len()`, as the root's is and each child was held against its parent.
        let skip = node.skip as usize;
        ensure(is_box(node.min, node.max), at, || {
            format!("bounds {:?} to {:?}", node.min, node.max)
        })?;
        ensure((node.cell() as usize) < origins.len(), at, || {
            format!("cell {} of {}", node.cell(), origins.len())
        })?;
        let Some(object) = node.object() else {
            let left = i + 1;
            ensure(left < skip, at, || {
                "an interior node without children".into()
            })?;
            let right = nodes[left].skip.to_native() as usize;
            ensure(left < right && right < skip, at, || {
                format!("right child {right}, its end is {skip}")
            })?;
            let right_end = nodes[right].skip.to_native() as usize;
            ensure(right_end == skip, at, || {
                format!("ends at {skip}, its right child at {right_end}")
            })?;
            for child in [left, right] {
                let parent = parents[child] as usize;
                ensure(
                    parent == i,
                    || part(&format!("node {child}")),
                    || format!("parent {parent}, should be {i}"),
                )?;
                let inside = cell_box(&nodes[child].to_native());
                // The child's cell is checked with the child; until then it may be out of range.
                let known = (inside.cell as usize) < origins.len();
                ensure(
                    known && cell_box(&node).contains(&inside, origins),
                    at,
                    || format!("does not contain its child {child}"),
                )?;
            }
            continue;
        };
        ensure(skip == i + 1, at, || format!("a leaf that ends at {skip}"))?;
        let (object, count) = (object as usize, object_bounds.len());
        ensure(object < count, at, || format!("object {object} of {count}"))?;
        let leaf = leaf_of_object[object];
        ensure(leaf as usize == i, at, || {
            format!("object {object}, whose leaf is node {leaf}")
        })?;
        let bounds = &object_bounds[object];
        let same = node.cell() == bounds.cell.to_native()
            && same_bits(&stored.min, &bounds.min)
            && same_bits(&stored.max, &bounds.max);
        ensure(same, at, || {
            format!("its bounds are not those of object {object}")
        })?;
    }
    stats(bvh)
}

/// Depth is exact, as readers may size their stacks by it; the measures are finite and not negative.
fn stats(bvh: &ArchivedBvh) -> Result {
    let at = || format!("tree {}, statistics", bvh.split);
    let stats = bvh.stats.to_native();
    ensure(stats.reserved == 0, at, || "reserved bytes in use".into())?;
    for (name, value) in [
        ("mean leaf depth", stats.mean_leaf_depth),
        ("SAH cost", stats.sah_cost),
        ("overlap", stats.overlap),
    ] {
        ensure(value.is_finite() && value >= 0.0, at, || {
            format!("{name} {value}")
        })?;
    }
    let mut depths = vec![0_u32; bvh.nodes.len()];
    // Parents come before their children, so theirs is known.
    for (i, &parent) in bvh.parents().iter().enumerate().skip(1) {
        depths[i] = depths[parent as usize] + 1;
    }
    let depth = depths.into_iter().max().unwrap_or(0);
    ensure(stats.depth == depth, at, || {
        format!("depth {}, should be {depth}", stats.depth)
    })
}

fn cell_box(node: &BvhNode) -> CellBox {
    CellBox {
        cell: node.cell(),
        min: node.min,
        max: node.max,
    }
}

/// Not `==`, for which -0 equals 0.
fn same_bits(a: &[rend::f32_le; 3], b: &[rend::f32_le; 3]) -> bool {
    bytemuck::cast_ref::<_, [u32; 3]>(a) == bytemuck::cast_ref::<_, [u32; 3]>(b)
}
