//! `results.json`.

use crate::compare::Comparison;

/// The text.
pub(super) fn json(comparison: &Comparison) -> String {
    let mut json = serde_json::to_string(comparison).expect("results become JSON");
    json.push('\n');
    json
}
