//! The baked scene file of hroc.
//!
//! A file is a 64-byte header, one rkyv archive of a [`Scene`] and optional [sections](Sections); `README.md` beside this crate
//! documents the bytes. A mapped file is the scene: its arrays go to the GPU unchanged.
//!
//! ```
//! use hroc_format::{BakedScene, Check, Scene, bytes_of, to_bytes};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene = Scene { name: "room".into(), ..Scene::default() };
//! let baked = BakedScene::from_aligned(to_bytes(&scene)?, Check::Everything)?;
//! assert_eq!(baked.scene().name, "room");
//! assert_eq!(bytes_of(baked.scene().objects.as_slice()).len(), 0);
//! # Ok(())
//! # }
//! ```
#![warn(missing_docs)]

// The archived arrays are read as plain numbers, on the CPU and on the GPU.
#[cfg(not(all(target_endian = "little", target_pointer_width = "64")))]
compile_error!("hroc reads its files in place, on 64-bit little-endian hosts only");

mod check;
mod error;
mod header;
mod open;
mod read;
mod schema;
mod section;
mod target;
mod types;
mod unfinished;
mod write;

pub use error::{CheckError, IN_MEMORY, LooksLike, OpenError, WriteError};
pub use header::{HEADER_LEN, Header, MAGIC, VERSION};
pub use open::{BakedScene, Check};
pub use read::{bytes_of, dequantize};
pub use schema::{Described, SCHEMA_HASH};
pub use section::{SectionEntry, SectionName, Sections};
pub use target::{file_to_replace, folder_of};
pub use types::*;
pub use unfinished::{TEMPORARY_PREFIX, discard_unfinished};
pub use write::{to_bytes, to_bytes_with, write, write_with};

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

/// Keeps the example in the README compiling.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
