//! Split rules against each other.

use crate::compare::Comparison;
use crate::report::Section;

/// The chapters of its report.
pub fn sections(_comparison: &Comparison) -> Vec<Section> {
    Vec::new()
}
