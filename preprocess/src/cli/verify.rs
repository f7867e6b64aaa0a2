//! `hroc-bake verify`.

use super::{Failure, say};
use crate::verify::compare_with_sources;
use hroc_format::BakedScene;
use std::path::PathBuf;

/// Checks a baked file completely: checksums, structure, ranges, bounds and trees; with --source its geometry too.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The baked file.
    file: PathBuf,
    /// The scenes it was baked from, in the order of the bake. They are read by a second reader and compared with
    /// the file, object by object.
    #[arg(long, value_name = "IN", num_args = 1..)]
    source: Vec<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let file = arguments.file.display();
    let baked = BakedScene::verify(&arguments.file).map_err(Failure::file)?;
    let scene = baked.scene();
    say(format_args!(
        "{file}: good, {} objects, {} trees",
        scene.objects.len(),
        scene.bvhs.len()
    ));
    if arguments.source.is_empty() {
        return Ok(());
    }
    let found = compare_with_sources(&baked, &arguments.source).map_err(Failure::file)?;
    say(format_args!(
        "{file}: compared with its source: {} objects, {} triangles, area {} in the source and {} in the file, \
         largest displacement {:.3e} on an axis, {} triangles too small to compare",
        found.objects,
        found.triangles,
        found.source_area,
        found.baked_area,
        found.displacement,
        found.small_triangles
    ));
    for difference in &found.differences {
        say(format_args!("difference: {difference}"));
    }
    match found.difference_count {
        0 => Ok(()),
        count => Err(Failure::file(format_args!(
            "{file}: differs from its source in {count} places; bake it again, and report it if they stay"
        ))),
    }
}
