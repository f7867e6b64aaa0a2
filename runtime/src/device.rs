//! What hroc needs of a device, and what it finds out about it at start.

mod box_cost;
mod rasterizer;

use wgpu::Features;

use crate::draw::Submission;
use crate::mutant::Mutant;
use crate::pipelines::Pipelines;

pub use rasterizer::COARSEST_SUBPIXEL_STEP_PX;

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
/// Features that hroc uses where they are; without one the next path is taken, with the same image.
pub const USED: Features =
    Features::MULTI_DRAW_INDIRECT_COUNT.union(Features::SHADER_EARLY_DEPTH_TEST);

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
        max_storage_buffers_per_shader_stage: 9,
        max_texture_dimension_2d: offered.max_texture_dimension_2d,
        ..wgpu::Limits::default()
    }
}

/// Cost of a box in ray-box tests where it was not measured. Some 30 to 300 on GPUs; an error of four times costs a
/// few percent.
pub const ASSUMED_BOX_COST: f32 = 256.0;

/// How fragments of the groups' boxes that lie behind the occlusion map are turned away.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EarlyZ {
    /// By the rasterizer, before the shader runs. What is left is compared in the shader.
    Forced,
    /// In the shader, which samples the map.
    Sampled,
}

impl EarlyZ {
    /// Every path, the best first.
    pub const ALL: [Self; 2] = [Self::Forced, Self::Sampled];

    /// The best that a device with `features` offers.
    pub fn of(features: Features) -> Self {
        if features.contains(Features::SHADER_EARLY_DEPTH_TEST) {
            Self::Forced
        } else {
            Self::Sampled
        }
    }

    /// `forced` or `sampled`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Forced => "forced",
            Self::Sampled => "sampled",
        }
    }
}

/// The paths to take on a device, and what its rasterizer does. A scene is uploaded for one; methods over the
/// scene go by it. Change a field to force a path.
#[derive(Clone, Debug)]
pub struct DeviceProfile {
    /// How draw lists are submitted.
    pub submission: Submission,
    /// How hidden fragments of boxes are turned away.
    pub early_z: EarlyZ,
    /// The grid that the rasterizer moves vertices to, pixels; bounds grow by it.
    pub subpixel_step_px: f64,
    /// The pipelines made so far.
    pub pipelines: Pipelines,
    #[doc(hidden)]
    pub mutant: Mutant,
}

impl DeviceProfile {
    /// What can be told without running anything: the coarsest grid that the API allows is assumed.
    pub fn assumed(device: &wgpu::Device) -> Self {
        Self {
            submission: Submission::of(device.features()),
            early_z: EarlyZ::of(device.features()),
            subpixel_step_px: COARSEST_SUBPIXEL_STEP_PX,
            pipelines: Pipelines::default(),
            mutant: Mutant::None,
        }
    }

    /// Measures what rasterizing one more box costs, in ray-box tests: for
    /// [`Grouping::Adaptive`](crate::Grouping::Adaptive). Takes tens of milliseconds; submits and waits.
    pub fn measure_box_cost(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> f32 {
        box_cost::box_cost(device, queue, self)
    }

    /// The features that its paths need.
    pub fn features(&self) -> Features {
        let mut features = REQUIRED;
        features.set(
            Features::MULTI_DRAW_INDIRECT_COUNT,
            self.submission == Submission::IndirectCount,
        );
        features.set(
            Features::SHADER_EARLY_DEPTH_TEST,
            self.early_z == EarlyZ::Forced,
        );
        features
    }

    /// Every combination of paths that a device with `features` can be made to take.
    pub fn every_path(&self, features: Features) -> Vec<Self> {
        let pairs = Submission::ALL
            .into_iter()
            .flat_map(|submission| EarlyZ::ALL.map(|early_z| (submission, early_z)));
        pairs
            .map(|(submission, early_z)| Self {
                submission,
                early_z,
                ..self.clone()
            })
            .filter(|profile| features.contains(profile.features()))
            .collect()
    }

    /// Finds out by drawing two rows of pixels. Submits and waits.
    pub fn probe(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        Self {
            subpixel_step_px: rasterizer::subpixel_step_px(device, queue),
            ..Self::assumed(device)
        }
    }
}
