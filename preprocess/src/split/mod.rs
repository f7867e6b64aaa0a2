//! The split rules: where a node of the tree is cut in two. A new rule is one file here and one line
//! in [`RULES`]; the builder, the command line and the tests then know it.

mod equal_count;
mod middle;
mod sah;

pub use equal_count::EqualCount;
pub use middle::Middle;
pub use sah::Sah;

use crate::bvh::{Aabb, ObjectBox};

/// Every rule, the default first.
pub const RULES: &[&dyn SplitRule] = &[&Sah, &Middle, &EqualCount];

/// The rule of that name.
pub fn by_name(name: &str) -> Option<&'static dyn SplitRule> {
    RULES.iter().copied().find(|rule| rule.name() == name)
}

/// Answers where the objects of a node are cut in two.
pub trait SplitRule: Sync {
    /// Its name on the command line and in baked files: lower case, words joined by hyphens.
    fn name(&self) -> &'static str;

    /// One line for the help text.
    fn describe(&self) -> &'static str;

    /// Where to cut; asked for three objects and more. The answer must depend on `node` alone. A cut
    /// that leaves one side empty is replaced by [`Cut::halves`], and so is any cut where the tree
    /// would otherwise become deeper than [`max_depth`](crate::bvh::max_depth).
    fn cut(&self, node: &NodeObjects) -> Cut;
}

/// A cut through a node's objects. Axes are 0, 1, 2 for x, y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cut {
    /// Objects whose centroid lies below `position` go left, all others right.
    Plane {
        /// The axis the plane is perpendicular to.
        axis: usize,
        /// Where the plane crosses the axis, world.
        position: f32,
    },
    /// The first `left` objects in order of their centroid on `axis`, then of their id, go left.
    Count {
        /// The axis of the order.
        axis: usize,
        /// Number of objects on the left.
        left: usize,
    },
}

impl Cut {
    /// As many objects left as right (one more on the right if odd), ordered on the axis on which
    /// their centroids spread most.
    pub fn halves(node: &NodeObjects) -> Self {
        Self::Count {
            axis: node.centroid_bounds.longest_axis(),
            left: node.objects.len() / 2,
        }
    }
}

/// The objects of a node and the boxes every rule needs.
pub struct NodeObjects<'a> {
    /// The objects, at least two. Their order is the same in every build of the same scene.
    pub objects: &'a [ObjectBox],
    /// Union of their bounds.
    pub bounds: Aabb,
    /// Bounds of their centroids.
    pub centroid_bounds: Aabb,
}

impl<'a> NodeObjects<'a> {
    /// Collects the boxes of a node.
    pub fn new(objects: &'a [ObjectBox]) -> Self {
        let (mut bounds, mut centroid_bounds) = (Aabb::EMPTY, Aabb::EMPTY);
        for object in objects {
            bounds = bounds.union(object.aabb());
            centroid_bounds = centroid_bounds.grow(object.centroid());
        }
        Self {
            objects,
            bounds,
            centroid_bounds,
        }
    }
}
