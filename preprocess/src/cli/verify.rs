//! `hroc-bake verify`.

use super::{Failure, say};
use hroc_format::BakedScene;
use std::path::PathBuf;

/// Checks a baked file completely: checksum, structure, ranges, bounds and trees.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The baked file.
    file: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let baked = BakedScene::verify(&arguments.file).map_err(Failure::file)?;
    let scene = baked.scene();
    say(format_args!(
        "{}: good, {} objects, {} trees",
        arguments.file.display(),
        scene.objects.len(),
        scene.bvhs.len()
    ));
    Ok(())
}
