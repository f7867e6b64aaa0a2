//! The split rules.
