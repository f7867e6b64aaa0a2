//! Spatial middle split.

use super::{Cut, SplitRule};
use crate::bvh::{ObjectBox, middle_bounds};

/// Cuts the bounds of the centroids in the middle of their longest axis.
pub struct Middle;

impl SplitRule for Middle {
    fn name(&self) -> &'static str {
        "middle"
    }

    fn describe(&self) -> &'static str {
        "spatial middle of the object centres on their longest axis"
    }

    fn cut(&self, objects: &[ObjectBox]) -> Cut {
        let bounds = middle_bounds(objects);
        let axis = bounds.longest_axis();
        Cut::Plane {
            axis,
            position: 0.5 * bounds.min[axis] + 0.5 * bounds.max[axis],
        }
    }
}
