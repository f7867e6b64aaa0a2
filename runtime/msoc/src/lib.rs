#![doc = include_str!("../README.md")]
//!
//! # How it works
//!
//! The image is made of tiles of 32 pixels by as many rows as a vector has lanes. `setup` turns a vector of
//! triangles into edges and depth planes; `raster` finds the run of covered pixels of each row from its
//! edges, turns it into bits by two shifts for a whole tile at once, rearranges these so that each lane has
//! a subtile of 8x4 pixels, and updates two depth layers and a mask per subtile. `query` asks the same
//! buffer. `clip` deals with what crosses the near plane. The vector abstraction under all that is `simd`.
#![warn(missing_docs)]

mod asked;
mod buffer;
mod clip;
mod footprint;
pub mod generate;
mod geometry;
pub mod hiz;
pub mod inner;
mod msoc;
mod occluders;
mod options;
mod query;
mod raster;
mod rasterize;
pub mod reference;
pub mod replay;
mod setup;
mod sides;
mod simd;
mod traverse;
mod view;

pub use footprint::{Rect, Visibility};
pub use geometry::{Aabb, Affine3, IDENTITY, Matrix4, Occluder, OccluderMesh};
pub use msoc::{MeshError, Msoc};
pub use occluders::{Candidate, OccluderChoice};
pub use options::{Depth, MAX_SIDE, Mode, Options, OptionsError};
pub use simd::{Isa, IsaName};
pub use traverse::{Hierarchy, Node, Traversal};
