//! What the tests that cross crates share: a device, a host that draws, oracles.

pub mod host;
pub mod oracle;

use std::sync::OnceLock;

/// A device for tests.
#[derive(Debug)]
pub struct Gpu {
    /// The device; errors nobody catches fail the test.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Adapter name and driver.
    pub name: String,
}

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
    Some(GPU.get_or_init(|| pollster::block_on(open()).unwrap_or_else(|error| panic!("{error}"))))
}

async fn open() -> Result<Gpu, String> {
    let hint = "no Vulkan adapter: apt-get install mesa-vulkan-drivers libvulkan1 (software), or set HROC_SKIP_GPU=1";
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter = instance
        .request_adapter(&wgpu::RequestAdapterOptions::default())
        .await
        .map_err(|error| format!("{hint} ({error})"))?;
    let (device, queue) = adapter
        .request_device(&wgpu::DeviceDescriptor {
            label: Some("hroc tests"),
            required_features: hroc_runtime::device::features(&adapter)
                .map_err(|error| error.to_string())?,
            required_limits: hroc_runtime::device::limits(&adapter),
            ..Default::default()
        })
        .await
        .map_err(|error| error.to_string())?;
    let info = adapter.get_info();
    Ok(Gpu {
        device,
        queue,
        name: format!("{} ({})", info.name, info.driver_info),
    })
}
