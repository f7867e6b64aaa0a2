//! What the file keeps of its import for people: which library read each source, and the materials of the objects.

use crate::scene::Materials;
use hroc_format::{BakedScene, OpenError, SectionName, Sections};
use serde::{Deserialize, Serialize};

/// The section with a [`Provenance`] as one JSON object, but for the materials of the objects.
pub const PROVENANCE: SectionName = SectionName::new("import");
/// The section with the material of each object: little-endian u32 numbers that count the names in [`PROVENANCE`],
/// or [`Materials::NONE`].
pub const MATERIALS: SectionName = SectionName::new("material");

/// How the sources were read, and their materials.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of this record: 1.
    pub schema: u32,
    /// The library that read each source file, and its version.
    pub loaders: Vec<String>,
    /// Names of the materials of all source files.
    pub materials: Vec<String>,
    /// For each object a number of a material, or [`Materials::NONE`]. Empty where no object has a material.
    #[serde(skip)]
    pub material_of_object: Vec<u32>,
}

impl Provenance {
    pub(super) fn new(loaders: &[&'static str], materials: Materials, objects: usize) -> Self {
        let mut material_of_object = materials.of_object;
        if !material_of_object.is_empty() {
            material_of_object.resize(objects, Materials::NONE);
        }
        Self {
            schema: 1,
            loaders: loaders.iter().map(|&loader| loader.to_owned()).collect(),
            materials: materials.names,
            material_of_object,
        }
    }

    pub(super) fn add_to(&self, sections: &mut Sections) {
        // Cannot fail: the record holds numbers, strings and lists.
        let json = serde_json::to_vec(self).unwrap_or_default();
        sections.insert(PROVENANCE, json);
        if !self.material_of_object.is_empty() {
            let numbers = self.material_of_object.iter();
            let bytes = numbers.flat_map(|number| number.to_le_bytes()).collect();
            sections.insert(MATERIALS, bytes);
        }
    }

    /// Reads the record of a baked file; an empty one if the file has none, or one of another version.
    ///
    /// # Errors
    /// If a section is damaged.
    pub fn of(baked: &BakedScene) -> Result<Self, OpenError> {
        let json = baked.section(PROVENANCE)?;
        let record = json.and_then(|json| serde_json::from_slice::<Self>(json).ok());
        let mut record = record
            .filter(|record| record.schema == 1)
            .unwrap_or_default();
        let numbers = baked.section(MATERIALS)?.unwrap_or_default();
        let numbers = numbers.as_chunks().0.iter().copied();
        record.material_of_object = numbers.map(u32::from_le_bytes).collect();
        Ok(record)
    }

    /// The name of an object's material, where it has one.
    pub fn material(&self, object: usize) -> Option<&str> {
        let number = *self.material_of_object.get(object)?;
        self.materials.get(number as usize).map(String::as_str)
    }
}
