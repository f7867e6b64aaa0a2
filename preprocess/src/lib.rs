//! Bakes scenes for hroc: import -> objects -> mesh optimization -> object-level BVHs -> one file.
//!
//! The library is what `hroc-bake` runs; it needs no GPU and prints nothing.
#![warn(missing_docs)]

pub mod bake;
pub mod bvh;
pub mod camera_path;
pub mod cli;
pub mod degenerate;
pub mod generate;
pub mod import;
pub mod normals;
pub mod optimize;
pub mod outputs;
pub mod progress;
pub mod quantize;
pub mod scene;
pub mod split;
pub mod subdivide;
pub mod tree;
pub mod verify;
mod whole_file;
pub mod world_bounds;
