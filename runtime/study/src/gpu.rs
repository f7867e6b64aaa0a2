//! The device that runs are measured on.

use std::env;
use std::sync::{Arc, Mutex, PoisonError};

use crate::gpu_clock::GpuClock;
use hroc_runtime::DeviceProfile;
use wgpu::{AdapterInfo, Backends, DeviceType, InstanceFlags};

/// Environment variable with part of the adapter's name, for when `--adapter` is not given.
pub const ADAPTER_VARIABLE: &str = "WGPU_ADAPTER_NAME";
const INSTALL_HINT: &str = "install a driver; for a software one on Debian: apt-get install mesa-vulkan-drivers libvulkan1";

/// No device, or one that failed.
#[derive(Clone, Debug, thiserror::Error)]
pub enum GpuError {
    /// No adapter at all.
    #[error("no Vulkan, Metal or Direct3D 12 adapter here; {INSTALL_HINT}")]
    NoAdapter,
    /// None of that name.
    #[error("no adapter with '{wanted}' in its name; there is: {present}")]
    NoSuchAdapter {
        /// What was asked for.
        wanted: String,
        /// Names of what there is.
        present: String,
    },
    /// It lacks a feature.
    #[error("{0}; choose another device with --adapter, or update its driver")]
    Unfit(#[from] hroc_runtime::device::DeviceError),
    /// It gives no device.
    #[error("the adapter '{adapter}' gives no device: {reason}; choose another one with --adapter")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
    /// A target larger than it can make.
    #[error("{0}x{1} pixels exceed this device's limit of {2} per side; use a smaller --size")]
    TooManyPixels(u32, u32, u32),
    /// It lacks what a method needs.
    #[error(
        "method '{method}' needs {features}, which the adapter '{adapter}' lacks; try --adapter"
    )]
    MethodUnfit {
        /// The method's name.
        method: &'static str,
        /// What is missing.
        features: String,
        /// The adapter's name.
        adapter: String,
    },
    /// It lacks what a forced path needs.
    #[error(
        "the forced path needs {features}, which the adapter '{adapter}' lacks; leave --submission and --early-z out"
    )]
    PathUnfit {
        /// What is missing.
        features: String,
        /// The adapter's name.
        adapter: String,
    },
    /// It has no timestamps.
    #[error("the adapter '{0}' has no timestamps; use --clock wall")]
    NoClock(String),
    /// It failed while running.
    #[error("the device failed: {0}; try a smaller --size, or another device with --adapter")]
    Failed(String),
}

/// Which device to open.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Part of the adapter's name, in any case; `None`: a GPU if there is one.
    pub adapter: Option<String>,
    /// Requested where the adapter has them, beside hroc's own.
    pub features: wgpu::Features,
    /// Checks every API call and every indirect argument. Slows runs down.
    pub validation: bool,
}

/// An open device. Errors that no call returns are kept and told by [`check`](Self::check).
#[derive(Debug)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// What it runs on.
    pub info: AdapterInfo,
    /// The paths it takes, found by probing.
    pub profile: DeviceProfile,
    failure: Arc<Mutex<Option<Failure>>>,
}

#[derive(Clone, Debug)]
struct Failure {
    message: String,
    /// The device is gone; a refused call leaves it usable.
    lost: bool,
}

impl Gpu {
    /// Opens the device that `options` ask for.
    ///
    /// # Errors
    /// If there is none, or it cannot run hroc.
    pub fn open(options: &GpuOptions) -> Result<Self, GpuError> {
        let flags = if options.validation {
            InstanceFlags::VALIDATION | InstanceFlags::VALIDATION_INDIRECT_CALL
        } else {
            InstanceFlags::empty()
        };
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            flags: flags.with_env(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let adapters = pollster::block_on(instance.enumerate_adapters(Backends::PRIMARY));
        let wanted = options
            .adapter
            .clone()
            .or_else(|| env::var(ADAPTER_VARIABLE).ok());
        let adapter = choose(adapters, wanted.as_deref())?;
        let info = adapter.get_info();
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("hroc"),
            required_features: hroc_runtime::device::features(&adapter)?
                | (adapter.features() & (GpuClock::FEATURES | options.features)),
            required_limits: hroc_runtime::device::limits(&adapter),
            memory_hints: wgpu::MemoryHints::Performance,
            ..Default::default()
        }))
        .map_err(|error| GpuError::NoDevice {
            adapter: info.name.clone(),
            reason: one_line(&error),
        })?;

        let failure = Arc::new(Mutex::new(None));
        let keep_first = |failure: &Mutex<Option<Failure>>, message: String, lost: bool| {
            let mut failure = failure.lock().unwrap_or_else(PoisonError::into_inner);
            failure.get_or_insert(Failure { message, lost }).lost |= lost;
        };
        let of_errors = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            keep_first(&of_errors, one_line(&error), false)
        }));
        let of_loss = Arc::clone(&failure);
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                keep_first(&of_loss, format!("lost: {message}"), true);
            }
        });
        let profile = DeviceProfile::probe(&device, &queue);
        Ok(Self {
            device,
            queue,
            info,
            profile,
            failure,
        })
    }

    /// Submits the commands and waits until the device has run them.
    ///
    /// # Errors
    /// If the device failed, now or since the last check.
    pub fn submit_and_wait(&self, encoder: wgpu::CommandEncoder) -> Result<(), GpuError> {
        self.queue.submit([encoder.finish()]);
        self.wait()
    }

    /// Waits until the device has run all that was submitted.
    ///
    /// # Errors
    /// As [`submit_and_wait`](Self::submit_and_wait).
    pub fn wait(&self) -> Result<(), GpuError> {
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        waited
            .map(drop)
            .map_err(|error| GpuError::Failed(one_line(&error)))
    }

    /// The first error since the device was opened.
    ///
    /// # Errors
    /// If there was one.
    pub fn check(&self) -> Result<(), GpuError> {
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        failure
            .clone()
            .map_or(Ok(()), |failure| Err(GpuError::Failed(failure.message)))
    }

    /// Forgets a call that was refused, so that others can go on with the device.
    ///
    /// # Errors
    /// If the device is lost: then nobody can.
    pub fn recover(&self) -> Result<(), GpuError> {
        let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        match failure.take_if(|failure| !failure.lost) {
            Some(_) => Ok(()),
            None => {
                drop(failure);
                self.check()
            }
        }
    }

    /// An encoder for a frame.
    pub fn encoder(&self) -> wgpu::CommandEncoder {
        self.device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("frame"),
            })
    }

    /// That targets of `size` pixels can be made.
    ///
    /// # Errors
    /// If not.
    pub fn check_size(&self, size: [u32; 2]) -> Result<(), GpuError> {
        let limit = self.device.limits().max_texture_dimension_2d;
        if size.iter().any(|&n| n > limit) {
            return Err(GpuError::TooManyPixels(size[0], size[1], limit));
        }
        Ok(())
    }
}

/// The adapter with `wanted` in its name, or the fittest: one that can run hroc before one that cannot, a GPU
/// before a CPU.
fn choose(adapters: Vec<wgpu::Adapter>, wanted: Option<&str>) -> Result<wgpu::Adapter, GpuError> {
    let names = || {
        adapters
            .iter()
            .map(|adapter| adapter.get_info().name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let present = names();
    let matches = |adapter: &wgpu::Adapter| {
        wanted.is_none_or(|part| {
            adapter
                .get_info()
                .name
                .to_lowercase()
                .contains(&part.to_lowercase())
        })
    };
    let fitness = |adapter: &wgpu::Adapter| {
        let kind = match adapter.get_info().device_type {
            DeviceType::DiscreteGpu => 0,
            DeviceType::IntegratedGpu => 1,
            DeviceType::VirtualGpu => 2,
            DeviceType::Other => 3,
            DeviceType::Cpu => 4,
        };
        (hroc_runtime::device::features(adapter).is_err(), kind)
    };
    if adapters.is_empty() {
        return Err(GpuError::NoAdapter);
    }
    adapters
        .into_iter()
        .filter(matches)
        .min_by_key(fitness)
        .ok_or_else(|| GpuError::NoSuchAdapter {
            wanted: wanted.unwrap_or_default().to_owned(),
            present,
        })
}

fn one_line(error: &dyn std::fmt::Display) -> String {
    error
        .to_string()
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}
