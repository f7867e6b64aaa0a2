//! `hroc-bake generate`.

use super::{Failure, say};
use crate::generate::{self, GenerateError, Generator, Params, Written};
use clap::builder::{PossibleValue, PossibleValuesParser};
use std::path::PathBuf;

/// Writes a generated scene as .glb, to be baked like any other, and camera paths through it as
/// OUT.path.json, OUT.NAME.path.json.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Which scene.
    #[arg(value_parser = names())]
    scene: String,
    /// Share of the full scene's objects.
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    scale: f64,
    /// Share of the full scene's triangles per object.
    #[arg(long, value_name = "D", default_value_t = 1.0)]
    detail: f64,
    /// Chooses one of the scenes of these proportions.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The .glb to write.
    #[arg(short, long, value_name = "OUT.glb")]
    output: PathBuf,
}

fn names() -> PossibleValuesParser {
    let value = |generator: &&dyn Generator| {
        PossibleValue::new(generator.name()).help(generator.describe())
    };
    generate::GENERATORS.iter().map(value).into()
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments {
        scale,
        detail,
        seed,
        output,
        ..
    } = arguments;
    let generator = generate::by_name(&arguments.scene).ok_or_else(|| {
        Failure::usage(format_args!(
            "{}: no such scene; see --help",
            arguments.scene
        ))
    })?;
    let params = Params {
        scale: *scale,
        detail: *detail,
        seed: *seed,
    };
    let Written { stats, paths } =
        generator
            .write(&params, output)
            .map_err(|error| match error {
                GenerateError::OutOfRange { .. } => Failure::usage(format_args!("--{error}")),
                GenerateError::WrittenTwice { .. } => Failure::usage(error),
                GenerateError::TooLarge { .. } => {
                    Failure::file(format_args!("{}: {error}", output.display()))
                }
                GenerateError::Write { .. } => {
                    Failure::file(format_args!("{error}; choose another folder"))
                }
            })?;
    say(format_args!(
        "{}: {} objects, {} triangles, {} vertices, {} bytes",
        output.display(),
        stats.objects,
        stats.triangles,
        stats.vertices,
        stats.bytes
    ));
    for path in paths {
        say(format_args!("{}: a camera path", path.display()));
    }
    Ok(())
}
