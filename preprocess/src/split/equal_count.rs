//! Equal-count (object median) split.

use super::{Cut, SplitRule};
use crate::bvh::ObjectBox;

/// Puts half of the objects on either side.
pub struct EqualCount;

impl SplitRule for EqualCount {
    fn name(&self) -> &'static str {
        "equal-count"
    }

    fn describe(&self) -> &'static str {
        "as many objects left as right, ordered on the longest axis of their centres"
    }

    fn cut(&self, objects: &[ObjectBox]) -> Cut {
        Cut::halves(objects)
    }
}
