//! Masked software occlusion culling.
#![warn(missing_docs)]

mod buffer;
mod clip;
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
mod simd;
mod traverse;
mod view;

pub use geometry::{Aabb, Affine3, IDENTITY, Matrix4, Occluder, OccluderMesh};
pub use msoc::{MeshError, Msoc};
pub use occluders::{Candidate, OccluderChoice};
pub use options::{Depth, MAX_SIDE, Mode, Options, OptionsError};
pub use query::{Rect, Visibility};
pub use simd::{Isa, IsaName};
pub use traverse::{Hierarchy, Node, Traversal};
