//! The culling methods that HROC is compared with, each in a file of its own, on the public interface of
//! hroc-runtime alone. Their shaders are the files of the same names in hroc-shaders.
//!
//! All share what does not tell them apart: bounds are padded as HROC's are, lists are drawn in the order of
//! object ids, what touches the near plane is drawn untested, blended objects are drawn last from a list of
//! their own. Each says how it departs from what was published.
#![warn(missing_docs)]

mod auto;
mod chc;
mod contents;
mod depth_pyramid;
mod drawn_once;
mod drawn_twice;
mod hardware;
mod hiz;
mod hiz_two_pass;
mod host_tree;
mod ioc;
mod msoc;
mod nohc;
mod queries;
mod raster_test;
mod reference;
mod roc;
mod roc_hiz;
mod vfc;
mod view;
mod waves;
mod woc;

pub use auto::Auto;
pub use chc::{ChcOptions, CoherentCulling};
pub use hardware::HardwareTimes;
pub use hiz::{HierarchicalZ, Projected};
pub use hiz_two_pass::TwoPassHierarchicalZ;
pub use ioc::{DepthRange, IocMode, IterativeOcclusionCulling};
pub use msoc::{MaskedSoftware, MsocMode};
pub use nohc::NearOptimalCulling;
pub use reference::{Recorded, Reference};
pub use roc::RasterOcclusionCulling;
pub use roc_hiz::PrerejectedOcclusionCulling;
pub use vfc::ViewFrustumCulling;
pub use woc::{WarpedOcclusionCulling, WocMode, WocOptions};
