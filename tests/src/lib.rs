//! What the tests that cross crates share: a device, a host that draws, oracles.

pub mod host;
pub mod oracle;
pub mod slab;

use std::sync::OnceLock;

use hroc_runtime::{DeviceProfile, Mutant};
pub use hroc_study::gpu::Gpu;
use hroc_study::gpu::GpuOptions;

/// The shared device, or `None` (said aloud) where `HROC_SKIP_GPU=1`.
///
/// # Panics
/// If there is no adapter: a machine that skips by accident tests nothing.
pub fn gpu() -> Option<&'static Gpu> {
    if std::env::var_os("HROC_SKIP_GPU").is_some_and(|value| value == "1") {
        eprintln!("SKIPPED: HROC_SKIP_GPU=1, this test ran nothing on a GPU");
        return None;
    }
    static GPU: OnceLock<Gpu> = OnceLock::new();
    Some(GPU.get_or_init(|| {
        Gpu::open(&GpuOptions::default())
            .unwrap_or_else(|error| panic!("{error} (or set HROC_SKIP_GPU=1)"))
    }))
}

/// The device's paths; with a safeguard left out where `HROC_MUTANT` names one (see `make mutants`).
///
/// # Panics
/// If there is no such mutant.
pub fn profile(gpu: &Gpu) -> DeviceProfile {
    let mutant = std::env::var("HROC_MUTANT").map_or(Mutant::None, |name| {
        let named = Mutant::ALL.into_iter().find(|mutant| mutant.name() == name);
        named.unwrap_or_else(|| panic!("no mutant '{name}'"))
    });
    DeviceProfile {
        mutant,
        ..gpu.profile
    }
}
