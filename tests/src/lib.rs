//! What the tests that cross crates share: a device, a host that draws, oracles.

pub mod attack;
pub mod compute;
pub mod depth_map;
pub mod group_oracle;
pub mod host;
pub mod messages;
pub mod no_culling;
pub mod oracle;
pub mod random_trees;
pub mod slab;
pub mod variants;

use std::sync::OnceLock;

pub use hroc_study::gpu::Gpu;
use hroc_study::gpu::GpuOptions;

/// The shared device, or `None` (said aloud) where `HROC_SKIP_GPU=1`.
///
/// # Panics
/// If there is no adapter: a machine that skips by accident tests nothing.
pub fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Option<Gpu>> = OnceLock::new();
    GPU.get_or_init(own_gpu).as_ref()
}

/// A device apart, likewise: long tests side by side would wait for each other's frames on the shared one.
///
/// # Panics
/// Likewise.
pub fn own_gpu() -> Option<Gpu> {
    if std::env::var_os("HROC_SKIP_GPU").is_some_and(|value| value == "1") {
        eprintln!("SKIPPED: HROC_SKIP_GPU=1, this test ran nothing on a GPU");
        return None;
    }
    let opened = Gpu::open(&GpuOptions::default());
    Some(opened.unwrap_or_else(|error| panic!("{error} (or set HROC_SKIP_GPU=1)")))
}
