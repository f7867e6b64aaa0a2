//! The tree builder. It owns the tree: layout, unions, parents, depth bound, threads. A
//! [`SplitRule`] answers one question only, where a node's objects are cut in two.
//!
//! With leaf size 1 a subtree over `k` objects takes `2k - 1` nodes, so in depth-first order the
//! place of every subtree is known before it is built. Subtrees are built in parallel into their own
//! slices, and the tree does not depend on the number of threads.

mod aabb;
mod depth_first;
mod stats;

use aabb::Scale;
pub use aabb::{Aabb, ObjectBox, middle_bounds};
pub use depth_first::from_depth_first;
use stats::Subtotal;
pub use stats::measure_in_cells;

use std::sync::atomic::{AtomicU32, Ordering};

use hroc_format::{Bounds, Bvh, BvhNode, MAX_OBJECTS};

use crate::split::{Cut, SplitRule};

/// Subtrees below this size are not worth handing to another thread.
const PARALLEL_MIN_OBJECTS: usize = 256;

/// Levels beyond twice the balanced depth that a tree may have; lets small trees be lopsided.
const DEPTH_SLACK: u32 = 8;

/// Why no tree was built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// There is nothing to build a tree over.
    #[error("no objects to build a tree over; leave the tree out of an empty scene")]
    NoObjects,
    /// The object of a leaf is 24 bits wide.
    #[error("{objects} objects are more than a tree can hold ({MAX_OBJECTS}); split the scene")]
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
/// When there are no objects or more than [`MAX_OBJECTS`], or a box is inverted or not finite.
pub fn build(bounds: &[Bounds], rule: &dyn SplitRule) -> Result<Bvh, BuildError> {
    check_bounds(bounds)?;
    let builder = Builder::new(bounds, rule);
    let mut objects = builder.objects();
    let mut nodes = vec![BLANK; 2 * bounds.len() - 1];
    let mut parents = vec![0; nodes.len()];
    let total = builder.build_subtree(Subtree {
        objects: &mut objects,
        nodes: &mut nodes,
        parents: &mut parents,
        index: 0,
        parent: 0,
        depth: 0,
    });
    Ok(Bvh {
        split: rule.name().to_owned(),
        stats: total.stats(&nodes[0]),
        nodes,
        parents,
        leaf_of_object: builder.into_leaf_of_object(),
    })
}

/// Whether a tree can be built over the boxes.
///
/// # Errors
/// As [`build`].
pub fn check_bounds(bounds: &[Bounds]) -> Result<(), BuildError> {
    if bounds.is_empty() {
        return Err(BuildError::NoObjects);
    }
    if bounds.len() > MAX_OBJECTS {
        return Err(BuildError::TooManyObjects {
            objects: bounds.len(),
        });
    }
    let Some(object) = bounds.iter().position(|b| !is_box(b)) else {
        return Ok(());
    };
    let Bounds { min, max } = bounds[object];
    if min.iter().chain(&max).all(|x| x.is_finite()) {
        Err(BuildError::Inverted { object, min, max })
    } else {
        Err(BuildError::NotFinite { object, min, max })
    }
}

/// Whether the bounds are finite and not inverted, with one branch.
#[inline]
fn is_box(Bounds { min, max }: &Bounds) -> bool {
    (0..3).fold(true, |good, axis| {
        good & (-f32::MAX <= min[axis]) & (min[axis] <= max[axis]) & (max[axis] <= f32::MAX)
    })
}

/// A node that is yet to be made.
const BLANK: BvhNode = BvhNode {
    min: [0.0; 3],
    skip: 0,
    max: [0.0; 3],
    cell_and_object: 0,
};

struct Builder<'a> {
    rule: &'a dyn SplitRule,
    max_depth: u32,
    bounds: &'a [Bounds],
    scale: Scale,
    /// Every leaf writes its own; atomic because leaves are made on all threads.
    leaf_of_object: Vec<AtomicU32>,
}

/// A subtree to build, with the slices it fills. `nodes` and `parents` are `2 * objects.len() - 1` long.
struct Subtree<'a> {
    objects: &'a mut [ObjectBox],
    nodes: &'a mut [BvhNode],
    parents: &'a mut [u32],
    /// Index of the subtree's root in the whole tree.
    index: u32,
    parent: u32,
    depth: u32,
}

impl<'a> Builder<'a> {
    fn new(bounds: &'a [Bounds], rule: &'a dyn SplitRule) -> Self {
        Self {
            rule,
            max_depth: max_depth(bounds.len()),
            bounds,
            scale: Scale::new(bounds),
            leaf_of_object: bounds.iter().map(|_| AtomicU32::new(0)).collect(),
        }
    }

    fn into_leaf_of_object(self) -> Vec<u32> {
        let leaves = self.leaf_of_object.into_iter();
        leaves.map(AtomicU32::into_inner).collect()
    }

    /// All objects in their order.
    fn objects(&self) -> Vec<ObjectBox> {
        let object = |(id, b)| ObjectBox::new(id as u32, b, self.scale);
        self.bounds.iter().enumerate().map(object).collect()
    }

    /// The leaf of an object, to stand at `index`.
    #[inline]
    fn leaf(&self, object: &ObjectBox, index: u32) -> BvhNode {
        let id = object.id();
        self.leaf_of_object[id as usize].store(index, Ordering::Relaxed);
        // The box at hand rather than the one given, which lies anywhere in memory.
        let Bounds { min, max } = if self.scale.is_exact() {
            object.unscaled(self.scale)
        } else {
            self.bounds[id as usize]
        };
        BvhNode {
            min,
            skip: index + 1,
            max,
            cell_and_object: BvhNode::pack(0, Some(id)),
        }
    }

    /// Recursion is safe: it is never deeper than [`max_depth`].
    fn build_subtree(&self, subtree: Subtree) -> Subtotal {
        let Subtree {
            objects,
            nodes,
            parents,
            index,
            parent,
            depth,
        } = subtree;
        parents[0] = parent;
        if let [object] = objects {
            nodes[0] = self.leaf(object, index);
            return Subtotal::leaf(&nodes[0]);
        }
        let left_count = self.partition(objects, depth);

        let left_nodes = 2 * left_count - 1;
        let (left_objects, right_objects) = objects.split_at_mut(left_count);
        let (node, below) = nodes.split_at_mut(1);
        let (left_slice, right_slice) = below.split_at_mut(left_nodes);
        let (left_parents, right_parents) = parents[1..].split_at_mut(left_nodes);
        let parallel = left_objects.len().min(right_objects.len()) >= PARALLEL_MIN_OBJECTS;
        let left = Subtree {
            objects: left_objects,
            nodes: left_slice,
            parents: left_parents,
            index: index + 1,
            parent: index,
            depth: depth + 1,
        };
        let right = Subtree {
            objects: right_objects,
            nodes: right_slice,
            parents: right_parents,
            index: index + 1 + left_nodes as u32,
            parent: index,
            depth: depth + 1,
        };
        let (left_total, right_total) = if parallel {
            rayon::join(|| self.build_subtree(left), || self.build_subtree(right))
        } else {
            (self.build_subtree(left), self.build_subtree(right))
        };
        let (left, right) = (&left_slice[0], &right_slice[0]);
        node[0] = parent_of(left, right);
        Subtotal::inner(&node[0], [(left, left_total), (right, right_total)])
    }

    /// Orders the objects of a node so that those of the left child come first, and returns how many
    /// they are. The order within both sides depends on `objects` alone.
    fn partition(&self, objects: &mut [ObjectBox], depth: u32) -> usize {
        let count = objects.len();
        if count == 2 {
            // Two in five nodes: there is one way to cut a pair.
            return 1;
        }
        // Halving from here on ends at `depth + ceil_log2`: past the last point where a lopsided cut
        // still leaves room for that, halve.
        if depth + ceil_log2(count) < self.max_depth {
            let left = partition(objects, self.rule.cut(objects));
            if 0 < left && left < count {
                return left;
            }
        }
        partition(objects, Cut::halves(objects))
    }
}

/// The inner node over two neighbours.
#[inline]
fn parent_of(left: &BvhNode, right: &BvhNode) -> BvhNode {
    // Of two zeros the left one, which `f32::min` would not promise: the file is the same everywhere.
    let smaller = |l: f32, r: f32| if r < l { r } else { l };
    let larger = |l: f32, r: f32| if r > l { r } else { l };
    BvhNode {
        min: std::array::from_fn(|axis| smaller(left.min[axis], right.min[axis])),
        skip: right.skip,
        max: std::array::from_fn(|axis| larger(left.max[axis], right.max[axis])),
        cell_and_object: BvhNode::INTERIOR,
    }
}

/// Moves the objects left of the cut to the front and returns how many they are.
fn partition(objects: &mut [ObjectBox], cut: Cut) -> usize {
    match cut {
        Cut::Plane { axis, position } => {
            // Every object trades places with the first on the right, and only one on the left moves
            // that place on: no branch depends on the data, which a processor would mispredict every
            // other time.
            let mut left = 0;
            for i in 0..objects.len() {
                let is_left = objects[i].middle_on(axis) < position;
                objects.swap(i, left);
                left += usize::from(is_left);
            }
            left
        }
        Cut::Count { axis, left } => {
            let order = |a: &ObjectBox, b: &ObjectBox| {
                let by_middle = a.middle_on(axis).total_cmp(&b.middle_on(axis));
                by_middle.then(a.id().cmp(&b.id()))
            };
            if left > 0 && left < objects.len() {
                objects.select_nth_unstable_by(left, order);
            }
            left.min(objects.len())
        }
    }
}
