//! The tree builders: everything that can make a tree over objects, by name. Each
//! [`SplitRule`] is one, through the top-down builder of [`crate::bvh`]; others bring their own way.
//!
//! A new builder is one file here and one line in [`OTHERS`], a new split rule one file and one line in
//! [`RULES`]; the command line, the bake and the tests then know it.

pub mod in_cells;
mod ploc;
mod ploc_reinsert;

pub use ploc::Ploc;
pub use ploc_reinsert::PlocReinsert;

use crate::bvh::{self, BuildError};
use crate::split::{RULES, SplitRule};
use hroc_format::{Bounds, Bvh};

/// The builders that are no split rules.
pub const OTHERS: &[&dyn TreeBuilder] = &[&Ploc, &PlocReinsert];

/// Every builder: the split rules first.
pub fn builders() -> impl Iterator<Item = &'static dyn TreeBuilder> {
    let rules = RULES.iter().map(|rule| rule as &dyn TreeBuilder);
    rules.chain(OTHERS.iter().copied())
}

/// The builder of that name.
pub fn by_name(name: &str) -> Option<&'static dyn TreeBuilder> {
    builders().find(|builder| builder.name() == name)
}

/// The builders whose trees are baked unless others are asked for.
pub fn baked_by_default() -> impl Iterator<Item = &'static dyn TreeBuilder> {
    builders().filter(|builder| builder.is_baked_by_default())
}

/// Makes trees over objects.
pub trait TreeBuilder: Sync {
    /// Its name on the command line and in baked files: lower case, words joined by hyphens.
    fn name(&self) -> &'static str;

    /// One line for the help text.
    fn describe(&self) -> &'static str;

    /// Whether a bake makes this tree unasked.
    fn is_baked_by_default(&self) -> bool {
        false
    }

    /// The tree over `bounds`: equal on every machine and for any number of threads, and no deeper than
    /// [`bvh::max_depth`].
    ///
    /// # Errors
    /// When there are no objects or more than [`hroc_format::MAX_OBJECTS`], or a box is inverted or not finite.
    fn build(&self, bounds: &[Bounds]) -> Result<Bvh, BuildError>;
}

impl TreeBuilder for &'static dyn SplitRule {
    fn name(&self) -> &'static str {
        SplitRule::name(*self)
    }

    fn describe(&self) -> &'static str {
        SplitRule::describe(*self)
    }

    fn is_baked_by_default(&self) -> bool {
        true
    }

    fn build(&self, bounds: &[Bounds]) -> Result<Bvh, BuildError> {
        bvh::build(bounds, *self)
    }
}
