//! `hroc path`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{Destination, open_scene, to_stdout};
use crate::camera_path::{orbit, walk_in};
use crate::error::{StudyError, exit};
use crate::output::{OutputFile, keep_inputs};

/// Options of `hroc path`.
#[derive(Debug, Args)]
pub(super) struct PathArguments {
    /// A baked scene.
    scene: PathBuf,
    /// Which path.
    kind: Standard,
    /// Where to write its JSON; `-` for the standard output.
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: Destination,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Standard {
    /// Overview, walk to the densest part, turn of 360 degrees there.
    WalkIn,
    /// A circle round the scene.
    Orbit,
}

pub(super) fn path(arguments: &PathArguments) -> Result<u8, StudyError> {
    let baked = open_scene(&arguments.scene)?;
    if let Some(file) = arguments.output.file() {
        keep_inputs(&[&arguments.scene], &[("--output", file)])?;
    }
    let path = match arguments.kind {
        Standard::WalkIn => walk_in(baked.scene()),
        Standard::Orbit => orbit(baked.scene()),
    };
    match &arguments.output {
        Destination::Stdout => to_stdout(&path.to_json())?,
        Destination::File(file) => OutputFile::create(file)?.finish(path.to_json().as_bytes())?,
    }
    Ok(exit::GOOD)
}
