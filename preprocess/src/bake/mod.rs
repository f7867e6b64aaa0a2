//! From a source scene to the baked scene: meshes optimized, vertices and objects packed, world
//! bounds, one tree per split rule. The same source and options give the same bytes on any number of
//! threads: threads work on separate meshes, objects and subtrees, and results are put together in
//! order.

mod accuracy;
mod cells;
mod pack;
mod place;
mod provenance;
mod recentre;
mod report;

pub use accuracy::{ACCURACY, Accuracy, AreaChange, Displacement, TriangleChanges};
pub use provenance::{MATERIALS, PROVENANCE, Provenance};
pub use report::{BakeReport, Stage, TreeReport};

use crate::bvh;
use crate::degenerate::{self, Degenerate};
use crate::import::MAX_OBJECTS;
use crate::normals;
use crate::optimize::{self, MeshError};
use crate::progress::Progress;
use crate::quantize::Grid;
use crate::scene::{SourceCamera, SourceMesh, SourceObject, SourceScene};
use crate::subdivide;
use crate::tree::{self, TreeBuilder, in_cells};
use crate::world_bounds::flush_denormals;
use accuracy::{Baked, MeshChange};
use glam::{DAffine3, DVec3};
use hroc_format::{Bounds, Camera, ObjectBounds, ObjectSource, ReferencedFile, Scene, SourceFile};
use pack::Packed;
use place::Placed;
use rayon::prelude::*;
use std::num::NonZeroU32;

/// Program and version, as stored in the file.
pub const GENERATOR: &str = concat!("hroc-bake ", env!("CARGO_PKG_VERSION"));

/// What to bake.
pub struct BakeOptions {
    /// One tree is built by each, in this order.
    pub splits: Vec<&'static dyn TreeBuilder>,
    /// Merge vertices and reorder triangles.
    pub optimize: bool,
    /// Keep normals where the source has them.
    pub normals: bool,
    /// Keep texture coordinates where the source has them.
    pub uvs: bool,
    /// Cut meshes of more triangles than this into several objects.
    pub split_objects: Option<NonZeroU32>,
    /// Store positions as 16-bit numbers.
    pub quantize: bool,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self {
            splits: tree::baked_by_default().collect(),
            optimize: true,
            normals: true,
            uvs: false,
            split_objects: None,
            quantize: false,
        }
    }
}

impl BakeOptions {
    /// The options, and the scene chosen, as stored in the file: only what decides its bytes.
    pub fn settings(&self, choice: Option<&str>) -> String {
        let splits: Vec<_> = self.splits.iter().map(|builder| builder.name()).collect();
        let Self {
            splits: _,
            optimize,
            normals,
            uvs,
            split_objects,
            quantize,
        } = self;
        let settings = serde_json::json!({
            "splits": splits, "optimize": optimize, "normals": normals, "uvs": uvs, "scene": choice,
            "split_objects": split_objects, "quantize": quantize,
        });
        settings.to_string()
    }
}

/// Why a scene was not baked.
#[derive(Clone, Debug, thiserror::Error)]
pub enum BakeError {
    /// A mesh breaks what importers promise.
    #[error("mesh {mesh}: {source}; check the importer that made it")]
    Mesh {
        /// Index into [`SourceScene::meshes`].
        mesh: usize,
        /// What is wrong.
        source: MeshError,
    },
    /// An object refers to a mesh or file that is not there.
    #[error("object {0}: its mesh or file does not exist; check the importer that made it")]
    Dangling(usize),
    /// An object leaves the range of f32.
    #[error(
        "object {object} {name:?}: its coordinates are too large for f32; scale the scene down"
    )]
    TooFar {
        /// Its id.
        object: usize,
        /// Its name.
        name: String,
    },
    /// The scene does not fit the 32-bit numbers of the format.
    #[error("the scene has more than 2^32 - 1 {0}; split it into several files")]
    TooLarge(&'static str),
    /// Cutting meshes would make more objects than an import may.
    #[error(
        "--split-objects would make more than {MAX_OBJECTS} objects; allow more triangles per object"
    )]
    TooManyParts,
    /// No tree could be built.
    #[error("tree {split}: {source}")]
    Tree {
        /// The builder.
        split: &'static str,
        /// Why.
        source: bvh::BuildError,
    },
}

/// Bakes a scene on the current rayon pool.
///
/// # Errors
/// If the source breaks its promises, leaves the range of f32 or exceeds the format's 32-bit counts.
pub fn bake(
    mut source: SourceScene,
    options: &BakeOptions,
    progress: &dyn Progress,
) -> Result<(Scene, BakeReport), BakeError> {
    let mut report = BakeReport {
        source_objects: source.objects.len(),
        source_vertices: source.meshes.iter().map(|mesh| mesh.positions.len()).sum(),
        warnings: std::mem::take(&mut source.warnings),
        ..Default::default()
    };
    let dangling = |object: &SourceObject| {
        object.mesh >= source.meshes.len() || object.file >= source.files.len()
    };
    if let Some(object) = source.objects.iter().position(dangling) {
        return Err(BakeError::Dangling(object));
    }

    progress.stage("clean", source.meshes.len() as u64);
    report.coincident_triangles += report.timed("clean", || clean(&mut source.meshes, progress))?;
    let cleaned = report.coincident_triangles;
    let kept = Kept::of(&source.meshes, &source.objects);
    retain(&mut source.position_errors, &kept.meshes);
    retain(&mut source.materials.of_object, &kept.objects);
    report.empty_objects += kept.retain(&mut source.meshes, &mut source.objects);

    if let Some(max) = options.split_objects.map(|max| max.get() as usize) {
        if subdivide::object_count(&source, max) > MAX_OBJECTS as u64 {
            return Err(BakeError::TooManyParts);
        }
        progress.stage("subdivide", 0);
        report
            .timed("subdivide", || subdivide::subdivide(&mut source, max))
            .map_err(|(mesh, source)| BakeError::Mesh { mesh, source })?;
    }
    let mut places = place::shared_places(&source.objects);
    let mut materials = std::mem::take(&mut source.materials);

    progress.stage("optimize", source.meshes.len() as u64);
    let keep = Keep::of(&source.meshes, options);
    let grids = options
        .quantize
        .then(|| Grid::of_meshes(&source.meshes, &source.objects));
    let prepared = report.timed("optimize", || {
        prepare(
            source.meshes,
            &source.position_errors,
            options,
            keep,
            grids.as_deref(),
            progress,
        )
    })?;
    let mut meshes = Vec::with_capacity(prepared.len());
    let mut changes = Vec::with_capacity(prepared.len());
    let mut source_from_mesh = Vec::with_capacity(prepared.len());
    for prepared in prepared {
        meshes.push(prepared.mesh);
        changes.push(prepared.change);
        source_from_mesh.push(prepared.source_from_mesh);
        report.coincident_triangles += prepared.degenerate.coincident;
        report.sliver_triangles += prepared.degenerate.slivers;
    }
    for object in &mut source.objects {
        object.world_from_object *= source_from_mesh[object.mesh];
    }
    let kept = Kept::of(&meshes, &source.objects);
    retain(&mut changes, &kept.meshes);
    retain(&mut materials.of_object, &kept.objects);
    retain(&mut places, &kept.objects);
    report.empty_objects += kept.retain(&mut meshes, &mut source.objects);
    report.warn_of_degenerate();
    report.objects = source.objects.len();
    report.provenance = Provenance::new(&source.loaders, materials, source.objects.len());
    report.meshes = meshes.len();
    report.vertices = meshes.iter().map(|mesh| mesh.positions.len()).sum();
    report.stored_triangles = meshes.iter().map(|mesh| mesh.indices.len() / 3).sum();
    report.triangles = source
        .objects
        .iter()
        .map(|object| meshes[object.mesh].indices.len() as u64 / 3)
        .sum();

    let packed = report.timed("pack", || Packed::new(meshes, keep, options.quantize))?;
    progress.stage("bounds", source.objects.len() as u64);
    let Placed {
        origins,
        objects,
        bounds: object_bounds,
    } = report.timed("bounds", || {
        place::place(&source.objects, &packed, &places, progress)
    })?;
    let origin = origins[0];

    report.measure(
        &Baked {
            sources: &source.objects,
            objects: &objects,
            meshes: &packed.meshes,
            changes: &changes,
        },
        |object| origins[object.cell as usize],
        options.quantize,
        cleaned,
    );

    progress.stage("trees", options.splits.len() as u64);
    let bvhs = report.timed("trees", || {
        trees(&object_bounds, &origins, &options.splits, progress)
    })?;
    report.trees = bvhs
        .iter()
        .map(|bvh| TreeReport::new(&bvh.split, bvh.nodes.len(), &bvh.stats))
        .collect();

    let (names, name_ends) = names(&source.objects)?;
    let scene = Scene {
        name: source.name,
        generator: GENERATOR.into(),
        settings: options.settings(source.choice.as_deref()),
        source_files: source
            .files
            .into_iter()
            .map(|file| SourceFile {
                name: file.name,
                hash: file.hash,
            })
            .collect(),
        referenced_files: source
            .referenced_files
            .into_iter()
            .map(|file| ReferencedFile {
                name: file.name,
                hash: file.hash,
                by: file.by as u32,
            })
            .collect(),
        origin: origin.into(),
        bounds: scene_bounds(&object_bounds, &origins),
        cells: origins.iter().map(|&origin| origin.into()).collect(),
        object_sources: source.objects.iter().map(object_source).collect(),
        objects,
        object_bounds,
        name_ends,
        names,
        meshes: packed.meshes,
        positions: packed.positions,
        quantized_positions: packed.quantized_positions,
        indices: packed.indices,
        normals: packed.normals,
        uvs: packed.uvs,
        bvhs,
        cameras: source
            .cameras
            .iter()
            .map(|source| camera(source, origin))
            .collect(),
    };
    Ok((scene, report))
}

/// Which attributes the file will have: those that are wanted and that any mesh has.
#[derive(Clone, Copy)]
struct Keep {
    normals: bool,
    uvs: bool,
}

impl Keep {
    fn of(meshes: &[SourceMesh], options: &BakeOptions) -> Self {
        Self {
            normals: options.normals && meshes.iter().any(|mesh| !mesh.normals.is_empty()),
            uvs: options.uvs && meshes.iter().any(|mesh| !mesh.uvs.is_empty()),
        }
    }
}

/// Checks the meshes and leaves out the triangles two of whose corners coincide. Returns how many.
fn clean(meshes: &mut [SourceMesh], progress: &dyn Progress) -> Result<u64, BakeError> {
    let clean = |(index, mesh): (usize, &mut SourceMesh)| {
        optimize::check(mesh).map_err(|source| BakeError::Mesh {
            mesh: index,
            source,
        })?;
        let coordinates = mesh.positions.iter_mut().flatten();
        coordinates.for_each(|x| *x = flush_denormals(*x));
        progress.advance(1);
        Ok(degenerate::remove_coincident(mesh))
    };
    meshes.par_iter_mut().enumerate().map(clean).sum()
}

/// Which meshes have triangles, and which objects draw one of those.
struct Kept {
    meshes: Vec<bool>,
    objects: Vec<bool>,
}

impl Kept {
    fn of(meshes: &[SourceMesh], objects: &[SourceObject]) -> Self {
        let has_triangles = |mesh: &SourceMesh| !mesh.indices.is_empty();
        let meshes: Vec<bool> = meshes.iter().map(has_triangles).collect();
        let objects = objects.iter().map(|object| meshes[object.mesh]).collect();
        Self { meshes, objects }
    }

    /// Leaves out the others. The rest keep their order. Returns the number of objects that went.
    fn retain(&self, meshes: &mut Vec<SourceMesh>, objects: &mut Vec<SourceObject>) -> usize {
        let mut next = 0;
        let number = |&kept: &bool| {
            next += usize::from(kept);
            next - usize::from(kept)
        };
        let numbers: Vec<usize> = self.meshes.iter().map(number).collect();
        retain(meshes, &self.meshes);
        retain(objects, &self.objects);
        for object in objects {
            object.mesh = numbers[object.mesh];
        }
        self.objects.iter().filter(|kept| !**kept).count()
    }
}

/// Keeps those of `items` that are kept. A list that is shorter than that is left out at its end.
fn retain<T>(items: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    items.retain(|_| kept.next().is_none_or(|&kept| kept));
}

/// A mesh as it is stored.
struct Prepared {
    mesh: SourceMesh,
    /// Takes it to the object space of its source.
    source_from_mesh: DAffine3,
    change: MeshChange,
    degenerate: Degenerate,
}

/// Gives all meshes the same attributes, moves them to their grids or near their zeros and optimizes them.
fn prepare(
    meshes: Vec<SourceMesh>,
    position_errors: &[f64],
    options: &BakeOptions,
    keep: Keep,
    grids: Option<&[Grid]>,
    progress: &dyn Progress,
) -> Result<Vec<Prepared>, BakeError> {
    let prepare = |(index, mut mesh): (usize, SourceMesh)| {
        let original = mesh.positions.clone();
        if !keep.normals {
            mesh.normals = Vec::new();
        } else if mesh.normals.is_empty() {
            mesh.normals = normals::compute(&mesh);
        }
        if !keep.uvs {
            mesh.uvs = Vec::new();
        } else if mesh.uvs.is_empty() {
            mesh.uvs = vec![[0.0; 2]; mesh.positions.len()];
        }
        let mut counts = Degenerate::default();
        // Before vertices are merged: on the grid some meet.
        let source_from_mesh = match grids {
            Some(grids) => {
                grids[index].quantize(&mut mesh);
                grids[index].object_from_cube()
            }
            None => DAffine3::from_translation(recentre::recentre(&mut mesh)),
        };
        // Here vertices and triangles are still in the order of the source.
        let import_error = position_errors.get(index).copied().unwrap_or(0.0);
        let change = MeshChange::measure(&original, &mesh, &source_from_mesh, import_error);
        drop(original);
        if grids.is_some() {
            counts.coincident = degenerate::remove_coincident(&mut mesh);
        }
        if options.optimize && !mesh.indices.is_empty() {
            mesh = optimize::optimize(&mesh).map_err(|source| BakeError::Mesh {
                mesh: index,
                source,
            })?;
        }
        counts.slivers = degenerate::count_slivers(&mesh);
        progress.advance(1);
        Ok(Prepared {
            change: change.finished(&mesh),
            mesh,
            source_from_mesh,
            degenerate: counts,
        })
    };
    meshes.into_par_iter().enumerate().map(prepare).collect()
}

fn object_source(source: &SourceObject) -> ObjectSource {
    ObjectSource {
        file: source.file as u32,
        node: source.node as u32,
        primitive: source.primitive as u32,
    }
}

/// One tree per builder, all at once; none for an empty scene.
fn trees(
    bounds: &[ObjectBounds],
    origins: &[DVec3],
    splits: &[&'static dyn TreeBuilder],
    progress: &dyn Progress,
) -> Result<Vec<hroc_format::Bvh>, BakeError> {
    if bounds.is_empty() {
        return Ok(Vec::new());
    }
    let build = |builder: &&'static dyn TreeBuilder| {
        let tree = in_cells::build(*builder, bounds, origins).map_err(|source| BakeError::Tree {
            split: builder.name(),
            source,
        });
        progress.advance(1);
        tree
    };
    splits.par_iter().map(build).collect()
}

/// All names in a row and where each ends.
fn names(objects: &[SourceObject]) -> Result<(Vec<u8>, Vec<u32>), BakeError> {
    let mut names = Vec::new();
    let mut ends = Vec::with_capacity(objects.len());
    for object in objects {
        names.extend_from_slice(object.name.as_bytes());
        ends.push(
            u32::try_from(names.len()).map_err(|_| BakeError::TooLarge("bytes of object names"))?,
        );
    }
    Ok((names, ends))
}

fn camera(source: &SourceCamera, origin: DVec3) -> Camera {
    Camera {
        name: source.name.clone(),
        position: (source.position - origin).into(),
        orientation: source.orientation.into(),
        fov_y_rad: source.fov_y_rad,
        half_height: source.half_height,
        near: source.near,
        far: source.far,
    }
}

/// World bounds that contain those of all objects.
fn scene_bounds(bounds: &[ObjectBounds], origins: &[DVec3]) -> Bounds {
    let world = |b: &ObjectBounds| in_cells::about(b, origins, origins[0]);
    let union = |a: Bounds, b: Bounds| Bounds {
        min: std::array::from_fn(|axis| a.min[axis].min(b.min[axis])),
        max: std::array::from_fn(|axis| a.max[axis].max(b.max[axis])),
    };
    bounds.iter().map(world).reduce(union).unwrap_or_default()
}
