//! `hroc-bake inspect`.

use super::Failure;
use crate::bake::{Accuracy, Provenance, TreeReport};
use crate::tree::in_cells;
use glam::DVec3;
use hroc_format::{ArchivedScene, BakedScene, Bounds, ObjectBounds, OpenError, object_flags};
use serde::Serialize;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

/// Shows what is in a baked file.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The baked file.
    file: PathBuf,
    /// Write everything but the geometry as JSON, the source and bounds of every object included.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let baked = BakedScene::open_checked(&arguments.file).map_err(Failure::file)?;
    let provenance = Provenance::of(&baked).map_err(Failure::file)?;
    let summary = Summary::new(&baked, &provenance).map_err(Failure::file)?;
    let mut out = BufWriter::new(io::stdout().lock());
    let result = if arguments.json {
        let details = Details {
            objects: objects(baked.scene(), &provenance),
            cameras: cameras(baked.scene()),
            summary,
        };
        serde_json::to_writer_pretty(&mut out, &details)
            .map_err(io::Error::from)
            .and_then(|()| writeln!(out))
    } else {
        summary.write_text(&mut out)
    };
    result.and_then(|()| out.flush()).map_err(Failure::stdout)
}

/// The JSON document; version 1.
#[derive(Serialize)]
struct Details {
    #[serde(flatten)]
    summary: Summary,
    cameras: Vec<Camera>,
    objects: Vec<Object>,
}

#[derive(Serialize)]
struct Summary {
    schema: u32,
    name: String,
    generator: String,
    settings: serde_json::Value,
    file_bytes: usize,
    source_files: Vec<SourceFile>,
    referenced_files: Vec<ReferencedFile>,
    origin: [f64; 3],
    bounds: Box3,
    counts: Counts,
    bytes: Vec<(&'static str, usize)>,
    trees: Vec<TreeReport>,
    /// How far the baked scene is from its source; null for a file that does not say.
    accuracy: Option<Accuracy>,
    sections: Vec<Section>,
}

#[derive(Serialize)]
struct Section {
    name: String,
    bytes: u64,
}

#[derive(Serialize)]
struct SourceFile {
    name: String,
    /// xxh3, hexadecimal.
    hash: String,
    /// The library that read it, and its version; null for a file that does not say.
    loader: Option<String>,
}

#[derive(Serialize)]
struct ReferencedFile {
    name: String,
    /// xxh3, hexadecimal.
    hash: String,
}

#[derive(Serialize)]
struct Box3 {
    min: [f32; 3],
    max: [f32; 3],
}

impl From<Bounds> for Box3 {
    fn from(bounds: Bounds) -> Self {
        Self {
            min: bounds.min,
            max: bounds.max,
        }
    }
}

#[derive(Serialize)]
struct Counts {
    objects: usize,
    masked_objects: usize,
    blended_objects: usize,
    /// Drawn: a mesh counts once per object.
    triangles: u64,
    meshes: usize,
    stored_triangles: usize,
    vertices: usize,
    cameras: usize,
}

#[derive(Serialize)]
struct Camera {
    name: String,
    position: [f64; 3],
    orientation: [f64; 4],
    fov_y_rad: f32,
    half_height: f32,
    near: f32,
    /// Null for infinity.
    far: Option<f32>,
}

#[derive(Serialize)]
struct Object {
    id: u32,
    name: String,
    source_file: String,
    node: u32,
    primitive: u32,
    mesh: u32,
    triangles: u32,
    alpha: &'static str,
    /// Linear red, green, blue and opacity in 0..=1, to 8 bits.
    color: [f32; 4],
    double_sided: bool,
    /// The source's name; null for an object without a material.
    material: Option<String>,
    bounds: Box3,
}

impl Summary {
    fn new(baked: &BakedScene, provenance: &Provenance) -> Result<Self, OpenError> {
        let scene = baked.scene();
        let with_flag = |flag| {
            scene
                .objects
                .iter()
                .filter(|object| object.flags.to_native() & flag != 0)
                .count()
        };
        let trees: Vec<TreeReport> = scene
            .bvhs
            .iter()
            .map(|bvh| TreeReport::new(&bvh.split, bvh.nodes.len(), &bvh.stats.to_native()))
            .collect();
        Ok(Self {
            schema: 1,
            accuracy: Accuracy::of(baked)?,
            sections: baked
                .sections()
                .iter()
                .map(|section| Section {
                    name: section.name.to_string(),
                    bytes: section.len,
                })
                .collect(),
            name: scene.name.as_str().into(),
            generator: scene.generator.as_str().into(),
            settings: serde_json::from_str(&scene.settings)
                .unwrap_or(scene.settings.as_str().into()),
            file_bytes: baked.file_bytes().len(),
            source_files: scene
                .source_files
                .iter()
                .enumerate()
                .map(|(number, file)| SourceFile {
                    name: file.name.as_str().into(),
                    hash: format!("{:016x}", file.hash.to_native()),
                    loader: provenance.loaders.get(number).cloned(),
                })
                .collect(),
            referenced_files: scene
                .referenced_files
                .iter()
                .map(|file| ReferencedFile {
                    name: file.name.as_str().into(),
                    hash: format!("{:016x}", file.hash.to_native()),
                })
                .collect(),
            origin: scene.origin.map(|x| x.to_native()),
            bounds: scene.bounds.to_native().into(),
            counts: Counts {
                objects: scene.objects.len(),
                masked_objects: with_flag(object_flags::MASKED),
                blended_objects: with_flag(object_flags::BLENDED),
                triangles: scene.drawn_triangle_count(),
                meshes: scene.meshes.len(),
                stored_triangles: scene.indices.len() / 3,
                vertices: scene.vertex_count(),
                cameras: scene.cameras.len(),
            },
            bytes: vec![
                ("objects", size_of_val(scene.objects.as_slice())),
                ("object_bounds", size_of_val(scene.object_bounds.as_slice())),
                (
                    "object_sources",
                    size_of_val(scene.object_sources.as_slice()),
                ),
                (
                    "names",
                    scene.names.len() + size_of_val(scene.name_ends.as_slice()),
                ),
                ("meshes", size_of_val(scene.meshes.as_slice())),
                ("positions", size_of_val(scene.positions())),
                (
                    "quantized_positions",
                    size_of_val(scene.quantized_positions()),
                ),
                ("indices", size_of_val(scene.indices())),
                ("normals", size_of_val(scene.normals())),
                ("uvs", size_of_val(scene.uvs())),
                ("trees", scene.bvhs.iter().map(bvh_bytes).sum()),
            ],
            trees,
        })
    }

    fn write_text(&self, out: &mut impl Write) -> io::Result<()> {
        let counts = &self.counts;
        writeln!(
            out,
            "{:?}, {} bytes, by {}",
            self.name, self.file_bytes, self.generator
        )?;
        for file in &self.source_files {
            let loader = file.loader.as_deref().unwrap_or("an unknown reader");
            writeln!(out, "source     {:?} {} by {loader}", file.name, file.hash)?;
        }
        writeln!(out, "settings   {}", self.settings)?;
        writeln!(out, "origin     {:?}", self.origin)?;
        writeln!(
            out,
            "bounds     {:?} to {:?}",
            self.bounds.min, self.bounds.max
        )?;
        writeln!(
            out,
            "objects    {} ({} masked, {} blended)",
            counts.objects, counts.masked_objects, counts.blended_objects
        )?;
        writeln!(
            out,
            "triangles  {} drawn, {} stored",
            counts.triangles, counts.stored_triangles
        )?;
        writeln!(
            out,
            "meshes     {}, {} vertices",
            counts.meshes, counts.vertices
        )?;
        writeln!(out, "cameras    {}", counts.cameras)?;
        for line in self.accuracy.iter().flat_map(Accuracy::lines) {
            writeln!(out, "{line}")?;
        }
        writeln!(out, "\n{:<16}{:>14}{:>8}", "part", "bytes", "%")?;
        for (part, bytes) in self.bytes.iter().filter(|(_, bytes)| *bytes > 0) {
            let share = *bytes as f64 / self.file_bytes as f64 * 100.0;
            writeln!(out, "{part:<16}{bytes:>14}{share:>8.1}")?;
        }
        if self.trees.is_empty() {
            return Ok(());
        }
        writeln!(
            out,
            "\n{:<16}{:>10}{:>7}{:>11}{:>12}{:>10}",
            "tree", "nodes", "depth", "mean depth", "SAH cost", "overlap"
        )?;
        for tree in &self.trees {
            let TreeReport {
                split,
                nodes,
                depth,
                mean_leaf_depth,
                sah_cost,
                overlap,
            } = tree;
            writeln!(
                out,
                "{split:<16}{nodes:>10}{depth:>7}{mean_leaf_depth:>11.2}{sah_cost:>12.2}{overlap:>10.2}"
            )?;
        }
        Ok(())
    }
}

fn bvh_bytes(bvh: &hroc_format::ArchivedBvh) -> usize {
    size_of_val(bvh.nodes.as_slice())
        + size_of_val(bvh.parents())
        + size_of_val(bvh.leaf_of_object())
}

fn cameras(scene: &ArchivedScene) -> Vec<Camera> {
    let camera = |camera: &hroc_format::ArchivedCamera| Camera {
        name: camera.name.as_str().into(),
        position: camera.position.map(|x| x.to_native()),
        orientation: camera.orientation.map(|x| x.to_native()),
        fov_y_rad: camera.fov_y_rad.to_native(),
        half_height: camera.half_height.to_native(),
        near: camera.near.to_native(),
        far: Some(camera.far.to_native()).filter(|far| far.is_finite()),
    };
    scene.cameras.iter().map(camera).collect()
}

fn objects(scene: &ArchivedScene, provenance: &Provenance) -> Vec<Object> {
    let ids = 0..scene.objects.len() as u32;
    let origins: Vec<_> = scene.cell_origins().into_iter().map(DVec3::from).collect();
    // A file that was opened without its objects checked may name a cell that is not there.
    let in_world = |b: ObjectBounds| match origins.get(b.cell as usize) {
        Some(_) => in_cells::about(&b, &origins, origins[0]),
        None => Bounds {
            min: b.min,
            max: b.max,
        },
    };
    let parts = scene
        .objects
        .iter()
        .zip(scene.object_bounds.iter())
        .zip(scene.object_sources.iter());
    ids.zip(parts)
        .map(|(id, ((object, bounds), source))| {
            let (object, source) = (object.to_native(), source.to_native());
            let mesh = scene.meshes.get(object.mesh as usize);
            let file = scene.source_files.get(source.file as usize);
            Object {
                id,
                name: scene.object_name(id).into(),
                source_file: file.map_or("", |file| file.name.as_str()).into(),
                node: source.node,
                primitive: source.primitive,
                mesh: object.mesh,
                triangles: mesh.map_or(0, |mesh| mesh.index_count.to_native() / 3),
                alpha: match object.flags {
                    flags if flags & object_flags::BLENDED != 0 => "blended",
                    flags if flags & object_flags::MASKED != 0 => "masked",
                    _ => "opaque",
                },
                color: object
                    .base_color
                    .to_le_bytes()
                    .map(|channel| f32::from(channel) / 255.0),
                double_sided: object.flags & object_flags::DOUBLE_SIDED != 0,
                material: provenance.material(id as usize).map(str::to_owned),
                bounds: in_world(bounds.to_native()).into(),
            }
        })
        .collect()
}
