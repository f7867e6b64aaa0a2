//! Generated scenes, from a seed: stand-ins with the object, triangle and vertex counts of scenes
//! that are not public. They are written as .glb and imported like any other file.
//!
//! A new generator is one file here and one line in [`GENERATORS`].

mod glb;
mod model;
mod radial_city;
mod rng;
mod shape;

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

pub use glb::GlbStats;
pub use model::{Group, Material, Mesh, Model, Part};
pub use radial_city::RadialCity;
pub use rng::Rng;
pub use shape::Shape;

/// Every generator.
pub const GENERATORS: &[&dyn Generator] = &[&RadialCity];

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
    /// The file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Where it should have been.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
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

    /// Generates the scene into a .glb. The file appears whole or not at all.
    ///
    /// # Errors
    /// When a parameter is out of range, the scene too large for the format, or writing fails.
    fn write_glb(&self, params: &Params, path: &Path) -> Result<GlbStats, GenerateError> {
        params.check()?;
        glb::write(&self.model(params), path)
    }
}
