//! The baked scene file of hroc.
//!
//! A file is a 64-byte header and one rkyv archive of a [`Scene`]; `README.md` beside this crate
//! documents the bytes.
#![warn(missing_docs)]

mod schema;
mod types;

pub use schema::{Described, SCHEMA_HASH};
pub use types::*;

/// Bits of [`Object::flags`].
pub mod object_flags {
    /// Holes are cut out by an alpha test.
    pub const MASKED: u32 = 1;
    /// Blended over what lies behind; writes no depth and never occludes.
    pub const BLENDED: u32 = 2;
    /// Both faces are drawn. (hroc draws both faces of every object; hosts may use this.)
    pub const DOUBLE_SIDED: u32 = 4;
    /// All bits that have a meaning.
    pub const ALL: u32 = MASKED | BLENDED | DOUBLE_SIDED;
}
