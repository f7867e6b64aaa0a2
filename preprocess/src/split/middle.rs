//! Spatial middle split.

use super::{Cut, NodeObjects, SplitRule};

/// Cuts the bounds of the centroids in the middle of their longest axis.
pub struct Middle;

impl SplitRule for Middle {
    fn name(&self) -> &'static str {
        "middle"
    }

    fn describe(&self) -> &'static str {
        "spatial middle of the object centres on their longest axis"
    }

    fn cut(&self, node: &NodeObjects) -> Cut {
        let axis = node.centroid_bounds.longest_axis();
        let (min, max) = (
            node.centroid_bounds.min[axis],
            node.centroid_bounds.max[axis],
        );
        Cut::Plane {
            axis,
            position: 0.5 * min + 0.5 * max,
        }
    }
}
