//! What hroc needs of a device.

use wgpu::Features;

/// Why an adapter cannot run hroc.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    /// A feature without which no path works.
    #[error("the adapter '{adapter}' lacks {features:?}, which hroc cannot do without")]
    Missing {
        /// The adapter's name.
        adapter: String,
        /// What it lacks.
        features: Features,
    },
}

/// Features without which nothing works: the object's id travels as the first instance of its draw.
pub const REQUIRED: Features = Features::INDIRECT_FIRST_INSTANCE;
/// Features that hroc uses where they are.
pub const USED: Features = Features::MULTI_DRAW_INDIRECT_COUNT;

/// The features to request from `adapter`, beside the host's own.
///
/// # Errors
/// If the adapter lacks one that is required.
pub fn features(adapter: &wgpu::Adapter) -> Result<Features, DeviceError> {
    let missing = REQUIRED - adapter.features();
    if missing.is_empty() {
        Ok(REQUIRED | (USED & adapter.features()))
    } else {
        Err(DeviceError::Missing {
            adapter: adapter.get_info().name,
            features: missing,
        })
    }
}

/// The limits to request: as large as the adapter's where scenes may need them, the defaults elsewhere.
pub fn limits(adapter: &wgpu::Adapter) -> wgpu::Limits {
    let offered = adapter.limits();
    wgpu::Limits {
        max_buffer_size: offered.max_buffer_size,
        max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
        max_storage_buffers_per_shader_stage: 10,
        max_texture_dimension_2d: offered.max_texture_dimension_2d,
        ..wgpu::Limits::default()
    }
}
