//! Generated scenes, from a seed: stand-ins with the object, triangle and vertex counts of scenes
//! that are not public. They are written as .glb and imported like any other file.
//!
//! A new generator is one file here and one line in [`GENERATORS`].

mod factory;
mod fantasy;
mod glb;
mod model;
mod noise;
mod patch;
mod radial_city;
mod rng;
mod route;
mod satellites;
mod shape;
mod sketch;
mod trig;

use crate::outputs::is_same_file;
use std::io;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

pub use factory::Factory;
pub use fantasy::Fantasy;
pub use glb::GlbStats;
pub use model::{Group, MAIN_PATH, Material, Mesh, Model, Part, ScenePath};
pub use radial_city::RadialCity;
pub use rng::Rng;
pub use satellites::Satellites;
pub use shape::Shape;

/// Every generator, by the number of its objects.
pub const GENERATORS: &[&dyn Generator] = &[&Fantasy, &Factory, &RadialCity, &Satellites];

/// The generator of that name.
pub fn by_name(name: &str) -> Option<&'static dyn Generator> {
    GENERATORS
        .iter()
        .copied()
        .find(|generator| generator.name() == name)
}

/// What a scene is generated from; equal parameters give equal bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// Share of the full scene's objects, in [`Params::RANGE`].
    pub scale: f64,
    /// Share of the full scene's triangles per object, in [`Params::RANGE`]. Objects are never simpler
    /// than a quad or a box, so small values are met only as far as shapes go.
    pub detail: f64,
    /// Chooses one of the scenes of these proportions.
    pub seed: u64,
}

impl Params {
    /// Where `scale` and `detail` may lie.
    pub const RANGE: RangeInclusive<f64> = 1e-6..=16.0;

    /// `count` objects at full scale are this many here; at least one.
    pub fn scaled_count(&self, count: usize) -> usize {
        ((count as f64 * self.scale).round() as usize).max(1)
    }

    fn check(&self) -> Result<(), GenerateError> {
        for (name, value) in [("scale", self.scale), ("detail", self.detail)] {
            if !Self::RANGE.contains(&value) {
                return Err(GenerateError::OutOfRange { name, value });
            }
        }
        Ok(())
    }
}

impl Default for Params {
    fn default() -> Self {
        Self {
            scale: 1.0,
            detail: 1.0,
            seed: 1,
        }
    }
}

/// Why no scene was written.
#[derive(Debug, thiserror::Error)]
pub enum GenerateError {
    /// A parameter is not a number or too small or too large to be meant.
    #[error("{name} is {value}; give a number from {} to {}", Params::RANGE.start(), Params::RANGE.end())]
    OutOfRange {
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// Sizes in a .glb are 32 bits wide.
    #[error(
        "the scene takes {bytes} bytes, more than a .glb can hold (4 GiB); lower scale or detail"
    )]
    TooLarge {
        /// Size of the file.
        bytes: u64,
    },
    /// Two of the scene's files would be one.
    #[error("{}: is another name of a second file of the scene; name another file to write", path.display())]
    WrittenTwice {
        /// One of its names.
        path: PathBuf,
    },
    /// The file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Where it should have been.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// Makes one kind of scene.
pub trait Generator: Sync {
    /// Its name on the command line: lower case, words joined by hyphens.
    fn name(&self) -> &'static str;

    /// One line for the help text.
    fn describe(&self) -> &'static str;

    /// The scene. `params` lie in their ranges.
    fn model(&self, params: &Params) -> Model;

    /// Generates the scene into a .glb, and its camera paths beside it: see [`path_file`]. Each file
    /// appears whole or not at all.
    ///
    /// # Errors
    /// When a parameter is out of range, the scene too large for the format, or writing fails.
    fn write(&self, params: &Params, glb: &Path) -> Result<Written, GenerateError> {
        params.check()?;
        let model = self.model(params);
        let names = model.paths.iter().map(|path| &path.name);
        let paths: Vec<PathBuf> = names.map(|name| path_file(glb, name)).collect();
        let written: Vec<&Path> = std::iter::once(glb)
            .chain(paths.iter().map(PathBuf::as_path))
            .collect();
        for (at, file) in written.iter().enumerate() {
            if written[..at].iter().any(|other| is_same_file(other, file)) {
                return Err(GenerateError::WrittenTwice { path: file.into() });
            }
        }
        let stats = glb::write(&model, glb)?;
        for (ScenePath { path, .. }, file) in model.paths.iter().zip(&paths) {
            path.save(file).map_err(write_error(file))?;
        }
        Ok(Written { stats, paths })
    }
}

/// What was written.
#[derive(Clone, Debug)]
pub struct Written {
    /// Of the scene.
    pub stats: GlbStats,
    /// The camera paths, the main one first.
    pub paths: Vec<PathBuf>,
}

/// Where the camera path `name` of a scene lies: `town.path.json` beside `town.glb` for the
/// [main one](MAIN_PATH), `town.NAME.path.json` for others.
pub fn path_file(glb: &Path, name: &str) -> PathBuf {
    if name == MAIN_PATH {
        glb.with_extension("path.json")
    } else {
        glb.with_extension(format!("{name}.path.json"))
    }
}

/// From an error of writing a file.
fn write_error(path: &Path) -> impl FnOnce(io::Error) -> GenerateError {
    let path = path.to_owned();
    |source| GenerateError::Write { path, source }
}
