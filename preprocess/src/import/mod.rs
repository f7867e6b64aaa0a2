//! The importers.
