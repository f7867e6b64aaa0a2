//! Compares a baked file with the scenes it was baked from, by a second path.
//!
//! The importers and the bake share no code with what is here but the parsers of JSON and of numbers, and the decoder
//! of meshopt: a fault in one of them shows as a difference. Objects are matched by the source that the file records
//! for them. What these readers cannot read is an error, never an object that is skipped.

mod affine;
mod clusters;
mod compare;
mod geometry;
mod gltf;
mod obj;
mod polygon;
mod stored;

use compare::{Outcome, compare};
use geometry::{Part, Shape};
use hroc_format::{ArchivedScene, BakedScene, folder_of};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use stored::{Stored, computed_tolerance, rounding_about_centre};

/// Differences that are described; the others are counted.
const MAX_DESCRIBED: usize = 20;

/// What a comparison found.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Objects of the file that were compared.
    pub objects: usize,
    /// Their triangles.
    pub triangles: usize,
    /// Source triangles with two corners that are equal to the tolerance; the bake may leave those out.
    pub small_triangles: usize,
    /// Of the source.
    pub source_area: f64,
    /// Of the file.
    pub baked_area: f64,
    /// The largest distance on an axis between a vertex of the source and of the file.
    pub displacement: f64,
    /// How many differences there are.
    pub difference_count: usize,
    /// The first of them, for people.
    pub differences: Vec<String>,
}

/// Why a comparison was not made.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}: {what}", file.display())]
pub struct SourceError {
    /// The source file.
    pub file: PathBuf,
    /// What is wrong.
    pub what: String,
}

/// The file, node and primitive of objects.
type Key = (u32, u32, u32);

/// Compares `baked` with its sources, given in the order of the bake.
///
/// # Errors
/// If a source cannot be read, is not the one that was baked, or uses what the comparison does not support.
pub fn compare_with_sources(
    baked: &BakedScene,
    sources: &[PathBuf],
) -> Result<Comparison, SourceError> {
    let scene = baked.scene();
    let files = scene.source_files.as_slice();
    if let Some(file) = sources.get(files.len()).or_else(|| sources.last())
        && files.len() != sources.len()
    {
        return Err(SourceError {
            file: file.clone(),
            what: format!(
                "the baked file has {} sources, not {}; name all of them in the order of the bake",
                files.len(),
                sources.len()
            ),
        });
    }
    let settings: serde_json::Value = serde_json::from_str(&scene.settings).unwrap_or_default();
    let mut objects: HashMap<Key, Vec<u32>> = HashMap::new();
    for (id, source) in (0..).zip(scene.object_sources.iter()) {
        let source = source.to_native();
        let key = (source.file, source.node, source.primitive);
        objects.entry(key).or_default().push(id);
    }
    let mut comparison = Comparison::default();
    for (number, path) in sources.iter().enumerate() {
        let fault = |what: String| SourceError {
            file: path.clone(),
            what,
        };
        let bytes = std::fs::read(path)
            .map_err(|error| fault(format!("cannot be read: {error}; check the name")))?;
        let hash = files[number].hash.to_native();
        if xxhash_rust::xxh3::xxh3_64(&bytes) != hash {
            return Err(fault(format!(
                "is not the {:?} that was baked; bake it again, or name that one",
                files[number].name.as_str()
            )));
        }
        let mut job = Job {
            scene,
            file: number as u32,
            objects: &mut objects,
            comparison: &mut comparison,
        };
        job.file(path, &bytes, settings["scene"].as_str())
            .map_err(fault)?;
    }
    let mut others: Vec<_> = objects.into_values().flatten().collect();
    others.sort_unstable();
    for id in others {
        let what = "is not in the source".to_owned();
        comparison.add_difference(scene, Some(id), "", what);
    }
    Ok(comparison)
}

impl Comparison {
    fn add_difference(
        &mut self,
        scene: &ArchivedScene,
        object: Option<u32>,
        part: &str,
        what: String,
    ) {
        self.difference_count += 1;
        if self.differences.len() >= MAX_DESCRIBED {
            return;
        }
        let object = object.map(|id| format!("object {id} {:?}", scene.object_name(id)));
        self.differences.push(match (object, part) {
            (Some(object), "") => format!("{object}: {what}"),
            (Some(object), part) => format!("{object} ({part}): {what}"),
            (None, part) => format!("{part}: {what}"),
        });
    }

    fn add(&mut self, outcome: &Outcome) {
        self.triangles += outcome.triangles;
        self.small_triangles += outcome.small;
        self.source_area += outcome.area[0];
        self.baked_area += outcome.area[1];
        if outcome.displacement.is_finite() {
            self.displacement = self.displacement.max(outcome.displacement);
        }
    }
}

/// A source file under comparison.
struct Job<'a> {
    scene: &'a ArchivedScene,
    file: u32,
    /// The objects of the baked file that no part of a source has claimed.
    objects: &'a mut HashMap<Key, Vec<u32>>,
    comparison: &'a mut Comparison,
}

/// A part and what was found about it: per copy the objects and the outcome, or what is wrong with all.
struct Compared<'p> {
    part: &'p Part,
    result: Result<Vec<(u32, Outcome)>, String>,
}

impl Job<'_> {
    fn file(&mut self, path: &Path, bytes: &[u8], choice: Option<&str>) -> Result<(), String> {
        let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        if bytes.starts_with(b"glTF") || text.trim_ascii_start().starts_with(b"{") {
            let file = gltf::File::read(bytes)?;
            let source = gltf::Scene::read(&file, folder_of(path), choice)?;
            self.parts(&source.parts, |shape| source.shape(shape))
        } else {
            let source = obj::File::read(bytes)?;
            self.parts(&source.parts, |shape| source.shape(shape))
        }
    }

    /// Compares all parts, shape by shape: each shape is read once, and a few of them are in memory at a time.
    fn parts(
        &mut self,
        parts: &[Part],
        read: impl Fn(usize) -> Result<Shape, String> + Sync,
    ) -> Result<(), String> {
        let mut by_shape: Vec<(&Part, Vec<u32>)> = Vec::with_capacity(parts.len());
        for part in parts {
            let key = (self.file, part.node, part.primitive);
            by_shape.push((part, self.objects.remove(&key).unwrap_or_default()));
        }
        by_shape.sort_by_key(|(part, _)| (part.shape, part.node));
        let shapes: Vec<&[(&Part, Vec<u32>)]> =
            by_shape.chunk_by(|a, b| a.0.shape == b.0.shape).collect();
        let scene = self.scene;
        let compared: Vec<Result<Vec<Compared<'_>>, String>> = shapes
            .into_par_iter()
            .map(|parts| {
                let shape = read(parts[0].0.shape)?;
                let compared = parts.par_iter().map(|(part, ids)| Compared {
                    part,
                    result: compare_part(scene, &shape, part, ids),
                });
                Ok(compared.collect())
            })
            .collect();
        for compared in compared {
            for Compared { part, result } in compared? {
                self.add(part, result);
            }
        }
        Ok(())
    }

    fn add(&mut self, part: &Part, result: Result<Vec<(u32, Outcome)>, String>) {
        let place = format!(
            "source {}, node {}, primitive {}, {:?}",
            self.file, part.node, part.primitive, part.name
        );
        let outcomes = match result {
            Ok(outcomes) => outcomes,
            Err(what) => {
                return self
                    .comparison
                    .add_difference(self.scene, None, &place, what);
            }
        };
        for (object, outcome) in outcomes {
            self.comparison.objects += 1;
            self.comparison.add(&outcome);
            for what in outcome.problems {
                self.comparison
                    .add_difference(self.scene, Some(object), &place, what);
            }
        }
    }
}

/// Compares the copies of a part with its objects, which are in the order of the copies. A copy that was cut has several
/// objects, one after another, and all copies were cut alike.
fn compare_part(
    scene: &ArchivedScene,
    shape: &Shape,
    part: &Part,
    objects: &[u32],
) -> Result<Vec<(u32, Outcome)>, String> {
    let copies = part.places.len();
    if objects.is_empty() {
        return match is_a_point_or_line(shape) {
            true => Ok(Vec::new()),
            false => Err(format!("its {copies} objects are not in the file")),
        };
    }
    if copies == 0 || !objects.len().is_multiple_of(copies) {
        let found = objects.len();
        return Err(format!(
            "is drawn {copies} times, but has {found} objects in the file"
        ));
    }
    let of_copy = |(place, objects): (&affine::Affine, &[u32])| {
        let stored = Stored::new(scene, objects);
        let computed = match shape.is_computed {
            true => computed_tolerance(place, &shape.points),
            false => 0.0,
        };
        let points: Vec<_> = shape
            .points
            .iter()
            .map(|&point| place.apply(point))
            .collect();
        let rounding = rounding_about_centre(&affine::Extent::of(&points));
        let mut outcome = compare(
            shape,
            &points,
            &stored,
            stored.tolerance + computed + rounding,
        );
        let wrong = stored.wrong_bounds.first();
        outcome
            .problems
            .extend(wrong.map(|id| format!("the bounds of object {id} do not fit it")));
        (objects[0], outcome)
    };
    let chunks = objects.chunks_exact(objects.len() / copies);
    let copies: Vec<_> = part.places.iter().zip(chunks).collect();
    Ok(copies.into_par_iter().map(of_copy).collect())
}

/// Whether every triangle has two corners that are equal in f32: the bake leaves out such an object.
fn is_a_point_or_line(shape: &Shape) -> bool {
    let size = affine::Extent::of(&shape.points).largest();
    let near = |a: u32, b: u32| {
        let [a, b] = [a, b].map(|corner| shape.points[corner as usize]);
        affine::length(affine::sub(a, b)) <= 1e-6 * size
    };
    let mut polygons = shape.polygons();
    polygons.all(|polygon| {
        let next = polygon.iter().cycle().skip(1);
        let distinct = polygon.iter().zip(next).filter(|(a, b)| !near(**a, **b));
        distinct.count() < 3
    })
}
