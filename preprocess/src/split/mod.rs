//! The split rules: where a node of the tree is cut in two. A new rule is one file here and one line
//! in [`RULES`]; the builder, the command line and the tests then know it.

mod equal_count;
mod middle;
mod sah;

pub use equal_count::EqualCount;
pub use middle::Middle;
pub use sah::Sah;

use crate::bvh::{ObjectBox, middle_bounds};

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

    /// Where to cut; asked for three objects and more, whose order is the same in every build of the
    /// same scene. The answer must depend on `objects` alone. A cut
    /// that leaves one side empty is replaced by [`Cut::halves`], and so is any cut where the tree
    /// would otherwise become deeper than [`max_depth`](crate::bvh::max_depth).
    fn cut(&self, objects: &[ObjectBox]) -> Cut;
}

/// A cut through a node's objects, by their [`ObjectBox::middle`]. Axes are 0, 1, 2 for x, y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cut {
    /// Objects whose middle lies below `position` go left, all others right.
    Plane {
        /// The axis the plane is perpendicular to.
        axis: usize,
        /// Where the plane crosses the axis, in the units of [`ObjectBox::middle`].
        position: f32,
    },
    /// The first `left` objects in order of their middle on `axis`, then of their id, go left.
    Count {
        /// The axis of the order.
        axis: usize,
        /// Number of objects on the left.
        left: usize,
    },
}

impl Cut {
    /// As many objects left as right (one more on the right if odd), ordered on the axis on which
    /// their middles spread most.
    pub fn halves(objects: &[ObjectBox]) -> Self {
        Self::Count {
            axis: middle_bounds(objects).longest_axis(),
            left: objects.len() / 2,
        }
    }
}
