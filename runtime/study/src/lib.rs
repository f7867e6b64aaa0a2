//! The study of culling methods: runs them over baked scenes, holds every frame against no culling, and
//! reports. The command is `hroc`; README.md beside this crate documents it.
#![warn(missing_docs)]

pub mod blended_truth;
pub mod camera_path;
pub mod check;
pub mod cli;
pub mod compare;
pub mod drawer;
pub mod drawn;
pub mod error;
pub mod fragment_oracle;
pub mod frustum;
pub mod gpu;
pub mod gpu_clock;
pub mod hard_cases;
pub mod hash;
pub mod id_set;
pub mod image;
pub mod metrics;
pub mod npy;
pub mod output;
pub mod registry;
pub mod report;
pub mod results;
pub mod run;
pub mod sampling;
pub mod stage_clock;
pub mod statistics;
pub mod study;
pub mod summary;
pub mod table;
pub mod targets;
pub mod truth;
pub mod unculled;
