//! Why a command failed, and the exit code that says so.

use std::io;
use std::path::PathBuf;

use hroc_format::OpenError;
use hroc_msoc::replay::ReplayError;
use hroc_runtime::{CameraError, UploadError};

use crate::camera_path::PathError;
use crate::gpu::GpuError;
use crate::hard_cases::CaseError;

/// Exit codes of `hroc`. Scripts rely on them.
pub mod exit {
    /// Everything went well.
    pub const GOOD: u8 = 0;
    /// A check failed: wrong pixels or false negatives of a conservative method.
    pub const CHECK_FAILED: u8 = 1;
    /// The command line asks for what there is not, or names a place that cannot be written.
    pub const USAGE: u8 = 2;
    /// An input cannot be used.
    pub const BAD_INPUT: u8 = 3;
    /// No device, or one that cannot do it.
    pub const DEVICE: u8 = 4;
}

/// A command that could not finish. The message is one line with the place and the next step.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// Options that contradict each other or name nothing.
    #[error("{0}")]
    Usage(String),
    /// The scene cannot be opened.
    #[error(transparent)]
    Scene(#[from] OpenError),
    /// A replay cannot be read.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A study has nothing to compare.
    #[error(
        "{}: a study needs the 'sah' tree and another one (it has: {baked}); bake it with --split sah,middle,equal-count,ploc",
        path.display()
    )]
    FewTrees {
        /// The scene.
        path: PathBuf,
        /// The split rules in it.
        baked: String,
    },
    /// Results cannot be read.
    #[error(
        "{}: {reason}; name a results.json that hroc compare or hroc study wrote",
        path.display()
    )]
    Results {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The CPU cannot do it.
    #[error("{0}")]
    Cpu(String),
    /// The scene lacks the tree asked for, or does not fit the device.
    #[error("{}", upload_advice(.0))]
    Upload(#[from] UploadError),
    /// The camera path is wrong.
    #[error(transparent)]
    Path(#[from] PathError),
    /// A camera on the path is degenerate.
    #[error("frame {frame} of the camera path: {source}")]
    Camera {
        /// Frame number, from 0.
        frame: u32,
        /// What is wrong with it.
        source: CameraError,
    },
    /// A generated case was refused.
    #[error("hard case '{case}': {source}")]
    HardCase {
        /// Its name.
        case: &'static str,
        /// By whom and why.
        source: CaseError,
    },
    /// The device failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A result cannot be written.
    #[error("{}: cannot write it: {source}; choose another place", path.display())]
    Output {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// The error with a next step for who runs the command; the error's own is for who writes a host.
fn upload_advice(error: &UploadError) -> String {
    match error {
        UploadError::TooLarge { what, bytes, limit } => format!(
            "{what} of {bytes} bytes exceed this device's limit of {limit} bytes; choose another device with --adapter, \
             or bake a part of the scene"
        ),
        other => other.to_string(),
    }
}

impl StudyError {
    /// The exit code for it.
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) | Self::Output { .. } => exit::USAGE,
            Self::Scene(_)
            | Self::Replay(_)
            | Self::Path(_)
            | Self::Results { .. }
            | Self::FewTrees { .. }
            | Self::Camera { .. }
            | Self::HardCase { .. }
            | Self::Upload(UploadError::NoTree { .. }) => exit::BAD_INPUT,
            Self::Upload(UploadError::TooLarge { .. } | UploadError::TooManyObjects { .. })
            | Self::Gpu(_)
            | Self::Cpu(_) => exit::DEVICE,
        }
    }

    /// For `map_err` on what is written to `path`.
    pub fn output(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::Output { path, source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_device_cannot_do_comes_with_advice_for_the_user() {
        let error = StudyError::from(UploadError::TooLarge {
            what: "vertices",
            bytes: 2,
            limit: 1,
        });
        let text = error.to_string();
        assert_eq!(error.exit_code(), exit::DEVICE);
        assert!(
            text.contains("limit of 1 bytes; choose another device with --adapter"),
            "{text}"
        );
    }
}
