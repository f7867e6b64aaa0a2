//! The tree builder. It owns the tree: layout, unions, parents, depth bound, threads. A
//! [`SplitRule`] answers one question only, where a node's objects are cut in two.
//!
//! With leaf size 1 a subtree over `k` objects takes `2k - 1` nodes, so in depth-first order the
//! place of every subtree is known before it is built. Subtrees are built in parallel into their own
//! slices, and the tree does not depend on the number of threads.

mod aabb;
mod depth_first;
mod stats;

pub use aabb::{Aabb, ObjectBox};
pub use depth_first::from_depth_first;

use hroc_format::{Bounds, Bvh, BvhNode, NO_OBJECT};

use crate::split::{Cut, NodeObjects, SplitRule};

/// Subtrees below this size are not worth handing to another thread.
const PARALLEL_MIN_OBJECTS: usize = 4096;

/// Levels beyond twice the balanced depth that a tree may have; lets small trees be lopsided.
const DEPTH_SLACK: u32 = 8;

/// Why no tree was built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// There is nothing to build a tree over.
    #[error("no objects to build a tree over; leave the tree out of an empty scene")]
    NoObjects,
    /// Node indices are 32 bits wide.
    #[error("{objects} objects are more than a tree can hold (2^31 - 1); split the scene")]
    TooManyObjects {
        /// How many there are.
        objects: usize,
    },
    /// A corner is infinite or not a number.
    #[error(
        "bounds of object {object} are not finite (min {min:?}, max {max:?}); check its vertices and transform"
    )]
    NotFinite {
        /// The object.
        object: usize,
        /// Its smallest corner.
        min: [f32; 3],
        /// Its largest corner.
        max: [f32; 3],
    },
    /// A minimum lies above its maximum.
    #[error(
        "bounds of object {object} are inverted (min {min:?} above max {max:?}); recompute them"
    )]
    Inverted {
        /// The object.
        object: usize,
        /// Its smallest corner.
        min: [f32; 3],
        /// Its largest corner.
        max: [f32; 3],
    },
}

/// The largest depth (edges from root to leaf) of a tree over `objects` objects, whatever the rule and
/// the boxes: `2 * ceil(log2 objects) + 8`.
pub fn max_depth(objects: usize) -> u32 {
    2 * ceil_log2(objects) + DEPTH_SLACK
}

/// Depth of a balanced tree over `objects` objects.
fn ceil_log2(objects: usize) -> u32 {
    objects.next_power_of_two().trailing_zeros()
}

/// Builds the tree over `bounds`, cut by `rule`. Runs on the current rayon pool.
///
/// # Errors
/// When there are no objects or more than 2^31 - 1, or a box is inverted or not finite.
pub fn build(bounds: &[Bounds], rule: &dyn SplitRule) -> Result<Bvh, BuildError> {
    let mut objects = checked_objects(bounds)?;
    let node_count = 2 * bounds.len() - 1;
    let mut nodes = vec![
        BvhNode {
            min: [0.0; 3],
            skip: 0,
            max: [0.0; 3],
            object: 0
        };
        node_count
    ];
    let mut parents = vec![0; node_count];
    let mut scratch = objects.clone();
    let builder = Builder {
        rule,
        max_depth: max_depth(bounds.len()),
    };
    builder.build_subtree(Subtree {
        objects: &mut objects,
        scratch: &mut scratch,
        nodes: &mut nodes,
        parents: &mut parents,
        index: 0,
        parent: 0,
        depth: 0,
    });
    Ok(finish(bounds.len(), rule.name(), nodes, parents))
}

/// Adds what follows from the nodes.
fn finish(objects: usize, name: &str, nodes: Vec<BvhNode>, parents: Vec<u32>) -> Bvh {
    let mut leaf_of_object = vec![0; objects];
    for (i, node) in nodes.iter().enumerate() {
        if node.object != NO_OBJECT {
            leaf_of_object[node.object as usize] = i as u32;
        }
    }
    let stats = stats::measure(&nodes, &parents);
    Bvh {
        split: name.to_owned(),
        nodes,
        parents,
        leaf_of_object,
        stats,
    }
}

/// Whether a tree can be built over the boxes.
///
/// # Errors
/// As [`build`].
pub fn check_bounds(bounds: &[Bounds]) -> Result<(), BuildError> {
    checked_objects(bounds).map(drop)
}

fn checked_objects(bounds: &[Bounds]) -> Result<Vec<ObjectBox>, BuildError> {
    if bounds.is_empty() {
        return Err(BuildError::NoObjects);
    }
    if bounds.len() > i32::MAX as usize {
        return Err(BuildError::TooManyObjects {
            objects: bounds.len(),
        });
    }
    let check = |(object, b): (usize, &Bounds)| {
        let (min, max) = (b.min, b.max);
        if !min.iter().chain(&max).all(|x| x.is_finite()) {
            Err(BuildError::NotFinite { object, min, max })
        } else if (0..3).any(|axis| min[axis] > max[axis]) {
            Err(BuildError::Inverted { object, min, max })
        } else {
            Ok(ObjectBox::new(object as u32, b))
        }
    };
    bounds.iter().enumerate().map(check).collect()
}

struct Builder<'a> {
    rule: &'a dyn SplitRule,
    max_depth: u32,
}

/// A subtree to build, with the slices it fills. `scratch` is as long as `objects`, `nodes` and
/// `parents` are `2 * objects.len() - 1`.
struct Subtree<'a> {
    objects: &'a mut [ObjectBox],
    scratch: &'a mut [ObjectBox],
    nodes: &'a mut [BvhNode],
    parents: &'a mut [u32],
    /// Index of the subtree's root in the whole tree.
    index: u32,
    parent: u32,
    depth: u32,
}

impl Builder<'_> {
    /// Recursion is safe: it is never deeper than [`max_depth`].
    fn build_subtree(&self, subtree: Subtree) {
        let Subtree {
            objects,
            scratch,
            nodes,
            parents,
            index,
            parent,
            depth,
        } = subtree;
        let skip = index + nodes.len() as u32;
        parents[0] = parent;
        if let [leaf] = objects {
            let Bounds { min, max } = leaf.bounds();
            nodes[0] = BvhNode {
                min,
                skip,
                max,
                object: leaf.id,
            };
            return;
        }
        let node = NodeObjects::new(objects);
        nodes[0] = BvhNode {
            min: node.bounds.min.truncate().to_array(),
            skip,
            max: node.bounds.max.truncate().to_array(),
            object: NO_OBJECT,
        };
        let halves = Cut::halves(&node);
        // Halving from here on ends at `depth + ceil_log2`: past the last point where a lopsided cut
        // still leaves room for that, halve. Two objects can only be cut in one way.
        let must_halve = objects.len() == 2 || depth + ceil_log2(objects.len()) >= self.max_depth;
        let cut = if must_halve {
            halves
        } else {
            self.rule.cut(&node)
        };
        let left_count = match partition(objects, scratch, cut) {
            0 => partition(objects, scratch, halves),
            all if all == objects.len() => partition(objects, scratch, halves),
            count => count,
        };

        let left_nodes = 2 * left_count - 1;
        let (left_objects, right_objects) = objects.split_at_mut(left_count);
        let (left_scratch, right_scratch) = scratch.split_at_mut(left_count);
        let (left_slice, right_slice) = nodes[1..].split_at_mut(left_nodes);
        let (left_parents, right_parents) = parents[1..].split_at_mut(left_nodes);
        let parallel = left_objects.len().min(right_objects.len()) >= PARALLEL_MIN_OBJECTS;
        let left = Subtree {
            objects: left_objects,
            scratch: left_scratch,
            nodes: left_slice,
            parents: left_parents,
            index: index + 1,
            parent: index,
            depth: depth + 1,
        };
        let right = Subtree {
            objects: right_objects,
            scratch: right_scratch,
            nodes: right_slice,
            parents: right_parents,
            index: index + 1 + left_nodes as u32,
            parent: index,
            depth: depth + 1,
        };
        if parallel {
            rayon::join(|| self.build_subtree(left), || self.build_subtree(right));
        } else {
            self.build_subtree(left);
            self.build_subtree(right);
        }
    }
}

/// Moves the objects left of the cut to the front and returns how many they are. The order within
/// both sides depends on `objects` and `cut` alone.
fn partition(objects: &mut [ObjectBox], scratch: &mut [ObjectBox], cut: Cut) -> usize {
    match cut {
        Cut::Plane { axis, position } => {
            // Every object is written to both sides and only one side moves on: no branch depends on
            // the data, which a processor would mispredict every other time.
            let (mut left, mut right) = (0, 0);
            for i in 0..objects.len() {
                let object = objects[i];
                let is_left = object.centroid_on(axis) < position;
                objects[left] = object;
                scratch[right] = object;
                left += usize::from(is_left);
                right += usize::from(!is_left);
            }
            objects[left..].copy_from_slice(&scratch[..right]);
            left
        }
        Cut::Count { axis, left } => {
            let order = |a: &ObjectBox, b: &ObjectBox| {
                let by_centroid = a.centroid_on(axis).total_cmp(&b.centroid_on(axis));
                by_centroid.then(a.id.cmp(&b.id))
            };
            match objects {
                // Two in five nodes hold a pair, which needs no selection.
                [a, b] if left == 1 && order(a, b).is_gt() => std::mem::swap(a, b),
                [_, _] => {}
                _ if left > 0 && left < objects.len() => {
                    objects.select_nth_unstable_by(left, order);
                }
                _ => {}
            }
            left.min(objects.len())
        }
    }
}
