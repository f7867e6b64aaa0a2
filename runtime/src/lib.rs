//! Hierarchical raster occlusion culling on wgpu, for any host.
//!
//! The host keeps its device, queue, encoder, targets, pipelines and materials. It uploads a baked scene
//! ([`Scene`]) and one of its trees ([`Tree`]), makes an [`Hroc`] per view, and each frame hands over an
//! encoder, a [`Camera`] and [`Targets`]; the method calls the host's [`Drawer`] back with the lists to draw.
//! `examples/embed.rs` is the smallest host.
//!
//! Cameras and transforms are in the source's coordinates, in f64; positions in shaders are relative to the eye. Lengths are
//! in the source's units.
#![warn(missing_docs)]

mod batch_occlusion_test;
mod box_pass;
pub mod camera;
mod counters;
pub mod device;
mod draw;
mod extract_groups;
mod filter_occluders;
pub mod frame_uniform;
pub mod gpu;
mod hroc;
mod kernel;
mod mark;
mod method;
pub mod moving;
mod mutant;
mod noc;
mod pack;
pub mod pipelines;
pub mod readback;
mod scene;
mod stage;
pub mod twin;

pub use box_pass::{BOX_VERTICES, BoxPass, BoxShader};
pub use camera::{Camera, CameraError, DepthConvention, Projection};
pub use counters::{Counters, CountersCopy};
pub use device::{DeviceProfile, EarlyZ};
pub use draw::{Draw, DrawList, DrawRange, Drawer, Marks, Submission, Targets};
pub use extract_groups::Grouping;
pub use filter_occluders::FilterOccluders;
pub use frame_uniform::{CELL_SLOTS, FrameUniform};
pub use hroc::{Hroc, HrocMode, HrocOptions, SMALLEST_LATE_MARGIN};
pub use kernel::Kernel;
pub use method::{CullingMethod, FrameContext, HostSync, QueryCounts, Sets};
#[doc(hidden)]
pub use mutant::Mutant;
pub use noc::Noc;
pub use pack::PackedList;
pub use scene::{Scene, SceneShape, Tree, UploadError};
pub use stage::{Stage, StageObserver};

/// Compiles the README's Rust.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
