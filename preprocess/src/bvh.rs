//! The tree builder.
